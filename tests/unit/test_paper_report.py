"""The report of the audit: complete, escaped, balanced, and nothing fetched."""

from __future__ import annotations

import base64
import io
import re
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise

import pytest
from pictures import luminance

from wedgebrake.figures.matplotlib import style
from wedgebrake.paper.claims import Finding, Part, Statement, Verdict
from wedgebrake.paper.report.content import (
    Correction,
    Illustration,
    Made,
    Report,
    Study,
    chapters,
    compared,
    counts,
    score,
)
from wedgebrake.paper.report.page import page, symbols
from wedgebrake.paper.timing import Timing

VOID = {"meta", "img", "br", "hr", "input", "link", "wbr", "col"}
HOSTILE = '<script>alert("x")</script> & \'{{ 7 * 7 }}\' "onload=1'


class Reader(HTMLParser):
    """Tags in order with their attributes, what does not balance, and the text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.words: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        assert len(dict(attrs)) == len(attrs), (tag, attrs)
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, self.getpos()

    def handle_data(self, data):
        if self.open and self.open[-1] != "style":
            self.words.append(data)

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.tags if name == tag]

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", "".join(self.words))


def png(width: float = style.PAGE, height: float = 3.0) -> bytes:
    figure = style.new_figure(width, height)
    figure.add_subplot().plot([0, 1], [0, 1])
    content = io.BytesIO()
    figure.savefig(content, format="png", dpi=100)
    return content.getvalue()


def finding(name: str, figure: str, verdict: Verdict, needed: str = "", **more: str) -> Finding:
    words = {"says": f"what {name} says", "test": "a test", "tolerance": "one column", **more}
    holds = {Verdict.CONTRADICTED: False, Verdict.UNDECIDABLE: None}.get(verdict, True)
    parts = (Part("first part", True, "1.5 rad/s"), Part("second part", holds, "F_a0 = 3"))
    printed = (Part("first part", True, "1.4 rad/s"), Part("second part", False, "diverged"))
    as_printed = parts if verdict is Verdict.REPRODUCED else printed
    statement = Statement(name, figure, check=lambda *_: [], **words)
    return Finding(statement, verdict, parts, as_printed, needed)


FINDINGS = (
    finding("S1", "2", Verdict.REPRODUCED),
    finding("S4", "3", Verdict.REPRODUCED),
    finding("B1", "8a", Verdict.CORRECTED, "c = 0.1 N m s/rad, μ_s = 0.3"),
    finding("B2", "8b", Verdict.CONTRADICTED),
    finding("R1", "9", Verdict.UNDECIDABLE),
    finding("K1", "–", Verdict.CONTRADICTED),
)


@pytest.fixture(scope="module")
def figures() -> tuple[Illustration, ...]:
    return tuple(
        Illustration(f"fig{number}", number, f"What Fig. {number} shows", png(width), width)
        for number, width in (("2", style.PAGE), ("3", style.COLUMN), ("8", style.PAGE), ("9", 6.0))
    )


@pytest.fixture(scope="module")
def report(figures) -> Report:
    picture = Illustration("", "", "Which choices fit", figures[0].png, style.PAGE)
    return Report(
        method="smoothed friction",
        assumptions="c = 0.1",
        made=Made("wedgebrake paper all", {"wedgebrake": "9.9", "python": "3.99"}),
        findings=FINDINGS,
        figures=figures,
        identification=Study(
            table=({"Choices": "c = 0.1", "Hold": "20 of 25"},
                   {"Choices": "c = 1", "Hold": "3 of 25"}),
            picture=picture,
            questions=(("Which F_0 in Fig. 14?", "0.036", True), ("Fig. 17?", "unknown", False)),
        ),
        smoothing=Study(("The two agree away from v = 0.",), ({"Case": "a", "Gap": "1e-3"},)),
        corrections=(Correction("eq. (14)", "no μ_k", "times μ_k", "Fig. 4"),),
        timings=(Timing("exact", 0.0020, 15.1), Timing("ode14x", 1.25, 7.6)),
    )  # fmt: skip


@pytest.fixture(scope="module")
def html(report) -> str:
    return page(report)


@pytest.fixture(scope="module")
def reader(html) -> Reader:
    return Reader(html)


class TestPage:
    def test_is_a_page(self, html, reader):
        assert html.startswith("<!DOCTYPE html>\n<html lang")
        levels = [int(tag[1]) for tag, _ in reader.tags if re.fullmatch(r"h[1-6]", tag)]
        assert levels[0] == 1
        assert all(1 < after <= before + 1 for before, after in pairwise(levels))
        assert not re.search(r"\{\{|\{%", html)

    def test_fetches_nothing(self, html, reader):
        """But for the doi, which is a link, no address is on the page."""
        assert not reader.all("script") + reader.all("link")
        for tag, attributes in reader.tags:
            for name in ("src", "srcset", "href", "action", "poster", "data"):
                address = attributes.get(name) or "#"
                doi = (tag, address) == ("a", "https://doi.org/10.1007/s11071-014-1603-y")
                assert address.startswith(("#", "data:image/png;base64,")) or doi, address
        assert not re.search(r"https?:(?!//doi.org/10.1007/s11071-014-1603-y)|@import|url\(", html)

    def test_ids_are_unique_and_links_lead_somewhere(self, reader):
        ids = [attributes["id"] for _, attributes in reader.tags if "id" in attributes]
        assert len(ids) == len(set(ids))
        for link in reader.all("a"):
            if link["href"].startswith("#"):
                assert link["href"][1:] in ids
        labels = [a["aria-labelledby"] for _, a in reader.tags if "aria-labelledby" in a]
        assert set(labels) <= set(ids)

    def test_pictures_are_inside_with_words_for_them(self, reader, figures):
        images = reader.all("img")
        assert len(images) == len(figures) + 1
        for image, one in zip(images, figures, strict=False):
            assert base64.b64decode(image["src"].partition(",")[2]) == one.png
            assert one.caption in image["alt"]
            shown = int(image["width"]) / int(image["height"])
            assert shown == pytest.approx(one.width / 3.0, rel=0.02)

    def test_every_statement_once_under_its_figure(self, reader):
        wanted = {"figure-2": ["S1"], "figure-3": ["S4"], "figure-8": ["B1", "B2"],
                  "figure-9": ["R1"], "rest": ["K1"]}  # fmt: skip
        found: dict[str, list[str]] = {}
        heading = ""
        for tag, attributes in reader.tags:
            if tag in ("h2", "h3"):
                heading = attributes.get("id", heading)
            if tag == "article":
                found.setdefault(heading, []).append(attributes["id"])
        assert found == wanted

    def test_what_was_found_is_there(self, reader):
        for word in (
            "what B1 says", "a test", "one column", "1.5 rad/s", "diverged",
            "c = 0.1 N m s/rad, μs = 0.3", "Which F0 in Fig. 14?", "20 of 25", "eq. (14)",
            "The two agree", "2 ms", "1.2 s", "7600", "6.1", "15.1 s", "wedgebrake paper all",
            "9.9", "10.1007/s11071-014-1603-y",
        ):  # fmt: skip
            assert word in reader.text, word

    def test_nothing_to_tell_is_a_page_too(self, report):
        empty = Report("smooth", "c = 0.1", report.made, (), ())
        assert Reader(page(empty)).text

    def test_hostile_words_stay_words(self, figures):
        bad = finding("S1", "2", Verdict.CORRECTED, HOSTILE, says=HOSTILE, test=HOSTILE,
                      tolerance=HOSTILE)  # fmt: skip
        bad = replace(bad, parts=(Part(HOSTILE, True, HOSTILE),), printed=())
        shown = Illustration("fig2", "2", HOSTILE, figures[0].png, 7.2)
        study = Study((HOSTILE,), ({HOSTILE: HOSTILE},), shown, ((HOSTILE, HOSTILE, True),))
        html = page(
            Report(HOSTILE, HOSTILE, Made(HOSTILE, {HOSTILE: HOSTILE}), (bad,), (shown,), study,
                   study, (Correction(HOSTILE, HOSTILE, HOSTILE, HOSTILE),),
                   (Timing(HOSTILE, 1.0, 2.0),))
        )  # fmt: skip
        read = Reader(html)
        assert not read.all("script")
        assert not any("onload" in attributes for _, attributes in read.tags)
        assert read.text.count(HOSTILE) >= 20
        assert any(HOSTILE in image["alt"] for image in read.all("img"))


def test_contrast_of_every_verdict(html):
    """At least 4.5 to 1, the relative luminances of WCAG 2."""
    found = re.findall(r"\.[a-z]+ \{ background: (\S+); color: (\S+); \}", html)
    assert len(found) == len(Verdict)
    for ground, ink in found:
        light, dark = sorted((luminance(ground), luminance(ink)), reverse=True)
        assert (light + 0.05) / (dark + 0.05) >= 4.5


class TestContent:
    def test_counts_every_verdict(self):
        assert list(counts(FINDINGS).values()) == [2, 1, 2, 1]
        assert list(counts([])) == list(Verdict)

    def test_figure_1_is_not_figure_12(self, figures):
        findings = (finding("A", "12", Verdict.REPRODUCED), finding("B", "1", Verdict.REPRODUCED))
        twelve = Illustration("fig12", "12", "", figures[0].png, 7.2)
        found, rest = chapters(Report("", "", Made("", {}), findings, (twelve,)))
        assert [one.statement.name for one in found[0].findings] == ["A"]
        assert [one.statement.name for one in rest] == ["B"]

    def test_parts_are_paired_by_what_they_say(self):
        one, two, three = (Part(word, True, "") for word in ("a", "a", "b"))
        four = Part("c", False, "")
        found = replace(FINDINGS[0], parts=(one, two, three), printed=(one, four))
        assert list(compared(found)) == [(one, one), (two, None), (three, None), (None, four)]

    def test_score(self):
        parts = [Part("", holds, "") for holds in (True, True, False, None)]
        assert score(parts) == "2 of 4, 1 cannot be told"
        assert score(parts[:3]) == "2 of 3"
        assert score([]) == "0 of 0"

    @pytest.mark.parametrize(
        ("text", "shown"),
        [
            ("F_a0 < μ_s·θ'", "F<sub>a0</sub> &lt; μ<sub>s</sub>·θ&#39;"),
            ("F_μ/F_a at φ_w", "F<sub>μ</sub>/F<sub>a</sub> at φ<sub>w</sub>"),
            ("node_focus_stable x_long", "node_focus_stable x_long"),
            ("a_1_b", "a_1_b"),
            ("-3 to -1e-5, 2-3", "−3 to −1e-5, 2-3"),
        ],
    )
    def test_indices_are_set_low(self, text, shown):
        assert str(symbols(text)) == shown

"""Results as a terminal and a notebook show them."""

from __future__ import annotations

from html.parser import HTMLParser

import pytest

import wedgebrake as wb

SYSTEM = wb.paper.system(eta=-24.0)


class Page(HTMLParser):
    """Text of the cells, row by row, tables within tables included; and the tags."""

    def __init__(self, text):
        super().__init__()
        self.rows, self.open, self.tags, self.within = [], [], set(), []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, _):
        self.tags.add(tag)
        self.open.append(tag)
        if tag == "tr":
            self.within.append([])
            self.rows.append(self.within[-1])
        if tag in ("th", "td"):
            self.within[-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag
        if tag == "tr":
            self.within.pop()

    def handle_data(self, data):
        if self.open[-1] in ("th", "td"):
            self.within[-1][-1] += data

    @property
    def cells(self):
        return {row[0]: tuple(row[1:]) for row in self.rows}


def test_numbers_have_their_units():
    motion, stability = wb.motion(SYSTEM), wb.stability(SYSTEM)
    cells = Page(motion._repr_html_()).cells
    assert cells["friction_power"][1] == "W"
    assert float(cells["friction_power"][0]) == pytest.approx(motion.friction_power, rel=1e-5)
    assert cells["order"] == ("6", "")
    cells = Page(stability.forward._repr_html_()).cells
    assert cells["damping"][1] == "N m s/rad"
    assert float(cells["damping"][0]) == pytest.approx(stability.forward.damping, rel=1e-5)
    assert Page(SYSTEM._repr_html_()).cells["brake.radius"] == ("0.2", "m")


def test_the_machine_of_a_repr_can_still_be_built_from_it():
    names = {name: getattr(wb, name) for name in wb.__all__}
    assert eval(repr(SYSTEM), names) == SYSTEM  # noqa: S307 - our own text

"""Results as a terminal and a notebook show them."""

from __future__ import annotations

from html.parser import HTMLParser

import pytest

import wedgebrake as wb

SYSTEM = wb.paper.system(eta=-24.0)
TURNING = SYSTEM.replace(drive_speed=20.0)


@pytest.fixture(scope="module")
def branch():
    one = wb.continuation(wb.orbit(SYSTEM.replace(eta=-15.0), order=1), eta=(-15.0, -17.0))
    list(one)
    return one


VERDICTS = {
    "motion": lambda _: wb.motion(SYSTEM),
    "stability": lambda _: wb.stability(SYSTEM),
    "stability of a turning shaft": lambda _: wb.stability(TURNING),
    "orbit": lambda _: wb.orbit(SYSTEM, order=1),
    "no orbit": lambda _: wb.orbit(SYSTEM.replace(stiffness=0.0, slope=0.0)),
}
OTHERS = {
    "forward": lambda _: wb.stability(SYSTEM).forward,
    "locked": lambda _: wb.stability(wb.paper.system(alpha=0.9)).forward,
    "turning": lambda _: wb.stability(TURNING).backward,
    "branch": lambda branch: branch,
    "branch that begins": lambda _: wb.continuation(wb.orbit(SYSTEM, order=1), eta=(-24, -25)),
    "point": lambda branch: branch.points[0],
    "bifurcation point": lambda branch: branch.bifurcations[0],
    "bifurcation": lambda branch: branch.bifurcations[0].bifurcation,
    "machine": lambda _: SYSTEM.machine,
}
PLAIN = {
    "measures": lambda branch: branch.points[0].measures,
    "torque": lambda _: wb.brake_torque(wb.simulate(SYSTEM, periods=5)),
    "groups": lambda _: SYSTEM.groups,
    "system": lambda _: SYSTEM,
    "study": lambda _: wb.load_study("examples/sweep.toml"),
    "law of one's own": lambda _: SYSTEM.replace(
        friction=wb.CustomFriction(law=lambda v: 0.3 * v / (0.01 + abs(v)), width=0.01)
    ),
}


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


@pytest.mark.parametrize("name", VERDICTS | OTHERS | PLAIN)
def test_a_repr_is_one_line_and_a_notebook_shows_a_table(name, branch):
    result = (VERDICTS | OTHERS | PLAIN)[name](branch)
    if name not in PLAIN:
        assert "\n" not in repr(result)
        assert " at 0x" not in repr(result)
    if name in VERDICTS:
        assert repr(result).startswith(result.verdict)
    page = Page(result._repr_html_())
    assert page.open == []
    assert page.tags <= {"p", "b", "table", "tr", "th", "td", "details", "summary"}
    assert page.rows or name == "branch that begins"
    assert all(cells[0] and len(cells) == 3 for cells in page.rows)


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

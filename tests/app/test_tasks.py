"""The tasks of docs/explorer.md, from the page alone, and what its text says one then sees."""

import math
import re
from pathlib import Path

import pytest
from playwright.sync_api import expect

from wedgebrake.explorer.core import limits

TEXT = (Path(__file__).parents[2] / "docs" / "explorer.md").read_text(encoding="utf-8")
FALLING = "falling-friction"


@pytest.fixture
def user(screen):
    return User(screen)


class User:
    """Somebody who does what the text says, and looks."""

    def __init__(self, screen):
        self.screen = screen

    def takes(self, preset):
        before = self.screen.shown()
        self.screen("preset").select_option(preset)
        self.screen.after(before)

    def types(self, name, value):
        before = self.screen.shown()
        self.screen.type(name, value)
        self.screen.after(before)

    def reads(self, *words):
        """Part of the sentence above all."""
        for one in words:
            expect(self.screen("headline")).to_contain_text(one)

    def sees(self, tile, *words):
        for one in words:
            expect(self.screen(f"tile-{tile}")).to_contain_text(one)

    def hovers(self, tile, *words):
        for one in words:
            expect(self.screen(f"tile-{tile}")).to_have_attribute(
                "title", re.compile(re.escape(one))
            )

    def chooses(self, what, value):
        before = self.screen.shown("picture")
        self.screen(what).select_option(value)
        self.screen.after(before, "picture")

    def spans(self, first, last, role=""):
        for end, value in (("from", first), ("to", last)):
            if float(self.screen(role + end).input_value()) == value:
                continue
            before = self.screen.shown("picture")
            self.screen(role + end).fill(str(value))
            self.screen(role + end).press("Enter")
            self.screen.after(before, "picture")


def test_is_my_brake_stable(user):
    user.reads("Linearly unstable both ways. Repeats every six periods of the torque, sticks in")
    user.sees("forward", "unstable", "margin −23.9 in η")
    user.sees("backward", "unstable", "margin −23.3 in η")
    user.hovers("forward", "−0.09 N s/rad, η = −0.054", "Beyond 7.5 rad/s", "releases")
    assert user.screen.number("slope") == -40.0

    user.screen("input-release").uncheck()
    user.types("eta", -60)
    user.sees("motion", "diverged")
    user.reads("Grows without bound")

    user.takes("start")
    user.types("damping", 10)
    user.sees("forward", "unstable", "margin −0.186")
    user.types("damping", 0.1)

    user.types("eta", 0)
    user.reads("Linearly stable. Moves in step with the torque, without sticking.")
    user.sees("forward", "stable", "margin +0.054 in η")
    user.sees("backward", "stable", "margin +0.654 in η")

    user.types("eta", -16)
    user.reads("unstable", "in step with the torque, without sticking")
    user.sees("forward", "margin −15.9")
    user.types("eta", -17)
    user.reads("Repeats every two periods")


def test_the_conventional_brake_has_less_torque(user):
    user.sees("torque", "106 N m")
    user.screen("comparison").check()
    user.sees("torque", "conventional: 9.44 N m")
    user.screen("comparison").uncheck()


def test_why_does_it_judder_at_10_hz(user):
    user.takes(FALLING)
    user.reads("Sliding at the shaft's speed is linearly unstable. Vibrates by itself at 10 Hz")
    user.reads("without a torque, sticks from forward sliding only.")
    assert user.screen.number("amplitude") == 0.0

    user.types("frequency", 20)
    user.reads("Vibrates by itself at 10 Hz")

    expect(user.screen("natural")).to_contain_text("10.07 Hz")
    user.types("stiffness", 16000)
    user.reads("Vibrates by itself at 20 Hz")
    user.types("stiffness", 4000)

    user.sees("forward", "unstable", "−2.7 N m s/rad at Ω")
    assert user.screen.number("drive_speed") == 3.0
    assert user.screen.number("damping") == 0.5
    expect(user.screen("input-speeds")).to_have_value("0, 0.2, 0.5, 1, 2")
    expect(user.screen("input-coefficients")).to_have_value("0.45, 0.4, 0.35, 0.31, 0.29")

    user.types("coefficients", "0.31 0.31 0.31 0.31 0.31")
    user.reads("linearly stable. Its free vibration at 10 Hz fades, without sticking.")
    user.takes(FALLING)

    user.types("damping", 4)
    user.reads("linearly stable. Its free vibration at 10 Hz fades")
    user.types("initial_velocity", -3)
    user.reads("linearly stable. Vibrates by itself at 10 Hz")
    user.sees("forward", "+0.8 N m s/rad")

    user.chooses("axis", "damping")
    user.spans(2, 10)
    user.screen.still()
    assert spread(user.screen, place(4.6, 2, 10)) > 0.3
    assert spread(user.screen, place(4.8, 2, 10)) < 0.05
    expect(user.screen("legend")).to_contain_text("undecided")
    user.types("damping", 5)
    user.reads("Slides evenly with the shaft, without sticking.")

    user.types("damping", 0.5)
    whole = torque(user)
    user.types("initial_force", 110)
    user.reads("Vibrates by itself at 10 Hz", "sticks")
    user.types("initial_force", 80)
    user.reads("fades")
    assert torque(user) / whole == pytest.approx(0.08, abs=0.005)


def test_which_wedge_angle_may_i_use(user):
    user.types("eta", -0.1)
    assert user.screen.number("slope") == pytest.approx(-0.16667)
    user.types("kinetic", 0.35)
    user.reads("Linearly unstable forwards. Stays at rest: the brake holds.")
    assert user.screen.number("alpha") == 1.0114

    user.chooses("axis", "alpha")
    user.screen.still()
    low, high = user.screen("from").input_value(), user.screen("to").input_value()
    dashed = dashes(user.screen)
    for value in (1.0, 1.3333):
        share = (value - float(low)) / (float(high) - float(low))
        assert any(abs(share - one) < 0.005 for one in dashed)
    expect(user.screen("legend")).to_contain_text("at rest")
    expect(user.screen("legend")).to_contain_text("synchronous (T)")

    user.types("alpha", 0.95)
    user.reads("Locks itself: cannot slide forwards.")
    user.types("alpha", 1.3)
    user.reads("Linearly unstable forwards")
    user.sees("forward", "margin −0.0117")
    user.types("alpha", 1.4)
    user.reads("Linearly stable")
    user.sees("forward", "margin +0.0233")
    user.sees("torque", "87.3 N m")
    assert user.screen.number("angle") == 0.45562

    user.screen("tab-stability").click()
    user.spans(-1, 0.2, "across-")
    for words in ("unstable", "stable: it decays", "locks: no forward sliding", "margin 0"):
        expect(user.screen("legend")).to_contain_text(words)

    user.types("kinetic", 0.3)
    assert user.screen.number("angle") == 0.45562
    assert user.screen.number("alpha") == 1.6333
    user.sees("forward", "margin +0.09 in η")
    user.sees("torque", "58.7 N m")
    # What the answer says of the limit.
    assert math.atan(0.35 + 0.1167) == pytest.approx(0.437, abs=5e-4)


def torque(user):
    return float(user.screen("tile-torque").inner_text().split()[2])


def place(value, low, high):
    """Where a value lies on a logarithmic axis, as a share of it."""
    return math.log(value / low) / math.log(high / low)


def spread(screen, share):
    """The share of a diagram's height over which points lie, in a few columns of pixels."""
    left, top, right, bottom = screen.frame("plot-diagram")
    box = screen("plot-diagram").bounding_box()
    pixels = screen.pixels(screen("plot-diagram")).astype(int)
    middle = round(left - box["x"] + share * (right - left))
    high = bottom - top
    rows = slice(round(top - box["y"]) + 3, round(top - box["y"] + 0.88 * high))
    dark = (pixels[rows, middle - 2 : middle + 3].sum(axis=2) < 560).any(axis=1).nonzero()[0]
    return float(dark.max() - dark.min()) / high if dark.size else 0.0


def dashes(screen):
    """Where dashed lines stand in the diagram, as shares of its width."""
    left, top, right, bottom = screen.frame("plot-diagram")
    box = screen("plot-diagram").bounding_box()
    pixels = screen.pixels(screen("plot-diagram")).astype(int)
    rows = slice(round(top - box["y"]) + 3, round(bottom - box["y"] - 0.15 * (bottom - top)))
    dark = (pixels[rows].sum(axis=2) < 400).mean(axis=0)
    columns = ((dark > 0.3) & (dark < 0.9)).nonzero()[0]
    return [(float(one) - (left - box["x"])) / (right - left) for one in columns]


# The table of limits is that of the program.

LIMITS = {
    "periods of the torque in one run": limits.MOST_PERIODS,
    "periods shown": limits.MOST_SHOWN,
    "events in one run of the exact solver": limits.MOST_EVENTS,
    "steps in one run of the other solvers": limits.MOST_STEPS,
    "values in a bifurcation diagram, at once": limits.COARSE_POINTS,
    "values in a bifurcation diagram, when all is still": limits.FINE_POINTS,
    "cells of a map, at once": limits.COARSE_MAP,
    "cells of a map, when all is still": limits.FINE_MAP,
    "seconds of one computation": limits.LONGEST_TURN,
    "seconds of one export": limits.LONGEST_EXPORT,
    "study file": limits.MOST_UPLOAD,
    "message of a browser": limits.MOST_MESSAGE,
    "exports of one page in hand": limits.MOST_FILES,
    "pages of one server": limits.MOST_SESSIONS,
}


def test_the_table_of_limits_is_that_of_the_program():
    table = TEXT.split("## Limits")[1].split("##")[0]
    rows = dict(re.findall(r"^\| ([a-z][^|]+?) \| ([^|]+?) \|$", table, flags=re.MULTILINE))
    rows = {
        name: tuple(int(one) for one in re.findall(r"\d+", value.replace(" 000", "000")))
        for name, value in rows.items()
    }
    assert rows == {
        name: value if isinstance(value, tuple) else (value,) for name, value in LIMITS.items()
    }

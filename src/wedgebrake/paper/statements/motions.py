"""Motions at a constant actuation force: statements M1 to M4 (section 4.1, figures 6 and 7)."""

from __future__ import annotations

from typing import Any

import numpy as np

from wedgebrake.analysis.sticking import BIDIRECTIONAL, NON_STICK_SLIP, UNIDIRECTIONAL
from wedgebrake.paper.assumptions import CONVENTIONAL, WEDGE, Case
from wedgebrake.paper.claims import Part, Statement
from wedgebrake.paper.laboratory import STEADY, Laboratory
from wedgebrake.paper.signal_features import STICK_SPEED, distortion, edges, lines, rests
from wedgebrake.paper.visual_criteria import EYE, SYNCHRONOUS, look

# "Much quicker" is at least this many times; and a bend is seen beside a smooth crossing if the
# acceleration jumps this many times as far.
_MUCH, BENT = 1.5, 3.0


def _case(values: dict[str, Any], brake: str = WEDGE) -> Case:
    return Case(brake=brake, eta=0.0, f=values.get("f", 0.63), F0=values["F0"])


def _sticks(laboratory: Laboratory, case: Case, wanted: str, words: str) -> Part:
    found = rests(laboratory.response(case), laboratory.eye)
    return Part(f"{words}: {wanted}", found.word == wanted, found.words())


def _non_stick_slip(laboratory: Laboratory, values: dict[str, Any]) -> list[Part]:
    wedge, other = _case(values), _case(values, CONVENTIONAL)
    response, compared = laboratory.responses([wedge, other])
    bent, smooth = distortion(response), distortion(compared)
    side, clean = (lines(one, laboratory.eye) for one in (response, compared))
    return [
        _sticks(laboratory, wedge, NON_STICK_SLIP, "wedge"),
        Part(
            "the wedge's velocity bends where it crosses zero, the conventional brake's does not",
            bent >= BENT * smooth,
            f"jump of the acceleration {bent:.2g} and {smooth:.2g} of its largest value",
        ),
        Part(
            "the wedge's spectrum has side bands, the conventional brake's has not",
            side.beside >= laboratory.eye.line > clean.beside,
            f"highest line beside f_e: {side.beside:.2g} of it for the wedge, {clean.beside:.2g}"
            " for the conventional brake",
        ),
    ]


def _bidirectional(laboratory: Laboratory, values: dict[str, Any]) -> list[Part]:
    case = _case(values)
    response = laboratory.response(case)
    back, forth = edges(response, -1), edges(response, 1)
    return [
        _sticks(laboratory, case, BIDIRECTIONAL, "wedge"),
        Part(
            "from negative velocity to zero much quicker than from zero to negative",
            back.rise >= _MUCH * back.fall,
            f"{1e3 * back.fall:.3g} ms against {1e3 * back.rise:.3g} ms between a tenth and nine"
            " tenths of the peak",
        ),
        Part(
            "from zero to positive milder than from positive to zero",
            forth.rise > forth.fall,
            f"{1e3 * forth.rise:.3g} ms against {1e3 * forth.fall:.3g} ms",
        ),
    ]


def _unidirectional(laboratory: Laboratory, values: dict[str, Any]) -> list[Part]:
    case = _case(values)
    response = laboratory.response(case)
    late = response["time"].to_numpy() >= STEADY
    velocity = response["velocity"].to_numpy()[late]
    if not velocity.size:
        return [Part("the run lasts 25 s", False, str(response.attrs["message"]))]
    high, low = float(np.max(velocity)), float(np.min(velocity))
    exact = rests(laboratory.like(method="exact").response(case), laboratory.eye).word
    return [
        _sticks(laboratory, case, UNIDIRECTIONAL, "wedge"),
        Part(
            "slips at negative velocity only; positive velocities are about zero",
            high <= STICK_SPEED < -low,
            f"velocity between {low:.3g} and {high:.3g} rad/s; friction reaches 99 % of its"
            f" value at {STICK_SPEED:.3g} rad/s. With Coulomb friction: {exact}",
        ),
    ]


def _conventional(laboratory: Laboratory, values: dict[str, Any]) -> list[Part]:
    cases = [Case(brake=CONVENTIONAL, eta=0.0, f=f, F0=F0) for f, F0 in values["cases"]]
    parts = []
    for letter, case in zip("abc", cases, strict=True):
        steady, found = laboratory.steady(case), lines(laboratory.response(case), laboratory.eye)
        height = float(np.ptp(laboratory.response(case)["velocity"].to_numpy()))
        sight = look(steady.velocity, height, laboratory.eye.dot)
        parts += [
            _sticks(laboratory, case, NON_STICK_SLIP, f"7{letter}"),
            Part(
                f"7{letter}: one limit cycle, a clean spectrum",
                sight.word == SYNCHRONOUS and found.beside < laboratory.eye.line,
                f"{sight.word}; highest line beside f_e {found.beside:.2g} of it, at"
                f" {found.where:.3g} Hz",
            ),
        ]
    return parts


_SPECTRUM = f"a line is seen from {100 * EYE.line:g} % of the highest on"
_AT = "classes must agree; "
STATEMENTS = (
    Statement(
        "M1", "6a", "η = 0: the wedge brake does not stick; its velocity is bent where it crosses"
        " zero and its spectrum has side bands; the conventional brake's (7a) has neither.",
        "Sticks after 20 s; jump of the acceleration at crossings; spectrum of all 25 s.",
        _AT + _SPECTRUM, _non_stick_slip, {"F0": 0.12}, {"F0": 0.036},
        "F_0 = 0.036 in figure 6a, not 0.12",
    ),
    Statement(
        "M2", "6b", "F_0 = 0.09: bidirectional stick-slip; negative to zero is much quicker than"
        " zero to negative, and zero to positive milder than positive to zero.",
        "Sticks after 20 s; times between a tenth and nine tenths of the peak of each slip.",
        f"{_AT}much quicker: {_MUCH:g} times", _bidirectional, {"F0": 0.09},
    ),
    Statement(
        "M3", "6c", "f = 1.89, F_0 = 0.114: unidirectional stick-slip, with slips at negative"
        " velocity only and positive velocities about zero.",
        "Sticks and extremes of the velocity after 20 s.",
        f"{_AT}about zero: friction has not reached 99 % of its value", _unidirectional,
        {"F0": 0.114, "f": 1.89},
    ),
    Statement(
        "M4", "7", "The conventional brake at the same three cases does not stick: one limit"
        " cycle of the excitation, a clean spectrum.",
        "Sticks and Poincaré points after 20 s, spectrum of all 25 s.", _AT + _SPECTRUM,
        _conventional, {"cases": ((0.63, 0.12), (0.63, 0.09), (1.89, 0.114))},
        {"cases": ((0.63, 0.036), (0.63, 0.09), (1.89, 0.114))},
        "F_0 = 0.036 in figure 7a, not 0.12",
    ),
)  # fmt: skip

"""Motions at a constant actuation force: statements M1 to M4 (section 4.1, figures 6 and 7)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from wedgebrake.analysis.sticking import BIDIRECTIONAL, NON_STICK_SLIP, UNIDIRECTIONAL
from wedgebrake.model.paper_machines import CONVENTIONAL, RESPONSES, Case
from wedgebrake.paper.claims import Part
from wedgebrake.paper.laboratory import STEADY, Laboratory
from wedgebrake.paper.signal_features import STICK_SPEED, edges
from wedgebrake.paper.statements.parts import bands_of, bent, stick_slip, sticks_of
from wedgebrake.paper.visual_criteria import SYNCHRONOUS, appearance

# "Much quicker" is at least this many times.
_MUCH = 1.5


def _non_stick_slip(laboratory: Laboratory, values: dict[str, Any]) -> Iterator[Part]:
    wedge = Case(eta=0.0, **values)
    other = wedge.at(brake=CONVENTIONAL)
    yield stick_slip(laboratory, wedge, NON_STICK_SLIP, "wedge")
    says = "the wedge's velocity bends where it crosses zero, the conventional brake's does not"
    yield bent(laboratory, wedge, other, says)
    side, clean = (bands_of(laboratory, one).beside for one in (wedge, other))
    yield Part(
        "the wedge's spectrum has side bands, the conventional brake's has not",
        side >= laboratory.thresholds.line > clean,
        f"highest line beside f_e: {side:.2g} of it for the wedge, {clean:.2g} for the"
        " conventional brake",
    )


def _bidirectional(laboratory: Laboratory, values: dict[str, Any]) -> Iterator[Part]:
    case = Case(eta=0.0, **values)
    response = laboratory.response(case)
    back, forth = edges(response, -1), edges(response, 1)
    yield stick_slip(laboratory, case, BIDIRECTIONAL, "wedge")
    yield Part(
        "from negative velocity to zero much quicker than from zero to negative",
        back.rise >= _MUCH * back.fall,
        f"{1e3 * back.fall:.3g} ms against {1e3 * back.rise:.3g} ms between a tenth and nine"
        " tenths of the peak",
    )
    yield Part(
        "from zero to positive milder than from positive to zero",
        forth.rise > forth.fall,
        f"{1e3 * forth.rise:.3g} ms against {1e3 * forth.fall:.3g} ms",
    )


def _unidirectional(laboratory: Laboratory, values: dict[str, Any]) -> Iterator[Part]:
    case = Case(eta=0.0, **values)
    response = laboratory.response(case)
    velocity = response["velocity"].to_numpy()[response["time"].to_numpy() >= STEADY]
    if not velocity.size:
        yield Part("the run lasts 25 s", False, str(response.attrs["message"]))
        return
    high, low = float(np.max(velocity)), float(np.min(velocity))
    exact = sticks_of(laboratory.like(method="exact"), case).kind
    yield stick_slip(laboratory, case, UNIDIRECTIONAL, "wedge")
    yield Part(
        "slips at negative velocity only; positive velocities are about zero",
        high <= STICK_SPEED < -low,
        f"velocity between {low:.3g} and {high:.3g} rad/s; friction reaches 99 % of its"
        f" value at {STICK_SPEED:.3g} rad/s. With Coulomb friction: {exact}",
    )


def _conventional(laboratory: Laboratory, values: dict[str, Any]) -> Iterator[Part]:
    first, *others = RESPONSES[7].cases
    for letter, case in zip("abc", (first.at(**values), *others), strict=True):
        found = bands_of(laboratory, case)
        height = float(np.ptp(laboratory.response(case)["velocity"].to_numpy()))
        velocity = laboratory.steady(case).velocity
        seen = appearance(velocity, height, laboratory.thresholds.dot).kind
        yield stick_slip(laboratory, case, NON_STICK_SLIP, f"7{letter}")
        yield Part(
            f"7{letter}: one limit cycle, a clean spectrum",
            seen == SYNCHRONOUS and found.beside < laboratory.thresholds.line,
            f"{seen}; highest line beside f_e {found.beside:.2g} of it, at {found.where:.3g} Hz",
        )


CHECKS = {
    "M1": _non_stick_slip,
    "M2": _bidirectional,
    "M3": _unidirectional,
    "M4": _conventional,
}

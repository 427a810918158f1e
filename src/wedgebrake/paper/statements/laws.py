"""Friction laws and the forces of the two brakes: statements S7 to S9 and K1."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from wedgebrake.analysis.responses.energy import energy
from wedgebrake.analysis.responses.sticking import BIDIRECTIONAL, UNIDIRECTIONAL
from wedgebrake.model.friction import SmoothFriction
from wedgebrake.model.paper_machines import CONVENTIONAL, FIGURE_5, KINETIC, RESPONSES, WEDGE, Case
from wedgebrake.paper.claims import Assertion
from wedgebrake.paper.laboratory import Laboratory
from wedgebrake.paper.statements.responses import bands_of, sticks_of
from wedgebrake.paper.timing import COULOMB, SMOOTHED, measure

# Sliding speeds of figure 4 [m/s].
_SPEEDS = np.linspace(1e-3, 0.5, 500)
# Away from zero speed: where tanh(100 v_r) is 1 to 1e-4 [m/s].
_AWAY = 0.05
_AGREE = 0.05
# Of the five cases of figure 15, those that are said to stick.
_STICKING = (0, 1, 3)


def _smoothed_gain(laboratory: Laboratory, case: Case) -> Callable[[float], float]:
    """F_mu/F_a of a case over the sliding speed, by the smoothed law."""
    system = laboratory.like(method="smooth").system(case)
    friction = system.friction
    assert isinstance(friction, SmoothFriction)  # noqa: S101 - the method makes it so
    return lambda speed: system.brake.amplification(friction.coefficient(speed))


def _figure_4(laboratory: Laboratory, values: dict[str, Any]) -> Iterator[Assertion]:
    gain = _smoothed_gain(laboratory, Case(**values))
    forward, backward = (max(abs(gain(sign * v)) for v in _SPEEDS) for sign in (1.0, -1.0))
    reaches = "F_μ/F_a reaches 5.58 forwards"
    if math.isinf(forward):
        locked = f"the wedge locks itself: tan α_w = {values['alpha'] * KINETIC:.3g}"
        yield Assertion(reaches, False, locked)
        return
    at = f"at α = {values['alpha']:.4g}, μ_s = {laboratory.assumptions.static:g}"
    for says, found, wanted, room in (
        (reaches, forward, 5.58, 0.005),
        ("and 0.46 backwards", backward, 0.46, 0.005),
        ("the ratio of the two is 12", forward / backward, 12.0, 0.5),
    ):
        yield Assertion(says, abs(found - wanted) <= room, f"{found:.4g} {at}")


def _figure_5(laboratory: Laboratory, _: dict[str, Any]) -> Iterator[Assertion]:
    both = (laboratory.like(method="smooth"), laboratory.like(method="exact"))
    gain, brake = _smoothed_gain(laboratory, FIGURE_5), both[0].system(FIGURE_5).brake
    gap = max(
        abs(gain(sign * float(speed)) / brake.amplification(sign * KINETIC) - 1.0)
        for sign in (1.0, -1.0)
        for speed in np.linspace(_AWAY, 1.0, 200)
    )
    responses = [one.response(FIGURE_5) for one in both]
    shown = responses[0]["time"].to_numpy() <= 5.0
    v1, v2 = (response["velocity"].to_numpy()[shown] for response in responses)
    difference = float(np.sqrt(np.mean((v1 - v2) ** 2)) / np.ptp(v2))
    found = [sticks_of(one, FIGURE_5) for one in both]
    yield Assertion(
        f"both laws give the same F_μ/F_a beyond |v_r| = {_AWAY:g} m/s",
        gap <= 1e-2,
        f"they differ by at most {100.0 * gap:.2g} %",
    )
    yield Assertion(
        "the responses agree over 5 s",
        difference <= _AGREE,
        f"rms difference {100.0 * difference:.2g} % of the velocity's range",
    )
    yield Assertion(
        "both are stick-slip",
        all(stuck.kind in (UNIDIRECTIONAL, BIDIRECTIONAL) for stuck in found),
        f"smoothed: {found[0].description()}; Coulomb: {found[1].description()}",
    )


def _run_time(_: Laboratory, __: dict[str, Any]) -> Iterator[Assertion]:
    found = "; ".join(f"{one.words}: {one.seconds:.2g} s" for one in measure())
    yield Assertion(
        f"the Coulomb law takes {COULOMB:g} s where the smoothed one takes {SMOOTHED:g} s",
        None,  # whatever the ratio here: the paper does not describe its program
        f"here {found}. Another program on another machine",
    )


def _force(laboratory: Laboratory, values: dict[str, Any]) -> Iterator[Assertion]:
    wedge, other = (
        laboratory.system(Case(brake=brake, alpha=values["alpha"])).brake.amplification
        for brake in (WEDGE, CONVENTIONAL)
    )
    forward, backward = (wedge(mu) / other(mu) for mu in (KINETIC, -KINETIC))
    cases = [case.at(F0=values["F0"]) for case in RESPONSES[15].cases]
    pairs = [(case, case.at(brake=CONVENTIONAL)) for case in cases]
    runs = laboratory.responses([case for pair in pairs for case in pair])
    if any(run.attrs["status"] != "completed" for run in runs):
        yield Assertion("the runs last 25 s", False, "some diverge")
        return
    yield Assertion(
        "the wedge's friction force is 12 times the conventional brake's",
        abs(forward - 12.0) <= 0.5 and abs(backward - 12.0) <= 0.5,
        f"{forward:.3g} times forwards, {backward:.3g} times backwards: 12 is the wedge's"
        f" own ratio of the two ({forward / backward:.3g})",
    )

    def power(case: Case) -> float:
        return float(energy(laboratory.response(case)).attrs["mean_friction_power"])

    def at_rest(case: Case) -> float:
        return sticks_of(laboratory, case).shares[2]

    def beside(case: Case) -> float:
        return bands_of(laboratory, case, natural=True).share

    sticking = [pairs[i] for i in _STICKING]
    for words, measured, compared in (
        ("more power dissipated in the friction interface", power, pairs),
        ("more of the time at rest where it is said to stick", at_rest, sticking),
        ("more energy beside f_e and f_n in the spectrum", beside, pairs),
    ):
        both = [(measured(one), measured(two)) for one, two in compared]
        more = sum(one > two for one, two in both)
        numbers = "; ".join(f"{one:.3g} against {two:.3g}" for one, two in both)
        found = f"at {more} of {len(both)} frequencies ({numbers})"
        yield Assertion(f"the wedge brings {words}", more == len(both), found)


CHECKS = {"S7": _figure_4, "S8": _figure_5, "S9": _run_time, "K1": _force}

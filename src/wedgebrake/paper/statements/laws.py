"""The friction law and the two brakes' forces: statements S7 to S9 and K1."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from wedgebrake.analysis.energy import energy
from wedgebrake.analysis.sticking import BIDIRECTIONAL, UNIDIRECTIONAL
from wedgebrake.model.friction import SmoothFriction
from wedgebrake.paper.assumptions import CONVENTIONAL, WEDGE, Case
from wedgebrake.paper.claims import Part, Statement
from wedgebrake.paper.diagrams import FORCE_WHY, FREQUENCIES, PLANS, PRINTED_F0, STICKING
from wedgebrake.paper.laboratory import Laboratory
from wedgebrake.paper.parameters import KINETIC
from wedgebrake.paper.signal_features import lines, rests
from wedgebrake.paper.timing import COULOMB, SMOOTHED, measure

# Sliding speeds of figure 4 [m/s].
_SPEEDS = np.linspace(1e-3, 0.5, 500)
# Away from zero speed: where tanh(100 v_r) is 1 to 1e-4 [m/s].
_AWAY = 0.05
_AGREE = 0.05


def _gains(laboratory: Laboratory, alpha: float) -> tuple[float, float]:
    """Largest F_mu/F_a of figure 4 forwards and backwards."""
    system = laboratory.like(method="smooth").system(Case(alpha=alpha))
    friction = system.friction
    assert isinstance(friction, SmoothFriction)  # noqa: S101 - the method makes it so
    gains = [
        max(abs(system.brake.amplification(friction.coefficient(sign * float(v)))) for v in _SPEEDS)
        for sign in (1.0, -1.0)
    ]
    return gains[0], gains[1]


def _figure_4(laboratory: Laboratory, values: dict[str, Any]) -> list[Part]:
    forward, backward = _gains(laboratory, values["alpha"])
    ratio = forward / backward
    if math.isinf(forward):
        locked = f"the wedge locks itself: tan α_w = {values['alpha'] * KINETIC:.3g}"
        return [Part("F_μ/F_a reaches 5.58 forwards", False, locked)]
    at = f"at α = {values['alpha']:.4g}, μ_s = {laboratory.assumptions.static:g}"
    return [
        Part("F_μ/F_a reaches 5.58 forwards", abs(forward - 5.58) <= 0.005, f"{forward:.4g} {at}"),
        Part("and 0.46 backwards", abs(backward - 0.46) <= 0.005, f"{backward:.4g} {at}"),
        Part("the ratio of the two is 12", abs(ratio - 12.0) <= 0.5, f"{ratio:.4g} {at}"),
    ]


def _figure_5(laboratory: Laboratory, _: dict[str, Any]) -> list[Part]:
    case = Case(eta=0.0, F0=0.09, alpha=1.21)
    smooth, exact = laboratory.like(method="smooth"), laboratory.like(method="exact")
    system = smooth.system(case)
    friction = system.friction
    assert isinstance(friction, SmoothFriction)  # noqa: S101 - the method makes it so
    gaps = []
    for sign in (1.0, -1.0):
        coulomb = system.brake.amplification(sign * KINETIC)
        for speed in np.linspace(_AWAY, 1.0, 200):
            gain = system.brake.amplification(friction.coefficient(sign * float(speed)))
            gaps.append(abs(gain / coulomb - 1.0))
    one, two = smooth.response(case), exact.response(case)
    shown = one["time"].to_numpy() <= 5.0
    v1, v2 = (r["velocity"].to_numpy()[shown] for r in (one, two))
    difference = float(np.sqrt(np.mean((v1 - v2) ** 2)) / np.ptp(v2))
    found = [rests(response, laboratory.eye) for response in (one, two)]
    return [
        Part(
            f"both laws give the same F_μ/F_a beyond |v_r| = {_AWAY:g} m/s",
            max(gaps) <= 1e-2,
            f"they differ by at most {100.0 * max(gaps):.2g} %",
        ),
        Part(
            "the responses agree over 5 s",
            difference <= _AGREE,
            f"rms difference {100.0 * difference:.2g} % of the velocity's range",
        ),
        Part(
            "both are stick-slip",
            all(stuck.word in (UNIDIRECTIONAL, BIDIRECTIONAL) for stuck in found),
            f"smoothed: {found[0].words()}; Coulomb: {found[1].words()}",
        ),
    ]


def _run_time(_: Laboratory, __: dict[str, Any]) -> list[Part]:
    seconds = {one.words: one.seconds for one in measure()}
    found = "; ".join(f"{words}: {value:.2g} s" for words, value in seconds.items())
    return [
        Part(
            f"the Coulomb law takes {COULOMB:g} s where the smoothed one takes {SMOOTHED:g} s",
            None,  # whatever the ratio here: the paper does not describe its program
            f"here {found}. Another program on another machine",
        )
    ]


def _force(laboratory: Laboratory, values: dict[str, Any]) -> list[Part]:
    wedge = laboratory.system(Case(alpha=values["alpha"])).brake
    other = laboratory.system(Case(brake=CONVENTIONAL)).brake
    forward = wedge.amplification(KINETIC) / other.amplification(KINETIC)
    backward = wedge.amplification(-KINETIC) / other.amplification(-KINETIC)
    cases = [Case(F0=values["F0"], f=f) for f in FREQUENCIES]
    runs = {
        brake: laboratory.responses([case.at(brake=brake) for case in cases])
        for brake in (WEDGE, CONVENTIONAL)
    }
    if any(r.attrs["status"] != "completed" for one in runs.values() for r in one):
        return [Part("the runs last 25 s", False, "some diverge")]
    power = {b: [energy(r).attrs["mean_friction_power"] for r in one] for b, one in runs.items()}
    side = {
        b: [lines(r, laboratory.eye, natural=True).share for r in one] for b, one in runs.items()
    }
    rest = {b: [rests(r, laboratory.eye).shares[2] for r in one] for b, one in runs.items()}
    parts = [
        Part(
            "the wedge's friction force is 12 times the conventional brake's",
            abs(forward - 12.0) <= 0.5 and abs(backward - 12.0) <= 0.5,
            f"{forward:.3g} times forwards, {backward:.3g} times backwards: 12 is the wedge's"
            f" own ratio of the two ({forward / backward:.3g})",
        )
    ]
    sticking = [cases.index(case) for case in cases if case.f in STICKING]
    rest = {brake: [shares[i] for i in sticking] for brake, shares in rest.items()}
    for words, both in (
        ("more power dissipated in the friction interface", power),
        ("more of the time at rest where it is said to stick", rest),
        ("more energy beside f_e and f_n in the spectrum", side),
    ):
        more = [w > c for w, c in zip(both[WEDGE], both[CONVENTIONAL], strict=True)]
        numbers = "; ".join(
            f"{w:.3g} against {c:.3g}" for w, c in zip(both[WEDGE], both[CONVENTIONAL], strict=True)
        )
        found = f"at {sum(more)} of {len(more)} frequencies ({numbers})"
        parts.append(Part(f"the wedge brings {words}", all(more), found))
    return parts


_WEDGE_034 = math.tan(0.34) / KINETIC

FRICTION = (
    Statement(
        "S7", "4", "The friction force is 5.58 times the actuation force forwards and 0.46 times"
        " backwards, a ratio of 12.",
        "Largest value of the smoothed law's curve up to |v_r| = 0.5 m/s.",
        "half a unit of the printed digits", _figure_4, {"alpha": 1.03}, {"alpha": _WEDGE_034},
        "α = 1.18 (a wedge angle of 0.34 rad) in figure 4, not 1.03",
    ),
    Statement(
        "S8", "5", "Smoothed and Coulomb friction agree away from zero speed and in their"
        " response, which is stick-slip.",
        "F_μ/F_a of both laws at 400 speeds; both responses over the 5 s of the figure.",
        "1 % for the laws, 5 % (rms) for the responses", _figure_5,
    ),
    Statement(
        "S9", "5", "The Coulomb computation takes twice as long as the smoothed one.",
        "The paper's scheme timed on both.", "none: another machine and another program",
        _run_time,
    ),
)  # fmt: skip

DISSIPATION = (
    Statement(
        "K1", "15", "The wedge's friction force is 12 times the conventional brake's; it brings"
        " more dissipation, more sticking and more side bands.",
        "Amplifications at μ_k; friction power, time at rest and spectra of the runs of figures"
        " 15 and 16.", "12 ± 0.5; order of the values at every frequency,"
        " of rest at those with sticks", _force,
        {"alpha": _WEDGE_034, "F0": PRINTED_F0}, {"F0": PLANS["14a"].base.F0}, FORCE_WHY,
    ),
)  # fmt: skip

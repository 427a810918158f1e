"""Cases chosen by hand: known answers, lasting chaos, tori, coexisting attractors, traps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import wedgebrake as wb

REST = (0.0, 0.0)


@dataclass(frozen=True)
class Case:
    """One motion to judge.

    group : what it is there for
    known : the answer and where it is known from, None where the judge is the only source
    """

    name: str
    group: str
    system: wb.BrakedDriveline
    initial: tuple[float, float] = REST
    known: tuple[str, int, str] | None = None


def _paper(eta: float, f: float, F0: float, alpha: float = 1.18, **more: Any):
    """The paper's wedge; ``more`` are other arguments of ``wb.paper.system``."""
    return wb.paper.system(eta=eta, f=f, F0=F0, alpha=alpha, **more)


def _plain(eta: float, f: float, F0: float, **more: Any):
    """The paper's conventional brake."""
    return wb.paper.system(eta=eta, f=f, F0=F0, brake="conventional", **more)


def _linear(f: float, damping: float = 0.0):
    """No brake at all: closed forms."""
    system = wb.paper.system(eta=0.0, f=f)
    return system.replace(slope=0.0, kinetic=0.0, static=0.0, damping=damping)


def _known() -> list[Case]:
    linear, free = "linear", "free vibration lasts: its period is f torque periods"
    mixed = "forced part plus free part of incommensurate frequency"
    golden = (math.sqrt(5.0) - 1.0) / 2.0
    before = "expected beforehand, from runs of other programs"
    return [
        Case("linear, f = 2/3", linear, _linear(2 / 3), REST, ("periodic", 2, free)),
        Case("linear, f = 3/4", linear, _linear(3 / 4), REST, ("periodic", 3, free)),
        Case("linear, f = 5/7", linear, _linear(5 / 7), (0.01, 2.0), ("periodic", 5, free)),
        Case("linear, f = 0.63", linear, _linear(0.63), REST, ("periodic", 63, free)),
        Case("linear, golden f", linear, _linear(golden), REST, ("quasi-periodic", 0, mixed)),
        Case(
            "linear, f = sqrt(1/2)", linear, _linear(math.sqrt(0.5)), (0.01, 1.0),
            ("quasi-periodic", 0, mixed),
        ),
        Case(
            "linear, damped", linear, _linear(0.63, 0.1), (0.05, -3.0),
            ("synchronous", 1, "free vibration decays like exp(-0.05 t)"),
        ),
        Case(
            "linear, resonance", linear, _linear(1.0), REST,
            ("diverged", 0, "undamped resonance grows like t"),
        ),
        Case(
            "forced 2T", "paper", _paper(-24, 0.63, 0.067), REST,
            ("periodic", 2, before),
        ),
        Case(
            "transient chaos, then 6T", "paper", _paper(-24, 0.63, 0.036), REST,
            ("periodic", 6, before),
        ),
        Case(
            "Coulomb friction only", "paper",
            _plain(0, 0.63, 0.036).replace(slope=0.0, damping=0.0), REST,
            ("synchronous", 1, "Den Hartog's vibration: friction damps whatever differs from it"),
        ),
    ]  # fmt: skip


def _settling() -> list[Case]:
    """Damping in sliding a little above zero: at 250 periods the motion still settles."""
    group, known = "slow settling", ("synchronous", 1, "all sliding is damped, c_+ and c_- > 0")
    return [
        Case("settles after hundreds", group, _plain(-0.8, 0.63, 0.012), REST, known),
        Case("settles after two thousand", group, _plain(-0.8, 1.5, 0.005), REST, known),
        Case("settles after thousands", group, _plain(-0.9, 1.5, 0.001), REST, known),
        Case("settles after a thousand, wedge", group, _paper(-0.05, 1.5, 0.001), REST, known),
    ]


def _transients() -> list[Case]:
    """Chaos that ends, after thousands of periods."""
    group, start = "chaotic transient", (-0.1312, -11.604)
    return [
        Case("transient of 1 700 periods, then 13T", group, _paper(-54, 0.93, 0.053)),
        Case("transient of 5 000 periods, then 10T", group, _paper(-13, 0.91, 0.045)),
        Case("transient of 23 000 periods, then 2T", group, _paper(-22, 0.63, 0.038), start),
    ]


def _ends() -> list[Case]:
    group = "ends and rest"
    holds = ("at rest", 1, "the largest torque is inside the holding interval")
    forwards = ("self-locked", 0, "forward sliding has no solution for alpha < 1")
    return [
        Case("never breaks loose", group, _plain(-10, 0.63, 1.2), REST, holds),
        Case("locked, slides back into rest", group, _paper(-20, 0.63, 0.02, 0.9), (0.0, -5.0)),
        Case("locked, forwards", group, _paper(-20, 0.63, 0.02, 0.9), (0.0, 5.0), forwards),
        Case("without release", group, _paper(-24, 0.63, 0.036, release=False)),
        Case("without release, c = 1", group, _plain(-30, 1.2, 0.1, damping=1.0, release=False)),
        Case("without release, damped", group, _paper(5, 1.2, 0.05, release=False)),
        Case("creeps to rest", group, _paper(-20, 2.05, 0.13, 1.21, damping=1.41)),
    ]


def _chaos() -> list[Case]:
    sticks, rarely = "chaos, sticks in every few periods", "chaos, sticks rarely"
    at = {
        sticks: [
            _paper(-22, 0.63, 0.03),
            _paper(-25, 0.63, 0.045),
            _paper(-28, 0.63, 0.041),
            _paper(-32, 0.63, 0.061),
            _paper(-39, 0.63, 0.09),
            _paper(-61, 0.63, 0.09),
            _paper(-23, 0.4, 0.025),
            _paper(-77, 0.35, 0.09, 2.01, damping=0.2),
            _paper(-64, 0.62, 0.12, 1.99, damping=0.2),
            _paper(-67, 0.23, 0.013, 1.39, damping=0.05, static=0.33),
            _paper(-37, 0.41, 0.095, 1.29, damping=2.0, static=0.33),
            _plain(-23, 0.34, 0.1, damping=1.0),
            _plain(-51, 0.37, 0.15, damping=1.0, static=0.33),
            _plain(-23, 0.27, 0.15, damping=0.5, static=0.39),
            _plain(-69, 0.63, 0.095),
        ],
        rarely: [
            _paper(-14, 0.97, 0.086),
            _paper(-17, 0.93, 0.071),
            _paper(-32, 0.96, 0.063),
            _paper(-50, 0.91, 0.089, 2.24, damping=0.05, static=0.39),
            _plain(-50, 0.89, 0.073, damping=0.05),
            _plain(-20, 0.63, 0.027),
        ],
    }
    return _numbered(at)


def _tori() -> list[Case]:
    smooth, sticky = "torus without sticks", "torus with sticks"
    at = {
        smooth: [
            _paper(-24, 1.37, 0.036),
            _paper(-20, 1.08, 0.06, 2.1),
            _paper(-77, 1.93, 0.036, 2.58, damping=0.17),
            _paper(-28, 1.48, 0.032, 2.16, damping=0.24),
            _paper(-55, 0.476, 0.0057, 2.12, damping=0.06),
            _plain(-50, 0.93, 0.13),
        ],
        sticky: [
            _paper(-76, 0.45, 0.034, 1.59, damping=0.13),
            _paper(-56, 0.44, 0.0088, 1.74),
            _plain(-62, 0.44, 0.021, damping=0.083, static=0.39),
        ],
        # Where a torus sticks, orders are high: beyond what a short run can see.
        "torus that locks": [
            _paper(-47.6732, 0.4543, 0.0259, 2.2567, damping=0.075, static=0.39),
            _plain(-79.8046, 0.5733, 0.0713, damping=0.214, static=0.39),
        ],
    }
    return _numbered(at)


def _coexisting() -> list[Case]:
    pairs = [
        (_paper(-36, 0.63, 0.049), REST, (0.0955, -1.192)),
        (_paper(-30, 0.63, 0.068), REST, (0.0229, 1.009)),
        (_paper(-54, 0.94, 0.07), REST, (-0.0093, 6.21)),
        (_paper(-48, 0.87, 0.068), REST, (-0.0505, 3.307)),
        (_plain(-50, 0.93, 0.13), (0.035, 3.848)),  # the torus above is the other one
        (_plain(-53, 0.35, 0.19), REST, (-0.0029, -0.303)),  # mirror images of each other
        (_paper(-56, 0.44, 0.0088, 1.74), (0.0512, 6.479)),  # the torus above is the other one
        (_paper(-51, 1.29, 0.11, 1.65, damping=1.0, static=0.39), REST, (0.0006, -2.59)),
        (_paper(-24, 1.1, 0.23, 1.64, damping=1.0, static=0.39), REST, (0.0095, 0.387)),
        (_paper(-53, 1.0, 0.15, 1.23), REST, (0.0302, 1.37), (0.0017, 2.728)),
    ]
    return [
        Case(f"coexisting {number}{'abc'[i]}", "coexisting attractors", system, initial)
        for number, (system, *starts) in enumerate(pairs, 1)
        for i, initial in enumerate(starts)
    ]


def _numbered(groups: dict[str, list[wb.BrakedDriveline]]) -> list[Case]:
    return [
        Case(f"{group} {number}", group, system)
        for group, systems in groups.items()
        for number, system in enumerate(systems, 1)
    ]


def named_cases() -> list[Case]:
    """All of them."""
    return [*_known(), *_settling(), *_transients(), *_ends(), *_chaos(), *_tori(), *_coexisting()]

"""The machines of Chen and Xi (2014) as data: fixed values, assumptions, cases and diagrams.

Chen and Xi, Stability and response of a self-amplified braking system under
velocity-dependent actuation force, Nonlinear Dynamics (2014),
doi 10.1007/s11071-014-1603-y.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from typing import Any

from wedgebrake.model.actuation import Actuation
from wedgebrake.model.brakes import Brake, ConventionalBrake, WedgeBrake
from wedgebrake.model.driveline import Driveline
from wedgebrake.model.friction import CoulombFriction, Friction, SmoothedFriction
from wedgebrake.model.signals.excitation import HarmonicTorque
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_choice

KINETIC, RADIUS, INITIAL_FORCE = 0.30, 0.2, 300.0
INERTIA, STIFFNESS = 1.0, 1e4
"""mu_k, R [m], F_a0 [N], J [kg m^2] and k [N m/rad], of the paper's sections 3 and 4."""
DURATION = 25.0
"""Length of every run [s] (section 4)."""


def system(
    eta: float = -24.0,
    f: float = 0.63,
    F0: float = 0.036,  # noqa: N803 - the paper's symbol, fixed public name
    alpha: float = 1.18,
    brake: str = "wedge",
    friction: str = "coulomb",
    damping: float = 0.1,
    static: float = 0.30,
    release: bool = True,
) -> BrakedDriveline:
    """The paper's braked driveline at the given normalised groups.

    The paper prints damping c = 1 N m s/rad, mu_s = 0.33 and an actuation force that may
    become negative; its nonlinear figures follow only with c = 0.1, mu_s = mu_k = 0.30 and
    a brake that releases, the defaults here. ``damping=1.0, static=0.33, release=False``
    is the paper as printed.

    eta, f, F0, alpha : slope of the actuation force, frequency of the torque, initial actuation
                        force, wedge angle (``wb.Groups``)
    brake             : "wedge" or "conventional" (``alpha`` is then without effect)
    friction          : "coulomb" or "smoothed"
    damping, static   : c [N m s/rad] and mu_s [1]
    release           : whether a negative actuation force releases the brake

    Raises ``InputError`` for any other word or a value out of range.
    """
    frictions: dict[str, Friction] = {
        "coulomb": CoulombFriction(kinetic=KINETIC, static=static),
        "smoothed": SmoothedFriction(kinetic=KINETIC, static=static),
    }
    brakes: dict[str, Brake] = {
        "wedge": WedgeBrake(angle=0.34, radius=RADIUS),
        "conventional": ConventionalBrake(radius=RADIUS),
    }
    base = BrakedDriveline(
        driveline=Driveline(inertia=INERTIA, damping=damping, stiffness=STIFFNESS),
        brake=brakes[check_choice("brake", brake, brakes)],
        friction=frictions[check_choice("friction", friction, frictions)],
        actuation=Actuation(initial_force=INITIAL_FORCE, release=release),
        excitation=HarmonicTorque(amplitude=500.0, frequency=10.0),
    )
    angle = {"alpha": alpha} if brake == "wedge" else {}
    return base.replace(eta=eta, f=f, F0=F0, **angle)


WEDGE, CONVENTIONAL = "wedge", "conventional"


@dataclass(frozen=True)
class Case:
    """One run of the paper: its brake and normalised groups, by default those of most figures."""

    brake: str = WEDGE
    eta: float = -24.0
    f: float = 0.63
    F0: float = 0.036
    alpha: float = 1.18

    def at(self, **changed: Any) -> Case:
        """Return the same case with other groups."""
        return replace(self, **changed)


@dataclass(frozen=True)
class Assumptions:
    """Choices that the paper leaves open and its nonlinear results depend on.

    damping  : c of section 4 [N m s/rad]
    static   : mu_s in the friction law of section 4
    release  : the actuation force cannot become negative
    slope_on : the speed in eq. (3): "shaft", |theta'| as printed, or "interface",
               |v_r| = R |theta'|, as friction is said to depend on
    """

    damping: float = 0.1
    static: float = 0.30
    release: bool = True
    slope_on: str = "shaft"

    def system(self, case: Case, friction: str) -> BrakedDriveline:
        """Return the system of a case, with friction "coulomb" or "smoothed"."""
        share = 1.0 if self.slope_on == "shaft" else RADIUS
        chosen: dict[str, Any] = {**vars(self), **vars(case.at(eta=case.eta * share))}
        del chosen["slope_on"]
        return system(friction=friction, **chosen)

    def relevant(self, case: Case) -> Assumptions:
        """Return the choices with those that make no difference to a case as corrected.

        A force that does not fall cannot become negative, and without a slope the speed that
        it depends on does not matter.
        """
        release = self.release or case.eta >= 0.0
        slope_on = "shaft" if case.eta == 0.0 else self.slope_on
        return replace(self, release=release, slope_on=slope_on)

    def words(self, names: Iterable[str] = ("damping", "static", "release", "slope_on")) -> str:
        """Describe the choices, or those named, in one line."""
        words = {
            "damping": f"c = {self.damping:g} N m s/rad",
            "static": f"μ_s = {self.static:g}",
            "release": "released at a negative force" if self.release else "force may be negative",
            "slope_on": "slope on |θ'|" if self.slope_on == "shaft" else "slope on |v_r|",
        }
        return ", ".join(words[name] for name in names)

    def differing(self, other: Assumptions) -> list[str]:
        """Names of the choices in which another set differs."""
        names = [field.name for field in fields(self)]
        return [name for name in names if getattr(self, name) != getattr(other, name)]


AS_PRINTED = Assumptions(damping=1.0, static=0.33, release=False)
CORRECTED = Assumptions()

HERTZ = 2.0 * math.pi / math.sqrt(STIFFNESS / INERTIA)
"""One hertz of the torque as a step of f = f_e/f_n."""
PRINTED_F0 = 0.024
"""F_0 that the captions of figures 14 to 16 print."""
_OTHER = Case(brake=CONVENTIONAL)


@dataclass(frozen=True)
class DiagramRange:
    """One of the paper's bifurcation diagrams.

    base, name : the case, and the group that is varied
    low, high  : its range
    limits     : printed limits between the kinds of motion
    """

    base: Case
    name: str
    low: float
    high: float
    limits: tuple[float, ...]


DIAGRAMS = {
    "8a": DiagramRange(Case(), "eta", -120.0, 12.0, (-30.0, -18.0)),
    "8b": DiagramRange(_OTHER, "eta", -120.0, 12.0, (-24.0,)),
    "11a": DiagramRange(Case(), "F0", 0.012, 0.12, (0.019, 0.028, 0.034, 0.058, 0.072)),
    "11b": DiagramRange(_OTHER, "F0", 0.012, 0.12, (0.044,)),
    "14a": DiagramRange(Case(), "f", 0.3, 3.0, (0.56, 1.57)),
    "14b": DiagramRange(_OTHER, "f", 0.3, 3.0, (0.69, 1.57)),
    "17": DiagramRange(Case(F0=PRINTED_F0), "alpha", 0.33, 8.60, (1.41,)),
}
"""The bifurcation diagrams, by figure."""


@dataclass(frozen=True)
class Rows:
    """A figure of responses, one row per case, and the groups in which its cases differ."""

    cases: tuple[Case, ...]
    varied: tuple[str, ...]

    def conventional(self) -> Rows:
        """Return the same rows with the conventional brake."""
        return Rows(tuple(case.at(brake=CONVENTIONAL) for case in self.cases), self.varied)


_CONSTANT = Rows(
    (Case(eta=0.0, F0=0.12), Case(eta=0.0, F0=0.09), Case(eta=0.0, f=1.89, F0=0.114)), ("f", "F0")
)
_SLOPES = Rows(tuple(Case(eta=eta) for eta in (-6.0, -24.0, -30.0, -60.0)), ("eta",))
_FORCES = Rows(tuple(Case(F0=F0) for F0 in (0.015, 0.024, 0.031, 0.042, 0.067, 0.120)), ("F0",))
# Printed as f = 0.31, 0.63, 1.0, 1.26 and 2.07.
_FREQUENCIES = Rows(tuple(Case(f=HERTZ * hertz) for hertz in (5, 10, 16, 20, 33)), ("f",))
# Wedge angles of 0.2 and 1 rad, printed as alpha = 0.68 and 5.20.
_ANGLES = Rows(
    tuple(Case(F0=PRINTED_F0, alpha=math.tan(angle) / KINETIC) for angle in (0.2, 1.0)),
    ("alpha",),
)
FIGURE_5 = Case(eta=0.0, F0=0.09, alpha=1.21)
"""The example of figure 5, whose run times the paper states."""
RESPONSES = {
    6: _CONSTANT,
    7: _CONSTANT.conventional(),
    9: _SLOPES,
    10: _SLOPES.conventional(),
    12: _FORCES,
    13: _FORCES.conventional(),
    15: _FREQUENCIES,
    16: _FREQUENCIES.conventional(),
    18: _ANGLES,
}
"""The figures of responses, by number: those of figure 6 as printed."""

"""What the paper leaves unsaid, decided one way or another, and the cases that it computes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from typing import Any

from wedgebrake.model.system import BrakedDriveline
from wedgebrake.paper.parameters import RADIUS, system

WEDGE, CONVENTIONAL = "wedge", "conventional"


@dataclass(frozen=True)
class Case:
    """One run of the paper: the brake and its normalised groups.

    The defaults are those of most of its figures.
    """

    brake: str = WEDGE
    eta: float = -24.0
    f: float = 0.63
    F0: float = 0.036
    alpha: float = 1.18

    def at(self, **changed: Any) -> Case:
        """The same case with other groups."""
        return replace(self, **changed)


@dataclass(frozen=True)
class Assumptions:
    """The choices that the paper's nonlinear results depend on.

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
        """The machine of a case, with friction "coulomb" or "smoothed"."""
        share = 1.0 if self.slope_on == "shaft" else RADIUS
        return system(
            eta=case.eta * share,
            f=case.f,
            F0=case.F0,
            alpha=case.alpha,
            brake=case.brake,
            friction=friction,
            damping=self.damping,
            static=self.static,
            release=self.release,
        )

    def relevant(self, case: Case) -> Assumptions:
        """The same choices for a case, with those that change nothing there as corrected.

        A force that does not fall cannot become negative, and without a slope its speed does
        not matter.
        """
        release = self.release or case.eta >= 0.0
        slope_on = "shaft" if case.eta == 0.0 else self.slope_on
        return replace(self, release=release, slope_on=slope_on)

    def words(self, names: Iterable[str] = ("damping", "static", "release", "slope_on")) -> str:
        """The choices, or those named, in a line."""
        said = {
            "damping": f"c = {self.damping:g} N m s/rad",
            "static": f"μ_s = {self.static:g}",
            "release": "released at a negative force" if self.release else "force may be negative",
            "slope_on": "slope on |θ'|" if self.slope_on == "shaft" else "slope on |v_r|",
        }
        return ", ".join(said[name] for name in names)

    def differing(self, other: Assumptions) -> list[str]:
        """Names of the choices that another set makes otherwise."""
        names = [field.name for field in fields(self)]
        return [name for name in names if getattr(self, name) != getattr(other, name)]


AS_PRINTED = Assumptions(damping=1.0, static=0.33, release=False)
CORRECTED = Assumptions()

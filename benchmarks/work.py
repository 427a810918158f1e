"""The work of ``make bench``, and the truth that errors are measured against.

Every case is followed over 250 periods of the torque, and compared where the truth itself is
known to 1e-9: at the end, but for the one case that is chaotic for its first hundred periods.
There a change of the torque in its last bit has grown to 1e-10 after 30 periods, and to 0.1
after 100.
"""

from typing import NamedTuple

import numpy as np

import wedgebrake as wb
from peers.brake import Brake
from peers.peer import LAWS

PERIODS = 250
ETAS = np.linspace(-60.0, 12.0, 200)
DIAGRAM_FORCE = 0.036
# Every point of the diagram is compared here, where that of none has lost more than 1e-10.
DIAGRAM_COMPARED = 20


class Case(NamedTuple):
    """One machine. compared: number of the period at whose end states are compared."""

    law: str
    eta: float
    force: float
    compared: int = PERIODS

    @property
    def system(self) -> wb.BrakedDriveline:
        """As the package has it: no static peak, release on."""
        return system(self.law, self.eta, self.force)

    @property
    def words(self) -> str:
        """Which case it is."""
        return f"η = {self.eta:g}, F₀ = {self.force:g}".replace("-", "−")


_PAIRS = ((-24.0, 0.036), (-60.0, 0.036), (-24.0, 0.067), (0.0, 0.09))
CASES = tuple(
    Case(law, *pair, 30 if (law, pair) == ("coulomb", _PAIRS[0]) else PERIODS)
    for law in LAWS
    for pair in _PAIRS
)


def system(law: str, eta: float, force: float = DIAGRAM_FORCE) -> wb.BrakedDriveline:
    """The paper's wedge brake at f = 0.63."""
    return wb.paper.system(eta=eta, F0=force, friction=law)


def duration(machine: wb.BrakedDriveline, periods: int) -> float:
    """Of some periods of the torque [s]."""
    return periods / machine.excitation.frequency


def truth(machine: wb.BrakedDriveline, periods: int) -> np.ndarray:
    """Angle [rad] and velocity [rad/s], from rest.

    Coulomb friction: the exact solver. Smoothed: converged. Tests hold both against heyoka,
    and the solvers themselves against arithmetic of 50 digits.
    """
    tolerance = {} if isinstance(machine.friction, wb.CoulombFriction) else {"rtol": 1e-13}
    until = duration(machine, periods)
    found = wb.simulate(machine, until, times=[until], **tolerance)
    return np.array([found.attrs["final_angle"], found.attrs["final_velocity"]])


def beside(case: Case, count: int) -> list[wb.BrakedDriveline]:
    """The case, and others a thousandth away."""
    return [
        system(case.law, case.eta - 0.001 * i * max(1.0, abs(case.eta)), case.force)
        for i in range(count)
    ]


def neighbours(case: Case, count: int) -> list[Brake]:
    """The same for programs that like to have several."""
    return [Brake.of(machine) for machine in beside(case, count)]


def diagram(law: str, stride: int = 1) -> list[Brake]:
    """The points of the bifurcation diagram, or every so-many-th."""
    return [Brake.of(system(law, float(eta))) for eta in ETAS[::stride]]

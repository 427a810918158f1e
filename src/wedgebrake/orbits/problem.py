"""Problem of continuation: a system with parameters in ranges, its section and measures."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.errors import InputError, nearest
from wedgebrake.model.display import Tabular
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.machine import Machine
from wedgebrake.model.sweep_settings import INITIAL, refuse_doubled, sweepable
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import is_finite, is_number, shown

if TYPE_CHECKING:
    from wedgebrake.solvers.machine.passage import Crossing

FloatArray = NDArray[np.float64]
# Structured arrays, such as the margins of an orbit.
Records = NDArray[np.record]

# Points of an orbit nearer than this share of its size count as one.
SAME = 1e-6
_TINY = 1e-300
# Differences and Newton's method use neighbouring parameter values repeatedly.
_REMEMBERED = 16
# Names of results in a dataset of orbits.
_TAKEN = ("angle", "velocity")


class NoOrbitError(ArithmeticError):
    """The equations have no value: the run does not last, or the brake lacks a segment."""


@dataclass(frozen=True, eq=False)
class Section:
    """Section at which orbits are sampled, and the distance of orbits there.

    That of a driven system is stroboscopic: the states at t = 0, T, 2 T, ..., T being the period
    of the torque; that of a self-excited one is a level of a speed.
    Points of an orbit are given as an array (order, n) of its successive returns.

    to : (p, n) scaled coordinates of a state, which are velocities
    """

    to: FloatArray

    @classmethod
    def of(cls, system: BrakedDriveline) -> Section:
        """Section of a driveline. Either of angle and velocity may vanish there."""
        return cls(np.diag([system.excitation.angular_frequency, 1.0]))

    def scaled(self, points: FloatArray) -> FloatArray:
        """Scaled coordinates of states, (..., p)."""
        return np.asarray(points @ self.to.T)

    def prime_order(self, points: FloatArray, tolerance: float = SAME) -> int:
        """Fewest returns after which an orbit repeats, to a share of its size."""
        order = len(points)
        for fewer in range(1, order):
            if order % fewer == 0 and self._agree(np.roll(points, fewer, 0), points, tolerance):
                return fewer
        return order

    def half_difference(self, points: FloatArray) -> FloatArray:
        """Difference of each point to that half an orbit before; empty for an odd order.

        It vanishes where an orbit repeats after half its returns. A branch that goes through such
        an orbit retraces its own orbits, half an orbit later: the difference then changes sign.
        """
        order = len(points)
        if order % 2:
            return np.zeros(0)
        states = self.scaled(points)
        return np.asarray(states - np.roll(states, order // 2, axis=0))

    def same_orbit(self, one: FloatArray, other: FloatArray, tolerance: float) -> bool:
        """Return True if two orbits of one order agree at some shift by whole returns."""
        return any(self._agree(np.roll(one, k, axis=0), other, tolerance) for k in range(len(one)))

    def _agree(self, one: FloatArray, other: FloatArray, tolerance: float) -> bool:
        first, second = self.scaled(one), self.scaled(other)
        size = float(np.max(np.abs(second))) + _TINY
        return bool(np.all(np.abs(first - second) <= tolerance * size))


@dataclass(frozen=True)
class Measures(Tabular):
    """Amplitudes, sticking, events and torque of an orbit.

    velocity_amplitude, angle_amplitude : half the range [rad/s], [rad]
    stick_share : share of time at rest relative to the brake
    sticks_forward, sticks_backward, events : in a period of the torque
    peak_torque : largest |R F_mu| [N m]
    """

    velocity_amplitude: float
    angle_amplitude: float
    stick_share: float
    sticks_forward: float
    sticks_backward: float
    events: float
    peak_torque: float


def multipliers(trace: float, determinant: float) -> tuple[complex, complex]:
    """Eigenvalues of a 2 x 2 monodromy matrix, the larger modulus first."""
    half = 0.5 * trace
    split = half * half - determinant
    if split < 0.0:
        root = complex(half, (-split) ** 0.5)
        return root, root.conjugate()
    # The smaller eigenvalue as a quotient: a difference would cancel.
    first = half + (split**0.5 if half >= 0.0 else -(split**0.5))
    # Adding zero makes negative zeros positive.
    return complex(first + 0.0), complex((determinant / first if first != 0.0 else 0.0) + 0.0)


class OrbitProblem:
    """A system of which some parameters vary, and the solver for its orbits.

    names  : of the parameters, SI parameters or groups; none for the system alone
    scales : (n,) typical change of each
    method : "exact" or "smooth"
    rtol   : tolerance of "smooth"
    crossing, longest : of a self-excited machine, its section and the longest time between two
                        returns [s]
    size   : of a self-excited machine, a typical size of its orbits, as ``ReturnMap.scales``; 0 if
             unknown
    """

    def __init__(
        self,
        system: BrakedDriveline | Machine,
        names: tuple[str, ...] = (),
        scales: tuple[float, ...] = (),
        *,
        method: str,
        rtol: float,
        crossing: Crossing | None = None,
        longest: float = math.inf,
        size: float = 0.0,
    ) -> None:
        self.base, self.names, self.scales = system, names, scales
        self.method, self.rtol = method, rtol
        self.crossing, self.longest, self.size = crossing, longest, size
        if isinstance(system, Machine):
            from wedgebrake.analysis.machine_motion.coordinates import coordinates

            self.space = coordinates(system)
        self._remembered: dict[tuple[float, ...], tuple[Any, Any]] = {}

    def over(self, names: tuple[str, ...], scales: tuple[float, ...]) -> OrbitProblem:
        """The same with parameters that vary."""
        return OrbitProblem(
            self.base, names, scales, method=self.method, rtol=self.rtol,
            crossing=self.crossing, longest=self.longest, size=self.size,
        )  # fmt: skip

    def system(self, values: tuple[float, ...]) -> Any:
        """The system with these values; raises ``InputError`` where there is none."""
        if not values:
            return self.base
        if values in self._remembered:
            return self._remembered[values][0]
        return with_values(self.base, dict(zip(self.names, map(float, values), strict=True)))

    def section(self, values: tuple[float, ...]) -> Section:
        """Section at which the orbits of the system with these values are sampled."""
        if isinstance(self.base, Machine):
            return Section(self.space.to)
        return Section.of(self.system(values))

    def kernel_problem(self, values: tuple[float, ...]) -> Any:
        """The system in the form of the kernels; raises ``NoOrbitError`` where there is none."""
        if values not in self._remembered:
            if len(self._remembered) >= _REMEMBERED:
                del self._remembered[next(iter(self._remembered))]
            try:
                system = self.system(values)
                self._remembered[values] = system, self._assemble(system)
            except InputError as error:
                if not values:
                    raise
                raise NoOrbitError(str(error)) from None
        return self._remembered[values][1]

    def _assemble(self, system: Any) -> Any:
        if isinstance(system, Machine):
            from wedgebrake.orbits.machine_flow import MachineFlow

            return MachineFlow(system, self.space, self.crossing, self.longest, self.method)
        if self.method == "exact":
            from wedgebrake.solvers.event_driven.solve import problem

            return problem(system)
        from wedgebrake.solvers.smooth.assemble import problem as smooth_problem

        return smooth_problem(system, self.rtol, any_law=True)


@dataclass(frozen=True)
class Range:
    """A parameter and the two ends between which it varies.

    dim           : name of its coordinate in a dataset: that of the parameter, but "brake_angle"
                    for the angle of the brake, since ``angle`` there is that of the driveline
    unit, meaning : attributes of that coordinate
    """

    name: str
    dim: str
    first: float
    last: float
    unit: str
    meaning: str

    @property
    def scale(self) -> float:
        """Width of the range."""
        return abs(self.last - self.first)

    @property
    def exact_scale(self) -> float:
        """The power of two nearest to the width: division by it is exact."""
        return float(2.0 ** round(math.log2(self.scale)))

    @property
    def bounds(self) -> tuple[float, float]:
        """(least, largest) value."""
        return min(self.first, self.last), max(self.first, self.last)

    def attributes(self) -> dict[str, str]:
        """Attributes of the coordinate of a dataset."""
        return {"units": self.unit, "long_name": self.meaning}


def with_values(system: Any, values: dict[str, Any]) -> Any:
    """A copy of a driveline or machine with other values."""
    return system.replace(values) if isinstance(system, Machine) else system.replace(**values)


def make_ranges(
    system: BrakedDriveline | Machine, given: dict[str, Any], count: int
) -> list[Range]:
    """The ranges of ``count`` parameters, in the order given.

    Raises ``InputError`` for another number of them, an unknown name, a group beside the
    parameter that it sets, or ends that are not two different numbers that the system takes.
    """
    if len(given) != count:
        words = "one parameter with its ends" if count == 1 else "two parameters with their ends"
        more = ", F0=(0.01, 0.1)" if count > 1 else ""
        example = f"eta=(12, -60){more}"
        if isinstance(system, Machine):
            example = '{"brake.slope": (0.0, -60.0)}'
        raise InputError(
            f"{', '.join(given) or 'no parameter'}: must be {words}, for example {example}."
        )
    ranges = [_range(system, name, ends) for name, ends in given.items()]
    for name in given:
        refuse_doubled(name, given)
    return ranges


def followable(system: BrakedDriveline | Machine) -> dict[str, tuple[str, str]]:
    """Parameters over which orbits can be followed, with unit and meaning: no initial states."""
    initial: Any = INITIAL
    if isinstance(system, Machine):
        initial = [f"{one.name}.{part}" for one in system.inertias for part in ("angle", "speed")]
    return {key: value for key, value in sweepable(system).items() if key not in initial}


def _range(system: BrakedDriveline | Machine, name: str, ends: Any) -> Range:
    allowed = followable(system)
    if name not in allowed:
        raise InputError(f"{name}: no parameter to follow orbits over. {nearest(name, allowed)}")
    pair = isinstance(ends, tuple | list) and len(ends) == 2
    if not pair or not all(is_number(end) and is_finite(end) for end in ends):
        raise InputError(
            f"{name} = {shown(ends)}: must be two numbers, from where to where, for example"
            f" {name}=(0.1, 1.0)."
        )
    first, last = (float(end) for end in ends)
    if first == last:
        raise InputError(f"{name} = {shown(ends)}: the ends are equal. Change one of them.")
    for end in (first, last):
        with_values(system, {name: end})
    dim = f"{system.owner(name)}_{name}" if name in _TAKEN else name  # type: ignore[union-attr]
    return Range(name, dim, first, last, *allowed[name])


def value_of(system: BrakedDriveline | Machine, name: str) -> float:
    """Value of a parameter or group of a system."""
    if isinstance(system, Machine):
        return system.parameters()[name]
    if name in SETTERS:
        return float(getattr(system.groups, name))
    return float(getattr(getattr(system, system.owner(name)), name))

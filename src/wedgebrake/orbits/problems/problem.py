"""Continuation problem: a system whose parameters vary, its section, and where to begin."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from wedgebrake._version import __version__
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.orbits.bifurcation_types import Kind
from wedgebrake.orbits.equations.equations import NoOrbitError, OrbitEquations
from wedgebrake.orbits.orbit_status import OrbitStatus
from wedgebrake.orbits.section import Section

_TINY = 1e-300
# Differences and Newton's method use neighbouring parameter values repeatedly.
_REMEMBERED = 16
# Number of near returns that are tried, the nearest ones first.
_GUESSES = 16


@dataclass(frozen=True, eq=False)
class OrbitProblem(ABC):
    """A system of which some parameters vary, and the flow on which its orbits are sought.

    What differs between systems and solvers is a method of a subclass (``choose_problem``).

    base   : the system
    method : "exact" or "smooth"
    rtol   : tolerance of "smooth"
    names  : of the parameters, SI parameters or groups; none for the system alone
    scales : (n,) typical change of each
    size   : typical size of the orbits, in the scales of the equations; 0 if unknown
    samplings : number of samplings in a period of the signals, which the sample times then follow;
             0 if the sample times do not change
    subject : the kind of the system in words
    unused  : settings of a run without effect on the orbits
    imposes : whether its runs can have imposed directions of the contacts, see ``ImposedRun``
    """

    subject: ClassVar[str]
    unused: ClassVar[tuple[str, ...]] = ()
    imposes: ClassVar[bool] = False
    base: Any
    method: str
    rtol: float
    names: tuple[str, ...] = ()
    scales: tuple[float, ...] = ()
    size: float = 0.0
    samplings: int = 0
    _remembered: dict[tuple[float, ...], tuple[Any, Any]] = field(default_factory=dict, init=False)

    @property
    @abstractmethod
    def self_excited(self) -> bool:
        """True if the period of an orbit is unknown, as no signal varies in time."""

    @property
    def inertias(self) -> tuple[str, ...]:
        """Names of the parts over which angles and velocities are given; none for a single one."""
        found: tuple[str, ...] = self.base.coords.get("inertia", ())
        return found

    @property
    def shafts(self) -> tuple[str, ...]:
        """Names of the shafts whose twists are given; none where the angle is the twist."""
        found: tuple[str, ...] = self.base.coords.get("shaft", ())
        return found

    @property
    def weights(self) -> FloatArray | float:
        """Factors of the coordinates of a point in its distance to another one."""
        return 1.0

    @abstractmethod
    def section(self, values: tuple[float, ...]) -> Section:
        """Section at which the orbits of the system with these values are sampled."""

    @abstractmethod
    def assemble(self, system: Any) -> Any:
        """A system in the form of the kernels."""

    @abstractmethod
    def guesses(self, order: int | None, initial: Any, limit: int) -> Guesses:
        """Find points near an orbit; arguments as for ``wb.orbit``."""

    @abstractmethod
    def returned(self, point: FloatArray, order: int) -> tuple[FloatArray, FloatArray]:
        """P^n, the point n returns later, and its derivative; raises ``NoOrbitError``."""

    @abstractmethod
    def equations_at(
        self, point: FloatArray, order: int
    ) -> tuple[OrbitEquations, FloatArray] | None:
        """Equations and a guess of their unknowns, from the run that begins at a point.

        None if nothing moves relative to the brake. Raises ``NoOrbitError``.
        """

    def by_parameters(
        self,
        equations: OrbitEquations,  # noqa: ARG002
        unknowns: FloatArray,  # noqa: ARG002
        values: tuple[float, ...],  # noqa: ARG002
    ) -> FloatArray | None:
        """Exact derivative of ``differentiable`` equations with respect to the parameters.

        None if it is unknown, as for friction laws without a series.
        """
        return None

    def form(self, system: Any) -> Any:
        """A system as its equations take it."""
        return system

    @abstractmethod
    def kinematics(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Angles and velocities of points of an orbit, (..., n)."""

    def initial(self, state: Any) -> Any:
        """An initial state of ``wb.simulate``, from that of the equations."""
        return state

    def can_follow(self, kind: Kind) -> bool:
        """Return True if one more equation defines a bifurcation as a curve over two parameters.

        The equations are singular at a branch point; at a symmetry breaking those of half an orbit
        are not. Those of the flow itself hold no margins that vanish at a bifurcation of friction.
        """
        return kind not in (Kind.BRANCH_POINT, Kind.HOPF) and not kind.of_friction

    @property
    def followed_kinds(self) -> list[str]:
        """Names of the bifurcations that can be followed over two parameters."""
        return [kind.value for kind in Kind if self.can_follow(kind)]

    @abstractmethod
    def has_odd_symmetry(self, values: tuple[float, ...]) -> bool:
        """Return True if mirror images of motions are motions."""

    def irregular_record(self, initial: Any) -> FloatArray:  # noqa: ARG002
        """Long record of the motion from a state, (k, n); none if no orbit is sought near it."""
        return np.empty((0, 0))

    def of(self, system: Any) -> OrbitProblem:
        """The same for another system, at the same section, so that orbits can be compared."""
        return replace(self, base=self._tied(system), names=(), scales=(), size=0.0)

    def over(self, names: tuple[str, ...], scales: tuple[float, ...]) -> Self:
        """The same with parameters that vary."""
        return replace(self, names=names, scales=scales)

    def system(self, values: tuple[float, ...]) -> Any:
        """The system with these values; raises ``InputError`` where there is none."""
        if not values:
            return self.base
        if values in self._remembered:
            return self._remembered[values][0]
        changes = dict(zip(self.names, map(float, values), strict=True))
        return self._tied(self.base.replace(**changes))

    def _tied(self, system: Any) -> Any:
        """Return a system with the sample times for ``samplings``; unchanged if these are 0."""
        period = system.machine.period if self.samplings else None
        if not period:
            return system
        return system.replace(dict.fromkeys(sample_times(system), period / self.samplings))

    def kernel_problem(self, values: tuple[float, ...]) -> Any:
        """The system in the form of the kernels; raises ``NoOrbitError`` where there is none."""
        if values not in self._remembered:
            if len(self._remembered) >= _REMEMBERED:
                del self._remembered[next(iter(self._remembered))]
            try:
                system = self.system(values)
                self._remembered[values] = system, self.assemble(system)
            except InputError as error:
                if not values:
                    raise
                raise NoOrbitError(str(error)) from None
        return self._remembered[values][1]

    def covers(self, system: Any) -> bool:  # noqa: ARG002
        """Return False if orbits of a system have states that those of the base do not have."""
        return True

    def general(
        self, equations: OrbitEquations, unknowns: FloatArray
    ) -> tuple[OrbitProblem, OrbitEquations, FloatArray]:
        """The same orbit by equations that cover more systems, if there are such equations."""
        return self, equations, unknowns

    def name_of_orbit(self, order: int) -> str:
        """Name of an orbit: "synchronous orbit", "2T-periodic orbit", "limit cycle"."""
        if self.self_excited:
            return "limit cycle" if order == 1 else f"limit cycle of {order} crossings"
        return "synchronous orbit" if order == 1 else f"{order}T-periodic orbit"

    def doubling_of(self, fewer: int) -> str:
        """Words for the end of a branch whose orbit repeats after fewer returns there."""
        name = self.name_of_orbit(fewer)
        return f"period doubling of {'the' if name == 'synchronous orbit' else 'a'} {name}"

    def attributes(self, system: Any) -> dict[str, str]:
        """Attributes of a dataset: settings of the computation, and the system."""
        described = {
            "system": system.as_dict(),
            "groups": system.groups.as_dict() if system.groups.defined else None,
        }
        texts = {name: json.dumps(one) for name, one in described.items() if one is not None}
        return {"method": self.method, "wedgebrake": __version__, **texts}


def sample_times(system: Any) -> dict[str, float]:
    """Return the sample times of actuations and controllers [s] by their names in ``replace``."""
    machine = system.machine
    found = {one.name: one.actuation.sample_time for one in machine.contacts}
    found |= {one.name: one.sample_time for one in machine.controllers}
    # The parameters of an only contact, whose dimension is left out, have no dot.
    single = "contact" in system.view.single
    return {
        "sample_time" if single else f"{name}.sample_time": value
        for name, value in found.items()
        if value is not None
    }


class Guesses(NamedTuple):
    """Points near an orbit, from which Newton's method starts.

    status   : FOUND, or why there is no orbit
    problem  : the problem with its section
    order    : number of returns in the orbit
    points   : (k, n) in the order in which they are tried
    isolated : whether no shift in time or angle of an orbit gives another one
    """

    status: OrbitStatus
    problem: OrbitProblem
    order: int = 0
    points: Sequence[FloatArray] = ()
    isolated: bool = True


def returns_by_distance(record: FloatArray, order: int) -> list[int]:
    """Indices of the points of a record, sorted by the distance of the motion's return."""
    size = np.ptp(record, axis=0) + _TINY
    apart = np.linalg.norm((record[order:] - record[:-order]) / size, axis=1)
    return [int(k) for k in np.argsort(apart)]


def points_near_returns(record: FloatArray, order: int) -> list[FloatArray]:
    """Points to which the motion nearly returns, nearest first, then the mean of all points."""
    nearest = [record[k] for k in returns_by_distance(record, order)[:_GUESSES]]
    mean = np.mean(record, axis=0)
    return [mean, *nearest] if order == 1 else [*nearest, mean]

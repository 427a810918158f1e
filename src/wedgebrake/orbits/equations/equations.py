"""Base class of the equations whose solutions are periodic orbits."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from wedgebrake.arrays import FloatArray, Records
from wedgebrake.model.display import Tabular
from wedgebrake.orbits.equations.segment_orbit import MARGINS
from wedgebrake.solvers.simulate import simulate

if TYPE_CHECKING:
    from wedgebrake.orbits.equations.floquet import Floquet
    from wedgebrake.orbits.equations.segments import OrbitSegments

Codes = tuple[int, ...]


class NoOrbitError(ArithmeticError):
    """The equations have no value: the run does not last, or the brake's law lacks a piece."""


@dataclass(frozen=True)
class OrbitMeasures(Tabular):
    """Amplitudes, sticking, events and torque of an orbit.

    velocity_amplitude, angle_amplitude : half the range [rad/s], [rad]; of an inertia that rotates
                  freely that of its angle about the mean rotation
    stick_share : share of time at rest relative to the brake
    sticks_forward, sticks_backward, events : per return
    peak_torque : largest |R F_mu| [N m]
    """

    velocity_amplitude: float
    angle_amplitude: float
    stick_share: float
    sticks_forward: float
    sticks_backward: float
    events: float
    peak_torque: float


class PartMeasures(NamedTuple):
    """The same for each part: of one inertia or contact, arrays of one element.

    velocity_amplitude, angle_amplitude : (inertias,)
    stick_share, peak_torque            : (contacts,)
    sticks_forward, sticks_backward, events : of all contacts
    driven : number of driven bodies, the last of the inertias
    """

    velocity_amplitude: FloatArray
    angle_amplitude: FloatArray
    stick_share: FloatArray
    peak_torque: FloatArray
    sticks_forward: float
    sticks_backward: float
    events: float
    driven: int = 0

    @property
    def largest(self) -> OrbitMeasures:
        """The largest of all inertias or contacts; the motion of driven bodies is given."""
        found = self._asdict()
        moving = self.velocity_amplitude.size - found.pop("driven")
        for name in ("velocity_amplitude", "angle_amplitude"):
            found[name] = found[name][:moving]
        return OrbitMeasures(
            **{name: float(np.max(one, initial=0.0)) for name, one in found.items()}
        )


class OrbitEquations(ABC):
    """F(u) = 0, as many equations as unknowns, for a system in the form of the kernels.

    The methods that are not abstract are those of equations that use the flow itself: they assume
    no segments, so that every solution is an orbit.

    order       : returns to the section in the orbit
    to_rounding : whether F is exact up to rounding, and not computed to a tolerance
    differentiable : whether the derivative of F with respect to parameters is known
    codes       : of the segments that are assumed; all_codes: of the whole orbit
    half        : whether the unknowns are those of the first half of a symmetric orbit
    """

    order: int
    to_rounding: bool = True
    differentiable: bool = False
    codes: Codes = ()
    all_codes: Codes = ()
    half: bool = False

    @property
    @abstractmethod
    def size(self) -> int:
        """Number of unknowns."""

    @abstractmethod
    def scales(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """Typical size of each unknown, (size,)."""

    @abstractmethod
    def residual(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """F(u)."""

    @abstractmethod
    def linearize(self, unknowns: FloatArray, problem: Any) -> tuple[FloatArray, FloatArray]:
        """F(u) and its derivative."""

    def by_parameters(self, unknowns: FloatArray, varied: Any) -> FloatArray:
        """Derivative of F with respect to parameters, (size, parameters), where ``differentiable``.

        varied : the ``VariedReturn`` or ``VariedSegments`` at the values of the parameters
        """
        raise NotImplementedError

    @abstractmethod
    def duration(self, unknowns: FloatArray, problem: Any) -> float:
        """Period of the orbit [s]."""

    @abstractmethod
    def floquet(self, unknowns: FloatArray, problem: Any) -> Floquet:
        """Floquet multipliers and test functions."""

    @abstractmethod
    def points(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """States at the section, (order, states)."""

    @abstractmethod
    def measures(self, unknowns: FloatArray, problem: Any, system: Any) -> PartMeasures:
        """Amplitudes, sticking, events and torque of each part."""

    @abstractmethod
    def doubled(self, unknowns: FloatArray) -> tuple[Self, FloatArray]:
        """Equations of the same orbit traversed twice."""

    @abstractmethod
    def halved(self, unknowns: FloatArray) -> tuple[Self, FloatArray]:
        """Equations of half the orbit, which must be its own mirror image."""

    @abstractmethod
    def whole(self, unknowns: FloatArray) -> tuple[Self, FloatArray]:
        """Equations of the whole orbit."""

    @abstractmethod
    def mirror_difference(
        self, unknowns: FloatArray, problem: Any, system: Any, tolerance: float
    ) -> FloatArray:
        """Difference from the mirror image half an orbit later, relative to the size; or empty."""

    def mirror_points(
        self, unknowns: FloatArray, problem: Any, system: Any, method: str
    ) -> FloatArray:
        """Points of the mirror image half a period later, as ``points``."""
        half = 0.5 / system.excitation.frequency
        starts = self.points(unknowns, problem).tolist()
        runs = [simulate(system, half, initial=tuple(x), method=method, times=()) for x in starts]
        ends = [(one.attrs["final_angle"], one.attrs["final_velocity"]) for one in runs]
        return -np.array(ends)

    def initial(self, unknowns: FloatArray, problem: Any) -> Any:
        """Initial state with which ``wb.simulate`` follows the orbit."""
        return tuple(map(float, self.points(unknowns, problem)[0]))

    def segments(self, unknowns: FloatArray, problem: Any) -> list[OrbitSegments]:  # noqa: ARG002
        """Slips and sticks of each contact, as the flow gives them."""
        return []

    def levels(self, unknowns: FloatArray, problem: Any) -> list[OrbitSegments]:  # noqa: ARG002
        """Segments of each contact of a machine between breakpoints, as the flow gives them."""
        return []

    @abstractmethod
    def twists(
        self, unknowns: FloatArray, problem: Any, system: Any
    ) -> tuple[FloatArray, FloatArray]:
        """Half range and largest magnitude of the twist of each shaft [rad]."""

    def sequence(self, unknowns: FloatArray, problem: Any) -> str:  # noqa: ARG002
        """Segments as text; empty if the flow is smooth."""
        return ""

    def is_mark(self, node: int) -> bool:  # noqa: ARG002
        """Return True if a node is not an event, but a mark at phase 0."""
        return False

    def margins(self, unknowns: FloatArray, problem: Any) -> Records:  # noqa: ARG002
        """Margins by which the solution is an orbit, for each segment that is assumed.

        Only the equations of a driveline with set-valued friction assume segments.
        """
        return np.empty(0, dtype=MARGINS)

    def follows_flow(self, unknowns: FloatArray, problem: Any, growth: float) -> bool:  # noqa: ARG002
        """Return True if the flow passes through the solution and returns."""
        return True

    def follows_events(self, unknowns: FloatArray, problem: Any) -> bool:  # noqa: ARG002
        """Return True if the events of the flow are those that the equations assume, if any."""
        return True

"""Periodic orbits as results: one orbit, or why it was not found, and a point of a branch."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.display import Result, words
from wedgebrake.orbits.bifurcation_types import Bifurcation
from wedgebrake.orbits.curves import OrbitSolution
from wedgebrake.orbits.orbit_status import ONE_OF_A_FAMILY, OrbitStatus
from wedgebrake.solvers.machine.final_state import FinalState

if TYPE_CHECKING:
    import xarray as xr

# Largest number of segments of an orbit that are listed in full.
_FEW_SEGMENTS = 24


@dataclass(frozen=True, repr=False)
class Orbit(Result):
    """A periodic orbit, stable or not, and how it was found.

    system, method : the system and the solver; of a driveline without closed forms its machine,
                    with the parameters and groups of the driveline
    status        : whether it was found; if not, the numbers below are nan
    rtol          : tolerance of "smooth"
    order         : number of returns to the section in the orbit: periods of the torque or of the
                    signals; of a self-excited machine, crossings of its section
    period        : [s]
    initial       : where ``wb.simulate(system, initial=...)`` begins to follow it
    angle, velocity : of a driveline, its state at t = 0 [rad], [rad/s]
    multipliers   : Floquet multipliers over the orbit, the largest modulus first, of deviations
                    that preserve its rests (with mu_s > mu_k other deviations may end a rest).
                    The multiplier 1 of a self-excited machine, which belongs to a shift in time,
                    is omitted. The angles of free rotations are omitted; their speeds are kept
    sequence      : its segments in their order, "+" forwards, "-" backwards, "0" rest; of one
                    inertia driven by a sine also "+1" the next piece of the brake's law (as after
                    release), and empty for smooth laws
    points        : (order, 2) angle and velocity at t = 0, T, 2 T, ...; of a machine (order,
                    states): angles, speeds, states of actuators
    velocity_amplitude, angle_amplitude : half the range [rad/s], [rad]; of an inertia that rotates
                    freely that of its angle about the mean rotation
    stick_share   : share of time at rest relative to the brake
    sticks_forward, sticks_backward, events : per return
    peak_torque   : largest |R F_mu| [N m]; of several inertias or contacts the largest amplitude,
                    share and torque, and the sum of sticks and events
    steps         : lengths of the last steps of Newton's method, relative
    isolated      : False for one of a continuous family of orbits of the same system, as without
                    damping at half the natural frequency: a multiplier is 1, so that a deviation
                    within the family neither grows nor decays
    """

    system: Any
    method: str
    rtol: float
    status: OrbitStatus
    order: int
    angle: float = math.nan
    velocity: float = math.nan
    multipliers: tuple[complex, ...] = (complex(math.nan), complex(math.nan))
    sequence: str = ""
    points: FloatArray = field(default_factory=lambda: np.empty((0, 2)), compare=False)
    velocity_amplitude: float = math.nan
    angle_amplitude: float = math.nan
    stick_share: float = math.nan
    sticks_forward: float = math.nan
    sticks_backward: float = math.nan
    events: float = math.nan
    peak_torque: float = math.nan
    steps: tuple[float, ...] = ()
    isolated: bool = True
    _solution: OrbitSolution | None = field(default=None, repr=False, compare=False)

    @classmethod
    def of(cls, solution: OrbitSolution, steps: list[float], isolated: bool = True) -> Orbit:
        """The orbit of a solution of its equations.

        steps    : of its computation
        isolated : False for one of a continuous family
        """
        state = map(np.asarray, solution.problem.kinematics(solution.points[0]))
        # Of a single inertia.
        angle, velocity = (float(one) if one.ndim == 0 else math.nan for one in state)
        return cls(
            system=solution.system, method=solution.problem.method, rtol=solution.problem.rtol,
            status=OrbitStatus.FOUND, order=solution.order, angle=angle, velocity=velocity,
            multipliers=solution.floquet.multipliers, sequence=solution.sequence,
            points=solution.points, **vars(solution.measures), steps=tuple(steps),
            isolated=isolated, _solution=solution,
        )  # fmt: skip

    @property
    def found(self) -> bool:
        """True if an orbit was found."""
        return self.status is OrbitStatus.FOUND

    def sensitivity(self, parameters: Sequence[str], of: Sequence[str] | None = None) -> xr.Dataset:
        """Exact derivatives of the orbit with respect to parameters of its system.

        They follow from the implicit function theorem (docs/numerics.md, "Derivatives of measures
        and of orbits"), for stable and for unstable orbits.

        Parameters
        ----------
        parameters : sequence of str
            Names of parameters, as for ``wb.sensitivity``, without initial conditions, except the
            angle of a driven body, ``"end.angle"``.
        of : sequence of str
            Measures over one period, as for ``wb.sensitivity``, for example ``["rms_velocity"]``;
            default: all of them.

        Returns
        -------
        xarray.Dataset
            Over (``parameter``, ...) and per unit of the parameter, the derivatives of ``period``,
            of ``angle`` and ``velocity`` at the start of the orbit (``initial``), and of the
            measures; ``<name>_value`` is the number itself. Where there is no derivative, the
            result is nan, and ``attrs["message"]`` gives the reason: equal extremes, an orbit of a
            continuous family, or no orbit for other values of the parameter.

        Raises
        ------
        InputError
            If no orbit was found; for a parameter without a derivative, or with which the orbit
            no longer closes (one of several frequencies, the frequency of a sampled system); and
            for actuations with a ``delay``.
        """
        if self._solution is None:
            raise InputError(f"sensitivity: there is no orbit. {self.message}")
        from wedgebrake.orbits.orbit_derivatives import orbit_sensitivity

        return orbit_sensitivity(self._solution, parameters, of)

    def mirror_points(self) -> FloatArray:
        """``points`` of the mirror image -x(t + T/2), on a system with odd symmetry."""
        return self.points if self._solution is None else self._solution.mirror_points()

    @property
    def period(self) -> float:
        """Period of the orbit [s]."""
        return math.nan if self._solution is None else self._solution.period

    @property
    def initial(self) -> Any:
        """Initial state with which ``wb.simulate`` follows the orbit; None if not found."""
        return None if self._solution is None else self._solution.initial

    @property
    def message(self) -> str:
        """The status in a sentence, with a remedy."""
        return self.status.sentence if self.isolated else ONE_OF_A_FAMILY

    @property
    def stable(self) -> bool:
        """True if small deviations decay."""
        return self.isolated and all(abs(one) < 1.0 for one in self.multipliers)

    @property
    def exponents(self) -> tuple[float, ...]:
        """Lyapunov exponents [1/s], from the multipliers; -inf where a stick forgets all."""
        return tuple(map(self._exponent, self.multipliers))

    def _exponent(self, multiplier: complex) -> float:
        if multiplier == 0.0:
            return -math.inf
        return math.log(abs(multiplier)) / self.period

    @property
    def verdict(self) -> str:
        """The orbit in a sentence."""
        if not self.found:
            return self.message
        sizes = " and ".join(map(words, self.multipliers))
        text = "" if self._solution is None else self._solution.name
        kind = "stable" if self.stable else "unstable" if self.isolated else "not isolated"
        text += f", {kind}" + (f": multipliers {sizes}" if sizes else "")
        if not self.sequence:
            return f"{text}."
        count = len(self.sequence.split())
        few = count <= _FEW_SEGMENTS
        return f"{text}; {f'segments {self.sequence}' if few else f'{count} segments'}."

    @property
    def states(self) -> dict[str, tuple[float, float]]:
        """Angle [rad] and speed [rad/s] of each inertia of a machine at the section, by name.

        Empty for a driveline, which has ``angle`` and ``velocity``.
        """
        at = self.initial
        if not isinstance(at, FinalState) or "inertia" not in self.system.coords:
            return {}
        return {name: (angle, at.speeds[name]) for name, angle in at.angles.items()}

    @property
    def twists(self) -> dict[str, tuple[float, float]]:
        """Half range and largest magnitude of the twist q_a - ratio q_b of each shaft [rad].

        By the name of the shaft, nan where the twist grows for ever; empty for a driveline, whose
        twist is its angle.
        """
        return {} if self._solution is None else self._solution.twists

    def _rows(self) -> Iterator[tuple[str, Any, str]]:
        """Values, without those that only a driveline has, and the states of inertias."""
        for name, value, unit in super()._rows():
            if not (isinstance(value, float) and math.isnan(value)):
                yield name, value, unit
        for name, (angle, speed) in self.states.items():
            yield f"angle, {name}", angle, "rad"
            yield f"speed, {name}", speed, "rad/s"
        for name, (amplitude, peak) in self.twists.items():
            if not math.isnan(amplitude):
                yield f"twist amplitude, {name}", amplitude, "rad"
                yield f"largest twist, {name}", peak, "rad"

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        names = (
            "order", "method", "period", "angle", "velocity", "stable", "sequence",
            "velocity_amplitude", "angle_amplitude", "stick_share", "sticks_forward",
            "sticks_backward", "events", "peak_torque", "message", "verdict",
        )  # fmt: skip
        return {name: getattr(self, name) for name in names} | {
            "status": self.status.value,
            "isolated": self.isolated,
            "states": {name: list(one) for name, one in self.states.items()},
            "twists": {name: list(one) for name, one in self.twists.items()},
            "multipliers": [[one.real, one.imag] for one in self.multipliers],
            "exponents": list(self.exponents),
            "points": self.points.tolist(),
        }


@dataclass(frozen=True, eq=False, repr=False)
class BranchPoint(Result, OrbitSolution):
    """A periodic orbit on a branch.

    Besides the attributes below it has the ``value`` of the parameter, ``order``, ``stable``,
    ``sequence``, the Poincare ``points``, ``measures`` (amplitudes, sticks, peak torque), and its
    ``system``; ``wb.orbit(point.system, point.order, initial=tuple(point.points[0]))`` finds it
    again.

    problem     : the system and the parameters that vary along the branch
    values      : of the parameters
    equations, unknowns : the equations and their solution
    multipliers : Floquet multipliers, the largest modulus first
    direction   : of the branch, in scaled unknowns
    arclength   : from the start of the branch, in scaled unknowns
    bifurcation : its bifurcation, if it is one
    """

    multipliers: tuple[complex, ...]
    direction: FloatArray
    arclength: float = 0.0
    bifurcation: Bifurcation | None = None

    @classmethod
    def of(
        cls,
        solution: OrbitSolution,
        direction: FloatArray,
        arclength: float = 0.0,
        bifurcation: Bifurcation | None = None,
    ) -> BranchPoint:
        """Return the point of a branch for a solution of its equations.

        solution             : orbit at a value of the parameter
        direction, arclength : of the branch at the solution
        bifurcation          : None for an ordinary point
        """
        return cls(
            solution.problem, solution.values, solution.equations, solution.unknowns,
            solution.floquet.multipliers,
            direction, arclength, bifurcation,
        )  # fmt: skip

    @property
    def value(self) -> float:
        """Value of the first parameter."""
        return self.values[0]

    @property
    def can_be_followed(self) -> bool:
        """True for a bifurcation that ``wb.boundary`` can follow over a second parameter."""
        found = self.bifurcation
        if found is None or not self.problem.can_follow(found.kind):
            return False
        # The onset of permanent sticking, and the grazing of a part other than a contact, have no
        # margin that vanishes.
        return not found.kind.of_friction or bool(found.margins) or found.changed is not None

    @property
    def stable(self) -> bool:
        """True if small deviations decay."""
        return abs(self.multipliers[0]) < 1.0

    def _parameters(self) -> Iterator[tuple[str, float]]:
        return zip(self.problem.names, self.values, strict=True)

    def _headline(self) -> str:
        at = ", ".join(f"{name} = {value:.9g}" for name, value in self._parameters())
        if self.bifurcation is not None:  # there an orbit is neither stable nor unstable
            return f"{at}: {self.bifurcation.kind.value} of a {self.name}"
        return f"{at}: {self.name}, {'stable' if self.stable else 'unstable'}"

    def _rows(self) -> Iterator[tuple[str, Any, str]]:
        for name, value in self._parameters():
            yield name, f"{value:.9g}", ""
        yield "order", self.order, ""
        if self.bifurcation is None:
            yield "stable", self.stable, ""
        yield "multipliers", self.multipliers, ""
        if self.sequence:
            yield "sequence", self.sequence, ""
        if self.bifurcation is not None:
            yield "bifurcation", self.bifurcation, ""

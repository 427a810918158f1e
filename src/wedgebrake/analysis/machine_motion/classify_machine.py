"""Run and classification of a machine: transient, windows, record."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis import classify
from wedgebrake.analysis.classify import Verdict, Window
from wedgebrake.analysis.growth import growths, log_multipliers, mean_exponents
from wedgebrake.analysis.machine_motion.coordinates import coordinates
from wedgebrake.analysis.machine_motion.result import (
    ContactSums,
    MachineResult,
    Vibration,
    vibration_rows,
)
from wedgebrake.analysis.machine_motion.section import crossing, sampling
from wedgebrake.analysis.machine_motion.steady import Known, is_locked, steady_state
from wedgebrake.analysis.machine_motion.tori import covers_torus
from wedgebrake.analysis.machine_motion.windows import (
    FIRST_WINDOW,
    distance_to_orbit,
    next_window,
    returns_to_settle,
)
from wedgebrake.analysis.run_settings import Protocol
from wedgebrake.dynamics.enums import MotionClass, Outcome
from wedgebrake.model.machine import Machine
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.passage import Course, Crossing, Every, Passage

FloatArray = NDArray[np.float64]
# Periods of the lowest natural vibration in which a self-excited motion is first looked at, and in
# which a return to its section is expected.
_FIRST_LOOK, _PATIENCE = 8.0, 4.0
# Fewest returns that can be classified.
_FEWEST = 4
# Relative size of a vibration that counts as none.
_STILL = 1e-9
# Relative size of a vibration that the linear machine describes, where friction is a curve.
_SMALL = 1e-5
# Distance of a return over the size of the last orbit that shows a vibration that decays.
_DRIFT = 1e-5
# Distance of a return over the size of the motion at which the period of a cycle has converged.
_CONVERGED = 1e-11
# Decay of a deviation in a window (logarithm) that leaves nothing of it.
_DECAYED = 8.0


def classify_machine(
    machine: Machine,
    protocol: Protocol,
    initial: FinalState | None = None,
    method: str = "exact",
) -> MachineResult:
    """Run a machine and classify its motion.

    method : "exact" or "smooth", see ``simulate``

    Raises ``InputError`` if a signal is neither periodic nor constant, and as ``simulate``.
    """
    return _Run(_Prepared(machine, method, initial), protocol).classified()


class Classifier:
    """Classification of machines one after the other.

    What depends on a machine, but not on its initial angles and speeds, is computed once.
    """

    def __init__(self, protocol: Protocol, method: str) -> None:
        self._protocol, self._method = protocol, method
        self._prepared: _Prepared | None = None

    def result(self, machine: Machine, initial: FinalState | None = None) -> MachineResult:
        """Run a machine and classify its motion, as ``classify_machine``."""
        prepared = self._prepared
        if initial is None and prepared is not None and prepared.differs_in_start(machine):
            prepared.course.repeat(machine)
        else:
            prepared = _Prepared(machine, self._method, initial)
        # The numbers of a run that begins later belong to its initial time.
        self._prepared = prepared if initial is None else None
        return _Run(prepared, self._protocol).classified()


class _Prepared:
    """A machine at the beginning of a run."""

    def __init__(self, machine: Machine, method: str, initial: FinalState | None) -> None:
        self.machine = machine
        self.space, self.every = coordinates(machine), sampling(machine)
        self.has_period = machine.period is not None
        # The proof of a steady state knows no controllers, whose forces are no states of it.
        self.linear = all(one.actuation.sample_time is None for one in machine.contacts)
        self.parts = len(machine.inertias), len(machine.contacts)
        self.known: Known = {}
        states = self.space.to.shape[1]
        self.course = Course(
            machine, initial, method=method, watched=np.vstack([self.space.to, np.eye(states)]),
            quantities=vibration_rows(*self.parts, states),
        )  # fmt: skip

    def differs_in_start(self, machine: Machine) -> bool:
        """Return True if a machine differs in nothing but the initial angles and speeds."""
        own = self.machine
        return (
            own.shafts == machine.shafts
            and own.contacts == machine.contacts
            and own.torques == machine.torques
            and [(one.name, one.inertia) for one in own.inertias]
            == [(one.name, one.inertia) for one in machine.inertias]
        )


class _Run:
    """A run that is continued window by window."""

    def __init__(self, prepared: _Prepared, protocol: Protocol) -> None:
        self.space, self.course = prepared.space, prepared.course
        self.protocol, self.every = protocol, prepared.every
        self.has_period, self.linear = prepared.has_period, prepared.linear
        self.parts, self.known = prepared.parts, prepared.known
        self.section: Every | Crossing | None = self.every
        self.natural = 2.0 * math.pi / self.space.frequency if self.space.frequency else 1.0
        self.done = 0
        # Of a deviation in an orbit (logarithm); 0: not known.
        self.decay = 0.0
        # Returns until the motion has settled, as estimated from the last window.
        self.waits = math.inf
        self.last: Passage | None = None
        self.result = MachineResult(
            np.full(self.space.size, math.nan),
            ContactSums.none(self.parts[1]),
            Vibration.constant(*self.parts, math.nan),
            self_excited=self.every is None,
        )

    def classified(self) -> MachineResult:
        """The result."""
        result, protocol = self.result, self.protocol
        if self.every is None and not self._choose_section():
            return self._finished()
        if protocol.automatic:
            self._settle()
        else:
            if protocol.first:
                self._advance(protocol.first)
            begin = self.done
            window = self._advance(protocol.recorded, derivatives=True, measures=True)
            steady = self.every is None and self._ends_steadily(window)
            if result.outcome == Outcome.COMPLETED and not steady:
                self._classify(window)
                result.transient, result.judged = begin, self.done - begin
                self._record(window)
        return self._finished()

    def _choose_section(self) -> bool:
        """Choose the section of a self-excited motion; return False if it is steady."""
        look = self._advance(0, duration=_FIRST_LOOK * self.natural)
        if self.result.outcome != Outcome.COMPLETED or self._ends_steadily(look):
            return False
        self.section = crossing(look, self.space)
        return True

    def _settle(self) -> None:
        """Run windows, each as long as all before it, until the motion has settled."""
        result, limit = self.result, self.protocol.limit
        while result.outcome == Outcome.COMPLETED and self.done < limit:
            begin = self.done
            target, derivatives = next_window(begin, limit, self.waits)
            window = self._advance(target - begin, derivatives=derivatives or not self.has_period)
            if result.outcome != Outcome.COMPLETED:
                return
            if self.every is None and self._ends_steadily(window):
                return
            if self.done < target:
                # It does not return to this section: take one of its present motion.
                self.section, self.done = crossing(window, self.space), target
                continue
            result.judged, result.transient = self.done - begin, self.done
            final = self._classify(window)
            result.settling = float(begin)
            if final and self._record():
                return
        if result.outcome == Outcome.COMPLETED:
            self._record()

    def _advance(
        self, returns: int, *, duration: float = math.inf, derivatives: bool = False,
        measures: bool = False,
    ) -> Passage:  # fmt: skip
        """Continue by a number of returns; a self-excited motion for a limited time."""
        if self.every is None:
            duration = min(duration, max(returns, FIRST_WINDOW) * _PATIENCE * self.natural)
        most = self.protocol.max_events - self.result.events
        passage = self.course.advance(
            self.section, returns, duration=duration, derivatives=derivatives, measures=measures,
            max_events=most,
        )  # fmt: skip
        self.done += len(passage.times)
        self.result.events += passage.events
        self.result.outcome, self.last = passage.outcome, passage
        return passage

    def _ends_steadily(self, passage: Passage) -> bool:
        """Set the result of a motion that ends in steady sliding or at rest; False for others."""
        if not self.linear:
            return self._ends_constant(passage)
        if self.course.state.curves.size and self._range(passage) > _SMALL * self._speed(passage):
            # Only of a small vibration the decay is that of the linear machine.
            return False
        problem, state = self.course.assembled.problem, self.course.state
        found = steady_state(problem, state, self.space, self.known)
        if found is None and is_locked(problem, state):
            # Moving bases wind up shafts for ever.
            self.result.motion = MotionClass.SELF_LOCKED
            return True
        sliding = found is not None and bool(found.sliding.any())
        if found is None or (sliding and found.ringing > _STILL * self._speed(passage)):
            return False
        result = self.result
        result.motion = MotionClass.STEADY_SLIDING if sliding else MotionClass.AT_REST
        result.exponents, result.exponent_error, result.size = found.exponents, 0.0, 0.0
        result.contacts = ContactSums.steady(found.sliding, found.torque)
        result.vibration = Vibration.constant(*self.parts, 0.0)
        result.low = result.high = found.states
        return True

    def _ends_constant(self, passage: Passage) -> bool:
        """Set the result of a motion that has reached a constant state; False for others."""
        if self._range(passage) > _STILL * self._speed(passage):
            return False
        sliding = bool(self.course.state.modes["side"].any())
        self.result.motion = MotionClass.STEADY_SLIDING if sliding else MotionClass.AT_REST
        self._describe(passage)
        return True

    def _classify(self, window: Passage) -> bool:
        """Set class, order and exponents from a window; return True if it ends the transient."""
        result = self.result
        if len(window.times) < _FEWEST:
            return False
        points = np.ascontiguousarray(window.states @ self.space.to.T)
        matrices = self.space.scaled(window.matrices[1:])
        growth = np.full(points[1:].shape, math.nan) if not len(matrices) else growths(matrices)
        area = float(growth[:, :2].mean(axis=0).sum()) if growth.shape[1] > 1 else -math.inf
        scale, size = np.ones(self.space.size), max(self._range(window), 1e-300)
        view = Window(points, scale, size, np.ascontiguousarray(growth[:, 0]), area, False)
        verdict: Verdict = classify.classify(view)
        # Numba takes long to recognise a member of an enumeration.
        motion: Any = int(verdict.motion)
        verdict = verdict._replace(motion=motion)
        self.waits = returns_to_settle(view, verdict.return_distance)
        if verdict.order:
            matrices = matrices[-verdict.order :] if len(matrices) else self._orbit(verdict.order)
            first = log_multipliers(matrices)[0] if len(matrices) else math.nan
            self.decay = -first
            change = points[-1] - points[-1 - verdict.order]
            attracts = len(matrices) and (
                classify.attracts(first, verdict.return_distance, view)
                or (first < 0.0 and distance_to_orbit(matrices, change) <= classify.SETTLED * size)
            )
            if not attracts:
                motion = int(MotionClass.UNDECIDED)
                verdict = verdict._replace(motion=motion, order=0)
        result.motion, result.order = MotionClass(verdict.motion), int(verdict.order)
        result.return_distance, result.size = verdict.return_distance, size
        interval = window.duration / len(window.times)
        result.exponents = self._exponents(mean_exponents(growth, interval * len(growth)))
        if math.isfinite(verdict.error):
            result.exponent_error = verdict.error / interval
        if not self.has_period:
            self._classify_modulated(growth)
        if classify.is_final(view, verdict):
            return True
        unsettled = (MotionClass.UNDECIDED, MotionClass.QUASI_PERIODIC)
        if result.motion not in unsettled or not covers_torus(points, growth, size):
            return False
        result.motion = MotionClass.QUASI_PERIODIC
        return not classify.is_resonant(view, verdict)

    def _orbit(self, order: int) -> FloatArray:
        """Derivatives over the next returns; none if the run ends before."""
        orbit = self._advance(order, derivatives=True)
        complete = self.result.outcome == Outcome.COMPLETED and len(orbit.times) == order
        return self.space.scaled(orbit.matrices if complete else orbit.matrices[:0])

    def _classify_modulated(self, growth: FloatArray) -> None:
        """Set the class if the signals have no common period, so that no motion repeats."""
        total, error = classify.mean_growth(np.ascontiguousarray(growth[:, 0]))
        if self.result.motion == MotionClass.UNDECIDED and total * len(growth) < -_DECAYED:
            # All deviations decay: the motion has the frequencies of the signals.
            self.result.motion = (
                MotionClass.QUASI_PERIODIC if total < -error else self.result.motion
            )

    def _record(self, window: Passage | None = None) -> bool:
        """Set the properties of the settled motion, over one orbit or over a window.

        window : record of a fixed protocol

        Returns False if the motion has not settled yet.
        """
        result = self.result
        fixed = window is not None
        if window is None and not result.order:
            window = self._advance(self.protocol.recorded, measures=True)
        if window is not None:
            self._keep(window.states, window.times)
            if result.order == 0:
                self._describe(window)
                return True
        elif self.every is None:
            self._approach()
        before = self.course.time
        orbit = self._advance(result.order, derivatives=True, measures=True)
        if result.outcome != Outcome.COMPLETED or len(orbit.times) < result.order:
            result.motion, result.order = MotionClass.UNDECIDED, 0
            return True
        if self._rests(orbit):
            result.motion, result.order = MotionClass.AT_REST, 0
            self._describe(orbit)
            return True
        if result.return_distance * result.size > _DRIFT * self._range(orbit):
            # A vibration that decays: each return is near the last, but not in its own size.
            result.motion, result.order = MotionClass.UNDECIDED, 0
            return False
        self._describe(orbit)
        result.period = float(orbit.times[-1]) - before
        matrices = self.space.scaled(orbit.matrices)
        result.exponents = self._exponents(log_multipliers(matrices) / result.period)
        result.exponent_error = 0.0
        if self.every is None:
            result.motion = MotionClass.LIMIT_CYCLE
        if not fixed:
            # The orbit, again and again.
            number = np.arange(self.protocol.recorded + 1) - 1
            rounds = number // result.order
            times = orbit.times[number % result.order] + rounds * result.period
            self._keep(orbit.states[number % result.order], times)
        return True

    def _approach(self) -> None:
        """Continue until the period of a limit cycle has converged, at most as long as so far.

        The distance of a return decreases by the largest multiplier in each orbit.
        """
        distance = self.result.return_distance
        if distance > _CONVERGED and self.decay > 0.0:
            orbits = math.ceil(math.log(distance / _CONVERGED) / self.decay)
            self._advance(min(orbits * self.result.order, self.done))

    def _rests(self, orbit: Passage) -> bool:
        """Return True if nothing moves in an orbit."""
        still = self._range(orbit) <= _STILL * self._speed(orbit)
        return still and bool(np.all(orbit.stick_time >= (1.0 - _STILL) * orbit.duration))

    def _keep(self, states: FloatArray, times: FloatArray) -> None:
        """Store the recorded returns in the result."""
        self.result.points, self.result.times = states, times

    def _describe(self, passage: Passage) -> None:
        """Set the extremes and the sums over the contacts."""
        result = self.result
        result.contacts = ContactSums.of(passage)
        if passage.quantities.rms.size:
            result.vibration = Vibration.of(passage, self.parts[0])
        elif result.motion in (MotionClass.STEADY_SLIDING, MotionClass.AT_REST):
            result.vibration = Vibration.constant(*self.parts, 0.0)
        p = self.space.size
        result.low, result.high = passage.low[p:], passage.high[p:]
        result.size = self._range(passage)

    def _exponents(self, of_returns: FloatArray) -> FloatArray:
        """Exponents of a motion from those of its return map.

        The map of a section has no deviation along the flow, so that a self-excited motion has an
        additional exponent 0.
        """
        if self.every is not None:
            return of_returns
        resolved = of_returns[np.isfinite(of_returns)]
        if np.isnan(of_returns).all():
            return of_returns
        # Those that are not resolved, or lost, are the least.
        known = np.sort(np.append(resolved[: of_returns.size - 1], 0.0))[::-1]
        return np.append(known, of_returns[known.size - 1 : -1])

    def _range(self, passage: Passage) -> float:
        """Sum of half the ranges of the scaled coordinates [rad/s]."""
        return 0.5 * float((passage.high - passage.low)[: self.space.size].sum())

    def _speed(self, passage: Passage) -> float:
        """Size of the scaled state [rad/s]."""
        return float(np.maximum(abs(passage.high), abs(passage.low))[: self.space.size].sum())

    def _finished(self) -> MachineResult:
        """The result at the end of the run."""
        result = self.result
        result.final = None if self.last is None else self.last.final
        if result.outcome == Outcome.DIVERGED:
            result.motion = MotionClass.DIVERGED
        elif result.outcome == Outcome.NO_FORWARD_SOLUTION:
            result.motion = MotionClass.SELF_LOCKED
        elif result.outcome != Outcome.COMPLETED:
            result.motion = MotionClass.UNDECIDED
        elif result.motion in (MotionClass.STEADY_SLIDING, MotionClass.AT_REST):
            result.settling, result.transient = float(self.done), self.done
            if not result.points.size and result.low.size:
                # A constant state at every return.
                count = self.protocol.recorded + 1
                states = np.tile(0.5 * (result.low + result.high), (count, 1))
                self._keep(states, np.full(count, self.course.time))
        return result

"""Run and classification of a machine, by series or stepper: transient, windows, record."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from wedgebrake.analysis import classify, settling
from wedgebrake.analysis.classify import FEWEST_OF_TORUS, Verdict, Window
from wedgebrake.analysis.growth import (
    distance_to_orbit,
    growths,
    log_multipliers,
    mean_exponents,
)
from wedgebrake.analysis.machine_motion.coordinates import winding_bodies
from wedgebrake.analysis.machine_motion.result import (
    ContactSums,
    MachineResult,
    Vibration,
)
from wedgebrake.analysis.machine_motion.return_run import (
    Prepared,
    RecordedReturns,
    ReturnRun,
)
from wedgebrake.analysis.machine_motion.section import FIRST_LOOK, FIRST_RETURNS, STILL
from wedgebrake.analysis.machine_motion.steady import Steady, is_locked, steady_state
from wedgebrake.analysis.machine_motion.tori import covers_torus
from wedgebrake.analysis.run_settings import Protocol
from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import MotionClass, Outcome
from wedgebrake.solvers.machine.passage import Passage, Record
from wedgebrake.solvers.machine.rest import remains_at_rest

# Fewest returns that can be classified.
_FEWEST = 4
# Relative size of a vibration that the linear machine describes, where friction is a curve.
_SMALL = 1e-5
# Distance of a return, relative to the size of the last orbit, above which a vibration decays.
_DRIFT = 1e-5
# Distance of a return, relative to the size of the motion, below which the period of a cycle has
# converged.
_CONVERGED = 1e-11
# Growth (logarithm) of a deviation in a period at rest below which it is a rounding error.
_KEPT = 1e-12
# Classes in which all speeds are constant.
_CONSTANT = (MotionClass.STEADY_SLIDING, MotionClass.STEADY_ROTATION, MotionClass.AT_REST)
# The multipliers of an orbit that is not known.
_UNKNOWN = np.array([math.nan])
# Decay of a deviation in a window (logarithm) that leaves nothing of it.
_DECAYED = 8.0


def classify_run(prepared: Prepared, protocol: Protocol) -> MachineResult:
    """Run a prepared machine and classify its motion."""
    return _Classification(prepared, protocol).classified()


class _Classification:
    """Classification of a run that is continued window by window."""

    def __init__(self, prepared: Prepared, protocol: Protocol) -> None:
        most = getattr(protocol, prepared.course.limit)
        self.run, self.protocol = ReturnRun(prepared, most), protocol
        self.prepared, self.space = prepared, prepared.space
        # Returns to the present section so far, in scaled coordinates.
        self.returns: list[FloatArray] = []
        # Decay of a deviation over one orbit (logarithm); 0 if it is not known.
        self.decay = 0.0
        # Returns until the motion has settled, as estimated from the last window.
        self.waits = math.inf
        # The orbit that follows the last window; None if it has not been recorded. Logarithms of
        # the moduli of its multipliers, or of the last one in the window.
        self.orbit: Passage | None = None
        self.multipliers = _UNKNOWN
        # Undamped vibration that is proved to go on for ever.
        self.free: Steady | None = None
        self.result = self._no_result()

    def _no_result(self) -> MachineResult:
        """Return a result in which nothing is known yet."""
        inertias, contacts = self.prepared.parts
        return MachineResult(
            np.full(self.space.size, math.nan),
            ContactSums.none(contacts),
            Vibration.constant(inertias, contacts, math.nan),
            self_excited=self.run.self_excited,
        )

    def classified(self) -> MachineResult:
        """The result."""
        protocol = self.protocol
        if self.run.self_excited and not self._choose_section():
            return self._finished()
        if winding_bodies(self.prepared.machine):
            return self._finished()  # its torques grow for ever
        if protocol.automatic:
            self._settle()
        else:
            if protocol.first:
                self.run.passages(protocol.first, Record.RETURNS)
            if not self._records_orbit():
                self._record_growth()
        return self._finished()

    def _records_orbit(self) -> bool:
        """Record only the returns, in a third of the time, if the motion repeats.

        For any other motion, rewinds the run to the beginning of the record and returns False: its
        measures and the growth of deviations need the whole record.
        """
        run, recorded = self.run, self.protocol.recorded
        if not run.completed or run.self_excited or not self.prepared.has_period:
            return False
        begin, rewind = run.done, run.snapshot()
        record = run.record_returns(recorded)
        if run.completed and self._classify(record.passage) and self._record(record):
            self.result.transient, self.result.judged = begin, recorded
        if self.result.order or self.result.motion == MotionClass.AT_REST:
            return True
        rewind()
        self.result = self._no_result()
        return False

    def _record_growth(self) -> None:
        """Record measures and the growth of deviations, and classify the motion."""
        recorded, steady = self.protocol.recorded, False
        while True:
            begin = self.run.done
            record = self.run.record(recorded, Record.DERIVATIVES)
            if not self.run.waits_for(record.passage, recorded):
                break
        if self.run.self_excited:
            steady = self._ends_steadily(record.passage)
        if self.run.completed and not steady:
            self._classify(record.passage)
            self.result.transient, self.result.judged = begin, self.run.done - begin
            self._record(record)

    def _choose_section(self) -> bool:
        """Choose the section of a self-excited motion; return False if it is steady."""
        look = self.run.advance(0, duration=FIRST_LOOK * self.space.longest_period)
        if not self.run.completed or self._ends_steadily(look):
            return False
        self.run.take_section(look)
        return True

    def _settle(self) -> None:
        """Run windows, each as long as all before it, until the motion has settled.

        If a motion approaches an orbit at a constant rate, the window ends when the motion is
        expected to have settled. Only the last windows need the growth of deviations.
        """
        result, limit = self.result, self.protocol.limit
        begins = (self.space.to @ self.run.course.values)[None]
        self.returns = [begins[: int(self.run.returned)]]
        while self.run.completed and self.run.done < limit:
            begin = self.run.done
            target = int(settling.next_window(begin, limit, FIRST_RETURNS, self.waits))
            last = target == limit or not self.prepared.has_period
            last |= begin + self.waits > limit and target - begin >= FEWEST_OF_TORUS
            growth = Record.DERIVATIVES if last else Record.RETURNS
            window = self.run.advance(target - begin, Record.EXTREMES | growth)
            if not self.run.completed:
                return
            if self.run.self_excited and self._ends_steadily(window):
                return
            if self.run.done < target:
                # It does not return to this section: choose one from the present motion.
                self.run.take_section(window)
                self.returns = [np.empty((0, self.space.size))]
                slow = self.run.waits_for(window, target - begin)
                self.run.done = begin if slow else target
                if self.run.is_lost(window):
                    break
                continue
            result.judged, result.transient = self.run.done - begin, self.run.done
            free = self.free is not None
            final = self._classify(window) or free
            result.settling = float(begin)
            self.returns.append(window.states @ self.space.to.T)
            if result.order:
                result.settling = self._settling()
            if final and (self._record() or free):
                return
        if self.run.completed:
            self._record()

    def _settling(self) -> float:
        """Number of returns after which the motion stays near its orbit."""
        points, size = np.concatenate(self.returns), max(self.result.size, 1e-300)
        before = self.run.done + 1 - len(points)
        scale = np.ones(self.space.size)
        return float(before + settling.settling_of(points, self.result.order, scale, size))

    def _ends_steadily(self, passage: Passage) -> bool:
        """Set the result of a motion that tends to constant speeds or is self-locked.

        Returns False for any other motion, including free vibration, which is stored in ``free``.
        """
        if not self.prepared.linear:
            return self._ends_constant(passage)
        state = self.run.course.state
        curved = bool(state.modes["side"][state.curves["contact"]].any())
        if curved and self.run.range_of(passage) > _SMALL * self.run.speed_of(passage):
            # Only small vibration decays as that of the linear machine.
            return False
        problem = self.run.course.assembled.problem
        found = steady_state(problem, state, self.space, self.prepared.known)
        if found is None and is_locked(problem, state):
            # Moving bases wind up shafts for ever.
            self.result.motion = MotionClass.SELF_LOCKED
            return True
        if found is None:
            return False
        if found.ringing > STILL * self.run.speed_of(passage):
            # With friction as a curve, the amplitude changes by terms that are not linear.
            self.free = None if curved else found
            return False
        result = self.result
        result.motion = self._without_vibration(bool(found.sliding.any()), passage, found.states)
        result.exponents, result.exponent_error, result.size = found.exponents, 0.0, 0.0
        result.contacts = ContactSums.steady(found.sliding, found.torque)
        result.vibration = Vibration.constant(*self.prepared.parts, 0.0)
        result.low = result.high = found.states
        return True

    def _ends_constant(self, passage: Passage) -> bool:
        """Set the result of a motion that has reached a constant state; False for others."""
        if self.run.range_of(passage) > STILL * self.run.speed_of(passage):
            return False
        sliding = bool(self.run.course.state.modes["side"].any())
        self.result.motion = self._without_vibration(sliding, passage, passage.states[-1])
        self._describe(passage)
        return True

    def _without_vibration(
        self, sliding: bool, passage: Passage, states: FloatArray
    ) -> MotionClass:
        """Class of a motion with constant speeds.

        sliding : whether a contact slides
        states  : (states,) to which the motion tends
        """
        if sliding:
            return MotionClass.STEADY_SLIDING
        speeds = (self.space.to @ states)[self.space.speeds]
        turns = float(np.abs(speeds).max()) > STILL * self.run.speed_of(passage)
        contacts = bool(self.prepared.machine.contacts)
        return MotionClass.AT_REST if contacts or not turns else MotionClass.STEADY_ROTATION

    def _classify(self, window: Passage) -> bool:
        """Set class, order and exponents from a window; return True if it ends the transient."""
        result, self.orbit = self.result, None
        if len(window.times) < _FEWEST:
            return False
        points = np.ascontiguousarray(window.states @ self.space.to.T)
        matrices = self.space.scaled(window.matrices[1:])
        growth: FloatArray = np.full(points[1:].shape, math.nan)
        if len(matrices):
            growth = np.maximum(growths(matrices), self.prepared.course.least_growth)
        area = float(growth[:, :2].mean(axis=0).sum()) if growth.shape[1] > 1 else -math.inf
        scale, size = np.ones(self.space.size), max(self.run.range_of(window), 1e-300)
        view = Window(points, scale, size, np.ascontiguousarray(growth[:, 0]), area, window.resting)
        verdict: Verdict = classify.classify(view)
        # Numba takes long to recognise a member of an enumeration.
        motion: Any = int(verdict.motion)
        if verdict.order and not self._may_repeat():
            motion = int(MotionClass.UNDECIDED)
            verdict = verdict._replace(order=0)
        verdict = verdict._replace(motion=motion)
        self.waits = settling.approach_of(view, verdict.return_distance).waits
        if verdict.order:
            if len(matrices):
                matrices = matrices[-verdict.order :]
            else:
                self.orbit = self.run.orbit(verdict.order)
                if self.orbit is not None:
                    matrices = self.space.scaled(self.orbit.matrices)
            self.multipliers = log_multipliers(matrices) if len(matrices) else _UNKNOWN
            first = self.multipliers[0]
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
        result.exponents = self._exponents(mean_exponents(growth, len(growth)), interval)
        if math.isfinite(verdict.error):
            result.exponent_error = verdict.error / interval
        if not self.prepared.has_period:
            self._classify_modulated(growth)
        if settling.is_final(view, verdict):
            return True
        unsettled = (MotionClass.UNDECIDED, MotionClass.QUASI_PERIODIC)
        if result.motion not in unsettled or not covers_torus(points, growth):
            return False
        result.motion = MotionClass.QUASI_PERIODIC
        return not settling.nearly_returns(view)

    def _may_repeat(self) -> bool:
        """Return True if a motion whose last returns are equal repeats for ever.

        If the signals have no common period, only proven rest does: the signals may add up later.
        """
        course = self.run.course
        return self.prepared.has_period or remains_at_rest(
            self.prepared.machine, course.assembled, course.state
        )

    def _classify_modulated(self, growth: FloatArray) -> None:
        """Set the class if the signals have no common period, so that no motion repeats."""
        total, error = classify.mean_growth(np.ascontiguousarray(growth[:, 0]))
        decays = total < -error and total * len(growth) < -_DECAYED
        if self.result.motion == MotionClass.UNDECIDED and decays:
            # All deviations decay: the motion has the frequencies of the signals.
            self.result.motion = MotionClass.QUASI_PERIODIC

    def _record(self, record: RecordedReturns | None = None) -> bool:
        """Set the properties of the settled motion, over one orbit or over a record.

        record : that of a fixed protocol, if the run has one

        Returns False if the motion has not settled yet.
        """
        result, rests = self.result, self.result.motion == MotionClass.AT_REST
        # At rest every return is an orbit.
        order, fixed = 1 if rests else result.order, record is not None
        if record is None and not order:
            record = self.run.record(self.protocol.recorded)
        if record is not None:
            self._keep(record.states, record.times)
            if order == 0:
                self._describe(record.passage)
                if self._rests(record.passage):
                    # It slips again, but not in the record.
                    result.motion = MotionClass.UNDECIDED
                return True
        if self.run.self_excited and not fixed:
            self._approach()
        orbit = self.orbit or self.run.orbit(order)
        if orbit is None:
            result.motion, result.order = MotionClass.UNDECIDED, 0
            return True
        rests = self._rests(orbit)
        if rests:
            result.motion = self._without_vibration(False, orbit, orbit.states[-1])
            result.order = 0
        elif result.return_distance * result.size > _DRIFT * self.run.range_of(orbit):
            # A vibration that decays: each return is near the last, but not relative to its size.
            result.motion, result.order = MotionClass.UNDECIDED, 0
            return False
        self._describe(orbit)
        if rests and self.run.self_excited:
            return True
        period = orbit.duration
        self._set_exponents(orbit, order)
        result.period = math.nan if rests else period
        if self.run.self_excited:
            result.motion = MotionClass.LIMIT_CYCLE
        if not fixed:
            # The orbit, again and again.
            number = np.arange(self.protocol.recorded + 1) - 1
            times = orbit.times[number % order] + number // order * period
            self._keep(orbit.states[number % order], times)
        return True

    def _approach(self) -> None:
        """Continue until the period of a limit cycle has converged, at most for as long as so far.

        The distance of a return decreases by the largest multiplier in each orbit.
        """
        distance = self.result.return_distance
        if distance > _CONVERGED and self.decay > 0.0:
            orbits = math.ceil(math.log(distance / _CONVERGED) / self.decay)
            self.run.advance(min(orbits * self.result.order, self.run.done), Record.RETURNS)
        self.orbit = None  # it was recorded before this approach

    def _rests(self, orbit: Passage) -> bool:
        """Return True if nothing moves in an orbit, or slips where friction is smooth."""
        if orbit.resting:
            return True
        still = self.run.range_of(orbit) <= STILL * self.run.speed_of(orbit)
        return still and bool(np.all(orbit.stick_time >= (1.0 - STILL) * orbit.duration))

    def _keep(self, states: FloatArray, times: FloatArray) -> None:
        """Store the recorded returns in the result."""
        self.result.points, self.result.times = states, times

    def _describe(self, passage: Passage) -> None:
        """Set the extremes and the sums over the contacts."""
        result = self.result
        result.contacts = ContactSums.of(passage)
        if passage.quantities.rms.size:
            result.vibration = Vibration.of(passage, self.prepared.parts[0])
        elif result.motion in _CONSTANT:
            result.vibration = Vibration.constant(*self.prepared.parts, 0.0)
        p = self.space.size
        result.low, result.high = passage.low[p:], passage.high[p:]
        result.size = self.run.range_of(passage)

    def _set_exponents(self, orbit: Passage, order: int) -> None:
        """Set the exponents of a motion that repeats, from the multipliers of its orbit."""
        result, multipliers = self.result, self.multipliers
        if orbit is not self.orbit:
            multipliers = log_multipliers(self.space.scaled(orbit.matrices))
        if result.motion in _CONSTANT:  # angles that are held keep their deviation
            multipliers[np.abs(multipliers) <= _KEPT] = 0.0
        result.exponents = self._exponents(multipliers / order, orbit.duration / order)
        result.exponent_error = math.nan if math.isnan(result.exponents[0]) else 0.0

    def _exponents(self, of_returns: FloatArray, interval: float) -> FloatArray:
        """Exponents of a motion [1/s] from the growths of deviations between returns, descending.

        interval : between returns [s]

        The map of a section has no deviation along the flow, so that a self-excited motion has an
        additional exponent 0.
        """
        # A deviation that shrinks so much more than the others is a rounding error.
        hidden = of_returns < 0.5 * self.prepared.course.least_growth
        hidden[:1] = False
        of_returns = np.where(hidden, math.nan, of_returns) / interval
        if not self.run.self_excited:
            return of_returns
        resolved = of_returns[np.isfinite(of_returns)]
        if np.isnan(of_returns).all():
            return of_returns
        # Exponents that are not resolved, or -inf, are the smallest.
        known = np.sort(np.append(resolved[: of_returns.size - 1], 0.0))[::-1]
        return np.append(known, of_returns[known.size - 1 : -1])

    def _finished(self) -> MachineResult:
        """The result at the end of the run."""
        result, run = self.result, self.run
        result.outcome, result.events, result.last = run.outcome, run.events, run.last
        if result.outcome == Outcome.DIVERGED:
            result.motion = MotionClass.DIVERGED
        elif result.outcome == Outcome.NO_FORWARD_SOLUTION:
            result.motion = MotionClass.SELF_LOCKED
        elif not self.run.completed:
            result.motion = MotionClass.UNDECIDED
        elif self.free is not None:
            result.motion, result.exponents = MotionClass.FREE_VIBRATION, self.free.exponents
            result.exponent_error = 0.0
        elif result.motion in _CONSTANT:
            if not result.judged:
                result.settling, result.transient = float(self.run.done), self.run.done
            if not result.points.size and result.low.size:
                # A constant state at every return.
                count = self.protocol.recorded + 1
                states = np.tile(0.5 * (result.low + result.high), (count, 1))
                self._keep(states, np.full(count, self.run.course.time))
        return result

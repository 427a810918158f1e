"""Equations of an orbit of a machine: multiple shooting from return to return."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.model.machine import Machine
from wedgebrake.orbits.equations.breakpoints import events_of, levels_of
from wedgebrake.orbits.equations.equations import PartMeasures
from wedgebrake.orbits.equations.floquet import Floquet
from wedgebrake.orbits.equations.machine_flow import MachineFlow, OrbitRotations
from wedgebrake.orbits.equations.multiple_shooting import MultipleShooting
from wedgebrake.orbits.equations.segments import OrbitSegments
from wedgebrake.orbits.equations.varied_return import VariedReturn
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.passage import Passage

_SIGNS = {1: "+", 0: "0", -1: "-"}


def segments_as_text(segments: list[OrbitSegments], machine: Machine) -> str:
    """Segments of each contact as text: "brake: + 0 -"; of a single one without its name."""
    words = [" ".join(_SIGNS[side] for side in one.sides) for one in segments]
    if len(words) == 1:
        return words[0]
    pairs = zip(machine.contacts, words, strict=True)
    return "; ".join(f"{one.name}: {word}" for one, word in pairs)


class ReturnMap(MultipleShooting):
    """Equations of an orbit of a machine for its points on the section.

    The flow is exact and misses no event, so that every solution is an orbit. Where its events
    change, the map is continuous or the motion jumps.
    """

    def scales(self, unknowns: FloatArray, problem: MachineFlow) -> FloatArray:
        """Size of the orbit: sum of half the ranges of its scaled coordinates [rad/s].

        Forces that are delayed are measured by their magnitude, most of which may be constant.
        """
        spread = self._ranges(unknowns, problem)[: problem.local.space.size]
        sizes = np.full((self.order, self.dimension), 0.5 * float(spread.sum()) or 1.0)
        first = problem.local.basis.shape[1]
        largest = float(np.abs(self._points(unknowns)[:, first:]).max(initial=0.0))
        sizes[:, first:] = np.maximum(sizes[:, first:], largest)
        return sizes.ravel()

    def _advanced(
        self, points: FloatArray, problem: MachineFlow, *, derivative: bool = True
    ) -> tuple[FloatArray, list[FloatArray]]:
        found = [problem.next_return(one, derivative=derivative, half=self.half) for one in points]
        ends = np.array([problem.end(one) for one in found])
        matrices = [problem.matrix(passage) for passage in found] if derivative else []
        if self.half:
            mirror = problem.local.mirror
            return ends * mirror, [mirror[:, None] * one for one in matrices]
        return ends, matrices

    def by_parameters(self, unknowns: FloatArray, varied: VariedReturn) -> FloatArray:
        """Derivative of F with respect to parameters, (size, parameters)."""
        points = self._points(unknowns)
        return np.concatenate([varied.changes(one, half=self.half) for one in points])

    def floquet(self, unknowns: FloatArray, problem: MachineFlow) -> Floquet:
        """Floquet multipliers and test functions, of the whole orbit."""
        matrices = self._advanced(self._points(unknowns), problem)[1]
        return Floquet.of_matrices(matrices, half=self.half)

    def duration(self, unknowns: FloatArray, problem: MachineFlow) -> float:
        """Period of the orbit [s]."""
        if problem.machine.period:
            return self.order * problem.machine.period
        return float(sum(one.duration for one in self._passages(unknowns, problem)))

    def initial(self, unknowns: FloatArray, problem: MachineFlow) -> FinalState:
        """Initial state with which ``wb.simulate`` follows the orbit."""
        return problem.initial(self._points(unknowns)[0])

    def segments(self, unknowns: FloatArray, problem: MachineFlow) -> list[OrbitSegments]:
        """The slips and sticks of each contact."""
        found = self._passages(unknowns, problem, derivative=False)
        events, period = events_of(found)
        sides = [[(one.time, one.side) for one in own] for own in events]
        at_end = [mode[0] for mode in found[-1].final.modes]
        pairs = zip(sides, at_end, strict=True)
        return [OrbitSegments.between(own, period, side) for own, side in pairs]

    def levels(self, unknowns: FloatArray, problem: MachineFlow) -> list[OrbitSegments]:
        """The segments of each contact between breakpoints: of the speed, then of the force."""
        found = self._passages(unknowns, problem, derivative=False)
        return levels_of(found, problem.breakpoints, problem.piece_levels)

    def sequence(self, unknowns: FloatArray, problem: MachineFlow) -> str:
        """Segments of each contact as text."""
        return segments_as_text(self.segments(unknowns, problem), problem.machine)

    def points(self, unknowns: FloatArray, problem: MachineFlow) -> FloatArray:
        """States at the section, (order, states)."""
        return problem.states(self._points(self.whole(unknowns)[1]))

    def mirror_difference(
        self,
        unknowns: FloatArray,
        problem: MachineFlow,
        system: Any,  # noqa: ARG002
        tolerance: float,  # noqa: ARG002
    ) -> FloatArray:
        """Difference from the mirror image half an orbit later, relative to the size."""
        points = self._points(self.whole(unknowns)[1])
        middle = problem.next_return(points[self.order // 2], derivative=False, half=True)
        apart = problem.local.mirror * problem.end(middle) - points[0]
        # Without forces, most of which may be constant.
        size = np.max(np.abs(points[:, : problem.local.space.speeds.stop]))
        return np.asarray(apart / (size or 1.0))

    def mirror_points(
        self,
        unknowns: FloatArray,
        problem: MachineFlow,
        system: Any,  # noqa: ARG002
        method: str,  # noqa: ARG002
    ) -> FloatArray:
        """States at the section of the mirror image half a period later."""
        points = self._points(self.whole(unknowns)[1])
        middles = [problem.next_return(one, derivative=False, half=True) for one in points]
        return problem.states(
            np.array([problem.local.mirror * problem.end(one) for one in middles])
        )

    def measures(
        self,
        unknowns: FloatArray,
        problem: MachineFlow,
        system: Any,  # noqa: ARG002
    ) -> PartMeasures:
        """Amplitudes, sticking, events and torque."""
        found, n = self._passages(unknowns, problem), len(problem.machine.inertias)
        half = 0.5 * self._ranges(unknowns, problem)[problem.local.space.size :]
        if problem.turning.any():
            swings = self._rotations(unknowns, problem).swings
            half[:n] = np.where(problem.turning, swings, half[:n])
        sticks = sum(one.sticks for one in found)
        rest = sum(one.stick_time for one in found)
        return PartMeasures(
            velocity_amplitude=half[n : 2 * n],
            angle_amplitude=half[:n],
            stick_share=np.asarray(rest / self.duration(unknowns, problem)),
            peak_torque=np.max([one.peak_torque for one in found], axis=0),
            sticks_forward=float(np.sum(sticks, axis=0)[0]) / self.order,
            sticks_backward=float(np.sum(sticks, axis=0)[1]) / self.order,
            events=sum(len(one.log) for one in found) / self.order,
            driven=len(problem.machine.driven),
        )

    def twists(
        self,
        unknowns: FloatArray,
        problem: MachineFlow,
        system: Any,  # noqa: ARG002
    ) -> tuple[FloatArray, FloatArray]:
        """Half range and largest magnitude of the twist of each shaft [rad]."""
        found = self._rotations(unknowns, problem)
        return found.amplitudes, found.peaks

    def _rotations(self, unknowns: FloatArray, problem: MachineFlow) -> OrbitRotations:
        return problem.rotations(self._points(unknowns)[0], self.duration(unknowns, problem))

    def _passages(
        self, unknowns: FloatArray, problem: MachineFlow, *, derivative: bool = True
    ) -> list[Passage]:
        """The passages of the whole orbit, in the order of time."""
        points = self._points(unknowns)
        found = [problem.next_return(one, derivative=derivative, half=self.half) for one in points]
        if not self.half:
            return found
        # Every second one is in the mirror image; their number is odd.
        images = [_mirrored(one, problem) for one in found]
        return [(images if k % 2 else found)[k % self.order] for k in range(2 * self.order)]

    def _ranges(self, unknowns: FloatArray, problem: MachineFlow) -> FloatArray:
        """Range of each scaled coordinate, and then of each state, over the orbit."""
        found = self._passages(unknowns, problem)
        low = np.min([one.low for one in found], axis=0)
        return np.asarray(np.max([one.high for one in found], axis=0) - low)


def _mirrored(passage: Passage, problem: MachineFlow) -> Passage:
    """Extremes, sticks and events of the mirror image of a passage."""
    signs = problem.local.signs
    log = passage.log.copy()
    for name in ("before", "after"):
        log[name] *= -1
    return replace(
        passage, log=log, sticks=passage.sticks[:, ::-1],
        low=np.where(signs < 0.0, -passage.high, passage.low),
        high=np.where(signs < 0.0, -passage.low, passage.high),
    )  # fmt: skip

"""Derivative of the return map of a machine with respect to parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial

import numpy as np

from wedgebrake.analysis.derivatives.varied_motion import period_changes
from wedgebrake.analysis.derivatives.varied_values import by_parameter
from wedgebrake.arrays import FloatArray
from wedgebrake.model.machine import Machine
from wedgebrake.orbits.equations.machine_flow import MachineFlow, SectionStates
from wedgebrake.solvers.machine.passage import Course, Crossing, Every
from wedgebrake.solvers.machine.tangents import QUICK, Neighbourhood, Parameter, TangentTask


class VariedReturn:
    """The derivative of a return map with respect to parameters, at fixed points.

    The map depends on them by the flow, by driven bodies and joints, which place other bodies at
    the beginning and at the end, and by the time of the return: of a crossing, or the period.

    flow   : the map
    values : of the parameters by name
    at     : the machine as a function of a name and a value

    Raises ``InputError`` for a parameter without a derivative.
    """

    def __init__(
        self, flow: MachineFlow, values: Mapping[str, float], at: Callable[[str, float], Machine]
    ) -> None:
        machine_at = tuple(cache(partial(at, name)) for name in values)
        parameters = tuple(
            Parameter(name, value, differences=QUICK).allowed(one)
            for (name, value), one in zip(values.items(), machine_at, strict=True)
        )
        self.flow, machine = flow, flow.machine
        self._task = task = TangentTask(
            machine, parameters, machine_at, (0.0, 0.0), np.empty(0), flow.method
        )
        self._course = Course(machine, method=flow.method, near=Neighbourhood(task))
        self._places = bool(machine.driven or machine.joints)
        self._later = np.zeros(len(values))
        if not isinstance(flow.section, Crossing):
            self._later = period_changes(task)

    def changes(self, point: FloatArray, *, half: bool) -> FloatArray:
        """Derivative (size, parameters) of the end of the passage that begins at a point.

        half : whether it ends after half a period of the signals, and its mirror image is the end
        """
        flow, tangents = self.flow, self._course.state.tangents
        flow.start(point, self._course)
        tangents.start[:] = self._by_places(lambda one: one.at(point))
        tangents.later[:] = self._later * (0.5 if half else 1.0)
        section = Every(0.5 * flow.period) if half else flow.section
        passage = flow.passage(1, derivative=True, section=section, course=self._course)
        changes = passage.matrices[0][:, -tangents.later.size :]
        changes = np.pad(changes, ((0, 1), (0, 0)))[flow.rows(passage.final)]
        changes[: len(tangents.start)] -= self._by_places(lambda one: one.carried)
        found: FloatArray = flow.local.to @ changes
        return flow.local.mirror[:, None] * found if half else found

    def _by_places(self, of: Callable[[SectionStates], FloatArray]) -> FloatArray:
        """Derivatives of states that driven bodies and joints determine."""
        local, task = self.flow.local, self._task
        if not self._places:
            return np.zeros((local.space.to.shape[1], len(task.parameters)))
        return by_parameter(task, lambda machine: of(SectionStates(machine, local)))

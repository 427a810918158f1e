"""Evaluation of machines: run, settle, record and classify, with the kernel that fits the problem.

``kernel_of`` chooses it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from wedgebrake.analysis.driveline_motion.closed_form import classify_closed_form
from wedgebrake.analysis.machine_motion.classify_machine import classify_run
from wedgebrake.analysis.machine_motion.result import MachineResult
from wedgebrake.analysis.machine_motion.return_run import Prepared
from wedgebrake.analysis.run_settings import Protocol
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_parts import speed_at
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import wrong
from wedgebrake.solvers.kernels import kernel_of
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.task import check_state

if TYPE_CHECKING:
    from wedgebrake.solvers.smooth.solve_periods import Passed


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
    return Evaluator(protocol, method).result(machine, initial)


class Evaluator:
    """Evaluation of machines one after the other.

    What they have in common is prepared once, see ``Prepared.repeat``.
    """

    def __init__(self, protocol: Protocol, method: str) -> None:
        self._protocol, self._method = protocol, method
        self._prepared: Prepared | None = None

    def results(self, machines: Sequence[Machine]) -> list[MachineResult]:
        """The results of machines; transients of the stepper are computed side by side."""
        from wedgebrake.solvers.smooth.course import transients_together

        begun: dict[int, Passed] = {}
        if self._method == "smooth" and self._protocol.first and len(machines) > 1:
            forms = {k: kernel_of(one, "smooth").line for k, one in enumerate(machines)}
            lines = {k: one for k, one in forms.items() if one is not None}
            bodies = {k: machines[k].inertias[0] for k in lines}
            starts = {k: (one.angle, speed_at(one, 0.0)) for k, one in bodies.items()}
            if lines:
                begun = transients_together(lines, starts, self._protocol.first, self._protocol)
        return [self.result(one, begun=begun.get(k)) for k, one in enumerate(machines)]

    def result(
        self, machine: Machine, initial: FinalState | None = None, begun: Passed | None = None
    ) -> MachineResult:
        """Run a machine and classify its motion, as ``classify_machine``.

        begun : its transient, if the stepper has run it before
        """
        if initial is not None and initial.time == 0.0 and _is_initial(initial):
            (angle,), (speed,) = initial.angles.values(), initial.speeds.values()
            machine, initial = machine.started_at(angle, speed), None
        line = kernel_of(machine, self._method).line if initial is None else None
        if line is not None:
            return classify_line(machine, line, self._method, self._protocol, begun)
        prepared = self._prepared
        if initial is not None or prepared is None or not prepared.repeat(machine):
            prepared = Prepared.by_series(machine, self._method, initial)
        # The numbers of a run that begins later belong to its initial time.
        self._prepared = prepared if initial is None else None
        return classify_run(prepared, self._protocol)


def classify_line(
    machine: Machine,
    line: BrakedDriveline,
    method: str,
    protocol: Protocol,
    begun: Passed | None = None,
) -> MachineResult:
    """Run one inertia driven by a sine with its own kernel, and classify its motion.

    line  : the machine as this kernel takes it
    begun : its transient, if the stepper has run it before
    """
    if method == "smooth":
        return classify_run(Prepared.by_stepper(machine, line, protocol.rtol, begun), protocol)
    return classify_closed_form(machine, line, protocol)


def _is_initial(state: FinalState) -> bool:
    """Return True if a state says no more than the initial angle and speed of one inertia."""
    return len(state.angles) == 1 and not state.modes and not state.actuators


def begun_at(system: BrakedDriveline | Machine, initial: Any) -> tuple[Machine, FinalState | None]:
    """The machine of a system, and the state in which its run begins.

    initial : (angle [rad], velocity [rad/s]) of one inertia, a ``FinalState``, or None
    """
    machine = system.machine
    if initial is None or isinstance(initial, FinalState):
        return machine, initial
    if len(machine.inertias) > 1:
        raise wrong("initial", initial, "a final state, as returned by wb.final_state")
    return machine.started_at(*check_state("initial", initial)), None

"""The package on the work of the table: the kernels alone, and the front doors."""

from collections.abc import Callable, Sequence

import numpy as np

import wedgebrake as wb
from wedgebrake.dynamics import problem
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.dynamics.problem import Instant
from wedgebrake.dynamics.segment_log import empty_log
from wedgebrake.solvers.event_driven import solve as exact
from wedgebrake.solvers.event_driven import trajectory as exact_kernel
from wedgebrake.solvers.smooth import assemble, solve_periods
from work import DIAGRAM_COMPARED, ETAS, PERIODS, system

TOLERANCES = {"coulomb": (None,), "smoothed": (1e-6, 1e-8, 1e-10, 1e-12)}
# What the others are set beside.
REFERENCE = {"coulomb": None, "smoothed": 1e-8}
LANES = solve_periods.WIDTH
State = tuple[float, float]


def kernel(machine: wb.BrakedDriveline, rtol: float | None, periods: int) -> Callable[[], State]:
    """The compiled solver alone, without what makes a dataset of its answer.

    rtol : None for the exact solver
    """
    if rtol is None:
        given = exact.problem(machine)
        log, points = empty_log(0), np.empty((periods, 2))
        start, end = problem.State(0, 0.0, 0.0, 0.0), Instant(periods, 0.0)

        def run() -> State:
            found = exact_kernel.run(given, start, end, 10**7, log, points)
            assert found.outcome == Outcome.COMPLETED
            return found.state.angle, found.state.velocity

        return run
    task = assemble.problem(machine, rtol)

    def advance() -> State:
        found = solve_periods.advance(task, (0.0, 0.0), periods, 10**8)
        assert found.outcome == Outcome.COMPLETED
        return found.state

    return advance


def kernel_in_lanes(
    machines: Sequence[wb.BrakedDriveline], rtol: float, periods: int
) -> Callable[[], State]:
    """Smoothed brakes side by side, as the transients of a sweep are run: the first one's state."""
    tasks = [assemble.problem(machine, rtol) for machine in machines]
    states = np.zeros((len(tasks), 2))

    def advance() -> State:
        found = solve_periods.advance_together(tasks, states, periods, 10**8)
        assert all(one.outcome == Outcome.COMPLETED for one in found)
        return found[0].state

    return advance


def bifurcation(law: str, rtol: float | None, threads: int) -> None:
    """The bifurcation diagram, with classes, exponents and torques of each point."""
    limits = {} if rtol is None else {"rtol": rtol}
    wb.bifurcation(
        system(law, 0.0), eta=ETAS, periods=PERIODS, transient=200, threads=threads, **limits
    )


def diagram_states(law: str, rtol: float | None) -> np.ndarray:
    """(point, 2): angle and velocity where the diagrams are compared, by the same sweep."""
    limits = {} if rtol is None else {"rtol": rtol}
    found = wb.sweep(
        system(law, 0.0), eta=ETAS, periods=DIAGRAM_COMPARED, transient=DIAGRAM_COMPARED // 2,
        **limits,
    )  # fmt: skip
    return np.column_stack([found["final_angle"], found["final_velocity"]])

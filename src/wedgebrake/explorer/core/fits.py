"""The motion of the current system for comparison with a measured trace, and fits to the trace."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from wedgebrake.analysis.fitting.fit import Fit, fit
from wedgebrake.analysis.fitting.observation import observations_of
from wedgebrake.errors import InputError
from wedgebrake.explorer.core.computation import linked_friction
from wedgebrake.explorer.core.limits import LONGEST_FIT, MOST_PERIODS
from wedgebrake.explorer.core.scheduler import is_wanted
from wedgebrake.explorer.core.state import PageState
from wedgebrake.explorer.core.traces import MeasuredTrace
from wedgebrake.figures.data.trace import TracePicture
from wedgebrake.solvers.simulate import simulate


def picture(state: PageState) -> TracePicture:
    """Return the columns of the trace, and the motion of the system from the first sample on.

    Raises ``InputError`` if there is no trace, or if no column has a quantity.
    """
    loaded = _loaded(state)
    system, trace = state.system, loaded.trace
    observations = observations_of(system, trace, state.view.observe)
    size = trace.time.size
    run: dict[str, Any] = {**_initial(state), **state.limits, "method": state.study.run.method}
    start, length = float(trace.time[0]), float(np.ptp(trace.time))
    response = simulate(system, length, times=trace.time, start_time=start, **run)
    columns = {}
    for one in observations:
        model = np.full(size, np.nan)
        values = one.of(response)
        model[: values.size] = values
        columns[one.column] = (one.quantity, one.unit, trace.columns[one.column], model)
    early = response.sizes["time"] < size
    return TracePicture(trace.time, columns, response.attrs["message"] if early else "")


def fits(state: PageState) -> Iterator[Fit]:
    """Yield the fit of the free parameters to the trace.

    Raises ``InputError`` as ``wb.fit``, and after a time limit.
    """
    loaded, begun = _loaded(state), time.perf_counter()

    def progress(_: int) -> None:
        if not is_wanted():
            raise InputError("fit: stopped. Press Fit to start it again.")
        if time.perf_counter() - begun > LONGEST_FIT:
            raise InputError(
                f"fit: exceeded the time limit of {LONGEST_FIT} s. Load a shorter trace, or use"
                " wb.fit, which has no time limit."
            )

    if not state.view.free:
        raise InputError('free: no parameter is free. Select one in the list "Free parameter".')
    yield fit(
        linked_friction(state, list(state.view.free)), loaded.trace, state.view.free,
        observe=state.view.observe, method=state.study.run.method, progress=progress,
        **_initial(state),
    )  # fmt: skip


def of_machine(state: PageState, values: Mapping[str, float]) -> dict[str, float]:
    """Return the fitted values that are parameters or initial conditions of the machine."""
    known = {*state.system.quantities(), *state.system.initial_conditions}
    return {name: value for name, value in values.items() if name in known}


def _initial(state: PageState) -> dict[str, Any]:
    return {} if state.system.holds_start else {"initial": state.study.run.initial}


def _loaded(state: PageState) -> MeasuredTrace:
    loaded = state.view.trace
    if loaded is None:
        raise InputError(
            "Load a measured trace: a .csv file with a column of times [s] and columns of measured"
            " quantities, in SI units or with units such as [ms] in their names. The page shows it"
            " together with the motion of the machine from the first sample on, and fits parameters"
            " to it."
        )
    if not state.view.observe:
        raise InputError(
            f"observe: no column of {loaded.name} has a quantity. Select the quantity that a column"
            " measures in the list beside the name of the column."
        )
    length, most = float(np.ptp(loaded.trace.time)), MOST_PERIODS * state.cycle
    if length > most:
        raise InputError(
            f"{loaded.name}: is {length:g} s long, but the page simulates this machine for at most"
            f" {most:g} s. Check that times are in seconds, load a shorter trace, or use wb.fit."
        )
    return loaded

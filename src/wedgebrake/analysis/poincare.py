"""Poincare section: the state once in every period of the torque."""

from __future__ import annotations

import inspect
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.run_settings import protocol
from wedgebrake.errors import InputError, nearest
from wedgebrake.model.system import BrakedDriveline, check_driveline
from wedgebrake.model.validation import check_number, check_whole
from wedgebrake.solvers.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr

_MOST = 5_000_000
# Options of ``simulate`` that the section sets, and the arguments to use instead.
_DECIDED = {
    "duration": "periods",
    "times": "periods, transient and section_time",
    "samples_per_period": "section_time",
}


def poincare(
    system: BrakedDriveline,
    periods: int = 250,
    *,
    transient: int = 200,
    section_time: float = 0.0,
    initial: tuple[float, float] = (0.0, 0.0),
    method: str | None = None,
    **options: Any,
) -> xr.Dataset:
    """Return the states at t = section_time + n / f_e for n = transient, ..., periods.

    The state is computed at these times, not interpolated from samples. The paper's own
    section, t = 20 s + n / f_e up to 25 s, is ``section_time=20.0, transient=0,
    periods=50`` (section 4.1; the phase of the section differs from that of n / f_e).

    Parameters
    ----------
    system : BrakedDriveline
        System to simulate.
    periods : int
        Number n of the last point, at least 0.
    transient : int
        Number n of the first point, at least 0 and below ``periods``.
    section_time : float
        Time of the point number 0 [s]; it sets the phase of the torque at the section.
    initial : (angle [rad], velocity [rad/s])
        State at ``start_time`` (an option of ``simulate``, default 0 s).
    method, options
        As in ``simulate``: method, start_time, rtol, step, max_events, max_steps.

    Returns
    -------
    xarray.Dataset
        Over ``period`` (the numbers n, at most periods - transient + 1 of them): angle
        [rad], velocity [rad/s], and ``time`` [s] as a coordinate. ``attrs`` are those of
        the response, with section_time [s], section_phase (share of a torque period) and
        transient. A run that ended early (``attrs["status"]``, ``attrs["message"]``)
        gives the points that it reached, perhaps none.

    Raises
    ------
    InputError
        For invalid arguments, and as ``simulate``.
    """
    check_driveline(system)
    _check_options(options)
    check_whole("periods", periods, 1, _MOST)
    check_whole("transient", transient, 0, _MOST)
    protocol(periods, transient)
    seconds = "a number of seconds in [0, 1e+12]"
    check_number("section_time", section_time, 0.0, 1e12, seconds)
    start_time = options.get("start_time", 0.0)
    check_number("start_time", start_time, 0.0, 1e12, seconds)

    numbers = np.arange(int(transient), int(periods) + 1)
    frequency = system.excitation.frequency
    times = section_time + numbers / frequency
    if times[0] < start_time:
        least = math.ceil((start_time - section_time) * frequency)
        raise InputError(
            f"transient = {transient!r}: its point lies at {times[0]:g} s, before"
            f" start_time = {start_time:g} s. Use a transient of at least {least}."
        )
    span: dict[str, Any] = {"duration": times[-1] - start_time}
    if section_time == 0.0 and start_time == 0.0:
        span = {"periods": int(periods)}
    response = simulate(system, **span, initial=initial, method=method, times=times, **options)
    reached = numbers[: response.sizes["time"]]
    number = ("time", reached, {"units": "1", "long_name": "number of periods"})
    points = response[["angle", "velocity"]].assign_coords(period=number).swap_dims(time="period")
    return points.assign_attrs(
        section_time=float(section_time),
        section_phase=section_time * frequency % 1.0,
        transient=int(transient),
    )


def _check_options(options: dict[str, Any]) -> None:
    allowed = set(inspect.signature(simulate).parameters) - set(_DECIDED) - {"system"}
    for name in options:
        if name in _DECIDED:
            raise InputError(
                f"{name} = {options[name]!r}: the section sets it. Use {_DECIDED[name]}."
            )
        if name not in allowed:
            raise InputError(f"{name}: no such option. {nearest(name, allowed)}")

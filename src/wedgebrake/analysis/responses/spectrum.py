"""The amplitude spectrum of a response."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.responses.datasets import attributes, dataset_over, of_part
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import shaft_matrices
from wedgebrake.model.studies.study import parse_study
from wedgebrake.model.validation import SECONDS, check_instance, check_number, unknown, wrong

if TYPE_CHECKING:
    import xarray as xr


# Times count as equally spaced if no step differs by more than this share of a step.
_UNIFORM = 1e-6


def spectrum(
    response: xr.Dataset,
    quantity: str = "velocity",
    window: str | tuple[Any, ...] = "hann",
    start: float | None = None,
    stop: float | None = None,
    *,
    part: str | None = None,
) -> xr.Dataset:
    """One-sided amplitude spectrum in physical units.

    A sine of amplitude A whose frequency is one of the bins gives A there, with any
    window (the coherent gain is divided out); a constant gives itself at 0 Hz. Harris,
    Proc. IEEE 66 (1978), 51-83, for windows, coherent gain and noise bandwidth.

    The paper's spectra use all 25 s of the response, the default here. Where the samples
    span a whole number of torque periods, the last sample, which repeats the phase of the
    first, is left out: forcing frequency and harmonics are then bins.

    Parameters
    ----------
    response : xarray.Dataset
        As returned by ``simulate``, equally spaced in time.
    quantity : str
        A variable over time: "velocity", "angle", "brake_torque", "shaft_torque",
        "sliding_velocity", "actuation_force", "torque" (of a driveline "drive_torque").
    window : str or tuple
        A window of ``scipy.signal.windows``, for example "hann", "boxcar", "flattop",
        ("kaiser", 8.6).
    start, stop : float
        Samples with start <= time <= stop are used [s]; default all.
    part : str
        Of a machine: the inertia, contact or shaft whose quantity it is, if there are several.

    Returns
    -------
    xarray.Dataset
        Over ``frequency`` [Hz], (n//2 + 1,): ``amplitude`` in the unit of the quantity.
        ``attrs``: quantity, window, coherent_gain [1], noise_bandwidth [bins], resolution
        [Hz], samples, sample_interval, start, stop [s]; of the response, what was computed:
        method, options, system, groups; if it describes its system, forcing_frequency (0: no
        torque acts) and natural_frequency [Hz] (0: no stiffness). Of a machine, forcing_frequency
        is that of the common period of all signals, if there is one, and natural_frequency is
        known for one inertia only.

    Raises
    ------
    InputError
        For an unknown quantity, part or window, fewer than two samples, values that are not
        finite, or times that are not equally spaced.
    """
    response = _of_part(response, quantity, part)
    times, values = _samples(response, quantity, start, stop)
    interval = _interval(times)
    known = frequencies(response)
    if known and not is_driven(response):
        known["forcing_frequency"] = 0.0
    n = _whole_periods(times, interval, known.get("forcing_frequency", 0.0))
    allowed = "the name of a window of scipy.signal.windows, or (name, parameter)"
    check_instance("window", window, str | tuple, allowed)
    try:
        weights = window_weights(window, n)
    except (ValueError, TypeError) as error:
        raise InputError.of(
            "window", window, f"not a window of scipy.signal.windows ({error}). For example 'hann',"
            " 'boxcar', 'flattop' or ('kaiser', 8.6).", allowed=allowed,
        ) from None  # fmt: skip
    amplitude = np.abs(np.fft.rfft(values[:n] * weights)) / abs(weights.sum())
    # Every line except 0 Hz and, for even n, the Nyquist frequency represents two.
    amplitude[1 : (n + 1) // 2] *= 2.0
    unit = response[quantity].attrs.get("units", "1")
    spec = {"frequency": ("Hz", "frequency"), "amplitude": (unit, f"amplitude of {quantity}")}
    columns = {"frequency": np.fft.rfftfreq(n, interval), "amplitude": amplitude}
    dataset = dataset_over("frequency", spec, columns)
    dataset.attrs = {
        "quantity": quantity,
        "window": str(window),
        "coherent_gain": float(weights.mean()),
        "noise_bandwidth": float(n * np.sum(weights**2) / weights.sum() ** 2),
        "resolution": 1.0 / (n * interval),
        "samples": n,
        "sample_interval": interval,
        "start": float(times[0]),
        "stop": float(times[n - 1]),
        **attributes(response, "method", "options", "system", "groups"),
        **known,
    }
    return dataset


def window_weights(window: str | tuple[Any, ...], n: int) -> FloatArray:
    """Return the n >= 2 weights of a window of ``scipy.signal.windows``, for use with the FFT.

    Raises ``ValueError`` or ``TypeError`` for anything that is not a window.
    """
    if window == "hann":  # the default, without the half second for importing scipy.signal
        return 0.5 + 0.5 * np.cos(np.linspace(-np.pi, np.pi, n + 1)[:-1])
    from scipy.signal import windows

    with np.errstate(all="ignore"):
        weights = np.asarray(windows.get_window(window, n, fftbins=True), dtype=float)
    if not np.all(np.isfinite(weights)):
        raise ValueError("its values are not finite")
    return weights


def frequencies(response: xr.Dataset) -> dict[str, float]:
    """Return forcing_frequency and natural_frequency [Hz] of a response, {} if unknown.

    A torque of amplitude 0 has a frequency too: periods and sections are counted with it.
    """
    try:
        tables = json.loads(response.attrs["system"])
        if "frequency" not in tables.get("excitation", {}):
            return _frequencies_of_machine(parse_study(tables).system.machine)
        line, torque = tables["driveline"], tables["excitation"]
        natural = math.sqrt(line["stiffness"] / line["inertia"]) / (2.0 * math.pi)
        return {"forcing_frequency": float(torque["frequency"]), "natural_frequency": natural}
    except (KeyError, TypeError, ValueError):
        return {}


def _frequencies_of_machine(machine: Machine) -> dict[str, float]:
    """Return ``frequencies`` of a machine."""
    found = {}
    if machine.period is not None:
        found["forcing_frequency"] = 1.0 / machine.period if machine.period else 0.0
    if len(machine.inertias) == 1:
        stiffness = shaft_matrices(machine)[0].item()
        natural = math.sqrt(stiffness / machine.inertias[0].inertia) / (2.0 * math.pi)
        found["natural_frequency"] = natural
    return found


def is_driven(response: xr.Dataset) -> bool:
    """Return True if a torque acts on the simulated system, or if this is unknown."""
    try:
        tables = json.loads(response.attrs["system"])
        if "amplitude" not in tables.get("excitation", {}):
            return not parse_study(tables).system.machine.autonomous
        return bool(tables["excitation"]["amplitude"] != 0.0)
    except (KeyError, TypeError, ValueError):
        return True


def _of_part(response: xr.Dataset, quantity: str, part: str | None) -> xr.Dataset:
    """Return a response with the quantity of one part of a machine."""
    variables = getattr(response, "data_vars", {})
    dims = response[quantity].dims if quantity in variables else ()
    if dims[:1] == ("time",) and len(dims) == 2:
        return of_part(response, str(dims[1]), part, "part")
    if part is not None and dims == ("time",):
        raise wrong("part", part, f"None, as {quantity} is given for one part")
    return response


def _samples(
    response: xr.Dataset, quantity: str, start: float | None, stop: float | None
) -> tuple[FloatArray, FloatArray]:
    """Times and values between start and stop."""
    if "time" not in getattr(response, "coords", {}):
        raise wrong(
            "response", response, "a dataset over time", "Use the result of wb.simulate(...)."
        )
    over_time = [str(name) for name, v in response.data_vars.items() if v.dims == ("time",)]
    if quantity not in over_time:
        raise unknown("quantity", quantity, over_time, "no such variable over time")
    times = np.asarray(response["time"].to_numpy(), dtype=float)
    values = np.asarray(response[quantity].to_numpy(), dtype=float)
    first, last = (float(times[0]), float(times[-1])) if times.size else (0.0, 0.0)
    low = first if start is None else check_number("start", start, allowed=SECONDS)
    high = last if stop is None else check_number("stop", stop, allowed=SECONDS)
    slack = 1e-12 * max(abs(first), abs(last))
    inside = (times >= low - slack) & (times <= high + slack)
    if np.count_nonzero(inside) < 2:
        raise InputError(
            f"start = {start!r}, stop = {stop!r}: this window contains"
            f" {np.count_nonzero(inside)} samples, but a spectrum needs at least 2. The response"
            f" has {times.size} from {first:g} s to {last:g} s. Choose a longer window.",
            name="start", value=start, allowed="before stop, by two samples or more",
        )  # fmt: skip
    times, values = times[inside], values[inside]
    if not np.all(np.isfinite(values)):
        raise InputError.of(
            "quantity", quantity, "has values that are not finite. Choose start and stop around"
            " them.", allowed="a variable with finite values",
        )  # fmt: skip
    return times, values


def _interval(times: FloatArray) -> float:
    """The common step of the times [s]."""
    steps = np.diff(times)
    interval = float((times[-1] - times[0]) / (times.size - 1))
    rounding = 8.0 * np.finfo(float).eps * float(np.max(np.abs(times)))
    worst = float(np.max(np.abs(steps - interval)))
    if interval <= 0.0 or worst > _UNIFORM * interval + rounding:
        raise InputError(
            f"response: its times are not equally spaced (steps of {steps.min():g} to"
            f" {steps.max():g} s), so it has no discrete spectrum. Simulate without `times`,"
            " or with equally spaced ones."
        )
    return interval


def _whole_periods(times: FloatArray, interval: float, forcing: float) -> int:
    """Number of samples to use, without the last if it repeats the phase of the first."""
    n = int(times.size)
    turns = float(times[-1] - times[0]) * forcing
    # To within a thousandth of a sample.
    repeats = round(turns) >= 1 and abs(turns - round(turns)) < 1e-3 * interval * forcing
    return n - 1 if repeats and n > 2 else n

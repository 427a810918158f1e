"""Order maps: amplitudes over speed and order."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.responses.datasets import attributes, labelled, of_part
from wedgebrake.analysis.responses.repeat import repeated, run_of, solved
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_parts import GROUND
from wedgebrake.model.signals.signal_tables import Ramp
from wedgebrake.model.signals.signals import Signal, as_signal
from wedgebrake.model.validation import (
    check_choice,
    check_number,
    check_whole,
    shown,
    unknown,
    wrong,
)

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.solvers.machine.solve import MachineTask


VARIABLES = {
    "velocity": "inertia",
    "torque": "inertia",
    "shaft_torque": "shaft",
    "brake_torque": "contact",
    "actuation_force": "contact",
    "sliding_velocity": "contact",
}
"""Variables that have an order map, and the dimension of each."""
_TURN = 2.0 * np.pi
# Samples per cycle of the highest order, fewest samples per turn, and most samples in total.
_PER_CYCLE, _LEAST, _MOST = 8, 64, 4_000_000
# Overlap of windows: steps per length of a window.
_STEPS = 4
# Number of times for the first interpolation of angles, of Newton steps, and tolerance [rad].
_FIRST, _NEWTON, _TOLERANCE = 4000, 30, 1e-11


class _Turning(NamedTuple):
    """Angle [rad] and speed [rad/s] of the reference at times."""

    angle: FloatArray
    speed: FloatArray


def order_map(
    response: xr.Dataset,
    variable: str,
    part: str | None = None,
    *,
    reference: str | Signal | None = None,
    highest: float = 10.0,
    turns: int = 8,
    start: float | None = None,
    stop: float | None = None,
) -> xr.Dataset:
    """Amplitude of a quantity over speed and order, for example during a run-up or a stop.

    An order is the number of cycles per turn of the reference. The run is repeated and sampled at
    equal steps of the reference's angle, so that orders stay sharp while the speed varies. The
    amplitudes are computed by ``scipy.signal.ShortTimeFFT`` with a Hann window. The amplitude of an
    order that is a multiple of 1/turns is exact if it is constant in a window.

    Parameters
    ----------
    response : xarray.Dataset
        As returned by ``simulate``.
    variable : str
        "velocity" or "torque" of an inertia, "shaft_torque", "brake_torque", "actuation_force" or
        "sliding_velocity".
    part : str
        Name of the inertia, shaft or contact; default: the only one.
    reference : str or Signal
        Name of an inertia, or a speed as a signal [rad/s]. Default: the first inertia, or, if it
        slides on a moving base, the speed of the base: the drive_speed of a driveline.
    highest : float
        Highest order of the map.
    turns : int
        Length of a window in turns; windows overlap by three quarters. Orders closer than 2/turns
        are not resolved.
    start, stop : float
        First and last time [s]; default: the start of the response, and its end or the time at
        which the reference comes to rest or reverses.

    Returns
    -------
    xarray.Dataset
        amplitude over (``speed``, ``order``), in the unit of the variable; ``speed`` is the mean
        speed of the reference in each window [rad/s], ascending, ``time`` [s] the midpoint of the
        window. Order 0 is the mean. A trend in a window leaks into low orders; the leakage
        decreases with the cube of the number of cycles in the window.

    Raises
    ------
    InputError
        If ``response`` is another dataset, if a name is unknown, or if the reference turns by less
        than one window before it comes to rest or reverses.
    """
    check_choice("variable", variable, VARIABLES)
    check_number("highest", highest, 1e-3, 1e4)
    check_whole("turns", turns, 1, 10_000)
    machine, task = run_of(response)
    whose = ""
    if reference is None:
        reference = _default_reference(machine)
        whose = "drive " if isinstance(reference, Signal) else ""
    begin = task.start if start is None else check_number("start", start, task.start, task.end)
    end = task.end if stop is None else check_number("stop", stop, begin, task.end)
    axis = _Reference(machine, task, reference)
    per_turn = _STEPS * max(_LEAST // _STEPS, int(np.ceil(_PER_CYCLE * highest / _STEPS)))
    times = axis.times(begin, end, per_turn, turns)
    kind = VARIABLES[variable]
    chosen = of_part(repeated(response, times)[[variable]], kind, part, "part")[variable]
    values, name = chosen.to_numpy(), str(chosen[kind].item())
    amplitude, orders, first = _amplitudes(values, per_turn, turns)
    kept = orders <= highest * (1.0 + 1e-12)
    last = first + turns * per_turn
    span = times[last] - times[first]
    speed = turns * _TURN / span
    ascending = np.argsort(speed, kind="stable")
    import xarray as xr

    unit, middle = chosen.attrs["units"], (0.5 * (times[first] + times[last]))[ascending]
    found = xr.Dataset(
        {
            "amplitude": labelled(
                ("speed", "order"), amplitude[ascending][:, kept], unit,
                f"amplitude of {variable} of {name}",
            )
        },
        coords={
            "speed": labelled("speed", speed[ascending], "rad/s", "mean speed of the reference"),
            "order": labelled("order", orders[kept], "1", "cycles in a turn of the reference"),
            "time": labelled("speed", middle, "s", "middle of the window"),
        },
    )  # fmt: skip
    found.attrs = {
        "kind": "order_map", "variable": variable, "part": name, "turns": turns,
        "reference": (
            reference if isinstance(reference, str) else whose + _words(reference, times)
        ),
        "start": begin, "stop": end, **attributes(response, "status"),
    }  # fmt: skip
    return found


def _default_reference(machine: Machine) -> str | Signal:
    """The first inertia, or the drive of a brake on a moving base, against which it vibrates."""
    name = machine.inertias[0].name
    for one in machine.contacts:
        if one.a == name and one.b == GROUND and as_signal(one.base_speed).bound > 0.0:
            base: Signal = as_signal(one.base_speed)
            return -base
    return name


def _words(speed: Signal, times: FloatArray) -> str:
    """A speed in words: the ends of a ramp; of other signals, the range at the given times."""
    if isinstance(speed, Ramp):
        begins = f" from t = {speed.begin:.4g} s" if speed.begin else ""
        return f"speed {speed.start:.4g} to {speed.end:.4g} rad/s in {speed.duration:.4g} s{begins}"
    values = speed(times)
    return f"speed between {values.min():.4g} and {values.max():.4g} rad/s ({speed.kind})"


class _Reference:
    """Reference of the angle: an inertia, or a speed as a signal."""

    def __init__(self, machine: Machine, task: MachineTask, reference: Any) -> None:
        names = [one.name for one in machine.inertias]
        if isinstance(reference, str) and reference not in names:
            raise unknown("reference", reference, names, "no such inertia")
        if not isinstance(reference, str | Signal):
            raise wrong("reference", reference, "the name of an inertia, or a speed as a signal")
        self.machine, self.task, self.reference = machine, task, reference

    def at(self, times: FloatArray) -> _Turning:
        """Angle and speed at ascending times."""
        if isinstance(self.reference, Signal):
            return _Turning(self.reference.integral(times), self.reference(times))
        number, n = self.machine.index(self.reference), len(self.machine.inertias)
        task = dataclasses.replace(self.task, times=times)
        states = solved(self.machine, task).observer.states
        return _Turning(states[:, number], states[:, n + number])

    def times(self, begin: float, end: float, per_turn: int, turns: int) -> FloatArray:
        """Times between two times at equal steps of the angle.

        Raises ``InputError`` if the reference turns by less than a window in one direction.
        """
        rough = np.linspace(begin, end, _FIRST)
        found = self.at(rough)
        sign = np.sign(found.angle[1] - found.angle[0]) if end > begin else 0.0
        angle = sign * (found.angle - found.angle[0])
        back = np.flatnonzero(np.diff(angle) <= 0.0)
        # Until it stops; after that there are no turns.
        count = back[0] + 1 if back.size else angle.size
        rough, angle = rough[:count], angle[:count]
        total = int(np.floor(angle[-1] / _TURN * per_turn)) if sign else 0
        if total < turns * per_turn:
            raise InputError(
                f"turns = {shown(turns)}: the reference turns {angle[-1] / _TURN:.4g} times in one"
                f" direction between {begin:g} s and {rough[-1]:g} s, must turn {turns} times at"
                " least. Lower turns, or choose another reference, start or stop.",
                name="turns", value=turns, allowed="turns of the reference in the response",
            )  # fmt: skip
        if total > _MOST:
            raise InputError(
                f"highest: {total} samples would be needed, at most {_MOST}. Lower highest, or"
                " choose a shorter time by start and stop."
            )
        wanted = np.arange(total + 1) * _TURN / per_turn
        low, high = self._brackets(rough, angle, wanted)
        times = np.interp(wanted, angle, rough)
        for _ in range(_NEWTON):
            found_now = self.at(times)
            error = sign * (found_now.angle - found.angle[0]) - wanted
            low = np.where(error <= 0.0, times, low)
            high = np.where(error >= 0.0, times, high)
            speed = sign * found_now.speed
            if np.max(np.abs(error)) < _TOLERANCE * (1.0 + 1e-4 * wanted[-1]):
                break
            step = np.divide(error, speed, out=np.full_like(times, np.inf), where=speed > 0.0)
            moved = times - step
            inside = (moved >= low) & (moved <= high)
            times = np.maximum.accumulate(np.where(inside, moved, 0.5 * (low + high)))
        return times

    @staticmethod
    def _brackets(
        times: FloatArray, angle: FloatArray, wanted: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Times before and after each wanted angle."""
        at = np.clip(np.searchsorted(angle, wanted, side="right") - 1, 0, times.size - 2)
        return times[at], times[at + 1]


def _amplitudes(
    values: FloatArray, per_turn: int, turns: int
) -> tuple[FloatArray, FloatArray, NDArray[np.int64]]:
    """Amplitudes (windows, orders), the orders, and the first sample of each window."""
    from scipy.signal import ShortTimeFFT
    from scipy.signal.windows import hann

    length = turns * per_turn
    hop = length // _STEPS
    transform = ShortTimeFFT(
        hann(length, sym=False), hop, fs=float(per_turn), fft_mode="onesided", scale_to="magnitude"
    )
    first = np.arange(0, values.size - length, hop)
    # Slices are centred: the first one that begins with the values has half the steps before it.
    p = _STEPS // 2
    amplitude = np.abs(transform.stft(values, p0=p, p1=p + first.size)).T
    amplitude[:, 1:] *= 2.0
    return amplitude, np.asarray(transform.f), first

"""Temperature of a disc from the heat of a contact."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from wedgebrake.analysis.responses.datasets import attributes, labelled
from wedgebrake.analysis.responses.machine_series import (
    NODES,
    WEIGHTS,
    machine_series,
    series,
    values_at,
)
from wedgebrake.analysis.responses.repeat import run_of, solved
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.discs import LumpedDisc, SemiInfiniteDisc
from wedgebrake.model.validation import check_instance, check_number, unknown

if TYPE_CHECKING:
    from collections.abc import Callable

    import xarray as xr


# Number of pairs of a time and a node that are evaluated at once.
_BLOCK = 4_000_000
# Tolerance of the time of the peak, as a share of the time between its neighbours.
_TOLERANCE = 1e-10


class _Flow:
    """A heat flow as Legendre series in consecutive intervals."""

    def __init__(self, start: FloatArray, length: FloatArray, values: FloatArray) -> None:
        self.start, self.length, self.values = start, length, values
        self.end = start + length
        self.series = series(values[..., None])[..., 0]
        self.integrals = legendre.legint(self.series, axis=1, lbnd=-1.0) * 0.5 * length[:, None]
        self.before = np.cumsum(np.sum(self.integrals, axis=1)) - np.sum(self.integrals, axis=1)

    def power(self, times: FloatArray) -> FloatArray:
        """The heat flow; at a jump, the value after it."""
        at, x = self._places(times)
        return values_at(self.series[at], x)

    def heat(self, times: FloatArray) -> FloatArray:
        """The integral of the heat flow from the beginning."""
        at, x = self._places(times)
        return np.asarray(self.before[at] + values_at(self.integrals[at], x))

    def memory(self, times: FloatArray) -> FloatArray:
        """The integral of flow(s) / sqrt(time - s) up to each time."""
        found = np.zeros(times.size)
        block = max(1, _BLOCK // max(self.values.size, 1))
        for first in range(0, times.size, block):
            found[first : first + block] = self._memory(times[first : first + block])
        return found

    def _memory(self, times: FloatArray) -> FloatArray:
        nodes = self.start[:, None] + 0.5 * self.length[:, None] * (1.0 + NODES)
        weighted = 0.5 * self.length[:, None] * WEIGHTS * self.values
        # At least one interval length from its pole, the kernel is smooth enough for the nodes.
        far = times[:, None] - self.end >= self.length
        gaps = np.where(far[..., None], times[:, None, None] - nodes, np.inf)
        found = np.einsum("pk,tpk->t", weighted, 1.0 / np.sqrt(gaps))
        # Closer to the pole, u = sqrt(time - s) makes the integrand a polynomial.
        number, at = np.nonzero(~far & (times[:, None] > self.start))
        here = times[number]
        low = np.sqrt(np.maximum(here - self.end[at], 0.0))
        high = np.sqrt(here - self.start[at])
        u = 0.5 * (low + high)[:, None] + 0.5 * (high - low)[:, None] * NODES
        x = 2.0 * (here[:, None] - u * u - self.start[at, None]) / self.length[at, None] - 1.0
        flow = np.einsum("rkd,rd->rk", legendre.legvander(x, NODES.size - 1), self.series[at])
        np.add.at(found, number, (high - low) * (flow @ WEIGHTS))
        return np.asarray(found)

    def _places(self, times: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
        """The interval of each time, and the position in it, -1 to 1."""
        at = np.clip(np.searchsorted(self.start, times, side="right") - 1, 0, self.start.size - 1)
        x = 2.0 * (times - self.start[at]) / self.length[at] - 1.0
        return at, np.clip(x, -1.0, 1.0)


def temperature(
    response: xr.Dataset,
    disc: LumpedDisc | SemiInfiniteDisc,
    contact: str | None = None,
    share: float = 1.0,
) -> xr.Dataset:
    """Temperature rise of a disc from the heat of a contact.

    The coupling is one-way: the temperature affects neither the friction nor the motion. Cooling
    is not modelled. The run is repeated, and the heat flow is computed from the exact motion, not
    from the samples of the response.

    Parameters
    ----------
    response : xarray.Dataset
        As returned by ``simulate``.
    disc : LumpedDisc or SemiInfiniteDisc
        Thermal model of the disc.
    contact : str
        Name of the contact; default: the only one.
    share : float
        Fraction of the heat that flows into this disc, 0 to 1; the rest heats the pads or another
        disc.

    Returns
    -------
    xarray.Dataset
        Over the times of the response: power [W] and heat [J] into the disc, and temperature [K],
        the rise at its surface. peak_temperature [K] and peak_time [s] are those of the exact
        motion, also between the samples.

    Raises
    ------
    InputError
        If ``response`` is another dataset, ``contact`` is unknown, or ``disc`` is not a disc.
    """
    example = "a disc, for example wb.LumpedDisc(mass=8.0, specific_heat=500.0)"
    check_instance("disc", disc, LumpedDisc | SemiInfiniteDisc, example)
    check_number("share", share, 0.0, 1.0)
    machine, task = run_of(response)
    names = [one.name for one in machine.contacts]
    place = _place(contact, names)
    motion = machine_series(machine, task, solved(machine, task))
    if not motion.start.size:
        raise InputError("response: lasts 0 s. Simulate a longer time.")
    flow = _Flow(motion.start, motion.length, share * motion.power[..., place])
    rise = _rise(disc, flow)
    times = response["time"].to_numpy()
    peak_time = _peak(rise, np.union1d(motion.start, [*times, task.end]))
    return _dataset(
        times, flow, rise, peak_time,
        {"contact": names[place], "disc": repr(disc), "share": share, "start": task.start,
         **attributes(response, "status")},
    )  # fmt: skip


def _place(contact: str | None, names: list[str]) -> int:
    if contact is None and len(names) == 1:
        return 0
    if contact not in names:
        raise unknown("contact", contact, names, "no such contact of the response")
    return names.index(contact)


def _rise(disc: LumpedDisc | SemiInfiniteDisc, flow: _Flow) -> Callable[[FloatArray], FloatArray]:
    """The temperature rise at an array of times."""
    if isinstance(disc, LumpedDisc):
        capacity = disc.mass * disc.specific_heat
        return lambda times: flow.heat(times) / capacity
    scale = disc.effusivity * disc.area * np.sqrt(np.pi)
    return lambda times: flow.memory(times) / scale


def _peak(rise: Callable[[FloatArray], FloatArray], times: FloatArray) -> float:
    """Time of the highest temperature, given times between which it has no other maximum."""
    from scipy.optimize import minimize_scalar

    values = rise(times)
    top = int(np.argmax(values))
    low, high = times[max(top - 1, 0)], times[min(top + 1, times.size - 1)]
    if high == low:
        return float(times[top])
    found = minimize_scalar(
        lambda time: -rise(np.array([time]))[0], bounds=(low, high), method="bounded",
        options={"xatol": _TOLERANCE * (high - low)},
    )  # fmt: skip
    return float(found.x if -found.fun > values[top] else times[top])


def _dataset(
    times: FloatArray,
    flow: _Flow,
    rise: Callable[[FloatArray], FloatArray],
    peak_time: float,
    attrs: dict[str, object],
) -> xr.Dataset:
    import xarray as xr

    highest, text = rise(np.array([peak_time]))[0], "temperature rise at the surface of the disc"
    found = xr.Dataset(
        {
            "power": labelled("time", flow.power(times), "W", "heat flow into the disc"),
            "heat": labelled("time", flow.heat(times), "J", "heat that has flowed into the disc"),
            "temperature": labelled("time", rise(times), "K", text),
            "peak_temperature": labelled((), highest, "K", "highest temperature rise"),
            "peak_time": labelled((), peak_time, "s", "time of the highest temperature"),
        },
        coords={"time": labelled("time", times, "s", "time")},
    )
    found.attrs = {"kind": "temperature", **attrs}
    return found

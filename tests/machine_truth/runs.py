"""Returns of a machine by ``wb.simulate`` alone.

The state is seen through the speeds, the shafts' torques and the actuators' forces, which fix it
but for rotations that nothing restrains.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

import wedgebrake as wb
from machine_reference import shaft_matrices

FloatArray = NDArray[np.float64]

COMPLETED = "completed"
# Fewest events of a kind that serve as a section, and their share of the most frequent kind.
_FEWEST, _SHARE = 60, 0.2
# Least scale of a column, as a share of the largest one: what hardly moves is rounding.
_LEAST = 1e-2


def time_unit(machine: wb.Machine) -> float:
    """Period of the signals or, without any that vary, of the slowest free vibration [s]."""
    if machine.period:
        return float(machine.period)
    names = [one.name for one in machine.inertias]
    shafts = [
        (names.index(one.a), -1 if one.b == "ground" else names.index(one.b),
         one.stiffness, one.damping, one.ratio)
        for one in machine.shafts
    ]  # fmt: skip
    stiffness, _ = shaft_matrices(len(names), shafts)
    inertia = np.diag([one.inertia for one in machine.inertias])
    squares = eigh(stiffness, inertia, eigvals_only=True)
    restrained = squares[squares > 1e-9 * max(squares[-1], 1e-300)]
    return 2.0 * math.pi / math.sqrt(restrained[0]) if restrained.size else 2.0 * math.pi


def seen(response: Any) -> FloatArray:
    """(times, k) what is seen of the states."""
    columns = [response[name].values for name in ("velocity", "shaft_torque", "actuation_force")]
    return np.column_stack(columns)


class Returns(NamedTuple):
    """(r, k) what is seen of the states at returns, their times, and a scale for each column."""

    states: FloatArray
    times: FloatArray
    scale: FloatArray


class Block(NamedTuple):
    """A part of a run: how it ended, its returns, samples, their times, events and its end."""

    end: str
    returns: Returns
    samples: FloatArray
    times: FloatArray
    sticking: NDArray[np.bool_]
    events: int
    start: wb.FinalState | None
    final: wb.FinalState


class Machine:
    """A machine whose run is continued block by block."""

    def __init__(self, machine: wb.Machine) -> None:
        self.machine, self.unit = machine, time_unit(machine)
        self.driven = bool(machine.period)

    def block(self, start: wb.FinalState | None, units: int) -> Block:
        """Run so many units of time."""
        begin = start.time if start else 0.0
        first = round(begin / self.unit)
        instants = (first + np.arange(units + 1)) * self.unit
        instants = instants[(instants >= begin)]
        # A sixteenth of the last units shows the size of the motion.
        close = np.linspace(instants[max(-61, -len(instants))], instants[-1], 1800)
        times = np.unique(np.concatenate([instants, close]))
        response = self.run(start, times)
        samples, status = seen(response), response.attrs["status"]
        here = response["time"].values
        inside, late = np.isin(here, instants), here >= close[0]
        span = np.ptp(samples[late], axis=0) if late.any() else np.ones(samples.shape[1])
        span = np.maximum(span, _LEAST * max(float(span.max()), 1e-300))
        final = wb.final_state(response)
        returns = Returns(samples[inside], here[inside], span)
        if not self.driven and status == COMPLETED:
            returns = self._at_events(start, response, span)
        sticking = response["sticking"].values[late].astype(bool)
        return Block(
            status, returns, samples[late], here[late], sticking, response["event_time"].size,
            start, final,
        )  # fmt: skip

    def run(self, start: wb.FinalState | None, times: FloatArray) -> Any:
        """A response at the times [s], from a state."""
        begin = start.time if start else 0.0
        return wb.simulate(self.machine, times[-1] - begin, times=times, initial=start)

    def _at_events(self, start: wb.FinalState | None, response: Any, span: FloatArray) -> Returns:
        """The states at the rarest kind of event that is not rare."""
        names = ("event_contact", "event_kind", "event_before", "event_after")
        labels = np.column_stack([response[name].values.astype(int) for name in names])
        nothing = Returns(np.empty((0, span.size)), np.empty(0), span)
        if not len(labels):
            return nothing
        kinds, number, counts = np.unique(labels, axis=0, return_inverse=True, return_counts=True)
        enough = counts >= max(_FEWEST, _SHARE * counts.max())
        if not enough.any():
            return nothing
        chosen = int(np.flatnonzero(enough)[counts[enough].argmin()])
        del kinds
        times = np.unique(response["event_time"].values[number.ravel() == chosen])
        times = times[times > (start.time if start else 0.0)]
        return Returns(seen(self.run(start, times)), times, span)

    def moved(self, state: wb.FinalState, change: float) -> wb.FinalState:
        """A state with other angles and forces, in which the contacts are as they were."""
        rng = np.random.default_rng(7)
        angles = {name: one + change * rng.normal() for name, one in state.angles.items()}
        forces = tuple(one * (1.0 + change * rng.normal()) for one in state.actuators)
        return dataclasses.replace(state, angles=angles, actuators=forces)

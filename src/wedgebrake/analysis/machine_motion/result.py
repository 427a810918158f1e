"""Result of the run of a machine: class of motion, returns, and sums over contacts."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import MotionClass, Outcome, StickClass
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.passage import Passage
from wedgebrake.solvers.machine.trajectory.watch import QuantityRows

# Largest share of slip in a record that counts as rest.
_NO_SLIP = 1e-9


@dataclass
class ContactSums:
    """Sticks, torques and losses, in arrays over the contacts.

    stick_class : (m,) of ``StickClass``
    sticks      : (m, 2) sticks per return, entered from v > 0 and from v < 0
    stick_share, peak_torque, friction_power : (m,) share of time, [N m], [W]
    """

    stick_class: NDArray[np.int64]
    sticks: FloatArray
    stick_share: FloatArray
    peak_torque: FloatArray
    friction_power: FloatArray

    @classmethod
    def none(cls, contacts: int) -> ContactSums:
        """Placeholder where nothing is known about the contacts."""
        unknown = np.full(contacts, math.nan)
        classes = np.full(contacts, int(StickClass.NONE), np.int64)
        return cls(classes, np.full((contacts, 2), math.nan), unknown, unknown, unknown)

    @classmethod
    def steady(cls, sliding: FloatArray, torque: FloatArray) -> ContactSums:
        """The sums at constant sliding speeds [rad/s] and torques [N m], each (m,)."""
        rest = sliding == 0.0
        classes = np.where(rest, StickClass.AT_REST, StickClass.NON_STICK_SLIP)
        sticks = np.zeros((sliding.size, 2))
        return cls(classes, sticks, rest.astype(float), np.abs(torque), -torque * sliding)

    @classmethod
    def of(cls, passage: Passage) -> ContactSums:
        """The sums over a passage with details."""
        time, returns = max(passage.duration, 1e-300), max(len(passage.times), 1)
        share = np.minimum(passage.stick_time / time, 1.0)
        classes = StickClass.NON_STICK_SLIP + (passage.sticks > 0).sum(axis=1)
        classes[share >= 1.0 - _NO_SLIP] = StickClass.AT_REST
        power = passage.heat / time
        return cls(classes, passage.sticks / returns, share, passage.peak_torque, power)


class Vibration(NamedTuple):
    """Root mean squares and peaks of a motion, of the inertias (n,) and of the contacts (m,).

    rms_velocity, rms_torque : about the mean [rad/s], [N m]
    rms_acceleration, peak_acceleration, rms_jerk, peak_jerk : [rad/s^2], [rad/s^3]; the jerk
        excludes the jumps of the acceleration
    """

    rms_velocity: FloatArray
    rms_acceleration: FloatArray
    peak_acceleration: FloatArray
    rms_jerk: FloatArray
    peak_jerk: FloatArray
    rms_torque: FloatArray

    @classmethod
    def constant(cls, inertias: int, contacts: int, value: float) -> Vibration:
        """The same value for all: 0 in a steady state, nan where nothing is known."""
        still = np.full(inertias, value)
        return cls(still, still, still, still, still, np.full(contacts, value))

    @classmethod
    def of(cls, passage: Passage, inertias: int) -> Vibration:
        """The vibration of a passage that recorded the quantities of ``vibration_rows``."""
        rms, peak = passage.quantities
        n = inertias
        return cls(
            rms[:n], rms[n : 2 * n], peak[n : 2 * n], rms[2 * n : 3 * n], peak[2 * n : 3 * n],
            rms[3 * n :],
        )  # fmt: skip


def vibration_rows(inertias: int, contacts: int, states: int) -> QuantityRows:
    """Speeds, accelerations and jerks of the inertias, and torques of the contacts."""
    n, m = inertias, contacts
    speeds = np.eye(states)[n : 2 * n]
    return QuantityRows(
        np.vstack([speeds, speeds, speeds, np.zeros((m, states))]),
        np.concatenate([np.full(3 * n, -1), np.arange(m)]),
        np.concatenate([np.repeat([0, 1, 2], n), np.zeros(m, int)]),
    )


@dataclass
class MachineResult:
    """Class of the motion of a machine, with its evidence; see ``Motion``.

    period      : of the motion [s]
    exponents   : (p,) Lyapunov exponents, descending [1/s]
    size        : sum of half the ranges of the scaled coordinates [rad/s]
    low, high   : (states,) extremes of the states
    points, times : (r + 1, states), (r + 1,) recorded returns
    self_excited : whether returns are crossings instead of periods of signals
    last        : the last passage of the run
    """

    exponents: FloatArray
    contacts: ContactSums
    vibration: Vibration
    outcome: Outcome = Outcome.COMPLETED
    motion: MotionClass = MotionClass.UNDECIDED
    order: int = 0
    period: float = math.nan
    exponent_error: float = math.nan
    return_distance: float = math.nan
    size: float = math.nan
    transient: int = 0
    settling: float = math.nan
    judged: int = 0
    events: int = 0
    self_excited: bool = False
    last: Passage | None = None
    low: FloatArray = field(default_factory=lambda: np.empty(0))
    high: FloatArray = field(default_factory=lambda: np.empty(0))
    points: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    times: FloatArray = field(default_factory=lambda: np.empty(0))

    @cached_property
    def final(self) -> FinalState | None:
        """State at the end of the run; None if it has not begun."""
        return None if self.last is None else self.last.final


def with_free_angle(exponents: FloatArray) -> FloatArray:
    """Exponents of one inertia with that of its angle, which is 0 without a spring, (p,)."""
    if exponents.size != 1:
        return exponents
    return np.array([exponents[0], 0.0] if exponents[0] > 0.0 else [0.0, exponents[0]])

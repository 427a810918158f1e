"""Whether a response obeys the laws of friction and the balances of torques and of energy."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.responses.energy import energy
from wedgebrake.analysis.responses.machine_energy import energy_of_parts
from wedgebrake.analysis.responses.repeat import complete, repeated, run_of
from wedgebrake.analysis.responses.segments import of_series
from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import EventKind
from wedgebrake.errors import InputError
from wedgebrake.model.characteristic import characteristic
from wedgebrake.model.elements import element_loads
from wedgebrake.model.friction import SetValuedFriction, SmoothFriction
from wedgebrake.model.joints import accelerations
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import contact_rows, masses, shaft_matrices, shaft_rows
from wedgebrake.model.machine_parts import GROUND, Contact
from wedgebrake.model.signals.signals import Signal, as_signal
from wedgebrake.model.studies.study_run import METHODS
from wedgebrake.model.validation import wrong
from wedgebrake.solvers.machine.assemble import HELD
from wedgebrake.solvers.response import driven_accelerations, shaft_torques
from wedgebrake.solvers.smooth.laws import friction_law

if TYPE_CHECKING:
    import xarray as xr

# Rounding of a speed relative to the largest one, and of the speed at an event, whose time is
# rounded too.
_ROUNDING, _NEARLY = 1e-12, 1e-10
# Rounding of a torque and of an acceleration relative to itself, and of energy exchanged.
_RELATIVE = 1e-9
# Share of the torque of the actuation forces that counts as a torque where no others act.
_PRESSED = 1e-6
# Rounding of the stored energy.
_STORED = 1e-13
# Largest energy residual of a smooth law that is integrated between samples.
_BETWEEN_SAMPLES = 1e-2
# Time in which the largest torque gives a machine that stands the speed it is compared with [s].
_STANDING = 1e-3
# A sliding velocity that is not 0 [rad/s].
_LEAST = 1e-300
# Time from a knot of a signal within which its value may be that before or after [s].
_KNOT = 1e-9
# Weights of a central difference of sixth order, and its step relative to 1/rate and to the
# distance of the next knot.
_WEIGHTS, _STEP, _INSIDE = (0.75, -0.15, 1.0 / 60.0), 1e-2, 0.3
_EPSILON, _LARGEST = 2.0**-52, float(np.finfo(float).max)
_WORKS = (
    "torque_work", "control_work", "drive_work", "base_work", "friction_heat", "viscous_loss",
    "stored_change",
)  # fmt: skip

_Mask = NDArray[np.bool_]


class Violation(NamedTuple):
    """A law that a response violates at a time.

    time    : [s]
    contact : name of the contact, or of a shaft or an inertia; empty for "energy"
    law     : one of those that ``check`` lists
    found, allowed : the quantity that ``check`` states for the law, and its largest allowed value
    """

    time: float
    contact: str
    law: str
    found: float
    allowed: float


class Examination(NamedTuple):
    """The violations, and what was examined.

    residual, exchanged : of the energy balance [J]; nan where it cannot be computed
    """

    violations: list[Violation]
    events: int
    samples: int
    residual: float
    exchanged: float


def check(response: xr.Dataset) -> list[Violation]:
    """The laws that a response violates, at its samples and at every event.

    The run is repeated, as for ``energy``, and evaluated at the samples and just before, at and
    just after every event. In the repeated motion and in the samples of the response,

    - "finite": angles, speeds, torques and forces are finite (found: the value);
    - "opposes": friction does not act along the sliding velocity, where the actuation force is not
      negative (found: torque along it [N m]);
    - "friction": the torque is that of the friction law and the brake at the sliding velocity and
      the actuation force (found: distance from it [N m]);
    - "sliding velocity": it follows from the speeds of the bodies and of the base (found:
      difference [rad/s]);
    - "stick": a contact that sticks does not slide, so that bodies that stick together have one
      speed (found: sliding velocity [rad/s]; allowed is 0 for a contact with the ground whose base
      does not move, rounding for others);
    - "limit": the torque of a contact that sticks is within the holding limit (found: its magnitude
      [N m]);
    - "balance": the torques on the bodies of a contact that sticks give them the acceleration of
      the base or of each other (found: difference [rad/s^2]);
    - "events": a contact sticks in the intervals of the response's sticks and nowhere else, and
      these begin and end at events (found: 1 for an event or a sticking contact, 0 for none);
    - "shaft": the torque of a shaft of a machine follows from its twist (found: difference [N m]);
    - "energy": the residual of the energy balance is rounding, 1e-9 of the energy exchanged, or
      for smooth laws of a ``BrakedDriveline``, integrated between the samples, 1e-2 of it (found:
      residual [J]). It is left out if the response has no whole period or too few samples.

    With a smooth friction law, a ``BrakedDriveline`` never sticks exactly: only the law of friction
    then applies. Speeds below 1e-10 of the largest one may have either sign, and torques are
    compared with a relative tolerance of 1e-9. Where a shaft with a gap and damping comes into
    contact its torque jumps: "limit" and "balance" are not examined within 1e-9 s of such events.

    Parameters
    ----------
    response : xarray.Dataset
        As returned by ``simulate``, by the methods "exact" and "smooth".

    Returns
    -------
    list of Violation
        Tuples (time, contact, law, found, allowed), in order of time; empty if nothing is wrong.

    Raises
    ------
    InputError
        For a dataset that is not a response, for parts without a name in study files, and for
        responses of ``wb.paper.ode14x``, whose sticks are passages through a band of speeds.
    """
    return examine(response).violations


def examine(response: xr.Dataset) -> Examination:
    """``check``, with the numbers of events and samples and the residual of the energy balance."""
    run = _run_of(response)
    seen = repeated(response, np.empty(0))
    events = seen["event_time"].to_numpy()
    around = [np.nextafter(events, -np.inf), events, np.nextafter(events, np.inf)]
    samples = response["time"].to_numpy()
    times = np.unique(np.concatenate([samples, *around]))
    again = repeated(response, times[(times >= run.start) & (times <= run.end)])
    given, exact = complete(response), _motion(again)
    laws = _Laws(run, exact, events[_jump(run.machine, seen)])
    found = [*laws.violations(_motion(given)), *laws.violations(exact)]
    found += [*_listed(run, given), *_listed(run, again)]
    residual, exchanged, faults = _energy(laws, response)
    ordered = sorted({*found, *faults}, key=lambda one: (one.time, one.contact, one.law))
    return Examination(ordered, events.size, samples.size, residual, exchanged)


def _jump(machine: Machine, response: xr.Dataset) -> _Mask:
    """Whether a torque jumps at each event: of a gap with damping, where contact begins."""
    damped = [one.name for one in machine.shafts if one.gap is not None and one.damping > 0.0]
    if not damped:
        return np.zeros(response.sizes["event"], bool)
    return np.isin(response["event_part"].to_numpy(), damped)


_VARIABLES = (
    "time", "angle", "velocity", "torque", "brake_torque", "actuation_force", "sliding_velocity",
    "sticking", "shaft_torque",
)  # fmt: skip


class _Motion(NamedTuple):
    """A motion at k times: arrays (k, inertias), (k, contacts) and, the last, (k, shafts)."""

    time: FloatArray
    angle: FloatArray
    velocity: FloatArray
    load: FloatArray
    torque: FloatArray
    force: FloatArray
    sliding: FloatArray
    sticking: _Mask
    shaft: FloatArray


class _Run(NamedTuple):
    """The run of a response.

    rests : whether contacts come to rest exactly
    """

    machine: Machine
    method: str
    start: float
    end: float
    rests: bool


def _run_of(response: xr.Dataset) -> _Run:
    """The run of a response."""
    machine, task = run_of(response)
    method = str(response.attrs["method"])
    if method not in METHODS:
        raise wrong(
            "response.method", method, "'exact' or 'smooth'",
            "The fixed-step scheme replaces sticks by a band of speeds; use wb.simulate.",
        )  # fmt: skip
    rests = method == "exact" or of_series(response)
    return _Run(machine, method, task.start, task.end, rests)


def _motion(response: xr.Dataset) -> _Motion:
    """The motion of a response that is complete."""
    found = [response[name].to_numpy() for name in _VARIABLES]
    motion = _Motion._make(found)
    # Contacts without an actuation force state their torques, which are those for 1 N.
    force = np.where(np.isnan(motion.force), 1.0, motion.force)
    return motion._replace(force=force, sticking=response["sticking"].to_numpy().astype(bool))


class _Laws:
    """The laws of a machine, with the sizes of the quantities of a motion that rounding refers to.

    speed : largest speed [rad/s]
    stored : largest kinetic and elastic energy [J]
    terms : (inertias,) largest sum of the magnitudes of the torques on each [N m]
    jumps : times at which the torque of a shaft jumps [s]
    """

    def __init__(self, run: _Run, motion: _Motion, jumps: FloatArray) -> None:
        self.run, self.machine = run, run.machine
        self.rows, self.shafts = contact_rows(run.machine), shaft_rows(run.machine)
        self.stiffness, self.damping = shaft_matrices(run.machine)
        self.linear = shaft_matrices(run.machine, linear=True)
        self.radii = np.array([one.brake.radius for one in run.machine.contacts])
        self.inertia = np.array([one.inertia for one in run.machine.inertias])
        self.masses = masses(run.machine)
        self.bases = [as_signal(one.base_speed) for one in run.machine.contacts]
        self.torques = [_torque_law(one, run.method) for one in run.machine.contacts]
        signals = run.machine.signals().values()
        knots = [one.knots(run.start, run.end) for one in signals]
        self.knots = np.unique(np.concatenate([[run.start, run.end], *knots]))
        self.jumps = jumps
        with np.errstate(over="ignore", invalid="ignore"):
            terms = np.abs(motion.load) + np.abs(motion.angle) @ np.abs(self.stiffness)
            terms += np.abs(motion.velocity) @ np.abs(self.damping)
            terms += np.abs(motion.torque) @ np.abs(self.rows)
            terms += _PRESSED * np.abs(motion.force * self.radii) @ np.abs(self.rows)
            turned = np.abs(motion.angle)
            stored = 0.5 * np.sum(turned @ np.abs(self.stiffness) * turned, axis=1)
            stored += 0.5 * motion.velocity**2 @ self.masses
        self.terms = np.max(terms, axis=0, where=np.isfinite(terms), initial=0.0)
        self.stored = float(np.max(stored, where=np.isfinite(stored), initial=0.0))
        speeds = np.column_stack([motion.velocity, *(one(motion.time) for one in self.bases)])
        fastest = float(np.max(np.abs(speeds), where=np.isfinite(speeds), initial=0.0))
        self.speed = max(2.0 * fastest, _STANDING * float(np.max(self.terms / self.inertia)))

    def violations(self, motion: _Motion) -> Iterator[Violation]:
        """All violations of a motion; states that are not finite are not examined further."""
        inertias, contacts, shafts = (
            [one.name for one in parts]
            for parts in (self.machine.inertias, self.machine.contacts, self.machine.shafts)
        )
        finite = np.ones(motion.time.size, bool)
        of = (inertias, inertias, inertias, contacts, contacts, contacts, contacts, shafts)
        for names, values in zip(of, motion[1:], strict=True):
            finite &= np.isfinite(values).all(axis=1)
            for name, column in zip(names, values.T, strict=True):
                yield from _listing("finite", name, motion.time, np.abs(column), _LARGEST)
        motion = _Motion._make(values[finite] for values in motion)
        twisted = shaft_torques(self.machine, motion.angle, motion.velocity)
        rounding = _ROUNDING * np.abs(self.shafts) @ self.terms
        for j, shaft in enumerate(self.machine.shafts):
            apart = np.abs(motion.shaft[:, j] - twisted[:, j])
            yield from _listing("shaft", shaft.name, motion.time, apart, rounding[j])
        load = motion.load - motion.angle @ self.linear[0] - motion.velocity @ self.linear[1]
        load += element_loads(self.machine, "shaft", motion.time, motion.angle, motion.velocity)
        load += np.array([one.preload for one in self.machine.shafts]) @ self.shafts
        driven = self._driven(motion.time)
        acceleration = accelerations(self.machine, load - motion.torque @ self.rows, driven)
        for j, contact in enumerate(self.machine.contacts):
            yield from self._of_contact(motion, acceleration @ self.rows[j], j, contact)

    def _driven(self, time: FloatArray) -> FloatArray:
        """Accelerations of driven bodies, which matter where joints connect others to them."""
        return (
            driven_accelerations(self.machine, time)
            if self.machine.joints
            else np.zeros((time.size, self.inertia.size))
        )

    def _of_contact(
        self, motion: _Motion, acceleration: FloatArray, j: int, contact: Contact
    ) -> Iterator[Violation]:
        """The violations of a contact; ``acceleration`` is that of its bodies [rad/s^2]."""
        time, base = motion.time, self.bases[j]
        torque, force, given = (one[:, j] for one in (motion.torque, motion.force, motion.sliding))
        rest = motion.sticking[:, j] & self.run.rests
        size, room = self.speed, _ROUNDING * float(np.max(self.terms))

        def listed(law: str, rows: _Mask, found: FloatArray, allowed: Any) -> Iterator[Violation]:
            where = np.broadcast_to(allowed, time.shape)
            return _listing(law, contact.name, time[rows], found[rows], where[rows])

        sliding = motion.velocity @ self.rows[j] - base(time)
        yield from listed("sliding velocity", ~rest, np.abs(given - sliding), _ROUNDING * size)
        exact = contact.b == GROUND and not base.bound
        slip = np.maximum(np.abs(sliding), np.abs(given))
        yield from listed("stick", rest, slip, 0.0 if exact else _ROUNDING * size)

        # A law may rise or fall towards rest: a speed that is rounding is that on both sides of it.
        near, rounding = np.abs(sliding) <= _NEARLY * size, _NEARLY * size
        least = np.maximum(np.abs(sliding), _LEAST)
        speeds = [sliding - rounding, sliding + rounding]
        speeds += [np.where(near, side * least, sliding) for side in (1.0, -1.0)]
        ends = np.array([self.torques[j](one, force) for one in speeds])
        low, high = np.fmin.reduce(ends), np.fmax.reduce(ends)
        along = -np.sign(sliding) * torque
        against = near | (force < 0.0) | (along <= room)
        yield from listed("opposes", ~rest & ~against, along, room)
        apart = np.maximum(np.maximum(low - torque, torque - high), 0.0)
        yield from listed("friction", ~rest & against, apart, room + _RELATIVE * np.abs(torque))

        law = contact.friction
        peak = law.breakaway if isinstance(law, SetValuedFriction) else HELD
        gains = [contact.brake.amplification(side * peak) for side in (1.0, -1.0)]
        gain = contact.brake.radius * np.abs(np.where(torque > 0.0, *gains))
        limit = np.multiply(gain, force, where=force > 0.0, out=np.zeros_like(force))
        # A brake that locks itself may hold at the instant at which its force comes to or from 0.
        beside = np.maximum(np.append(force[1:], 0.0), np.append(0.0, force[:-1]))
        limit[np.isinf(gain) & (beside > 0.0)] = np.inf
        # Where the torque of a shaft jumps, a contact may hold and slip at one instant.
        rest &= _distance(self.jumps, time) > _KNOT
        yield from listed("limit", rest, np.abs(torque), limit * (1.0 + _RELATIVE) + room)

        away = _distance(self.knots, time)
        held = rest & (away > _KNOT)
        rate, error = _rates(base, time, np.where(held, away, 0.0))
        sizes = float(np.abs(self.rows[j]) @ (self.terms / self.inertia)) + np.abs(rate)
        yield from listed("balance", held, np.abs(acceleration - rate), _RELATIVE * sizes + error)


def _distance(points: FloatArray, time: FloatArray) -> FloatArray:
    """Distance of times from the nearest of some ascending ones."""
    ends = np.concatenate([[-np.inf], points, [np.inf]])
    after = np.searchsorted(ends, time)
    return np.asarray(np.minimum(time - ends[after - 1], ends[after] - time))


def _listing(
    law: str, contact: str, time: FloatArray, found: FloatArray, allowed: Any
) -> Iterator[Violation]:
    """The violations among quantities at some times."""
    most = np.broadcast_to(allowed, time.shape)
    for k in np.flatnonzero(~(found <= most)):
        yield Violation(float(time[k]), contact, law, float(found[k]), float(most[k]))


def _torque_law(contact: Contact, method: str) -> Callable[[FloatArray, FloatArray], FloatArray]:
    """The torque of a sliding contact, from sliding velocities and forces [N m]."""
    brake, friction, given = contact.brake, contact.friction, contact.actuation
    lined = isinstance(friction, SetValuedFriction) and not friction.constant
    if method == "exact" and lined and not given.begins_released:
        lines = characteristic(brake, cast("SetValuedFriction", friction), given)
        return lambda speed, _: lines.torque(speed)

    def coefficient(speed: FloatArray) -> FloatArray:
        if not isinstance(friction, SetValuedFriction):
            law, shape = friction_law(cast("SmoothFriction", friction))
            return np.array([law(one, shape) for one in speed.tolist()])
        size, found = np.abs(speed), np.full(speed.shape, friction.reference)
        if not friction.constant and friction.is_curve:
            found = np.array([friction.kinetic_at(one) for one in size.tolist()])
        elif not friction.constant:
            found = np.interp(size, *np.transpose(friction.nodes()))
        return np.asarray(np.copysign(found, speed))

    def torque(speed: FloatArray, force: FloatArray) -> FloatArray:
        values, which = np.unique(coefficient(brake.radius * speed), return_inverse=True)
        gain = brake.radius * np.array([brake.amplification(one) for one in values.tolist()])
        gains = gain[which] if speed.size else speed
        return np.multiply(gains, force, where=force != 0.0, out=np.zeros_like(force))

    return torque


def _rates(signal: Signal, time: FloatArray, away: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The rates of change of a signal, from differences between its knots, and their rounding.

    away : distance of the next knot [s]; where it is 0, no rate is found
    """
    if not signal.varies:
        return np.zeros_like(time), np.zeros_like(time)
    step = np.minimum(_INSIDE * away, _STEP / max(signal.rate, _STEP))
    change = np.zeros_like(time)
    for number, weight in enumerate(_WEIGHTS, start=1):
        change += weight * (signal(time + number * step) - signal(time - number * step))
    rate = np.divide(change, step, where=step > 0.0, out=change)
    error = _EPSILON * (4.0 * signal.bound + np.abs(rate * time))
    return rate, np.divide(error, step, where=step > 0.0, out=error)


def _listed(run: _Run, response: xr.Dataset) -> Iterator[Violation]:
    """Samples that do not agree with the sticks, and sticks that do not agree with the events."""
    time, event, kind = (response[name].to_numpy() for name in ("time", "event_time", "event_kind"))
    samples = response["sticking"].to_numpy().astype(bool)
    for j, contact in enumerate(run.machine.contacts):
        own = response["stick_contact"].to_numpy() == j
        mine = response["event_contact"].to_numpy() == j
        start, end, entry, left = (
            response[f"stick_{name}"].to_numpy()[own] for name in ("start", "end", "entry", "exit")
        )
        # Times of events are rounded, and the start is the end of a stick that is not listed.
        early, late = (np.nextafter(np.nextafter(time, way), way) for way in (-np.inf, np.inf))
        inside = np.searchsorted(start, early) > np.searchsorted(end, late, side="right")
        within = np.searchsorted(start, late, side="right") > np.searchsorted(end, early)
        within |= early <= run.start
        sticks = samples[:, j]
        bad = [(float(t), True) for t in time[sticks & ~within]]
        bad += [(float(t), False) for t in time[inside & ~sticks]]
        for of, ends in ((EventKind.STICK, start[entry != 0]), (EventKind.SLIP, end[left != 0])):
            if run.rests:
                listed = event[mine & (kind == of)]
                bad += [(float(t), bool(np.isin(t, listed))) for t in np.setxor1d(listed, ends)]
        for at, found in bad:
            yield Violation(at, contact.name, "events", float(found), float(not found))


def _energy(laws: _Laws, response: xr.Dataset) -> tuple[float, float, list[Violation]]:
    """Residual of the energy balance and energy exchanged [J], and its violation."""
    run = laws.run
    if of_series(response):
        found = energy_of_parts(response)
        parts = [found[name].to_numpy() for name in _WORKS if name in found]
        exchanged = float(sum(np.abs(one).sum() for one in parts))
        at, residual = run.end, abs(float(found["residual"]))
        allowed = _RELATIVE * exchanged + 10.0 * float(found["rounding"]) + _STORED * laws.stored
    else:
        try:
            found = energy(response)
        except InputError:  # no whole period, or samples too far apart
            return np.nan, np.nan, []
        worst = int(np.abs(found["residual"].to_numpy()).argmax())
        at = float(found["time"][worst])
        residual = abs(float(found["residual"][worst]))
        error = found.attrs["error"]
        exchanged = residual / error if error else 0.0
        allowed = (_RELATIVE if run.method == "exact" else _BETWEEN_SAMPLES) * exchanged
    wrong_at = [] if residual <= allowed else [Violation(at, "", "energy", residual, allowed)]
    return residual, exchanged, wrong_at

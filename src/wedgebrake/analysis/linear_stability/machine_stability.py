"""Linear stability of a machine: every case of steady sliding, with its modes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from wedgebrake.analysis.linear_stability.controllers import command_loads, commanded_actuation
from wedgebrake.analysis.linear_stability.equilibrium import about_equilibrium
from wedgebrake.analysis.linear_stability.linear_system import (
    Mechanics,
    linear_system,
    mechanics,
)
from wedgebrake.analysis.linear_stability.modes import Mode, growth_of, spectrum_of
from wedgebrake.analysis.linear_stability.sliding_contact import (
    CURVE,
    Method,
    SlidingContact,
    frozen,
    linearised,
)
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.display import Result
from wedgebrake.model.joints import with_followers
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import contact_rows
from wedgebrake.model.signals.signals import Signal
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.torque_contacts import TorqueContact
from wedgebrake.model.validation import check_number, is_number, unknown, wrong

# Relative size below which a difference of speeds is rounding error: the contact is at rest.
_STANDS = 1e-12
_FASTEST = 1e12
# Largest number of contacts at rest, each of which doubles the number of cases.
_MOST_STANDING = 10


@dataclass(frozen=True, repr=False)
class SlidingCase(Result):
    """Linear stability of one case of steady sliding.

    contacts    : the linearised contacts
    speeds      : sliding speed of each contact, by name [rad/s]; 0 for the limit near rest
    modes       : one for each real eigenvalue and each pair of complex ones, the fastest-growing
                  first, rigid ones last
    eigenvalues : all of them [1/s], the largest real part first; with samples the logarithms of the
                  non-zero multipliers over the sample time
    multipliers : factors from sample to sample, the largest magnitude first; None without samples
    growth_rate : largest growth rate of the modes that are not rigid [1/s]; -inf if there are none
    stable      : True if all modes that are not rigid decay; False if all modes are rigid, or none
                  exist
    state       : "decays", "grows" or "does not decay"
    rounding    : growth rates up to this magnitude are rounding errors [1/s]

    If a contact is ``locked``, this sliding does not exist, and the fields from ``modes`` on are
    empty or None.
    """

    contacts: tuple[SlidingContact, ...]
    speeds: dict[str, float]
    modes: tuple[Mode, ...] = ()
    eigenvalues: tuple[complex, ...] = ()
    multipliers: tuple[complex, ...] | None = None
    growth_rate: float | None = None
    stable: bool | None = None
    state: str = ""
    rounding: float = 0.0

    @property
    def directions(self) -> dict[str, int]:
        """+1 (forwards) or -1 (backwards) of each contact, by name; 0 if it sticks."""
        return {one.name: one.direction for one in self.contacts}

    @property
    def forces(self) -> dict[str, float]:
        """Steady actuation force of each contact, by name [N]; nan: unknown, or no actuation."""
        return {one.name: one.force for one in self.contacts}

    @property
    def locked(self) -> tuple[str, ...]:
        """Names of the self-locking contacts; if there are any, this sliding does not exist."""
        return tuple(one.name for one in self.contacts if one.locked)

    @property
    def limited(self) -> tuple[str, ...]:
        """Names of the contacts whose force is held by a limit or by the release."""
        return tuple(one.name for one in self.contacts if one.direction and not one.follows)

    @property
    def sticking(self) -> tuple[str, ...]:
        """Names of the contacts that stick."""
        return tuple(one.name for one in self.contacts if one.direction == 0)

    def as_dict(self) -> dict[str, Any]:
        """Plain values, complex numbers as [real, imaginary] pairs."""
        plain: dict[str, Any] = {
            "directions": self.directions,
            "locked": list(self.locked),
            "limited": list(self.limited),
            "forces": self.forces,
            **vars(self),
            "modes": [one.as_dict() for one in self.modes],
        }
        del plain["contacts"]
        for name in ("eigenvalues", "multipliers"):
            if plain[name] is not None:
                plain[name] = [[one.real, one.imag] for one in plain[name]]
        return plain

    def _headline(self) -> str:
        ways = {1: "forwards", -1: "backwards"}
        places = [f"{ways[side]} at {name}" for name, side in self.directions.items() if side]
        parts = [f"sticking at {', '.join(self.sticking)}"] if self.sticking else []
        parts += [f"sliding {', '.join(places)}"] if places else []
        where = "; ".join(parts) or "without contacts"
        where = where[0].upper() + where[1:]
        if self.locked:
            verb = "locks itself" if len(self.locked) == 1 else "lock themselves"
            return f"{where}: does not exist; {' and '.join(self.locked)} {verb}."
        mode = next(iter(self.modes), None)
        if mode is None or mode.rigid:
            return f"{where}: nothing vibrates."
        if not mode.drift:
            return f"{where}: small vibration {self.state} ({_how(mode)})."
        # The speed is one question, and the vibration another.
        drift = f"{where}: the speed of a free rotation {self.state} ({mode.growth_rate:+.4g} 1/s)"
        vibrating = [one for one in self.modes if not (one.rigid or one.drift)]
        if not vibrating:
            return f"{drift}; nothing vibrates."
        state = _state(vibrating[0].growth_rate, self.rounding)
        return f"{drift}; small vibration {state} ({_how(vibrating[0])})."

    def _rows(self) -> Iterator[tuple[str, Any, str]]:
        for name, speed in self.speeds.items():
            yield f"sliding speed, {name}", speed, "rad/s"
        if self.limited:
            yield "force held by a limit or the release", ", ".join(self.limited), ""
        for number, mode in enumerate(self.modes):
            yield f"mode {number}", mode, ""


def _state(growth: float, rounding: float) -> str:
    """Course of vibration at a growth rate; rates up to ``rounding`` count as zero [1/s].

    If nothing vibrates, the rate is -inf, and a free rotation keeps any change of its speed.
    """
    if abs(growth) <= rounding or growth == -math.inf:
        return "does not decay"
    return "grows" if growth > 0.0 else "decays"


def _how(mode: Mode) -> str:
    """Frequency and growth rate of a mode."""
    how = f"{mode.frequency:.6g} Hz" if mode.frequency > 0.0 else "without oscillation"
    how += ", alternating from sample to sample" if mode.alternates else ""
    return f"{how}, {mode.growth_rate:+.4g} 1/s"


@dataclass(frozen=True, repr=False)
class Stability(Result):
    """The linear verdict on steady sliding.

    cases    : one for each combination of directions of the contacts at rest; one without these
    stable   : True if sliding exists and small vibration decays in each case that exists
    critical : the existing case whose vibration grows fastest; None if none exists
    verdict  : the above in words
    inertias : their names, in the order of the shapes
    method   : how friction that varies with the speed is linearised: "curve", by the derivative of
               its curve, or "exact", by the slope of the straight lines of the method "exact"
    held     : the case in which the contacts that stand and are pressed stick, and the others
               slide; None if there are no such contacts, if nothing can then move, and where
               ``sticking`` is given. It has no part in ``stable`` and ``critical``

    ``modes``, ``eigenvalues``, ``multipliers`` and ``growth_rate`` are those of ``critical``.
    """

    cases: tuple[SlidingCase, ...]
    stable: bool
    critical: SlidingCase | None
    verdict: str
    inertias: tuple[str, ...]
    method: Method = CURVE
    held: SlidingCase | None = None

    @property
    def modes(self) -> tuple[Mode, ...]:
        """Modes of the critical case; empty if no sliding exists."""
        return () if self.critical is None else self.critical.modes

    @property
    def eigenvalues(self) -> tuple[complex, ...]:
        """Eigenvalues of the critical case [1/s]; empty if no sliding exists."""
        return () if self.critical is None else self.critical.eigenvalues

    @property
    def multipliers(self) -> tuple[complex, ...] | None:
        """Multipliers of the critical case; None without samples."""
        return None if self.critical is None else self.critical.multipliers

    @property
    def growth_rate(self) -> float | None:
        """Largest growth rate of the critical case [1/s]; None if no sliding exists."""
        return None if self.critical is None else self.critical.growth_rate

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON; ``critical`` is the index of the case in ``cases``."""
        number = next((i for i, one in enumerate(self.cases) if one is self.critical), None)
        cases = [one.as_dict() for one in self.cases]
        held = None if self.held is None else self.held.as_dict()
        plain = {"cases": cases, "critical": number, "inertias": list(self.inertias)}
        return dict(vars(self)) | plain | {"held": held}

    def _rows(self) -> Iterator[tuple[str, Any, str]]:
        yield "stable", "yes" if self.stable else "no", ""
        for number, case in enumerate(self.cases):
            yield f"case {number}", case, ""
        if self.held is not None:
            yield "with contacts that stick", self.held, ""


def machine_stability(
    machine: Machine,
    speeds: Mapping[str, float] | Sequence[float] | None = None,
    sticking: Sequence[str] = (),
    method: Method = CURVE,
    *,
    modes: bool = True,
    corner: int = 0,
) -> Stability:
    """Linear stability of a machine about sliding at given speeds; see ``wb.stability``.

    sticking : checked names of the contacts that stick; the others slide, ``held`` is None
    modes : whether to compute modes and the verdict in words; without samples, growth rates and
            ``stable`` take a fraction of the time
    corner : side of the line at an equilibrium at a corner over an angle, -1 or 1; 0: it is refused
    """
    at = sliding_speeds(machine, speeds)
    about = _About(machine, at, tuple(sticking), method, mechanics(machine, sticking), corner)
    cases = tuple(
        _case(about, sliding, directions, modes=modes)
        for sliding, directions in _patterns(machine, at, sticking)
    )
    existing = [one for one in cases if one.stable is not None]
    critical = max(existing, key=lambda one: one.growth_rate or 0.0, default=None)
    stable = bool(existing) and all(bool(one.stable) for one in existing)
    names = tuple(one.name for one in machine.inertias)
    if not modes:
        return Stability(cases, stable, critical, "", names, method)
    words = [one._headline() for one in cases if one is critical or one.stable is None]
    more = len(existing) - 1
    if more > 0:
        words.append(
            "The other case grows no faster."
            if more == 1
            else f"The other {more} cases grow no faster."
        )
    if existing:
        words.append(conclusion(stable, existing))
    return Stability(cases, stable, critical, " ".join(words), names, method)


def conclusion(stable: bool, existing: Sequence[SlidingCase]) -> str:
    """The last sentence of a verdict."""
    grows = any(one.state == "grows" for one in existing)
    return f"Linearly {'stable' if stable else 'unstable' if grows else 'neutral'}."


def with_held(
    machine: Machine, found: Stability, speeds: Mapping[str, float] | Sequence[float] | None
) -> Stability:
    """The verdict with its ``held`` case, the case in which pressed contacts that stand stick.

    speeds : those of the verdict, see ``wb.stability``
    """
    first = found.cases[0]
    sliding = list(first.speeds.values())
    directions = tuple(
        0 if speed == 0.0 and one.force != 0.0 else one.direction
        for one, speed in zip(first.contacts, sliding, strict=True)
    )
    if all(directions):
        return found
    names = zip(machine.contact_names, directions, strict=True)
    sticks = tuple(name for name, side in names if side == 0)
    given = mechanics(machine, sticks)
    if given.basis.shape[1] == 0:  # nothing can move
        return found
    about = _About(machine, sliding_speeds(machine, speeds), sticks, found.method, given)
    held = _case(about, sliding, directions, modes=True)
    if not any(np.any(one.shape) for one in held.modes):
        return found
    return replace(found, held=held, verdict=f"{found.verdict} {held._headline()}")


def check_sticking(machine: Machine, given: Any) -> tuple[str, ...]:
    """The names of contacts that stick; ``InputError`` for anything else."""
    names = [one.name for one in machine.contacts]
    if not isinstance(given, list | tuple):
        raise wrong("sticking", given, "a list of names of contacts, for example ('clutch',)")
    for name in given:
        if name not in names:
            raise unknown("sticking", name, names, "no such contact")
    return tuple(given)


class _About(NamedTuple):
    """What is linearised.

    at       : (n,) speeds of the inertias [rad/s]
    sticking : names of the contacts that stick
    corner   : as for ``machine_stability``
    """

    machine: Machine
    at: FloatArray
    sticking: tuple[str, ...]
    method: Method
    given: Mechanics
    corner: int = 0


def _case(
    about: _About, speeds: Sequence[float], directions: tuple[int, ...], *, modes: bool
) -> SlidingCase:
    """Stability of sliding at the magnitudes of ``speeds`` in given directions."""
    machine, method, at, given = about.machine, about.method, about.at, about.given
    linear = about_equilibrium(machine, at, speeds, directions, given.held, about.corner)
    if linear is not machine:
        machine, given = linear, mechanics(linear, about.sticking)
    names = machine.contact_names
    unknown_forces = {one.name for one in machine.contacts if isinstance(one, TorqueContact)}
    for number, (name, speed) in enumerate(zip(names, speeds, strict=True)):
        if command_loads(machine, name):
            machine, known = commanded_actuation(machine, number, speed, at)
            unknown_forces |= set() if known else {name}
    contacts = tuple(
        linearised(contact, abs(speed), side, method)
        for contact, speed, side in zip(machine.contacts, speeds, directions, strict=True)
    )
    sliding = dict(zip(names, speeds, strict=True))
    if any(one.locked for one in contacts):
        return SlidingCase(contacts, sliding)
    system = linear_system(machine, contacts, given, at)
    contacts = tuple(
        one._replace(force=math.nan) if one.name in unknown_forces else one for one in contacts
    )
    fast = not modes and system.sample_time is None
    found = growth_of(system) if fast else spectrum_of(system, names)
    state = _state(found.growth_rate, found.rounding)
    return SlidingCase(
        contacts, sliding, found.modes, found.eigenvalues, found.multipliers, found.growth_rate,
        state == "decays", state, found.rounding,
    )  # fmt: skip


def _patterns(
    machine: Machine, speeds: FloatArray, sticking: Sequence[str]
) -> Iterator[tuple[list[float], tuple[int, ...]]]:
    """Sliding speeds and directions of each case."""
    at = dict(zip((one.name for one in machine.inertias), speeds.tolist(), strict=True))
    sliding, standing = [], []
    for number, one in enumerate(machine.contacts):
        terms = (at[one.a], -one.ratio * at.get(one.b, 0.0), -frozen(one.base_speed))
        speed = sum(terms)
        if abs(speed) <= _STANDS * sum(map(abs, terms)):
            speed = 0.0
            if one.name not in sticking:
                standing.append(number)
        elif one.name in sticking:
            raise wrong(
                "sticking", tuple(sticking), "names of contacts that stand",
                f"{one.name} slides at {speed:.6g} rad/s. Give speeds at which it stands.",
            )  # fmt: skip
        sliding.append(speed)
    if len(standing) > _MOST_STANDING:
        raise InputError(
            f"speeds: {len(standing)} contacts are at rest: must be at most {_MOST_STANDING},"
            " because each of them can slide in two directions. Give speeds at which they slide.",
            name="speeds", value=speeds.tolist(), allowed=f"at most {_MOST_STANDING} at rest",
        )  # fmt: skip
    rows = contact_rows(machine)[standing] if len(standing) > 1 else np.zeros((0, 0))
    directions = [(one > 0.0) - (one < 0.0) for one in sliding]
    for ways in itertools.product((1, -1), repeat=len(standing)):
        if len(rows) and not _possible(rows * np.array(ways)[:, None]):
            continue
        for number, way in zip(standing, ways, strict=True):
            directions[number] = way
        yield sliding, tuple(directions)


def _possible(rows: FloatArray) -> bool:
    """Return True if there are speeds for which all rows are positive."""
    count, n = rows.shape
    if np.linalg.matrix_rank(rows) == count:
        return True
    from scipy.optimize import linprog

    found = linprog(np.zeros(n), A_ub=-rows, b_ub=-np.ones(count), bounds=(None, None))
    return bool(found.status == 0)


def sliding_speeds(machine: Machine, given: Any) -> FloatArray:
    """The speeds of the inertias [rad/s]; by default the initial ones."""
    names = [one.name for one in machine.inertias]
    speeds = [frozen(one.speed) for one in machine.inertias]
    if given is None:
        return np.array(speeds)
    if isinstance(given, Mapping):
        for name, value in given.items():
            if name not in names:
                raise unknown(f"speeds.{name}", value, names, "no such inertia")
            speeds[names.index(name)] = _speed(name, value)
        if machine.joints:
            own = {name: speeds[names.index(name)] for name in given}
            return with_followers(machine, "speed", own)
        return np.array(speeds)
    numbers = "1 number" if len(names) == 1 else f"{len(names)} numbers"
    allowed = f"{numbers} in rad/s, or a mapping from names of inertias to them"
    if is_number(given) or isinstance(given, str) or np.ndim(given) != 1:
        raise wrong("speeds", given, allowed)
    if len(given) != len(names):
        raise wrong("speeds", given, allowed, f"The inertias are {', '.join(names)}.")
    found = {name: _speed(name, one) for name, one in zip(names, given, strict=True)}
    return with_followers(machine, "speed", found)


def _speed(name: str, value: Any) -> float:
    return check_number(f"speeds.{name}", value, -_FASTEST, _FASTEST)


def unpressed_sentences(system: Machine | BrakedDriveline, found: Stability) -> list[str]:
    """A sentence on each contact that is not pressed where the signal of its force begins."""
    forces = {} if found.critical is None else found.critical.forces
    return [
        f"{one.name}: the signal of its force is evaluated at the start, where the brake is not"
        " pressed and has no effect. For the verdict at another force set"
        f" {f'{one.name}.' if 'contact' in system.coords else ''}initial_force to a number."
        for one in system.machine.contacts
        if isinstance(one.actuation.initial_force, Signal) and forces.get(one.name) == 0.0
    ]

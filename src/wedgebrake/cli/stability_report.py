"""The report of ``stability``, as data for ``--json`` and as text."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import singledispatch
from math import isnan
from typing import Any

import numpy as np

from wedgebrake._version import __version__
from wedgebrake.analysis.linear_stability import (
    DirectionStability,
    DrivelineStability,
    ParameterLimit,
    SlidingCase,
    Stability,
    VerdictChange,
    limits_of,
    stability,
    unpressed_sentences,
)
from wedgebrake.cli.output import describe, nearly_zero, with_unit
from wedgebrake.model.friction import SetValuedFriction
from wedgebrake.model.machine import Machine
from wedgebrake.model.torque_contacts import TorqueContact

# Largest number of modes listed one by one.
_MOST_MODES = 12
# What ends the range of a parameter, by the word for that side.
_ENDS = {
    "locked": "a brake locks itself",
    "released": "an actuator is released",
    "limited": "a force is held by its limit",
}
# The friction to which a report refers, where this depends on the method.
_FRICTION = {
    "curve": "Friction: the curve over the sliding speed, as the method smooth uses it",
    "exact": "Friction: straight lines of the torque, as the method exact uses them",
}


def stability_report(
    system: Any, sticking: Sequence[str] | None, method: Any
) -> tuple[dict[str, Any], str]:
    """The data of ``stability --json``, and the text."""
    found = stability(system, sticking=sticking, method=method)
    limits = _limits(system, found, sticking or ())
    report = {
        "wedgebrake": __version__,
        "system": system.as_dict(),
        **({"groups": system.groups.as_dict()} if system.groups.defined else {}),
        **found.as_dict(),
        "limits": [one.as_dict() for one in limits],
    }
    return report, "\n".join(_lines(system, found, limits))


def _limits(system: Any, found: Stability, sticking: Sequence[str]) -> Sequence[ParameterLimit]:
    """Stability limits at the speeds of the system, by the names of its parameters."""
    if _states_limits(found):
        return []
    names = system.names()
    return [
        # Names of the machine, of which a driveline has the last words: brake.slope, brake.scale.
        one if one.parameter in names else replace(one, parameter=one.parameter.rpartition(".")[2])
        for one in limits_of(system.machine, sticking, found.method)
    ]


@singledispatch
def _states_limits(found: Stability) -> bool:  # noqa: ARG001
    """True if the verdict itself states the limits, as the Hopf points of both directions."""
    return False


@_states_limits.register
def _(found: DrivelineStability) -> bool:
    directions = (found.forward, found.backward)
    return all(one.speed == 0.0 and one.hopf_slope is not None for one in directions)


def _lines(system: Any, found: Stability, limits: Sequence[ParameterLimit]) -> list[str]:
    machine, case = system.machine, found.critical
    lines = [describe(system), "", f"Linear stability: {found.verdict}"]
    if case is not None and case.speeds:
        lines.append("")
        if "contact" in system.coords:
            sliding = [f"{name} {speed:.4g} rad/s" for name, speed in case.speeds.items()]
            lines.append(f"Sliding speeds: {', '.join(sliding)}")
        forces = [
            f"{one.name} {'unknown' if isnan(force) else f'{force:.4g} N'}"
            for one, force in zip(machine.contacts, case.forces.values(), strict=True)
            if not isinstance(one, TorqueContact)
        ]
        if forces:
            lines.append(f"Actuation forces: {', '.join(forces)}")
        lines += unpressed_sentences(system, found)
        if case.limited:
            lines.append(f"Force held by a limit or the release: {', '.join(case.limited)}")
        if _differs_by_method(machine):
            lines.append(_FRICTION[found.method])
    return [*lines, *_verdict_lines(found, machine), *_limits_text(limits)]


def _differs_by_method(machine: Machine) -> bool:
    """Return True if the methods exact and smooth treat a friction law differently.

    Between two points of a table, the torque is linear with "exact", the coefficient with "smooth".
    """
    laws = (one.friction for one in machine.contacts)
    return any(
        isinstance(one, SetValuedFriction) and one.has_nodes and not one.constant for one in laws
    )


@singledispatch
def _verdict_lines(found: Stability, machine: Machine) -> Iterator[str]:  # noqa: ARG001
    """The modes of the critical case, and of the case with contacts that stick."""
    for case in (found.critical, found.held if found.critical is not None else None):
        if case is not None:
            where = f" with {' and '.join(case.sticking)} sticking" if case.sticking else ""
            yield f"Modes{where}, the one that grows fastest first:"
            yield from _modes(found, case)


@_verdict_lines.register
def _(found: DrivelineStability, machine: Machine) -> Iterator[str]:
    """Values and points of both directions, and the angles of a wedge."""
    directions = {"forwards": found.forward, "backwards": found.backward}
    for name, one in directions.items():
        if one.speed is not None:
            yield ""
            yield from _direction(name, one)
    sliding, resting = found.kinetic_locking_angle, found.static_locking_angle
    brake: Any = machine.contacts[0].brake
    if sliding is not None and resting is not None:
        at_rest = f", at rest up to {resting:.6g} rad" if resting > sliding else ""
        yield ""
        yield f"Wedge angle, here {brake.angle:.6g} rad, all other values unchanged:"
        yield f"  self-locking up to {sliding:.6g} rad{at_rest}"
        hopf = {name: one.hopf_angle for name, one in directions.items()}
        angles = [f"{name} {one:.6g} rad" for name, one in hopf.items() if one is not None]
        if angles:
            yield f"  Hopf: {', '.join(angles)} (vibration decays above)"


def _direction(name: str, one: DirectionStability) -> list[str]:
    """Values of a direction."""
    at = f" at {one.speed:.6g} rad/s" if one.speed else ""
    if one.locked or one.eigenvalues is None:
        return [f"Sliding {name}{at}: does not exist (self-locking)."]
    lines = [f"Sliding {name}{at}:"]
    lines.append(f"  damping      {one.damping:.6g} N m s/rad: small vibration {one.state}")
    if one.released:
        lines.append(
            "  actuator     released at this speed; slopes given below are those of a pressed brake"
        )
    roots = ", ".join(f"{value.real:.6g}{value.imag:+.6g}i" for value in one.eigenvalues)
    lines.append(f"  eigenvalues  {roots} 1/s")
    for label, stem in (
        ("Hopf", "hopf"),
        ("node-focus, stable side", "node_focus_stable"),
        ("node-focus, unstable side", "node_focus_unstable"),
    ):
        slope, eta = getattr(one, f"{stem}_slope"), getattr(one, f"{stem}_eta")
        if slope is not None:
            in_eta = "" if eta is None else f"eta = {eta:.6g}, "
            lines.append(f"  {label}: {in_eta}slope = {slope:.6g} N s/rad")
    return lines


def _modes(found: Stability, case: SlidingCase) -> Iterator[str]:
    """The modes of a case with their shapes."""
    for mode in case.modes[:_MOST_MODES]:
        yield f"  {mode._headline()}"
        if not mode.rigid and np.any(mode.shape):
            shape = zip(found.inertias, mode.shape.tolist(), strict=True)
            yield "    " + ", ".join(f"{name} {_complex(one)}" for name, one in shape)
    if len(case.modes) > _MOST_MODES:
        yield f"  ... and {len(case.modes) - _MOST_MODES} more; --json lists all"


def _complex(value: complex) -> str:
    """An amplitude, with its phase unless it is real."""
    size, phase = abs(value), float(np.angle(value, deg=True))
    if size < 5e-4:
        return "0"
    if min(abs(phase), 180.0 - abs(phase)) < 0.05:
        return f"{value.real:.3g}"
    return f"{size:.3g} at {phase:.3g}°"


def _limits_text(limits: Sequence[ParameterLimit]) -> list[str]:
    """A heading, and a line for each limit; nothing without limits."""
    if not limits:
        return []
    lines = ["", "Stability limits at these speeds, one parameter at a time:"]
    width = max(len(one.parameter) for one in limits)
    for one in limits:
        unit = with_unit(one.unit)
        # The limit first, then the others in ascending order.
        changes = sorted(one.changes, key=lambda change: change.value != one.limit)
        found = [_change(change, one, unit) for change in changes]
        if one.limit is None:
            # Stable values end where a brake locks itself, or a force is held constant.
            where = "" if one.stable == "everywhere" and found else f" {one.stable}"
            found = [f"no limit, sliding is stable{where}", *found]
        also = ["static friction in proportion"] if one.also_static else []
        value = f"{one.present:.6g}{unit}"
        lines.append(f"  {one.parameter:{width}}  {value}: {'; '.join([*found, *also])}")
    return lines


def _change(change: VerdictChange, limit: ParameterLimit, unit: str) -> str:
    """A change of the verdict in words."""
    value = f"{nearly_zero(change.value, max(abs(limit.present), 1.0)):.6g}{unit}"
    for side, word in (("below", change.below), ("above", change.above)):
        if word in _ENDS:
            return f"{_ENDS[word]} {side} {value}"
    how = {
        "hopf": f"Hopf, {change.frequency:.4g} Hz",
        "divergence": "divergence",
        "flip": "alternating from sample to sample",
    }[change.kind]
    stable = next((s for s in ("above", "below") if getattr(change, s) == "stable"), None)
    sides = "nowhere beside it" if stable is None else f"{stable} it"
    word = "limit " if change.value == limit.limit else ""
    return f"{word}{value}, sliding is stable {sides} ({how})"

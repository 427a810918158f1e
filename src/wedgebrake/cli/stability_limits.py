"""Stability limits at the own speed of a system as text, and the friction to which they refer."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from wedgebrake.analysis.linear_stability import ParameterLimit, VerdictChange
from wedgebrake.cli.output import nearly_zero, with_unit
from wedgebrake.model.friction import Friction, SetValuedFriction

# What ends the range of a parameter, by the word for that side.
_ENDS = {
    "locked": "a brake locks itself",
    "released": "an actuator is released",
    "limited": "a force is held by its limit",
}


def differ_by_method(laws: Iterable[Friction]) -> bool:
    """Return True if a law is straight lines to the method exact, and a curve to the method smooth.

    Between two points of a table the lines are those of the torque, the curve that of the
    coefficient.
    """
    return any(
        isinstance(one, SetValuedFriction) and one.has_nodes and not one.constant for one in laws
    )


def limits_text(limits: Sequence[ParameterLimit], heading: str) -> list[str]:
    """A heading, and a line for each limit; nothing without limits."""
    if not limits:
        return []
    lines = ["", heading]
    width = max(len(one.parameter) for one in limits)
    for one in limits:
        unit = with_unit(one.unit)
        # The limit first, then the others in ascending order.
        changes = sorted(one.changes, key=lambda change: change.value != one.limit)
        found = [_change(change, one, unit) for change in changes]
        if one.limit is None:
            # Stable values end where a brake locks itself, or a force is held.
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

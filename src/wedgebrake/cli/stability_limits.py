"""Stability limits at the own speed of a system as text, and the friction to which they refer."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from wedgebrake.analysis.linear_stability import ParameterLimit
from wedgebrake.cli.output import nearly_zero, with_unit
from wedgebrake.model.friction import Friction, SetValuedFriction


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
        value = f"{one.present:.6g}{unit}"
        if one.limit is None:
            found = f"no limit, sliding is stable {one.stable}"
        else:
            limit = nearly_zero(one.limit, max(abs(one.present), 1.0))
            found = f"limit {limit:.6g}{unit}, sliding is stable {one.stable} it"
            found += f" ({one.frequency:.4g} Hz)" if one.frequency else ""
        also = "; static friction in proportion" if one.also_static else ""
        lines.append(f"  {one.parameter:{width}}  {value}: {found}{also}")
    return lines

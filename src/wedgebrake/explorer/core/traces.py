"""Measured traces on the page: their files, the quantities of columns, and ranges as text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from wedgebrake.analysis.fitting.observation import named_quantities, quantities_of
from wedgebrake.analysis.fitting.trace import Trace, read_trace
from wedgebrake.analysis.fitting.trace_files import read_csv
from wedgebrake.errors import InputError
from wedgebrake.explorer.core.formatting import number_text, parsed_numbers
from wedgebrake.explorer.core.limits import MOST_SAMPLES, MOST_TRACE

# Characters of a line of a file: a few thousand columns, which are read within a second.
_LONGEST_LINE = 20_000
# Lines of a file beside its samples: names and comments.
_MORE_LINES = 1000
Ranges = Mapping[str, tuple[float, float]]


@dataclass(frozen=True, eq=False)
class MeasuredTrace:
    """A trace and the name of its file."""

    name: str
    trace: Trace


def read(name: str, content: bytes) -> MeasuredTrace:
    """Read the trace in a .csv file.

    Raises ``InputError`` for a file that is too large, or that ``wb.fit`` refuses.
    """
    if len(content) > MOST_TRACE:
        raise InputError(
            f"{name}: has more than {MOST_TRACE} bytes, the most that the page accepts. Omit"
            " samples or columns, or use wb.fit."
        )
    lines = max(content.count(b"\n"), content.count(b"\r"))
    if lines > MOST_SAMPLES + _MORE_LINES:  # before they take memory
        raise _too_long(name, f"{lines} lines")
    if max(map(len, content.splitlines()), default=0) > _LONGEST_LINE:
        raise InputError(
            f"{name}: has a line of more than {_LONGEST_LINE} characters. Omit columns that are not"
            " fitted, and put each sample on a line of its own."
        )
    trace = read_trace(read_csv(name, content))
    if trace.time.size > MOST_SAMPLES:
        raise _too_long(name, f"{trace.time.size} samples")
    return MeasuredTrace(name, trace)


def _too_long(name: str, what: str) -> InputError:
    return InputError(
        f"{name}: has {what}, but the page accepts at most {MOST_SAMPLES} samples. Omit samples, or"
        " use wb.fit."
    )


def observed(trace: Trace, given: Mapping[str, str], system: Any, *, new: bool) -> dict[str, str]:
    """Return the quantity that each column measures, where column and quantity exist.

    given : quantity by column
    new   : whether the trace is new: if none of ``given`` exists, columns that have the name of a
            quantity then measure this quantity
    """
    known = quantities_of(system)
    kept = {name: one for name, one in given.items() if name in trace.columns and one in known}
    return kept or (named_quantities(trace, known) if new else {})


def quantities(system: Any) -> list[str]:
    """Return the quantities that a column can measure."""
    return list(quantities_of(system))


def parsed_ranges(text: str) -> dict[str, tuple[float, float]]:
    """Read free parameters with their ranges from text such as "kinetic=0.1:0.5, slope=-100:0".

    Raises ``InputError`` for another form.
    """
    found = {}
    for one in filter(None, (part.strip() for part in text.split(","))):
        name, _, ends = one.partition("=")
        low, high = (
            parsed_numbers(end) for end in (ends.partition(":")[0], ends.partition(":")[2])
        )
        if not name.strip() or not low or not high or len(low) + len(high) > 2:
            raise InputError(
                f"free {one}: must have the form NAME=LOW:HIGH, for example kinetic=0.1:0.5."
            )
        found[name.strip()] = (low[0], high[0])
    return found


def ranges_text(free: Ranges) -> str:
    """Return free parameters with their ranges as text."""
    return ", ".join(
        f"{name}={number_text(low)}:{number_text(high)}" for name, (low, high) in free.items()
    )

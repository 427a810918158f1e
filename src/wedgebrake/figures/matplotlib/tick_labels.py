"""Labels of ticks on linear axes."""

from __future__ import annotations

from typing import Any

from matplotlib.ticker import ScalarFormatter

_BEFORE, _AFTER = r"$\mathdefault{", "}$"


class PlainNumbers(ScalarFormatter):
    """Numbers as plain text, which looks like that of formulas and takes less time to lay out.

    A power of ten at the end of the axis remains a formula.
    """

    def __call__(self, x: float, pos: Any = None) -> str:
        """The label of the tick at a value."""
        return super().__call__(x, pos).removeprefix(_BEFORE).removesuffix(_AFTER)

"""Axes given by the user, in which a picture is drawn instead of in a new figure."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.model.validation import wrong

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ALLOWED = "rectilinear Matplotlib Axes, or a sequence of distinct Axes of one figure"


def given_axes(ax: Any) -> tuple[Axes, ...]:
    """The axes that a user gave: Axes, or an array or sequence of them; () for None.

    Raises ``InputError`` for anything else.
    """
    from matplotlib.axes import Axes

    if ax is None:
        return ()
    several = isinstance(ax, Iterable) and not isinstance(ax, str)
    found = tuple(np.array(list(ax), dtype=object).flat) if several else (ax,)
    if (
        not found
        or not all(isinstance(one, Axes) and one.name == "rectilinear" for one in found)
        or len({id(one) for one in found}) < len(found)
        or len({id(one.figure and one.figure.figure) for one in found}) > 1
        or found[0].figure is None
    ):
        raise wrong("ax", ax, _ALLOWED)
    return found


class GivenAxes:
    """Axes given by the user, with those methods of a new figure that pictures use."""

    def __init__(self, axes: tuple[Axes, ...]) -> None:
        self._given, self._next = axes, iter(axes)
        self._before = len(self.root.axes)

    @property
    def root(self) -> Figure:
        """The figure of the axes."""
        figure: Any = self._given[0].figure
        root: Figure = figure.figure  # of a figure itself, of a subfigure that around it
        return root

    @property
    def added(self) -> list[Axes]:
        """Axes that the picture has added, such as those of a colour bar."""
        return self.root.axes[self._before :]

    @property
    def axes(self) -> list[Axes]:
        """The given axes, and those that the picture has added."""
        return [*self._given, *self.added]

    def gca(self) -> Axes:
        """The first axes."""
        return self._given[0]

    def subplots(
        self,
        rows: int = 1,
        columns: int = 1,
        *,
        squeeze: bool = True,
        sharex: bool = False,
        **_: Any,
    ) -> Any:
        """The axes as an array; raises ``InputError`` if their number differs."""
        grid = self.add_gridspec(rows, columns)
        first = self._given[0] if sharex else None
        each = [self.add_subplot(grid, sharex=first) for _ in self._given]
        found = np.array(each, dtype=object).reshape(rows, columns)
        if squeeze and 1 in (rows, columns):
            return found.ravel() if found.size > 1 else found.item()
        return found

    def add_gridspec(self, rows: int, columns: int) -> Any:
        """A placeholder grid; raises ``InputError`` if the number of axes differs."""
        from matplotlib.gridspec import GridSpec

        count = rows * columns
        if len(self._given) != count:
            panels = (
                f"{count} Axes, one for each panel of this picture" if count > 1 else "one Axes"
            )
            raise wrong("ax", f"{len(self._given)} Axes", panels)
        return GridSpec(rows, columns)

    def add_subplot(self, _: Any, sharex: Axes | None = None) -> Axes:
        """The next of the axes."""
        axes = next(self._next)
        if sharex is not None and not axes.get_shared_x_axes().joined(axes, sharex):
            axes.sharex(sharex)
        return axes

    def align_ylabels(self, rows: Any) -> None:
        """Align the labels of axes in a column."""
        self.root.align_ylabels(rows)

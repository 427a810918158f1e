"""Plots over parameters in tabs: what they range over, their legend and their progress."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape
from typing import Any

import panel as pn
from bokeh.models import InlineStyleSheet

from wedgebrake.errors import InputError
from wedgebrake.explorer.core import basins, diagram, regimes, stability
from wedgebrake.explorer.core.axis import parameter_axis
from wedgebrake.explorer.core.formatting import number_text, parsed_numbers
from wedgebrake.explorer.core.state import Desk, axes
from wedgebrake.explorer.ui.widgets.controls import Input, Select, style_sheet, update
from wedgebrake.figures.data.axes import ParameterAxis
from wedgebrake.model.groups import SETTERS

_TITLES = {
    "diagram": "Bifurcation diagram", "regimes": "Regimes", "stability": "Stability",
    "basins": "Basins",
}  # fmt: skip
_NOTES = {
    "diagram": "Poincaré points. Each value is simulated from the same initial state until its"
    " motion has settled, or up to a limit, beyond which it is undecided.",
    "regimes": "Classes of motion. Each cell is simulated from the same initial state until its"
    " motion has settled, or up to a limit, beyond which it is undecided.",
    "stability": "Small vibration about sliding, with the kinetic friction coefficient.",
    "basins": "The motion that each initial state leads to; each is simulated until its motion has"
    " settled, or up to a limit, beyond which it is undecided.",
}
Edit = Callable[[dict[str, Any]], None]


class PlotTabs:
    """Tabs with the plots.

    edit : called with changes of plate, axis, across, up, quantity or spans
    """

    def __init__(self, edit: Edit, styles: InlineStyleSheet) -> None:
        self._edit, self._showing = edit, False
        style = {"stylesheets": [style_sheet("plot_tabs.css")], "margin": 0}
        shared = {"shared": styles, "margin": 0}
        self._frames = {
            name: pn.Column(sizing_mode="stretch_both", css_classes=[f"plot-{name}"], margin=0)
            for name in _TITLES
        }
        tabs = [(title, self._frames[name]) for name, title in _TITLES.items()]
        self._tabs = pn.Tabs(*tabs, sizing_mode="stretch_both", css_classes=["tabs"], **style)
        self._axes = {role: _AxisControl(role, self._change, shared) for role in ("across", "up")}
        self._quantity = Select(
            options=["velocity", "angle"], width=84, css_classes=["quantity"],
            hint="Quantity drawn of the Poincaré section", **shared,
        )  # fmt: skip
        self._foot = pn.pane.HTML(css_classes=["foot"], **style)
        controls = [widget for one in self._axes.values() for widget in one.widgets]
        controls = pn.Row(*controls, self._quantity, css_classes=["controls"], **style)
        self.view = pn.Column(
            controls, self._tabs, self._foot, css_classes=["plots"], sizing_mode="stretch_both",
            **style,
        )  # fmt: skip
        self._legend: Sequence[tuple[str, str]] = ()
        self._progress, self._note, self._number = "", "", 0
        self._tabs.param.watch(lambda event: self._open(event.new), "active")
        self._quantity.param.watch(lambda event: self._change({"quantity": event.new}), "value")

    def add(self, name: str, figure: Any) -> None:
        """Put the Bokeh figure of a plot into its tab."""
        self._frames[name].append(pn.pane.Bokeh(figure, sizing_mode="stretch_both", margin=0))

    def show(self, desk: Desk) -> None:
        """Show which plot is open and what it ranges over."""
        self._showing = True
        plate = desk.view.plate
        update(self._tabs, active=list(_TITLES).index(plate))
        ranges = _ranges(desk)
        for place, (role, control) in enumerate(self._axes.items()):
            role = "axis" if plate == "diagram" else role
            control.show(role, ranges[place] if place < len(ranges) else None, desk)
        update(self._quantity, value=desk.view.quantity, visible=plate == "diagram")
        self._showing = False
        if self._note != _NOTES[plate]:
            self._legend, self._progress, self._note = (), "", _NOTES[plate]
            self._put()

    def legend(self, chips: Sequence[tuple[str, str]], progress: str, number: int) -> None:
        """Show the legend, as (CSS background, words), and how much of the plot is known.

        number : of the study that the plot shows
        """
        self._legend, self._progress, self._number = chips, progress, number
        self._put()

    def _put(self) -> None:
        chips = "".join(
            f'<li><i style="background:{escape(background)}"></i>{escape(words)}</li>'
            for background, words in self._legend
        )
        update(self._foot, object=(
            f'<div title="{escape(self._note)}" data-picture="{self._number}">'
            f'<ul class="legend" aria-label="Legend">{chips}</ul>'
            f'<span class="progress">{escape(self._progress)}</span>'
            "<span>Click in the plot to go there</span></div>"
        ))  # fmt: skip

    def _open(self, place: int) -> None:
        self._change({"plate": list(_TITLES)[place]})

    def _change(self, changes: dict[str, Any]) -> None:
        if not self._showing:
            self._edit(changes)


class _AxisControl:
    """The parameter along one axis, and its range."""

    def __init__(self, place: str, change: Edit, style: dict[str, Any]) -> None:
        self._change, self._role, self._axis = change, place, ""
        self._select = Select(css_classes=[place], hint="Parameter", width=160, **style)
        self._low = Input(css_classes=[f"{place}-from"], hint="from", width=58, **style)
        self._high = Input(css_classes=[f"{place}-to"], hint="to", width=58, **style)
        self.widgets = (self._select, self._low, self._high)
        self._select.param.watch(lambda event: change({self._role: event.new}), "value")
        for end in (self._low, self._high):
            end.param.watch(self._typed, "value")

    def show(self, role: str, axis: ParameterAxis | None, desk: Desk) -> None:
        """Show a parameter and its range; None hides them."""
        self._role = role
        for widget in self.widgets:
            update(widget, visible=axis is not None)
        if axis is None:
            return
        self._axis = axis.name
        fixed = desk.view.plate in ("stability", "basins")
        groups = {"Parameters": {axis.title: axis.name}} if fixed else _choices(desk)
        update(self._select, groups=groups, value=axis.name, disabled=fixed)
        update(self._low, value=number_text(axis.low))
        update(self._high, value=number_text(axis.high))

    def _typed(self, _: Any) -> None:
        ends = [parsed_numbers(one.value) or [one.value] for one in (self._low, self._high)]
        self._change({"spans": {self._axis: [one[0] for one in ends]}})


def _ranges(desk: Desk) -> list[ParameterAxis]:
    """Return the axes of the open plot; none if this machine has no such plot."""
    plate = desk.view.plate
    names = {"regimes": regimes.parameters, "stability": stability.parameters}
    try:
        if plate == "diagram":
            return [parameter_axis(desk, diagram.parameters(desk)[0])]
        pair = names[plate](desk) if plate in names else basins.parameters(desk)
        return [parameter_axis(desk, name) for name in pair]
    except InputError:
        return []


def _choices(desk: Desk) -> dict[str, dict[str, str]]:
    """Return all parameters that a plot can range over, by heading."""
    found: dict[str, dict[str, str]] = {"Groups": {}, "Parameters": {}}
    for name in axes(desk.system):
        heading = "Groups" if name in SETTERS else "Parameters"
        axis = parameter_axis(desk, name)
        found[heading][f"{axis.symbol}  {axis.words}".strip()] = name
    return {heading: choices for heading, choices in found.items() if choices}

"""Plots over parameters in tabs, with their ranges, legend and progress."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any

import panel as pn
from bokeh.models import InlineStyleSheet

from wedgebrake.errors import InputError
from wedgebrake.explorer.core.fields import axis_choices
from wedgebrake.explorer.core.formatting import number_text, parsed_numbers
from wedgebrake.explorer.core.plots import PARAMETER_PLOTS, Picture, curve
from wedgebrake.explorer.core.state import PageState
from wedgebrake.explorer.ui.widgets.controls import (
    Checkbox,
    FigurePane,
    Input,
    Select,
    on_user,
    style_sheet,
    update,
)
from wedgebrake.figures.data.axes import ParameterAxis
from wedgebrake.figures.data.partial import MEASURES, QUANTITIES
from wedgebrake.figures.style import SECTION
from wedgebrake.orbits.problems.problem import sample_times

_TITLES = {
    "diagram": "Bifurcations", "regimes": "Regimes", "stability": "Stability",
    "basins": "Basins", "curve": "Amplitudes", "trace": "Measured",
}  # fmt: skip
_SETTLED = "until its motion has settled; if it has not within a limit, it is undecided."
# Notes of the plots except the diagram, whose note depends on what it shows.
_NOTES = {
    "regimes": f"Classes of motion. Each cell is simulated from the same initial state {_SETTLED}",
    "stability": "Small vibration about sliding, with the kinetic friction coefficient. The limit"
    " is a Hopf bifurcation.",
    "curve": "Periodic orbits with the period of the torque, stable and unstable, followed over the"
    " parameter at each level",
    "trace": "A measured trace and the motion of the machine from the first sample on",
    "basins": f"The motion that each initial state leads to; each is simulated {_SETTLED}",
}
_STOP, _AGAIN = "Stop", "Compute"
Edit = Callable[[dict[str, Any]], None]


class PlotTabs:
    """Tabs with the plots.

    edit : called with changes of plot, axis, across, up, quantity, follow, spans, or of the
           settings of the amplitude curves: over, level, levels, samplings, measure
    stop : called with True to stop the computation of the open plot, with False to start it again
    """

    def __init__(self, edit: Edit, stop: Callable[[bool], None], styles: InlineStyleSheet) -> None:
        style = {"stylesheets": [style_sheet("plot_tabs.css")], "margin": 0}
        shared = {"shared": styles, "margin": 0}
        self._frames = {
            name: pn.Column(sizing_mode="stretch_both", css_classes=[f"plot-{name}"], margin=0)
            for name in _TITLES
        }
        tabs = [(title, self._frames[name]) for name, title in _TITLES.items()]
        self._tabs = pn.Tabs(*tabs, sizing_mode="stretch_both", css_classes=["tabs"], **style)
        self._axes = {role: _AxisControl(role, edit, shared) for role in ("across", "up")}
        self._quantity = Select(
            options={words.partition("  ")[0]: name for name, words in QUANTITIES.items()},
            width=150, css_classes=["quantity"],
            hint="Poincaré points, or an amplitude of the motion", **shared,
        )  # fmt: skip
        self._follow = Checkbox(
            label="up and down", css_classes=["follow"], align="center",
            hint="Start each value where its neighbour ended, upwards and downwards", **shared,
        )  # fmt: skip
        self._level = _LevelControl(edit, shared)
        self._samplings = Input(
            placeholder="samplings", width=72, css_classes=["samplings"],
            hint="Samplings in a period, which the sample times then follow; empty: they do not"
            " change", **shared,
        )  # fmt: skip
        self._measure = Select(
            options={words.partition("  ")[0]: name for name, words in MEASURES.items()},
            width=100, css_classes=["measure"], hint="Measure of the periodic motion", **shared,
        )  # fmt: skip
        self._stop = pn.widgets.Button(css_classes=["stop"], visible=False, **style)
        self._foot = pn.pane.HTML(css_classes=["foot"], **style)
        controls = [widget for one in self._axes.values() for widget in one.widgets]
        controls += [self._quantity, self._follow]
        controls += [*self._level.widgets, self._samplings, self._measure]
        controls = pn.Row(*controls, css_classes=["controls"], **style)
        self.view = pn.Column(
            controls, self._tabs, self._foot, self._stop, css_classes=["plots"],
            sizing_mode="stretch_both", **style,
        )  # fmt: skip
        self._plot = self._note = self._progress = ""
        self._number = 0
        self._picture: Picture | None = None
        on_user(self._tabs, lambda place: edit({"plot": list(_TITLES)[place]}), "active")
        on_user(self._quantity, lambda quantity: edit({"quantity": quantity}))
        on_user(self._measure, lambda measure: edit({"measure": measure}))
        on_user(self._samplings, lambda text: edit({"samplings": _whole(text)}))
        self._stop.on_click(lambda _: stop(self._stop.label == _STOP))
        on_user(self._follow, lambda follow: edit({"follow": bool(follow)}))

    def add(self, name: str, figure: Any) -> None:
        """Put the Bokeh figure of a plot into its tab."""
        self._frames[name].append(FigurePane(figure))

    def add_trace(self, figure: Any, controls: Any, result: Any) -> None:
        """Put the figure of a measured trace into its tab, with controls and the result of fits."""
        shown = pn.Row(
            FigurePane(figure), result, css_classes=["trace-shown"], sizing_mode="stretch_both",
            stylesheets=[style_sheet("trace_panel.css")], margin=0,
        )  # fmt: skip
        self._frames["trace"].extend([controls, shown])

    def show(self, state: PageState) -> None:
        """Show the open plot with its parameters and ranges."""
        plot = state.view.plot
        update(self._tabs, active=list(_TITLES).index(plot))
        try:
            ranges = PARAMETER_PLOTS[plot].axes(state)
        except InputError:  # this machine has no such plot
            ranges = []
        for place, (role, control) in enumerate(self._axes.items()):
            role = {"diagram": "axis", "curve": "over"}.get(plot, role)
            control.show(role, ranges[place] if place < len(ranges) else None, state)
        self._level.show(state if plot == "curve" else None)
        count = state.view.samplings
        sampled = plot == "curve" and bool(sample_times(state.system))
        update(self._samplings, value=str(count or ""), visible=sampled)
        update(self._measure, value=state.view.measure, visible=plot == "curve")
        update(self._quantity, value=state.view.quantity, visible=plot == "diagram")
        update(self._follow, value=state.view.follow, visible=plot == "diagram")
        self._note = _NOTES.get(plot) or _diagram_note(state)
        if self._plot != plot:
            self._plot = plot
            self.describe(None, self._number)
        else:
            self._put(self._progress)

    def describe(self, picture: Picture | None, number: int) -> None:
        """Show the legend of a picture, and how much of it is computed; None: no picture.

        number : of the state that the picture shows
        """
        self._number, self._picture = number, picture
        if picture is None:
            update(self._stop, visible=False)
        self._put("" if picture is None else picture.progress)

    def computing(self) -> None:
        """Show that the next picture is being computed; the last one stays visible."""
        update(self._stop, label=_STOP, visible=self._plot == "curve")
        self._put("computing …")

    def ended(self, *, stopped: bool = False) -> None:
        """Show that the computation has ended, by itself or because the user stopped it."""
        update(self._stop, label=_AGAIN, visible=stopped)
        self._put("stopped" if stopped else self._progress)

    def _put(self, progress: str) -> None:
        self._progress, picture = progress, self._picture
        entries = [entry.css for entry in picture.legend] if picture is not None else []
        reason = getattr(picture, "reason", "")
        click = "" if self._plot == "trace" else "Click in the plot to go there"
        beside = ' class="beside"' if self._stop.visible else ""
        legend = "".join(
            f'<li><i style="background:{escape(background)}"></i>{escape(words)}</li>'
            for background, words in entries
        )
        update(self._foot, object=(
            f'<div title="{escape(self._note)}" data-picture="{self._number}">'
            f'<ul class="legend" aria-label="Legend">{legend}</ul>'
            f'<span class="progress" title="{escape(reason)}">{escape(progress)}</span>'
            f"<span{beside}>{click}</span></div>"
        ))  # fmt: skip


def _diagram_note(state: PageState) -> str:
    points = state.view.quantity in SECTION
    what = "Poincaré points" if points else "A property of the settled motion"
    start = "is simulated from the same initial state"
    if state.view.follow:
        start = "starts where its neighbour ended, upwards and downwards, and is simulated"
    return f"{what}. Each value {start} {_SETTLED}"


def _whole(text: str) -> Any:
    """The whole number in a text, None if it is empty; other texts as they are."""
    numbers = parsed_numbers(text) or []
    whole = len(numbers) == 1 and numbers[0].is_integer()
    return int(numbers[0]) if whole else text.strip() or None


class _LevelControl:
    """Inputs for the parameter of the levels of amplitude curves, and for the levels."""

    def __init__(self, edit: Edit, style: dict[str, Any]) -> None:
        self._select = Select(
            css_classes=["level"], hint="Parameter with a curve for each level", width=110, **style
        )
        self._values = Input(css_classes=["levels"], hint="Levels, for example 250, 500", width=76,
                             **style)  # fmt: skip
        self.widgets = (self._select, self._values)
        on_user(self._select, lambda name: edit({"level": name}))
        on_user(self._values, lambda text: edit({"levels": parsed_numbers(text) or [text]}))

    def show(self, state: PageState | None) -> None:
        """Show the levels of a state; hide the inputs if it is None."""
        for widget in self.widgets:
            update(widget, visible=state is not None)
        if state is None:
            return
        update(self._select, groups=axis_choices(state), value=curve.level(state))
        try:
            levels = curve.levels(state)
        except InputError:  # the plot says why
            levels = ()
        update(self._values, value=", ".join(map(number_text, levels)))


class _AxisControl:
    def __init__(self, place: str, edit: Edit, style: dict[str, Any]) -> None:
        self._edit, self._role, self._axis = edit, place, ""
        self._select = Select(css_classes=[place], hint="Parameter", width=160, **style)
        self._low = Input(css_classes=[f"{place}-from"], hint="from", width=58, **style)
        self._high = Input(css_classes=[f"{place}-to"], hint="to", width=58, **style)
        self.widgets = (self._select, self._low, self._high)
        on_user(self._select, lambda name: edit({self._role: name}))
        for end in (self._low, self._high):
            on_user(end, self._typed)

    def show(self, role: str, axis: ParameterAxis | None, state: PageState) -> None:
        """Show a parameter and its range; None hides them."""
        self._role = role
        for widget in self.widgets:
            update(widget, visible=axis is not None)
        if axis is None:
            return
        self._axis = axis.name
        # The stability map of a machine is over the parameters of the regime map.
        fixed = state.view.plot == "basins" or (state.view.plot == "stability" and state.counted)
        groups = {"Parameters": {axis.title: axis.name}} if fixed else axis_choices(state)
        update(self._select, groups=groups, value=axis.name, disabled=fixed)
        update(self._low, value=number_text(axis.low))
        update(self._high, value=number_text(axis.high))

    def _typed(self, _: Any) -> None:
        ends = [parsed_numbers(one.value) or [one.value] for one in (self._low, self._high)]
        self._edit({"spans": {self._axis: [one[0] for one in ends]}})

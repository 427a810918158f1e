"""Controls of a measured trace: its file, its columns, free parameters, and the fit."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any

import numpy as np
import panel as pn
from bokeh.models import InlineStyleSheet

from wedgebrake.analysis.fitting.fit import Fit
from wedgebrake.errors import InputError
from wedgebrake.explorer.core.fields import axis_choices, parameter_axis
from wedgebrake.explorer.core.state import PageState
from wedgebrake.explorer.core.traces import parsed_ranges, quantities, ranges_text
from wedgebrake.explorer.ui.widgets.controls import (
    FileChooser,
    Input,
    Select,
    on_user,
    style_sheet,
    update,
)
from wedgebrake.figures.style import number

Edit = Callable[[dict[str, Any]], None]

_NOTHING, _ADD = "not used", "Free parameter …"
_FIT, _STOP = "Fit", "Stop"


class TracePanel:
    """Controls above the chart of a trace, and the result of a fit beside it.

    load : called with the name and content of a file
    edit : called with changes of column, observe or free
    fit  : called with True to start a fit, with False to stop it
    take : called to apply the fitted values to the machine
    refuse : called with the reason if an input cannot be read
    """

    def __init__(
        self,
        load: Callable[[str, bytes], None],
        edit: Edit,
        fit: Callable[[bool], None],
        take: Callable[[], None],
        refuse: Callable[[str], None],
        styles: InlineStyleSheet,
    ) -> None:
        self._edit, self._refuse = edit, refuse
        self._style = {"stylesheets": [style_sheet("trace_panel.css")], "margin": 0}
        shared = {"shared": styles, "margin": 0}
        self._state: PageState | None = None
        files = FileChooser(".csv", "load-trace", load, self._style)
        self._column = Select(
            options=[], css_classes=["column"], hint="Column of the file", width=130, **shared
        )
        self._quantity = Select(
            options=[], css_classes=["observes"], hint="What the column measures", width=150,
            **shared,
        )  # fmt: skip
        self._add = Select(
            groups={"": {_ADD: ""}}, value="", css_classes=["add-free"], width=150,
            hint="Add a parameter to be fitted", **shared,
        )  # fmt: skip
        self._free = Input(
            css_classes=["free"], hint="Free parameters with ranges: kinetic=0.1:0.5, slope=-100:0",
            width=300, **shared,
        )  # fmt: skip
        self._button = pn.widgets.Button(label=_FIT, css_classes=["fit"], **self._style)
        self._take = pn.widgets.Button(
            label="Apply", css_classes=["take"], visible=False, **self._style
        )
        self._result = pn.pane.HTML(css_classes=["fitted"], **self._style)
        self._needs_trace = (self._column, self._quantity, self._add, self._free, self._button)
        self.controls = pn.Row(
            files.view, *self._needs_trace, css_classes=["trace-controls"], **self._style
        )
        self.result = pn.Column(
            self._take, self._result, css_classes=["trace-result"], visible=False, **self._style
        )
        on_user(self._column, lambda name: edit({"column": name}))
        on_user(self._quantity, self._observed)
        on_user(self._add, self._added)
        on_user(self._free, self._typed)
        self._button.on_click(lambda _: fit(self._button.label == _FIT))
        self._take.on_click(lambda _: take())

    def show(self, state: PageState) -> None:
        """Show the trace of a state, the quantities of its columns, and the free parameters."""
        before, self._state, view = self._state, state, state.view
        for widget in self._needs_trace:
            update(widget, visible=view.trace is not None)
        if view.trace is None:
            return
        if before is None or before.view.trace is not view.trace:
            self.clear()
        update(self._column, options=list(view.trace.trace.columns), value=view.column)
        measured = view.observe.get(view.column, _NOTHING)
        update(self._quantity, options=[_NOTHING, *quantities(state.system)], value=measured)
        update(self._add, groups={"": {_ADD: ""}, **axis_choices(state)}, value="")
        update(self._free, value=ranges_text(view.free))

    def fitting(self) -> None:
        """Show that a fit is being computed."""
        update(self._button, label=_STOP)
        self._put('<p class="busy">Fitting …</p>')

    def clear(self) -> None:
        """Show no fit."""
        update(self._button, label=_FIT)
        update(self.result, visible=False)

    def show_fit(self, found: Fit, *, takes: bool) -> None:
        """Show fitted values with their intervals, and the remarks.

        takes : whether fitted values can be applied to the machine
        """
        units = found.covariance["unit"].to_numpy()
        rows = "".join(
            f"<tr><td>{escape(name)}</td><td>{_value(value, high - value)}</td>"
            f"<td>{'' if unit == '1' else escape(str(unit))}</td></tr>"
            for (name, value), (_, high), unit in zip(
                found.values.items(), found.interval().values(), units, strict=True
            )
        )
        rms = ", ".join(f"{escape(name)} {one:.3g}" for name, one in found.rms.items())
        remarks, caption = found.warnings, "Fitted, ± 95 % interval"
        if not found.converged:
            remarks, caption = [found.outcome, *remarks], "Not converged"
        notes = "".join(f"<li>{escape(one)}</li>" for one in remarks)
        self._put(
            f"<table><caption>{caption}</caption>{rows}</table>"
            f"<p>rms of the residuals: {rms}</p>" + (f"<ul>{notes}</ul>" if notes else ""),
            takes=takes,
        )
        update(self._button, label=_FIT)

    def show_no_fit(self, words: str) -> None:
        """Show why there is no fit."""
        update(self._button, label=_FIT)
        self._put(f'<p class="refused">{escape(words)}</p>')

    def _put(self, text: str, *, takes: bool = False) -> None:
        update(self._result, object=text)
        update(self._take, visible=takes)
        update(self.result, visible=True)

    def _observed(self, quantity: str) -> None:
        assert self._state is not None  # noqa: S101 - shown before
        view = self._state.view
        observe = {name: one for name, one in view.observe.items() if name != view.column}
        if quantity != _NOTHING:
            observe[view.column] = quantity
        self._edit({"observe": observe})

    def _added(self, name: str) -> None:
        assert self._state is not None  # noqa: S101 - shown before
        if not name:
            return
        axis = parameter_axis(self._state, name)
        here = float(self._state.value(name))
        ends = min(axis.low, here), max(axis.high, here)
        self._edit({"free": {**self._state.view.free, name: ends}})

    def _typed(self, text: str) -> None:
        assert self._state is not None  # noqa: S101 - shown before
        try:
            free = parsed_ranges(text)
        except InputError as error:
            self._refuse(str(error))
            update(self._free, value=ranges_text(self._state.view.free))
            return
        self._edit({"free": free})


def _value(value: float, half: float) -> str:
    """Return a value and half the width of its interval, rounded to two digits of the latter.

    half : inf if the value is not determined, nan if the fit has not converged
    """
    if np.isnan(half):
        return number(value, 6)
    if not np.isfinite(half):
        return f"{number(value, 6)} (not determined)"
    if half == 0.0:
        return f"{number(value, 8)} ± 0"
    digits = max(0, 1 - int(np.floor(np.log10(half))))
    exact = min(max(int(np.floor(np.log10(abs(value) or half))) + digits + 1, 1), 12)
    return f"{number(value, exact)} ± {number(half, 2)}"

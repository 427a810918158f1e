"""The parameters of the machine and its run: a slider and an input for each number."""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Mapping
from typing import Any

import panel as pn
from bokeh.models import InlineStyleSheet

from wedgebrake.explorer.core.fields import Row, sections, symbol
from wedgebrake.explorer.core.formatting import number_text, parsed_numbers, plain
from wedgebrake.explorer.core.state import Desk
from wedgebrake.explorer.ui.widgets.controls import (
    Checkbox,
    Input,
    Select,
    Slider,
    style_sheet,
    update,
)

Edit = Callable[[str, Any, bool], None]
"""Takes a name, its new value, and True while the slider is dragged."""

_STYLE = style_sheet("parameters.css")
_STEPS = 400  # of a slider


class ParameterPanel:
    """Sections of parameters.

    edit   : called with each change by the user
    refuse : called with a sentence if an input cannot be read
    """

    def __init__(self, edit: Edit, refuse: Callable[[str], None], styles: InlineStyleSheet) -> None:
        self._showing = False

        def changed(name: str, value: Any, dragging: bool) -> None:
            if not self._showing:
                edit(name, value, dragging)

        self._new = {
            kind: lambda row, control=control: control(row, changed, refuse, styles)
            for kind, control in _CONTROLS.items()
        }
        self._sections: dict[str, _Section] = {}
        self.view = pn.Column(css_classes=["parameters"], stylesheets=[_STYLE], margin=0)

    def show(self, desk: Desk) -> None:
        """Show the values of a study."""
        self._showing = True
        try:
            found = sections(desk)
            if not self._sections:
                self._sections = {title: _Section(title) for title in found}
                self.view.extend(one.view for one in self._sections.values())
            for title, rows in found.items():
                self._sections[title].show(rows, self._new)
        finally:
            self._showing = False


class _Section:
    """A heading, the controls of some rows, and the values that cannot be set."""

    def __init__(self, title: str) -> None:
        self._controls: dict[tuple[str, str], _Control] = {}
        style = {"stylesheets": [_STYLE], "margin": 0}
        self._heading = pn.pane.HTML(title, css_classes=["heading"], **style)
        self._facts = pn.pane.HTML(css_classes=["facts"], **style)
        self.view = pn.Column(css_classes=["section"], **style)

    def show(self, rows: list[Row], new: Mapping[str, Callable[[Any], _Control]]) -> None:
        """Show rows, with controls made where there are none yet."""
        widgets = [self._heading]
        for row in rows:
            if row.kind == "fixed":
                continue
            key = row.name, row.kind
            if key not in self._controls:
                self._controls[key] = new[row.kind](row)
            self._controls[key].show(row)
            widgets += self._controls[key].widgets
        facts = "".join(
            f'<span title="{html.escape(row.hint)}" class="fact-{row.name}">{symbol(row.name)} ='
            f" {plain(row.value)} {row.unit}</span>"
            for row in rows
            if row.kind == "fixed"
        )
        if facts:
            update(self._facts, object=facts)
            widgets.append(self._facts)
        # Bokeh puts children that are added later behind those that are there already.
        for place, widget in enumerate(widgets):
            update(widget, styles={**widget.styles, "order": str(place)})
        if list(self.view) != widgets:
            self.view.objects = widgets


class _Control:
    """The widgets of one row."""

    def __init__(
        self, row: Row, edit: Edit, refuse: Callable[[str], None], styles: InlineStyleSheet
    ) -> None:
        self._row, self._edit, self._refuse, self._styles = row, edit, refuse, styles
        self.widgets: list[Any] = []

    def _add(self, widget: type, *classes: str, **options: Any) -> Any:
        self.widgets.append(
            widget(
                css_classes=[*classes],
                shared=self._styles,
                margin=0,
                width=None,
                sizing_mode="stretch_width",
                **options,
            )
        )
        return self.widgets[-1]

    def show(self, row: Row) -> None:
        """Show a value."""
        self._row = row
        for widget in self.widgets:
            update(widget, hint=row.hint, disabled=not row.enabled)


class _Choice(_Control):
    def __init__(self, row: Row, *args: Any) -> None:
        super().__init__(row, *args)
        options = {words: kind for kind, words in row.choices}
        self._select = self._add(
            Select, "wide", f"input-{row.name}", label=row.title, options=options, value=row.value
        )
        self._select.param.watch(lambda event: self._edit(row.name, event.new, False), "value")

    def show(self, row: Row) -> None:
        super().show(row)
        update(self._select, value=row.value)


class _Switch(_Control):
    def __init__(self, row: Row, *args: Any) -> None:
        super().__init__(row, *args)
        self._box = self._add(
            Checkbox, "wide", f"input-{row.name}", label=row.title, value=row.value
        )
        self._box.param.watch(lambda event: self._edit(row.name, event.new, False), "value")

    def show(self, row: Row) -> None:
        super().show(row)
        update(self._box, value=row.value)


class _List(_Control):
    """An input for numbers; with one number, an input beside a slider."""

    example = "write numbers with commas between them, for example 0, 0.1, 1."
    place: tuple[str, ...] = ("wide",)

    def __init__(self, row: Row, *args: Any) -> None:
        super().__init__(row, *args)
        name = row.title if "wide" in self.place else ""
        self._input = self._add(Input, *self.place, f"input-{row.name}", label=name)
        self._input.styles = {"--unit": f'"{row.unit}"'}
        self._input.param.watch(self._typed, "value")

    def show(self, row: Row) -> None:
        super().show(row)
        update(self._input, value=self._text(row))

    def _text(self, row: Row) -> str:
        return ", ".join(map(number_text, row.value))

    def _typed(self, event: Any) -> None:
        if event.new == self._text(self._row):
            return
        value = self._value(parsed_numbers(event.new))
        if value is None:
            self._refuse(f"{self._row.title}: {self.example}")
            update(self._input, value=self._text(self._row))
        else:
            self._edit(self._row.name, value, False)

    def _value(self, numbers: list[float] | None) -> Any:
        return numbers


class _Number(_List):
    """A slider and an input."""

    example = "write a number, for example 0.5."
    place = ("number",)

    def __init__(self, row: Row, *args: Any) -> None:
        super().__init__(row, *args)
        self._slider = self._add(
            Slider, f"slider-{row.name}", label=row.title, show_value=False, tooltips=False,
            start=row.low, end=row.high, value=row.low,
        )  # fmt: skip
        self.widgets.reverse()
        self._slider.param.watch(lambda event: self._slid(event.new, True), "value")
        self._slider.param.watch(lambda event: self._slid(event.new, False), "value_throttled")

    def show(self, row: Row) -> None:
        super().show(row)
        low, high, place = (_place(row, one) for one in (row.low, row.high, row.value))
        step = (high - low) / _STEPS
        # The handle in the user's hand stays where it is if its value was only rounded.
        near = abs(self._slider.value - place) <= step
        update(self._slider, start=low, end=high, step=step,
               **({} if near else {"value": place}))  # fmt: skip

    def _text(self, row: Row) -> str:
        return number_text(row.value, whole=row.whole)

    def _value(self, numbers: list[float] | None) -> Any:
        if numbers is None or len(numbers) != 1:
            return None
        whole = self._row.whole and numbers[0].is_integer()
        return int(numbers[0]) if whole else numbers[0]

    def _slid(self, place: Any, dragging: bool) -> None:
        row = self._row
        if not isinstance(place, float | int) or not math.isfinite(place):
            return
        value = 10.0**place if row.log else place
        digits = 3 - math.floor(math.log10((row.high - row.low) / _STEPS)) if not row.log else 0
        value = float(f"{value:.3g}") if row.log else round(value, digits - 2)
        self._edit(row.name, round(value) if row.whole else value + 0.0, dragging)


def _place(row: Row, value: float) -> float:
    """Return where a value lies on its slider."""
    if not row.log:
        return value
    return math.log10(max(value, row.low))


_CONTROLS: dict[str, type[_Control]] = {
    "number": _Number, "list": _List, "choice": _Choice, "switch": _Switch,
}  # fmt: skip

"""The parameters of the system and its run: a slider and an input for each number."""

from __future__ import annotations

import html
import math
from collections.abc import Callable
from typing import Any

from bokeh.models import (
    Button,
    Checkbox,
    Column,
    CustomJS,
    Div,
    InlineStyleSheet,
    Select,
    Slider,
    TextInput,
)  # fmt: skip

from wedgebrake.explorer.core.fields import Row, sections
from wedgebrake.explorer.core.formatting import number_text, parsed_numbers
from wedgebrake.explorer.core.state import PageState
from wedgebrake.explorer.ui.widgets.controls import FigurePane, on_user, style_sheet, update
from wedgebrake.figures.style import number

Edit = Callable[[str, Any, bool], None]
"""Takes a name, its new value, and True while the slider is dragged."""

_STEPS = 400  # of a slider
# Folds a section, or opens it, on the page only.
_FOLD = """
const folded = !section.css_classes.includes("folded")
const classes = folded ? ["folded"] : []
section.setv({css_classes: ["section", ...classes]}, {sync: false})
title.setv({css_classes: ["title", ...classes]}, {sync: false})
"""


class ParameterPanel:
    """Sections of parameters, with widgets of Bokeh: sixty of Panel's would slow down each page.

    edit   : called with each change by the user
    refuse : called with a sentence if an input cannot be read
    """

    def __init__(self, edit: Edit, refuse: Callable[[str], None], styles: InlineStyleSheet) -> None:
        self._arguments = (edit, refuse, styles)
        self._controls: dict[tuple[str, str], _Control] = {}
        sheet = InlineStyleSheet(css=style_sheet("parameters.css"))
        self._style: dict[str, Any] = {
            "stylesheets": [sheet], "margin": 0, "sizing_mode": "stretch_width",
        }  # fmt: skip
        self._column = Column(css_classes=["parameters"], **self._style)
        self._sections: dict[str, tuple[Column, Button, Div]] = {}
        self.view = FigurePane(
            self._column, css_classes=["parameters"], sizing_mode="stretch_width"
        )

    def show(self, state: PageState) -> None:
        """Show the values of a study."""
        found = sections(state)
        for title, rows in found.items():
            if title not in self._sections:
                column = Column(css_classes=["section"], **self._style)
                head = Button(label=title, css_classes=["title"], **self._style)
                head.js_on_click(CustomJS(args={"section": column, "title": head}, code=_FOLD))
                facts = Div(css_classes=["facts"], **self._style)
                self._sections[title] = column, head, facts
            self._show_section(*self._sections[title], rows)
        update(self._column, children=[self._sections[title][0] for title in found])

    def _show_section(self, column: Column, head: Button, facts: Div, rows: list[Row]) -> None:
        """Show rows, with controls made where there are none yet; and values that cannot be set."""
        widgets: list[Any] = [head]
        texts = []
        for row in rows:
            if row.kind == "fixed":
                texts.append(
                    f'<span title="{html.escape(row.hint)}" class="fact-{row.name}">'
                    f"{row.symbol} = {number(row.value)} {row.unit}</span>"
                )
                continue
            key = row.name, row.kind
            if key not in self._controls:
                self._controls[key] = _CONTROLS[row.kind](row, *self._arguments)
            self._controls[key].show(row)
            widgets += self._controls[key].widgets
        if texts:
            update(facts, text="".join(texts))
            widgets.append(facts)
        # Bokeh places children that are added later behind the existing ones.
        for place, widget in enumerate(widgets):
            update(widget, styles={**widget.styles, "order": str(place)})
        update(column, children=widgets)


def _place_of(row: Row, what: str = "input") -> str:
    """The class of an input, by which style sheets and tests find it."""
    return f"{what}-{row.name.replace('.', '-')}"


class _Control:
    def __init__(
        self, row: Row, edit: Edit, refuse: Callable[[str], None], styles: InlineStyleSheet
    ) -> None:
        self._row, self._edit, self._refuse, self._styles = row, edit, refuse, styles
        self.widgets: list[Any] = []

    def _add(self, widget: type, *classes: str, **options: Any) -> Any:
        self.widgets.append(
            widget(
                css_classes=[*classes], stylesheets=[self._styles], margin=0, width=None,
                sizing_mode="stretch_width", **options,
            )
        )  # fmt: skip
        return self.widgets[-1]

    def show(self, row: Row) -> None:
        """Show a value."""
        self._row = row
        for widget in self.widgets:
            update(widget, html_attributes={"title": row.hint}, disabled=not row.enabled)


class _Choice(_Control):
    def __init__(self, row: Row, *args: Any) -> None:
        super().__init__(row, *args)
        self._words = dict(row.choices)
        self._select = self._add(
            Select, "wide", _place_of(row), title=row.title,
            options=list(self._words.values()), value=self._words[row.value],
        )  # fmt: skip
        kinds = {words: kind for kind, words in row.choices}
        on_user(self._select, lambda words: self._edit(row.name, kinds.get(words), False))

    def show(self, row: Row) -> None:
        super().show(row)
        update(self._select, value=self._words[row.value])


class _Switch(_Control):
    def __init__(self, row: Row, *args: Any) -> None:
        super().__init__(row, *args)
        name = _place_of(row)
        self._box = self._add(Checkbox, "wide", name, label=row.title, active=row.value)
        on_user(self._box, lambda value: self._edit(row.name, value, False), "active")

    def show(self, row: Row) -> None:
        super().show(row)
        update(self._box, active=row.value)


class _List(_Control):
    """An input for numbers; with one number, an input beside a slider."""

    example = "write numbers with commas between them, for example 0, 0.1, 1."
    place: tuple[str, ...] = ("wide",)

    def __init__(self, row: Row, *args: Any) -> None:
        super().__init__(row, *args)
        name = row.title if "wide" in self.place else ""
        self._input = self._add(TextInput, *self.place, _place_of(row), title=name)
        self._input.styles = {"--unit": f'"{row.unit}"'}
        on_user(self._input, self._typed)

    def show(self, row: Row) -> None:
        super().show(row)
        update(self._input, value=self._text(row))

    def _text(self, row: Row) -> str:
        return ", ".join(map(number_text, row.value))

    def _typed(self, text: str) -> None:
        if text == self._text(self._row):
            return
        value = self._value(parsed_numbers(text))
        if value is None:
            self._refuse(f"{self._row.title}: {self.example}")
            update(self._input, value=self._text(self._row))
        else:
            self._edit(self._row.name, value, False)

    def _value(self, numbers: list[float] | None) -> Any:
        return numbers


class _Text(_Control):
    """A value that is shown and not edited."""

    def __init__(self, row: Row, *args: Any) -> None:
        super().__init__(row, *args)
        self._input = self._add(TextInput, "wide", _place_of(row), title=row.title, disabled=True)
        self._input.styles = {"--unit": f'"{row.unit}"'}

    def show(self, row: Row) -> None:
        super().show(row)
        update(self._input, value=str(row.value), disabled=True)


class _Number(_List):
    example = "write a number, for example 0.5."
    place = ("number",)

    def __init__(self, row: Row, *args: Any) -> None:
        super().__init__(row, *args)
        self._slider = self._add(
            Slider, _place_of(row, "slider"), title=row.title, show_value=False, tooltips=False,
            start=row.low, end=row.high, value=row.low,
        )  # fmt: skip
        self.widgets.reverse()
        on_user(self._slider, lambda place: self._slid(place, True))
        on_user(self._slider, lambda place: self._slid(place, False), "value_throttled")

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
        place = min(max(place, _place(row, row.low)), _place(row, row.high))
        if row.log:
            value = float(f"{10.0**place:.3g}")
        else:
            step = (row.high - row.low) / _STEPS
            value = round(place, 1 - math.floor(math.log10(step)))
        self._edit(row.name, round(value) if row.whole else value + 0.0, dragging)


def _place(row: Row, value: float) -> float:
    return math.log10(max(value, row.low)) if row.log else value


_CONTROLS: dict[str, type[_Control]] = {
    "number": _Number, "list": _List, "choice": _Choice, "switch": _Switch, "text": _Text,
}  # fmt: skip

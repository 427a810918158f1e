"""Panel's widgets with a tooltip, and the style sheets of the page."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import panel as pn
import param
from bokeh.models import InlineStyleSheet
from panel.widgets.base import Widget


def style_sheet(name: str) -> str:
    """Return a style sheet of this folder, embedded so that no route has to serve it."""
    return Path(__file__).with_name(name).read_text(encoding="utf-8")


def widget_styles() -> InlineStyleSheet:
    """Return the style sheet of the widgets of one page, as one model that they share."""
    return InlineStyleSheet(css=style_sheet("widgets.css"))


class _Hinted(Widget):
    """A widget with a tooltip and a shared style sheet."""

    hint = param.String(default="", doc="text shown while the pointer rests on the widget")
    shared = param.Parameter(default=None, doc="style sheet, as a model of Bokeh")

    _rename: ClassVar[dict[str, str | None]] = {"hint": "html_attributes", "shared": None}
    # A change is handled at once; Panel waits 50 ms for others.
    _debounce: ClassVar[int] = 0

    def _process_param_change(self, params: dict[str, Any]) -> dict[str, Any]:
        found: dict[str, Any] = super()._process_param_change(params)
        if "html_attributes" in found:
            found["html_attributes"] = {"title": found["html_attributes"]}
        if "stylesheets" in found and self.shared is not None:
            found["stylesheets"] = [*found["stylesheets"], self.shared]
        return found


class Slider(_Hinted, pn.widgets.FloatSlider):
    """A slider."""


class Input(_Hinted, pn.widgets.TextInput):
    """An input for numbers as text."""


class Select(_Hinted, pn.widgets.Select):
    """A choice from a list."""


class Checkbox(_Hinted, pn.widgets.Checkbox):
    """A switch."""


def update(one: Any, **values: Any) -> None:
    """Set parameters that differ, all at once."""
    changed = {name: value for name, value in values.items() if getattr(one, name) != value}
    if changed:
        one.param.update(**changed)

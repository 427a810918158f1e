"""The design of the page, widgets with tooltips, and changes of widgets by the user."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import panel as pn
import param
from bokeh.model import Model
from bokeh.models import InlineStyleSheet
from panel.theme.base import THEME_CSS
from panel.theme.native import Native
from panel.widgets.base import Widget


@cache
def style_sheet(name: str) -> str:
    """Return a style sheet of this folder, embedded so that no route has to serve it."""
    return Path(__file__).with_name(name).read_text(encoding="utf-8")


def widget_styles() -> InlineStyleSheet:
    """Return the style sheet of the widgets of one page, as one model that they share."""
    return InlineStyleSheet(css=style_sheet("widgets.css"))


class PageDesign(Native):
    """Panel's design without a style sheet in each widget: ``page_styles`` has its variables.

    Panel looks the sheets up anew at each change of each widget.
    """

    def params(self, viewable: Any, doc: Any = None) -> tuple[dict[str, Any], dict[str, Any]]:  # noqa: ARG002
        """Return no changes."""
        return {}, {}


@cache
def page_styles() -> list[str]:
    """Return the style sheets of the page as a whole."""
    return [(THEME_CSS / "default.css").read_text(encoding="utf-8"), style_sheet("theme.css")]


class FigurePane(pn.pane.Bokeh):
    """A figure or layout of Bokeh, which Panel does not search for callbacks of notebooks."""

    margin = 0
    sizing_mode = "stretch_both"

    def _get_model(self, doc: Any, root: Any = None, parent: Any = None, comm: Any = None) -> Any:  # noqa: ARG002
        self._models[root.ref["id"]] = (self.object, parent)
        return self.object


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


class Input(_Hinted, pn.widgets.TextInput):
    """An input for numbers as text."""

    def _process_event(self, event: Any) -> None:
        """Ignore the Enter key: the browser also reports the changed text, and once is enough."""


class Select(_Hinted, pn.widgets.Select):
    """A choice from a list."""


class Checkbox(_Hinted, pn.widgets.Checkbox):
    """A switch."""


class FileChooser:
    """A button that loads a file from the user's computer; ``view`` shows it.

    load : called with the name and content of each file
    """

    def __init__(
        self, accept: str, name: str, load: Callable[[str, bytes], None], style: dict[str, Any]
    ) -> None:
        self._accept, self._name, self._load, self._style = accept, name, load, style
        self.view = pn.Row(self._new(), css_classes=["files"], **style)

    def _new(self) -> Any:
        chosen = pn.widgets.FileInput(accept=self._accept, css_classes=[self._name], **self._style)
        # The value is not watched, because it does not change if the file is empty.
        chosen.param.watch(self._loaded, "filename")
        return chosen

    def _loaded(self, event: Any) -> None:
        name, content = event.obj.filename, event.obj.value
        # A new input, so that the same file can be chosen again.
        self.view[:] = [self._new()]
        if isinstance(name, str):
            self._load(name, content if isinstance(content, bytes) else b"")


_UPDATED: set[int] = set()


def update(one: Any, **values: Any) -> None:
    """Set properties of a widget of Panel or Bokeh that differ; ``on_user`` does not notice."""
    changed = {name: value for name, value in values.items() if getattr(one, name) != value}
    if changed:
        _UPDATED.add(id(one))
        try:
            (one if isinstance(one, Model) else one.param).update(**changed)
        finally:
            _UPDATED.discard(id(one))


def on_user(widget: Any, call: Callable[[Any], None], name: str = "value") -> None:
    """Call a function with each value that the user gives to a property of a widget."""

    def changed(value: Any) -> None:
        if id(widget) not in _UPDATED:
            call(value)

    if isinstance(widget, Model):
        widget.on_change(name, lambda _attr, _old, new: changed(new))
    else:
        widget.param.watch(lambda event: changed(event.new), name)

"""The bar at the top: presets, files, friction law, comparison, parts, activity and help."""

from __future__ import annotations

import html
import io
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import panel as pn
from bokeh.models import InlineStyleSheet

from wedgebrake.explorer.core.export import File
from wedgebrake.explorer.core.presets import Preset
from wedgebrake.explorer.core.state import PageState
from wedgebrake.explorer.core.values import chosen_of
from wedgebrake.explorer.ui.widgets.controls import (
    Checkbox,
    FileChooser,
    Select,
    on_user,
    style_sheet,
    update,
)
from wedgebrake.explorer.ui.widgets.help import HELP
from wedgebrake.model.friction import CoulombFriction, SmoothedFriction, TabulatedFriction

_EXPORTS = [
    ("Response, PNG", "png"), ("Response, SVG", "svg"), ("Open plot, PNG", "diagram-png"),
    ("Open plot, SVG", "diagram-svg"), ("Open plot data, CSV", "diagram-csv"), None,
    ("Response data, netCDF", "netcdf"),
    ("Response data, CSV", "csv"), ("Response data, MATLAB", "mat"), None,
    ("Study file, TOML", "study"), ("Python program", "python"),
]  # fmt: skip
_LAWS = {
    CoulombFriction.kind: "Exact", SmoothedFriction.kind: "Smoothed",
    TabulatedFriction.kind: "Table",
}  # fmt: skip
_BRAND = (
    '<svg width="24" height="20" viewBox="0 0 24 20" aria-hidden="true"><rect x="1" y="1"'
    ' width="22" height="3" rx="1" fill="#5B6675"/><path d="M2 17.5L22 17.5L22 6Z"'
    ' fill="#0072B2"/></svg><b>wedgebrake</b>'
)


class Header:
    """The bar at the top.

    choose : called with the name of a preset
    load   : called with name and content of a file
    export : called with a format
    edit   : called with a name and its new value
    """

    def __init__(
        self,
        presets: Iterable[Preset],
        choose: Callable[[str], None],
        load: Callable[[str, bytes], None],
        export: Callable[[str], None],
        edit: Callable[[str, Any], None],
        styles: InlineStyleSheet,
    ) -> None:
        self._style = {"stylesheets": [style_sheet("header.css")], "margin": 0}
        shared = {"shared": styles, "margin": 0}
        groups: dict[str, dict[str, str]] = {"Presets": {"Choose a machine …": ""}}
        for one in presets:
            groups.setdefault(one.group, {})[one.title] = one.name
        self._presets = Select(groups=groups, value="", css_classes=["preset"], width=280, **shared)
        files = FileChooser(".toml", "load", load, self._style).view
        exports = pn.widgets.MenuButton(
            label="Export", items=_EXPORTS, css_classes=["export"], **self._style
        )
        save = pn.widgets.Button(label="Save", css_classes=["save"], **self._style)
        self._law = pn.widgets.RadioButtonGroup(css_classes=["law"], **self._style)
        self._comparison = Checkbox(
            label="conventional brake behind", css_classes=["comparison"], **shared
        )
        self._inertia, self._contact = (
            Select(options=[], css_classes=[f"of-{what}"], width=60, hint=f"{words} that is shown",
                   visible=False, **shared)
            for what, words in (("inertia", "Inertia"), ("contact", "Contact"))
        )  # fmt: skip
        self._busy = pn.pane.HTML(css_classes=["busy"], **self._style)
        self._download = pn.widgets.FileDownload(
            filename="study.toml", auto=True, css_classes=["unseen"], **self._style
        )
        self.view = pn.Row(
            pn.pane.HTML(_BRAND, css_classes=["brand"], **self._style),
            self._presets, files, save, exports, self._law, self._comparison,
            self._inertia, self._contact, self._busy,
            pn.pane.HTML(HELP, css_classes=["help"], **self._style), self._download,
            css_classes=["header"], sizing_mode="stretch_width", **self._style,
        )  # fmt: skip
        on_user(self._presets, choose)
        save.on_click(lambda _: export("study"))
        exports.on_click(lambda event: export(event.new))
        self._friction = "friction"
        on_user(self._law, lambda kind: edit(self._friction, kind))
        on_user(self._inertia, partial(edit, "of_inertia"))
        on_user(self._contact, partial(edit, "of_contact"))
        on_user(self._comparison, partial(edit, "comparison"))

    def show(self, state: PageState) -> None:
        """Show the friction law, the comparison, and the parts whose motion is shown."""
        self._friction = "friction" if state.contact is None else f"{state.contact}.friction"
        friction = chosen_of(state.system).get(self._friction)
        kind = "" if friction is None else friction.kind
        laws = [CoulombFriction.kind, SmoothedFriction.kind]
        laws += [] if kind in laws else [kind]
        update(
            self._law, options={_LAWS.get(one, one): one for one in laws},
            value=kind, visible=friction is not None,
        )  # fmt: skip
        update(
            self._comparison, value=state.view.comparison and state.comparable,
            disabled=not state.comparable, visible=state.counted,
            hint="Show the same system with a conventional brake of the same radius."
            if state.comparable else "The brake is the conventional one.",
        )  # fmt: skip
        for widget, names, value in (
            (self._inertia, state.system.coords.get("inertia", ()), state.inertia),
            (self._contact, state.system.coords.get("contact", ()), state.contact),
        ):
            update(widget, options=list(names), value=value, visible=len(names) > 1)

    def choose(self, name: str) -> None:
        """Show which preset is loaded; none for an empty name."""
        update(self._presets, value=name)

    def busy(self, text: str) -> None:
        """Show the work in progress; nothing for an empty text."""
        update(self._busy, object=html.escape(text))

    def deliver(self, file: File) -> None:
        """Hand a file to the browser, which saves it."""
        self._download.param.update(filename=file.name, file=io.BytesIO(file.content))
        self._download._transfer()

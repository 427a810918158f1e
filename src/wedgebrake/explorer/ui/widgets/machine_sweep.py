"""Controls of a sweep of a machine: parameters, ranges, picture."""

from __future__ import annotations

from collections.abc import Callable

import panel as pn

from wedgebrake.explorer.core.machine_sweep import (
    DIAGRAMS,
    LIMITS,
    MAPS,
    SweepRequest,
    parameter_labels,
    usual_parameter,
    usual_range,
)
from wedgebrake.explorer.ui.widgets.controls import Checkbox, Select, on_user, update
from wedgebrake.model.machine import Machine

_NONE = "(no second parameter)"


class MachineSweepForm:
    """A form for a sweep over one or two parameters of a machine.

    start : called with the ``SweepRequest`` when the button is pressed
    """

    def __init__(self, machine: Machine, start: Callable[[SweepRequest], None]) -> None:
        self._start = start
        names = {words: name for name, words in parameter_labels(machine).items()}
        self._picture = Select(width=250, css_classes=["picture"], hint="Picture")
        self._first = _Range("first", names, usual_parameter(machine), machine)
        self._second = _Range("second", {_NONE: "", **names}, "", machine)
        self._follow = Checkbox(
            label="up and down", css_classes=["follow"],
            hint="Start each value where its neighbour ended, upwards and downwards",
        )  # fmt: skip
        self._inertia, self._contact = (
            Select(options=[one.name for one in parts], width=130, css_classes=[what],
                   hint=f"{what.capitalize()} that is shown", visible=len(parts) > 1)
            for what, parts in (("inertia", machine.inertias), ("contact", machine.contacts))
        )  # fmt: skip
        button = pn.widgets.Button(
            name="Compute", css_classes=["compute"], button_type="primary", width=90
        )
        button.on_click(lambda _: start(self._request()))
        self._offer()
        for widget in (self._second.name, self._picture):
            on_user(widget, lambda _: self._offer())
        self.view = pn.Column(
            pn.Row(self._picture, self._inertia, self._contact, button),
            pn.Row(*self._first.widgets, self._follow),
            pn.Row(*self._second.widgets),
            css_classes=["sweep"],
        )

    def _offer(self) -> None:
        """Offer the pictures for the chosen number of parameters."""
        maps = bool(self._second.name.value)
        wanted = {words: name for name, words in (MAPS if maps else DIAGRAMS).items()}
        if self._picture.options != wanted:
            update(self._picture, options=wanted, value=next(iter(wanted.values())))
        update(self._follow, visible=not maps and self._picture.value != LIMITS)

    def _request(self) -> SweepRequest:
        ranges = [one for one in (self._first, self._second) if one.name.value]
        return SweepRequest(
            self._picture.value,
            tuple((one.name.value, one.low.value, one.high.value) for one in ranges),
            follow=bool(self._follow.value) and len(ranges) == 1,
            inertia=self._inertia.value,
            contact=self._contact.value,
        )


class _Range:
    def __init__(self, place: str, names: dict[str, str], name: str, machine: Machine) -> None:
        self._machine = machine
        self.name = Select(
            options=names, value=name, width=250, css_classes=[place], hint="Parameter"
        )
        self.low, self.high = (
            pn.widgets.FloatInput(css_classes=[f"{place}-{end}"], width=110)
            for end in ("from", "to")
        )
        self.widgets = (self.name, self.low, self.high)
        self._set_range(name)
        on_user(self.name, self._set_range)

    def _set_range(self, name: str) -> None:
        for field, value in zip(self.widgets[1:], usual_range(self._machine, name), strict=True):
            update(field, value=value, visible=bool(name))

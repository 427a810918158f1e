"""Controls of a sweep of a machine: parameters, ranges, picture."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import panel as pn

from wedgebrake.explorer.core.formatting import number_text, parsed_numbers
from wedgebrake.explorer.core.machine_sweep import (
    DIAGRAMS,
    LIMITS,
    MAPS,
    SweepRequest,
    parameter_labels,
    usual_parameter,
    usual_range,
)
from wedgebrake.explorer.ui.widgets.controls import Checkbox, Input, Select, on_user, update
from wedgebrake.model.machine import Machine

_NONE = "(no second parameter)"


class MachineSweepForm:
    """A form for a sweep over one or two parameters of a machine.

    start  : called with the ``SweepRequest`` when the button is pressed
    refuse : called with a message if an input is not a number
    """

    def __init__(
        self,
        machine: Machine,
        start: Callable[[SweepRequest], None],
        refuse: Callable[[str], None],
    ) -> None:
        self._start = start
        names = {words: name for name, words in parameter_labels(machine).items()}
        self._picture = Select(width=250, css_classes=["picture"], hint="Picture")
        self._first = _Range("first", names, usual_parameter(machine), machine, refuse)
        self._second = _Range("second", {_NONE: "", **names}, "", machine, refuse)
        self._follow = Checkbox(
            label="up and down", css_classes=["follow"], align="center",
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
            tuple((one.name.value, *one.ends) for one in ranges),
            follow=bool(self._follow.value) and len(ranges) == 1,
            inertia=self._inertia.value,
            contact=self._contact.value,
        )


class _Range:
    """A parameter and the ends of its range: the last valid numbers that were entered."""

    def __init__(
        self,
        place: str,
        names: dict[str, str],
        name: str,
        machine: Machine,
        refuse: Callable[[str], None],
    ) -> None:
        self._machine, self._refuse = machine, refuse
        self.ends = [0.0, 1.0]
        self.name = Select(
            options=names, value=name, width=250, css_classes=[place], hint="Parameter"
        )
        self._inputs = [
            Input(css_classes=[f"{place}-{end}"], hint=end, width=110) for end in ("from", "to")
        ]
        self.widgets = (self.name, *self._inputs)
        self._set_range(name)
        on_user(self.name, self._set_range)
        for end, field in enumerate(self._inputs):
            on_user(field, partial(self._typed, end))

    def _set_range(self, name: str) -> None:
        self.ends = [*usual_range(self._machine, name)]
        for field, value in zip(self._inputs, self.ends, strict=True):
            update(field, value=number_text(value), visible=bool(name))

    def _typed(self, end: int, text: str) -> None:
        field, numbers = self._inputs[end], parsed_numbers(text)
        if numbers is not None and len(numbers) == 1:
            self.ends[end] = numbers[0]
        else:
            self._refuse(
                f"{self.name.value}, {field.hint}: {text!r} is not a number. Enter one, for example"
                f" {number_text(self.ends[end])}. The value is unchanged."
            )
        update(field, value=number_text(self.ends[end]))

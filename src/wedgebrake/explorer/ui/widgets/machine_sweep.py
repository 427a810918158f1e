"""Controls of a sweep of a machine: parameters, ranges, picture."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import panel as pn

from wedgebrake.errors import InputError
from wedgebrake.explorer.core.formatting import number_text, parsed_numbers
from wedgebrake.explorer.core.machine_sweep import (
    DIAGRAMS,
    LIMITS,
    MAPS,
    SweepOrder,
    choices,
    usual_parameter,
    usual_range,
)
from wedgebrake.explorer.ui.widgets.controls import Checkbox, Input, Select, on_user, update
from wedgebrake.model.machine import Machine

_NONE = "(no second parameter)"


class MachineSweepForm:
    """A form for a sweep over one or two parameters of a machine.

    start  : called with the ``SweepOrder`` when the button is pressed
    refuse : called with a message if an input is not a number
    """

    def __init__(
        self,
        machine: Machine,
        start: Callable[[SweepOrder], None],
        refuse: Callable[[str], None],
    ) -> None:
        self._machine, self._start, self._refuse = machine, start, refuse
        names = {label: name for name, label in choices(machine).items()}
        first = usual_parameter(machine)
        self._picture = Select(
            options=_labels(DIAGRAMS), width=250, css_classes=["picture"], hint="Picture"
        )
        self._first = _Range("first", names, first, machine)
        self._second = _Range("second", {_NONE: "", **names}, "", machine)
        self._follow = Checkbox(
            name="up and down", css_classes=["follow"],
            hint="Start each value where its neighbour ended, upwards and downwards",
        )  # fmt: skip
        self._inertia, self._contact = (
            Select(options=[one.name for one in parts], width=130, css_classes=[what], hint=words)
            for parts, what, words in (
                (machine.inertias, "inertia", "Inertia that is shown"),
                (machine.contacts, "contact", "Contact that is shown"),
            )
        )
        self._inertia.visible = len(machine.inertias) > 1
        self._contact.visible = len(machine.contacts) > 1
        button = pn.widgets.Button(
            name="Compute", css_classes=["compute"], button_type="primary", width=90
        )
        button.on_click(lambda _: self._ask())
        on_user(self._second.name, lambda _: self._offer())
        on_user(self._picture, lambda _: self._offer())
        self.view = pn.Column(
            pn.Row(self._picture, self._inertia, self._contact, button),
            pn.Row(*self._first.widgets, self._follow),
            pn.Row(*self._second.widgets),
            css_classes=["sweep"],
        )

    def _offer(self) -> None:
        """Offer the pictures for the chosen number of parameters."""
        maps = bool(self._second.name.value)
        wanted = _labels(MAPS if maps else DIAGRAMS)
        if self._picture.options != wanted:
            update(self._picture, options=wanted, value=next(iter(wanted.values())))
        update(self._follow, visible=not maps and self._picture.value != LIMITS)

    def _ask(self) -> None:
        try:
            order = SweepOrder(
                self._picture.value, self._first.name.value, *self._first.ends(),
                self._second.name.value, *self._second.ends(),
                follow=bool(self._follow.value) and not self._second.name.value,
                inertia=self._inertia.value, contact=self._contact.value,
            )  # fmt: skip
        except InputError as error:
            self._refuse(str(error))
            return
        self._start(order)


class _Range:
    """Inputs for a parameter and its range."""

    def __init__(self, place: str, names: dict[str, str], name: str, machine: Machine) -> None:
        self._machine = machine
        self.name = Select(
            options=names, value=name, width=250, css_classes=[place], hint="Parameter"
        )
        self._low = Input(css_classes=[f"{place}-from"], hint="from", width=90)
        self._high = Input(css_classes=[f"{place}-to"], hint="to", width=90)
        self.widgets = (self.name, self._low, self._high)
        self._set_range(name)
        on_user(self.name, self._set_range)

    def _set_range(self, name: str) -> None:
        low, high = usual_range(self._machine, name)
        update(self._low, value=number_text(low), visible=bool(name))
        update(self._high, value=number_text(high), visible=bool(name))

    def ends(self) -> tuple[float, float]:
        """The ends of the range; raises ``InputError`` for anything but numbers."""
        found = []
        for field in (self._low, self._high):
            numbers = parsed_numbers(field.value)
            if not numbers or len(numbers) != 1:
                raise InputError(f"{self.name.value}: {field.value!r} is not a number.")
            found.append(float(numbers[0]))
        return found[0], found[1]


def _labels(named: dict[str, str]) -> dict[str, Any]:
    return {words: name for name, words in named.items()}

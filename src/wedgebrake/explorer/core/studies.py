"""Studies put on the desk, and what lies there made a study again."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from wedgebrake.errors import InputError
from wedgebrake.explorer.core.calls import picture
from wedgebrake.explorer.core.state import Desk, View
from wedgebrake.model.study import Study
from wedgebrake.model.sweep_settings import INITIAL, SWEEP_SETTINGS, Sweep, swept_values

_SPAN = ("from", "to", "points", "scale")


def opened(study: Study, view: View | None = None) -> Desk:
    """A study on a desk, seen as before, its sweep as the picture that lies open.

    Raises ``InputError`` for a machine that the explorer cannot show.
    """
    desk = Desk.of(study)
    for name in (one.name for one in fields(View) if one.name != "spans"):
        try:
            desk = desk.edited(**{name: getattr(view or View(), name)})
        except InputError:  # a parameter that this machine does not have
            continue
    return _with_sweep(desk, study.sweep)


def _with_sweep(desk: Desk, sweep: Sweep) -> Desk:
    swept = {
        name: (float(np.min(values)), float(np.max(values)))
        for name, values in sweep.parameters().items()
    }
    spans = {name: one for name, one in swept.items() if one[0] < one[1]}
    names = list(swept)
    changes: dict[str, Any] = {"spans": spans}
    if set(names) == set(INITIAL):
        changes["plate"] = "basins"
    elif len(names) == 1 and names[0] not in INITIAL:
        changes |= {"plate": "diagram", "axis": names[0]}
    elif len(names) == 2 and not set(names) & set(INITIAL):
        changes |= {"plate": "regimes", "across": names[0], "up": names[1]}
    return desk.edited(**changes) if swept else desk


def filed(desk: Desk) -> Study:
    """The study on a desk, with the picture that lies open as its sweep.

    Where there is no such picture, or it needs no sweep, the study as it is.
    """
    try:
        call = picture(desk)
    except InputError:
        return desk.study
    if call.function == "stability_map":
        return desk.study
    tables = tuple(
        (name, swept_values(dict(zip(_SPAN, one, strict=True)), f"{name}."))
        for name, one in call.axes.items()
    )
    settings = {name: call.options[name] for name in SWEEP_SETTINGS if name in call.options}
    return desk.study.changed(sweep=Sweep(**settings, axes=tables))

"""Study files as states of the page, and states as studies."""

from __future__ import annotations

from typing import Any

import numpy as np

from wedgebrake.errors import InputError
from wedgebrake.explorer.core.presets import START, preset
from wedgebrake.explorer.core.program import picture
from wedgebrake.explorer.core.state import PageState, PageView, axes
from wedgebrake.model.studies.study import Study
from wedgebrake.model.studies.sweep_settings import (
    SWEEP_SETTINGS,
    Sweep,
    swept_values,
)

_SPAN = ("from", "to", "points", "scale")


def opened(study: Study | None) -> PageState:
    """The state of a new page: of a study, by default of the first preset."""
    return preset(START).state() if study is None else state_of(study)


def state_of(study: Study, view: PageView | None = None) -> PageState:
    """The state of a study, in the same view, with its sweep as the open plot.

    Raises ``InputError`` for a system that the explorer cannot edit.
    """
    state = PageState.of(study)
    kept = (
        "comparison", "shown", "plot", "quantity", "follow", "axis", "across", "up", "measure",
        "samplings", "trace", "column", "observe", "free",
    )  # fmt: skip
    for name in kept if view else ():
        try:
            state = state.edited(**{name: getattr(view, name)})
        except InputError:  # a parameter that this machine does not have
            continue
    return _with_sweep(state, state.study.sweep)


def _with_sweep(state: PageState, sweep: Sweep) -> PageState:
    swept = {
        name: (float(np.min(values)), float(np.max(values)))
        for name, values in sweep.parameters().items()
    }
    spans = {name: one for name, one in swept.items() if one[0] < one[1]}
    names, initial = list(swept), {*state.system.initial_conditions}
    possible = {*axes(state.system)}
    changes: dict[str, Any] = {"spans": spans}
    if any("," in name for name in names):  # parameters that are tied
        return state
    if len(names) == 2 and set(names) <= initial:
        changes["plot"] = "basins"
    elif len(names) == 1 and names[0] in possible:
        follow = sweep.follow is not None
        changes |= {"plot": "diagram", "axis": names[0], "follow": follow}
    elif len(names) == 2 and set(names) <= possible:
        changes |= {"plot": "regimes", "across": names[0], "up": names[1]}
    return state.edited(**changes) if swept else state


def study_of(state: PageState) -> Study:
    """The study of a state, with the open plot as its sweep.

    If there is no such plot, or it needs no sweep, the study is unchanged.
    """
    try:
        call = picture(state)
    except InputError:
        return state.study
    if call.function in ("stability_map", "response_curve"):
        return state.study
    tables = tuple(
        (name, swept_values(dict(zip(_SPAN, one, strict=True)), f"{name}."))
        for name, one in call.axes.items()
    )
    settings = {name: call.options[name] for name in SWEEP_SETTINGS if name in call.options}
    if settings.get("follow"):  # True in a call, the name of the parameter in a study
        (settings["follow"],) = call.axes
    return state.study.changed(sweep=Sweep(**settings, axes=tables))

"""The page for a machine with several inertias: its response, sweeps and stability limits."""

from __future__ import annotations

import html
from typing import Any

import panel as pn

from wedgebrake.explorer.core.machine_sweep import SweepPicture, SweepRequest, sweep_pictures
from wedgebrake.explorer.core.machine_view import MachineView, take_machine_view
from wedgebrake.explorer.core.scheduler import Scheduler
from wedgebrake.explorer.ui.page import Page
from wedgebrake.explorer.ui.widgets.machine_sweep import MachineSweepForm
from wedgebrake.model.studies.study import Study

_STARTING = "Simulating. The first use compiles part of the solver (up to about a minute)."
_HOW = "This machine cannot be edited here. Change the study file and restart the explorer."
_SWEEP = "<h3>Over a parameter</h3>"
_COMPUTING = "Computing ..."


class MachinePage(Page):
    """A page that shows the study of a machine."""

    def __init__(self, study: Study, scheduler: Scheduler | None = None) -> None:
        super().__init__(scheduler)
        self._text = pn.pane.HTML(_paragraphs([_STARTING]), sizing_mode="stretch_width")
        self._picture = pn.pane.PNG(None, sizing_mode="scale_width", max_width=1200)
        self._study = study
        machine: Any = study.system
        self._form = MachineSweepForm(machine, self._sweep, self.refuse)
        self._said = pn.pane.HTML("", css_classes=["said"], sizing_mode="stretch_width")
        self._sweep_picture = pn.pane.PNG(
            None, sizing_mode="scale_width", max_width=1000, css_classes=["sweep-picture"]
        )
        self._page = pn.Column(
            self._text, self._picture, pn.pane.HTML(_SWEEP), self._form.view, self._said,
            self._sweep_picture, sizing_mode="stretch_width", margin=(8, 16),
        )  # fmt: skip
        self._sweep_slot, views = self.slot(), (take_machine_view(one) for one in [study])
        pn.state.onload(lambda: self.slot().start(views, self._show, self._fail))

    def _show(self, view: MachineView) -> None:
        with pn.io.hold():
            head = f"<h2>{html.escape(view.headline)}</h2>"
            self._text.object = head + _paragraphs([*view.sentences, _HOW])
            self._picture.object = view.picture

    def _sweep(self, request: SweepRequest) -> None:
        self._say(_COMPUTING)
        self._sweep_slot.start(sweep_pictures(self._study, request), self._show_sweep, self._say)

    def _show_sweep(self, found: SweepPicture) -> None:
        with pn.io.hold():
            self._sweep_picture.object = found.picture
            self._say(f"{_COMPUTING} {found.progress}" if found.progress else "")

    def _say(self, words: str) -> None:
        self._said.object = _paragraphs([words] if words else [])

    def _fail(self, words: str) -> None:
        self._text.object = _paragraphs([words, _HOW])


def _paragraphs(sentences: list[str]) -> str:
    return "".join(f"<p>{html.escape(one)}</p>" for one in sentences)

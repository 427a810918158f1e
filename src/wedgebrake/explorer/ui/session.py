"""One user's page: edits change the current study; motion and plots are computed and shown."""

from __future__ import annotations

import functools
import logging
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import panel as pn
from bokeh.events import Tap

from wedgebrake.analysis.fitting.fit import Fit
from wedgebrake.errors import InputError
from wedgebrake.explorer.core.export import File, export
from wedgebrake.explorer.core.fits import fits, of_machine
from wedgebrake.explorer.core.limits import MOST_FILES, MOST_UPLOAD
from wedgebrake.explorer.core.plots import PARAMETER_PLOTS
from wedgebrake.explorer.core.presets import PRESETS, preset
from wedgebrake.explorer.core.scheduler import Scheduler, file_scheduler, is_wanted
from wedgebrake.explorer.core.snapshot import Snapshot, take_snapshot
from wedgebrake.explorer.core.state import PageState, PageView
from wedgebrake.explorer.core.studies import state_of
from wedgebrake.explorer.core.traces import MeasuredTrace, read
from wedgebrake.explorer.core.verdict import verdict
from wedgebrake.explorer.ui.page import LASTING, Page
from wedgebrake.explorer.ui.widgets.brake_animation import BrakeAnimation
from wedgebrake.explorer.ui.widgets.controls import FigurePane, style_sheet, widget_styles
from wedgebrake.explorer.ui.widgets.header import Header
from wedgebrake.explorer.ui.widgets.parameters import ParameterPanel
from wedgebrake.explorer.ui.widgets.plot_tabs import PlotTabs
from wedgebrake.explorer.ui.widgets.trace_panel import TracePanel
from wedgebrake.explorer.ui.widgets.verdict_strip import VerdictStrip
from wedgebrake.figures.bokeh.bifurcation import BifurcationPlot
from wedgebrake.figures.bokeh.class_map import MapPlot
from wedgebrake.figures.bokeh.curve import CurvePlot
from wedgebrake.figures.bokeh.motion import (
    HistoryChart,
    PhaseChart,
    SectionChart,
    SpectrumChart,
    TorqueChart,
)
from wedgebrake.figures.bokeh.trace import TracePlot
from wedgebrake.model.studies.study import Study, read_study

_LOG = logging.getLogger("wedgebrake.explorer")

# Urgency of work: the motion before plots, coarse plots before finer ones.
_MOTION, _DRAFT, _SETTLED, _FINER = 0, 1, 2, 3
# Time without a change after which finer work begins [s].
_STILL = 0.3
# Least time between two updates of the page; each includes all edits until then [ms].
_GAP = 40
# Slots for the motion, for plots, for files that are loaded and for fits; others prepare files.
_SLOTS = 4


def _reported(action: Callable[..., None]) -> Callable[..., None]:
    """Show a notice if an action fails."""

    @functools.wraps(action)
    def wrapped(self: Explorer, *arguments: Any) -> None:
        try:
            action(self, *arguments)
        except InputError as error:
            self.refuse(str(error))
        except Exception as error:
            _LOG.exception("an action of the user failed")
            self.refuse(f"internal error: {type(error).__name__}: {error}")

    return wrapped


class Explorer(Page):
    """The page: the current study, the widgets that show it, work in progress."""

    def __init__(self, state: PageState, scheduler: Scheduler | None = None) -> None:
        super().__init__(scheduler)
        # The current state, and the displayed state.
        self._state = self._shown = state
        self._number, self._preset_name = 0, ""
        # Inputs of the displayed motion.
        self._computed: Any = None
        self._waiting, self._behind = False, False
        # While a slider is dragged: its parameter, and the state before.
        self._dragged: tuple[str, PageState] | None = None
        # Inputs of the open plot; inputs and contents of the complete plots.
        self._plot_key: Any = None
        self._complete: dict[str, tuple[Any, Any]] = {}
        self._picture: Any = None
        styles = widget_styles()
        self._header = Header(PRESETS.values(), self._choose, self._upload, self._export,
                              lambda name, value: self._edit({name: value}), styles)  # fmt: skip
        self._parameters = ParameterPanel(
            lambda name, value, dragging: self._edit({name: value}, dragging), self.refuse, styles
        )
        self._verdict = VerdictStrip()
        history, section, spectrum = HistoryChart(), SectionChart(), SpectrumChart()
        phase, torque = PhaseChart(history), TorqueChart()
        self._charts = (history, phase, section, spectrum, torque)
        self._animation = BrakeAnimation(sizing_mode="stretch_both", margin=0)
        self._plots: dict[str, BifurcationPlot | MapPlot | CurvePlot | TracePlot] = {}
        self._tabs = PlotTabs(self._edit, self._stop, styles)
        self._measured = TracePanel(
            self._upload_trace, self._edit, self._fit, self._take, self.refuse, styles
        )
        self._fitted: Fit | None = None
        self._plot(state.view.plot)
        cards = {
            "history": FigurePane(history.figure), "phase": FigurePane(phase.figure),
            "brake": self._animation, "spectrum": FigurePane(spectrum.figure),
            "section": FigurePane(section.figure), "torque": FigurePane(torque.figure),
            "plots": self._tabs.view,
        }  # fmt: skip
        for name, card in cards.items():
            card.css_classes = [*card.css_classes, "card", name]
        layout = {"stylesheets": [style_sheet("page.css")], "margin": 0}
        layout["sizing_mode"] = "stretch_both"
        main = pn.Column(self._verdict.view, *cards.values(), css_classes=["main"], **layout)
        self._page = pn.Column(
            self._header.view, self._parameters.view, main, css_classes=["explorer"], **layout
        )
        self._motion_slot, self._plot_slot, self._study_slot, self._fit_slot = (
            self.slot() for _ in range(_SLOTS)
        )
        self._show_values(state)
        # Not before the browser is connected: earlier messages may be lost.
        pn.state.onload(lambda: self._set_state(self._state))

    @property
    def state(self) -> PageState:
        """The current study and its view."""
        return self._state

    def begin_again(self) -> None:
        """Compute the motion and the open plot, after a pause."""
        del self._slots[_SLOTS:]  # files that were in progress
        self._measured.clear()
        self._computed = self._plot_key = None
        self._update()

    def show_compiling(self, words: str) -> None:
        """Show the progress of compilation; called in any thread."""
        self._post(partial(self._header.busy, words))
        if words and not self._verdict.number:
            self._post(partial(self._verdict.starting, words))

    # Actions of the user

    @_reported
    def _edit(self, changes: dict[str, Any], dragging: bool = False) -> None:
        # Intermediate values of a slider have no lasting effect: all of them edit the same state.
        name, base = next(iter(changes)), self._state
        if self._dragged is not None and self._dragged[0] == name:
            base = self._dragged[1]
        self._dragged = (name, base) if dragging else None
        try:
            state = base.edited(**changes)
        except InputError:
            self._show_values(self._state)
            raise
        self._set_state(state)

    @_reported
    def _choose(self, name: str) -> None:
        view, self._dragged = self._state.view, None
        state = preset(name).state().edited(comparison=view.comparison, shown=view.shown)
        self._set_state(state, name)

    @_reported
    def _upload(self, name: str, content: bytes) -> None:
        name = name[:60]
        if len(content) > MOST_UPLOAD:
            raise InputError(f"{name}: is larger than {MOST_UPLOAD} bytes.")
        self._study_slot.start(
            _loaded(name, content, self._state.view), partial(self._show_loaded, name),
            self.refuse, urgency=_MOTION,
        )  # fmt: skip

    @_reported
    def _upload_trace(self, name: str, content: bytes) -> None:
        name = name[:60]
        self._study_slot.start(
            _traces(name, content), self._show_trace, self.refuse, urgency=_MOTION
        )

    @_reported
    def _show_trace(self, trace: MeasuredTrace) -> None:
        self._fit_slot.stop()
        self._edit({"trace": trace})

    @_reported
    def _fit(self, start: bool) -> None:
        """Start a fit to the trace, or stop it."""
        self._fit_slot.stop()
        if not start:
            self._measured.clear()
            return
        self._measured.fitting()
        self._fit_slot.start(
            fits(self._state), self._show_fit, self._measured.show_no_fit, urgency=_FINER
        )

    @_reported
    def _show_fit(self, found: Fit) -> None:
        self._fitted = found
        self._measured.show_fit(found, takes=bool(of_machine(self._state, found.values)))

    @_reported
    def _take(self) -> None:
        """Apply the fitted values to the machine."""
        if self._fitted is not None:
            self._edit(of_machine(self._state, self._fitted.values))

    @_reported
    def _show_loaded(self, name: str, loaded: tuple[Study, PageState]) -> None:
        study, state = loaded
        self._dragged = None
        self._preset_name = ""
        self._set_state(state)
        notice = f"Loaded {name}"
        unit = "periods" if state.counted else "duration"
        asked, run = getattr(study.run, unit, None), state.value(unit)
        if asked in (None, run):
            self.notify(f"{notice}.")
        elif state.counted:
            self.notify(f"{notice}; run for {run} periods of the torque instead of {asked}.",
                        "success", LASTING)  # fmt: skip
        else:
            self.notify(f"{notice}; run for {run:g} s instead of {asked:g} s.", "success", LASTING)

    @_reported
    def _export(self, kind: str) -> None:
        if len(self._slots) >= _SLOTS + MOST_FILES:
            raise InputError(f"{MOST_FILES} files are being prepared. Wait for one of them.")
        slot = self.slot(file_scheduler())
        self._show_busy()

        def finished() -> None:
            self._slots.remove(slot)
            self._show_busy()

        def failed(words: str) -> None:
            finished()
            self.refuse(words)

        slot.start(_exported(self._state, kind), self._header.deliver, failed,
                   finished=finished)  # fmt: skip

    def _show_busy(self) -> None:
        self._header.busy("Preparing the file …" if len(self._slots) > _SLOTS else "")

    def _tapped(self, event: Tap) -> None:
        if event.x is None or event.y is None:
            return
        plot = PARAMETER_PLOTS[self._state.view.plot]
        try:
            changes = plot.pick(self._state, float(event.x), float(event.y))
        except InputError:  # there is no plot; the reason is shown instead
            return
        if changes:
            self._edit(changes)

    # Display

    def _set_state(self, state: PageState, preset_name: str = "") -> None:
        """Make a state the current state, and update the page at once or after the gap."""
        before, self._state = self._state, state
        if state != before or not self._number:
            self._number += 1
        if (state.study, preset_name) != (before.study, ""):
            self._preset_name = preset_name
        if self._waiting:
            self._behind = True
        else:
            self._update()

    @_reported
    def _update(self) -> None:
        """Show the values of the current state, and compute the results."""
        state = self._shown = self._state
        self._behind, self._waiting = False, True
        self._document.add_timeout_callback(self._continue, _GAP)
        with pn.io.hold():
            self._show_values(state)
            self._header.choose(self._preset_name)
            if _motion_inputs(state) != self._computed:
                self._computed = _motion_inputs(state)
                self._verdict.pending()
                self._motion_slot.start(
                    _snapshots(state), partial(self._show_motion, state, self._number),
                    partial(self._show_no_motion, self._number),
                    urgency=_MOTION, later=_SETTLED, pause=_STILL,
                )  # fmt: skip
            self._draw_plot(state)

    def _continue(self) -> None:
        self._waiting = False
        if self._behind:
            self._update()

    def _show_values(self, state: PageState) -> None:
        """Show the values of a study wherever they can be changed."""
        self._parameters.show(state)
        self._header.show(state)
        self._tabs.show(state)
        self._measured.show(state)

    def _show_motion(self, state: PageState, number: int, snapshot: Snapshot) -> None:
        with pn.io.hold():
            self._show_busy()
            other = snapshot.comparison.figures if snapshot.comparison is not None else None
            for chart in self._charts:
                chart.show(snapshot.figures, other)
            self._animation.show(state, snapshot)
            self._verdict.show(verdict(state, snapshot), number)
            if _motion_inputs(state) != self._computed:
                self._verdict.pending()

    def _show_no_motion(self, number: int, words: str) -> None:
        with pn.io.hold():
            for chart in self._charts:
                chart.show_message("No run.")
            self._show_busy()
            self._verdict.show({"headline": words, "tone": "bad", "tiles": []}, number)

    def _plot(self, name: str) -> BifurcationPlot | MapPlot | CurvePlot | TracePlot:
        """Return a plot, created on first use: each costs as much as all charts of a motion."""
        if name not in self._plots:
            kinds: dict[str, type[BifurcationPlot | MapPlot | CurvePlot | TracePlot]] = {
                "diagram": BifurcationPlot, "curve": CurvePlot, "trace": TracePlot,
            }  # fmt: skip
            plot = self._plots[name] = kinds.get(name, MapPlot)()
            plot.figure.on_event(Tap, self._tapped)
            if name == "trace":
                panel = self._measured
                self._tabs.add_trace(plot.figure, panel.controls, panel.result)
            else:
                self._tabs.add(name, plot.figure)
        return self._plots[name]

    def _draw_plot(self, state: PageState) -> None:
        """Mark the current value in the open plot, and draw it anew if it depends on more."""
        name, computed = state.view.plot, PARAMETER_PLOTS[state.view.plot]
        try:
            key = (name, computed.inputs(state))
        except InputError as error:
            self._plot_slot.stop()
            self._show_no_plot(name, str(error))
            return
        self._mark(name, state)
        if key == self._plot_key:
            return
        if self._plot_key is None or self._plot_key[0] != name:
            self._plot_slot.stop()
        self._plot_key = key
        before, picture = self._complete.get(name, (None, None))
        if before == key:  # it is still complete from its last use
            self._plot_slot.stop()
            self._tabs.describe(picture, self._number)
            self._tabs.ended()
            return
        self._complete.pop(name, None)

        def finished() -> None:
            self._complete[name] = (key, self._picture)
            self._tabs.ended()

        self._tabs.computing()
        self._plot_slot.start(
            computed.pictures(state), partial(self._show_plot, name, self._number),
            partial(self._show_no_plot, name), finished=finished,
            urgency=_DRAFT, later=_FINER, pause=_STILL,
        )  # fmt: skip

    @_reported
    def _stop(self, stop: bool) -> None:
        """Stop the computation of the open plot, or start it again."""
        if stop:
            self._plot_slot.stop()
            self._tabs.ended(stopped=True)
            if not any(getattr(self._picture, "done", ())):
                self._plot(self._shown.view.plot).show_overlay(
                    "Stopped. Press Compute to start again."
                )
        else:
            self._plot_key = None
            self._draw_plot(self._shown)

    def _mark(self, name: str, state: PageState) -> None:
        """Mark the current values in a plot, and show the selected quantity."""
        axes = PARAMETER_PLOTS[name].axes(state)
        view = state.view
        chosen = {"curve": view.measure, "trace": view.column}.get(name, view.quantity)
        self._plot(name).choose(chosen)
        self._plot(name).mark(axes, [state.value(axis.name) for axis in axes])

    def _show_plot(self, name: str, number: int, picture: Any) -> None:
        with pn.io.hold():
            self._picture = picture
            self._plot(name).show(picture)
            self._mark(name, self._shown)
            self._tabs.describe(picture, number)

    def _show_no_plot(self, name: str, words: str) -> None:
        with pn.io.hold():
            self._plot_key = None
            self._complete.pop(name, None)
            self._plot(name).show_message(words)
            self._tabs.describe(None, self._number)


def _motion_inputs(state: PageState) -> Any:
    view = state.view
    return state.study, view.comparison, view.shown, state.window, state.inertia, state.contact


def _snapshots(state: PageState) -> Iterator[Snapshot]:
    """Yield the motion of the run as set, then that of a run continued until it has settled."""
    yield take_snapshot(state)
    yield take_snapshot(state, settle=True)


def _loaded(name: str, content: bytes, view: PageView) -> Iterator[tuple[Study, PageState]]:
    """Yield the study in a file, and its state."""
    try:
        study = read_study(content)
        yield study, state_of(study, view)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def _traces(name: str, content: bytes) -> Iterator[MeasuredTrace]:
    """Yield the trace in a file."""
    yield read(name, content)


def _exported(state: PageState, kind: str) -> Iterator[File]:
    def progress(_: Any) -> None:
        """Cancel a sweep whose result is no longer needed."""
        if not is_wanted():
            raise InputError("export: cancelled. Save the file again.")

    yield export(state, kind, progress)

"""One user's page: edits change the current study; motion and plots are computed and shown."""

from __future__ import annotations

import functools
import html
import logging
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import panel as pn
from bokeh.events import Tap
from tornado.ioloop import IOLoop

from wedgebrake.errors import InputError
from wedgebrake.explorer.core.export import File, export
from wedgebrake.explorer.core.limits import MOST_FILES, MOST_UPLOAD
from wedgebrake.explorer.core.presets import PRESETS, preset
from wedgebrake.explorer.core.scheduler import Lane, Turns, common_turns, file_turns
from wedgebrake.explorer.core.snapshot import Moment, look
from wedgebrake.explorer.core.state import Desk
from wedgebrake.explorer.core.studies import opened
from wedgebrake.explorer.core.verdict import verdict
from wedgebrake.explorer.ui.parameter_plots import ParameterPlot
from wedgebrake.explorer.ui.widgets.brake_animation import BrakeAnimation
from wedgebrake.explorer.ui.widgets.controls import widget_styles
from wedgebrake.explorer.ui.widgets.header import Header
from wedgebrake.explorer.ui.widgets.page import page
from wedgebrake.explorer.ui.widgets.parameters import ParameterPanel
from wedgebrake.explorer.ui.widgets.plot_tabs import PlotTabs
from wedgebrake.explorer.ui.widgets.verdict_strip import VerdictStrip
from wedgebrake.figures.bokeh.history import HistoryChart
from wedgebrake.figures.bokeh.phase import PhaseChart
from wedgebrake.figures.bokeh.section import SectionChart
from wedgebrake.figures.bokeh.spectrum import SpectrumChart
from wedgebrake.model.study import read_study

_LOG = logging.getLogger("wedgebrake.explorer")

# Urgency of work: the motion before plots, their first draft before what is finer.
_MOTION, _DRAFT, _SETTLED, _FINER = 0, 1, 2, 3
# Time without a change after which finer work begins [s].
_STILL = 0.3
_STARTING = "Starting; the first start on a machine compiles the solver, about half a minute."
# Time after the page has followed an edit before it follows further ones, together [ms].
_GAP = 40
# How long a notice stays [ms].
_BRIEF, _LASTING = 6000, 12_000


def _answered(action: Callable[..., None]) -> Callable[..., None]:
    """Let an action of the user end in a notice where it fails."""

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


class Explorer(pn.viewable.Viewer):
    """A page: the current study, the widgets that show it, and the work in progress.

    Made within a session of the server, whose document it belongs to.

    desk  : the study to begin with
    turns : the threads that compute, by default those of all pages of this process
    """

    def __init__(self, desk: Desk, turns: Turns | None = None) -> None:
        super().__init__()
        # The study as it is, and as the page shows it.
        self._desk = self._displayed = desk
        self._number, self._chosen = 0, ""
        self._computed: Any = None
        self._resting, self._behind, self._closed = False, False, False
        # While a slider is dragged: its parameter, and the study before.
        self._dragged: tuple[str, Desk] | None = None
        # What the open plot depends on; of complete plots that too, and what they show.
        self._drawing: Any = None
        self._drawn: dict[str, tuple[Any, Any]] = {}
        self._shown: Any = None
        styles = widget_styles()
        self._header = Header(
            PRESETS.values(), self._preset, self._upload, self._deliver,
            lambda name, value: self._edit({name: value}), styles,
        )  # fmt: skip
        self._machine = ParameterPanel(
            lambda name, value, dragging: self._edit({name: value}, dragging), self.refuse, styles
        )
        self._strip = VerdictStrip()
        history, section, spectrum = HistoryChart(), SectionChart(), SpectrumChart()
        phase = PhaseChart(history)
        self._charts = (history, phase, section, spectrum)
        self._stage = BrakeAnimation(sizing_mode="stretch_both", margin=0)
        self._plates: dict[str, Any] = {}
        self._atlas = PlotTabs(self._edit, styles)
        self._plate(desk.view.plate)
        self._page = page(
            self._header.view, self._machine.view, self._strip.view, self._atlas.view,
            history=_pane(history.figure), phase=_pane(phase.figure), brake=self._stage,
            spectrum=_pane(spectrum.figure), section=_pane(section.figure),
        )  # fmt: skip
        threads = common_turns() if turns is None else turns
        self._document, self._loop = pn.state.curdoc, IOLoop.current()
        self._motion, self._picture = threads.lane(self._post), threads.lane(self._post)
        self._files: list[Lane] = []
        self._notices = pn.state.notifications
        self._header.busy(_STARTING)
        self._lay(desk)
        # Not before the browser listens: what is sent while it connects may be lost.
        pn.state.onload(lambda: self._put(self._desk))

    def __panel__(self) -> Any:
        return self._page

    @property
    def desk(self) -> Desk:
        """The current study and its view."""
        return self._desk

    def close(self) -> None:
        """Discard all work: the page is gone."""
        self._closed = True
        for lane in (self._motion, self._picture, *self._files):
            lane.stop()

    def _post(self, call: Callable[[], None]) -> None:
        """Call a function on the event loop of the page, from any thread.

        Bokeh's documents may lose callbacks that other threads add to them.
        """

        def add() -> None:
            if not self._closed:
                self._document.add_next_tick_callback(call)

        self._loop.add_callback(add)

    def refuse(self, words: str) -> None:
        """Show why something cannot be done."""
        self._notify(words, "error", _LASTING)

    def _notify(self, words: str, kind: str = "success", duration: int = _BRIEF) -> None:
        if self._notices is not None:
            self._notices.send(html.escape(words), duration=duration, type=kind)

    # Actions of the user

    @_answered
    def _edit(self, changes: dict[str, Any], dragging: bool = False) -> None:
        # What a slider only passes leaves no trace: all its values edit the same study.
        name, base = next(iter(changes)), self._desk
        if self._dragged is not None and self._dragged[0] == name:
            base = self._dragged[1]
        self._dragged = (name, base) if dragging else None
        try:
            desk = base.edited(**changes)
        except InputError:
            self._lay(self._desk)
            raise
        self._put(desk)

    @_answered
    def _preset(self, name: str) -> None:
        view, self._dragged = self._desk.view, None
        desk = preset(name).desk().edited(ghost=view.ghost, shown=view.shown)
        self._put(desk, chosen=name)

    @_answered
    def _upload(self, name: str, content: bytes) -> None:
        name = name[:60]
        if len(content) > MOST_UPLOAD:
            raise InputError(f"{name}: is larger than {MOST_UPLOAD} bytes.")
        try:
            study = read_study(content)
            desk = opened(study, self._desk.view)
        except InputError as error:
            raise InputError(f"{name}: {error}") from None
        self._dragged = None
        self._put(desk)
        self._header.choose("")
        if study.run.periods in (None, desk.periods):
            self._notify(f"Loaded {name}.")
        else:
            self._notify(f"Loaded {name}; run for {desk.periods} periods of the torque instead of"
                         f" {study.run.periods}.", "success", _LASTING)  # fmt: skip

    @_answered
    def _deliver(self, kind: str) -> None:
        if len(self._files) >= MOST_FILES:
            raise InputError(f"{MOST_FILES} files are being prepared. Wait for one of them.")
        lane = file_turns().lane(self._post)
        self._files.append(lane)
        self._say_files()
        lane.start(
            _exported(self._desk, kind, lane), self._header.deliver,
            partial(self._not_delivered, lane), finished=partial(self._delivered, lane),
        )  # fmt: skip

    def _delivered(self, lane: Lane) -> None:
        self._files.remove(lane)
        self._say_files()

    def _not_delivered(self, lane: Lane, words: str) -> None:
        self._delivered(lane)
        self.refuse(words)

    def _say_files(self) -> None:
        self._header.busy("Preparing the file …" if self._files else "")

    def _tapped(self, event: Tap) -> None:
        if event.x is None or event.y is None:
            return
        plate = self._plate(self._desk.view.plate)
        try:
            changes = plate.pick(self._desk, float(event.x), float(event.y))
        except InputError:  # there is no plot, and the reason stands in its place
            return
        if changes:
            self._edit(changes)

    # Display

    def _put(self, desk: Desk, chosen: str = "") -> None:
        """Make a study the current one, and let the page follow.

        Edits that come faster than the page can follow are followed together.
        """
        before, self._desk = self._desk, desk
        if desk != before or not self._number:
            self._number += 1
        if (desk.study, chosen) != (before.study, ""):
            self._chosen = chosen
        if self._resting:
            self._behind = True
        else:
            self._follow()

    def _follow(self) -> None:
        """Show the values of the current study, and compute what follows from them."""
        desk = self._displayed = self._desk
        self._behind, self._resting = False, True
        self._document.add_timeout_callback(self._rested, _GAP)
        with pn.io.hold():
            self._lay(desk)
            self._header.choose(self._chosen)
            if _seen(desk) != self._computed:
                self._computed = _seen(desk)
                self._strip.pending()
                self._motion.start(
                    _moments(desk), partial(self._show_moment, self._number),
                    partial(self._no_moment, self._number),
                    urgency=_MOTION, later=_SETTLED, pause=_STILL,
                )  # fmt: skip
            self._draw(desk)

    @_answered
    def _rested(self) -> None:
        self._resting = False
        if self._behind:
            self._follow()

    def _lay(self, desk: Desk) -> None:
        """Show the values of a study wherever they can be changed."""
        self._machine.show(desk)
        self._header.show(desk)
        self._atlas.show(desk)

    def _show_moment(self, number: int, moment: Moment) -> None:
        with pn.io.hold():
            self._say_files()
            ghost = moment.ghost.figures if moment.ghost is not None else None
            for chart in self._charts:
                chart.show(moment.figures, ghost)
            self._stage.show(self._displayed, moment)
            self._strip.show(verdict(self._displayed, moment), number)

    def _no_moment(self, number: int, words: str) -> None:
        with pn.io.hold():
            for chart in self._charts:
                chart.say("No run.")
            self._say_files()
            self._strip.show({"headline": words, "tone": "bad", "tiles": []}, number)

    def _draw(self, desk: Desk) -> None:
        """Mark the current value in the open plot, and draw it anew if it depends on more."""
        plate = self._plate(desk.view.plate)
        try:
            key = (plate.name, plate.key(desk))
        except InputError as error:
            self._picture.stop()
            self._no_picture(plate, str(error))
            return
        plate.mark(desk)
        if key == self._drawing:
            return
        self._drawing = key
        before, picture = self._drawn.get(plate.name, (None, None))
        if before == key:  # it is still there from when it was open before
            self._picture.stop()
            self._tell(plate, picture, self._number)
            return
        self._forget(plate)
        self._drawing = key
        self._picture.start(
            plate.work(desk), partial(self._show_picture, plate, self._number),
            partial(self._no_picture, plate), finished=partial(self._keep, plate, key),
            urgency=_DRAFT, later=_FINER, pause=_STILL,
        )  # fmt: skip

    def _show_picture(self, plate: Any, number: int, picture: Any) -> None:
        with pn.io.hold():
            self._shown = picture
            plate.show(picture)
            plate.mark(self._displayed)
            self._tell(plate, picture, number)

    def _plate(self, name: str) -> Any:
        """Return a plot, created on first use: each costs as much as all charts of a motion."""
        if name not in self._plates:
            plate = self._plates[name] = ParameterPlot(name)
            plate.figure.on_event(Tap, self._tapped)
            self._atlas.add(name, plate.figure)
        return self._plates[name]

    def _tell(self, plate: Any, picture: Any, number: int) -> None:
        """Show the legend, and how much of the plot is known."""
        self._atlas.legend(plate.legend(picture), plate.progress(picture), number)

    def _keep(self, plate: Any, key: Any) -> None:
        """Keep a complete plot."""
        self._drawn[plate.name] = (key, self._shown)

    def _forget(self, plate: Any) -> None:
        self._drawing = None
        self._drawn.pop(plate.name, None)

    def _no_picture(self, plate: Any, words: str) -> None:
        with pn.io.hold():
            self._forget(plate)
            plate.say(words)
            self._atlas.legend((), "", self._number)


def _moments(desk: Desk) -> Iterator[Moment]:
    """Give the motion of the run as it is set, then of one continued until it has settled."""
    yield look(desk)
    yield look(desk, settle=True)


def _exported(desk: Desk, kind: str, lane: Lane) -> Iterator[File]:
    def heed(_: Any) -> None:
        """Cancel a sweep whose result is no longer needed."""
        if not lane.busy:
            raise InputError("export: cancelled. Save the file again.")

    yield export(desk, kind, heed)


def _seen(desk: Desk) -> Any:
    """Return what the motion and its charts depend on."""
    return desk.study, desk.view.ghost, desk.view.shown


def _pane(figure: Any) -> pn.pane.Bokeh:
    return pn.pane.Bokeh(figure, sizing_mode="stretch_both", margin=0)

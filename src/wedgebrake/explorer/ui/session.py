"""One user's page: what is heard changes the desk, what lies on it is computed and shown."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from functools import partial
from typing import Any

import panel as pn
from bokeh.events import Tap

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
from wedgebrake.explorer.ui.widgets.brake_animation import Stage
from wedgebrake.explorer.ui.widgets.header import Header
from wedgebrake.explorer.ui.widgets.machine import Machine
from wedgebrake.explorer.ui.widgets.page import Page
from wedgebrake.explorer.ui.widgets.tabs import Atlas
from wedgebrake.explorer.ui.widgets.verdict_strip import VerdictStrip
from wedgebrake.figures.bokeh.history import HistoryChart
from wedgebrake.figures.bokeh.phase import PhaseChart
from wedgebrake.figures.bokeh.section import SectionChart
from wedgebrake.figures.bokeh.spectrum import SpectrumChart
from wedgebrake.model.study import read_study

_LOG = logging.getLogger("wedgebrake.explorer")

# Urgency of work: the motion before pictures, their first draft before what is finer.
_MOTION, _DRAFT, _SETTLED, _FINER = 0, 1, 2, 3
# Seconds in which nothing has changed: the sliders are still.
_STILL = 0.3
_STARTING = "Starting; the first start on a machine compiles the solver, about half a minute."


class Explorer(pn.viewable.Viewer):
    """A page of its own: a desk, the parts that show it, and the work that is going on.

    Made within a session of the server, whose document it belongs to.

    desk  : what lies on it at the beginning
    turns : the threads that work for it, by default those of all pages of this process
    """

    def __init__(self, desk: Desk, turns: Turns | None = None) -> None:
        super().__init__()
        presets = [
            {"name": one.name, "title": one.title, "group": one.group} for one in PRESETS.values()
        ]
        self._desk = desk
        self._number = 0
        self._dragged: tuple[set[str], Desk] | None = None
        # Of the open picture what it depends on; of whole ones that too, and what they show.
        self._drawing: Any = None
        self._drawn: dict[str, tuple[Any, Any]] = {}
        self._shown: Any = None
        self._header = Header(self.hear, presets)
        self._machine = Machine(self.hear)
        self._strip = VerdictStrip()
        history, section, spectrum = HistoryChart(), SectionChart(), SpectrumChart()
        phase = PhaseChart(history)
        self._charts = (history, phase, section, spectrum)
        self._stage = Stage()
        self._plates: dict[str, Any] = {}
        self._atlas = Atlas(self.hear)
        self._plate(desk.view.plate)
        self._page = Page(
            header=self._header, machine=self._machine, strip=self._strip,
            history=_pane(history.figure), phase=_pane(phase.figure),
            section=_pane(section.figure), spectrum=_pane(spectrum.figure),
            stage=self._stage, atlas=self._atlas, sizing_mode="stretch_width",
        )  # fmt: skip
        threads = common_turns() if turns is None else turns
        post = pn.state.curdoc.add_next_tick_callback
        self._motion, self._picture = threads.lane(post), threads.lane(post)
        self._post, self._files = post, list[Lane]()
        self._header.busy(_STARTING)
        self._lay(desk)
        # Not before the browser listens: what comes while it connects may be lost.
        pn.state.onload(self._begin)

    def __panel__(self) -> Page:
        return self._page

    @property
    def desk(self) -> Desk:
        """What lies on the desk now."""
        return self._desk

    def close(self) -> None:
        """Want nothing more: the page is gone."""
        for lane in (self._motion, self._picture, *self._files):
            lane.stop()

    def _begin(self) -> None:
        self._put(self._desk)

    # What is heard

    def hear(self, event: dict[str, Any]) -> None:
        """Do what a part of the page was asked to do; a wrong wish is answered by a sentence."""
        deeds = {
            "edit": self._edit,
            "preset": self._preset,
            "upload": self._upload,
            "export": self._deliver,
        }
        deed = deeds.get(str(event.get("type")))
        if deed is None:
            return
        try:
            deed(event)
        except Exception as error:
            _LOG.exception("a wish could not be granted")
            self._header.notify(f"internal error: {type(error).__name__}: {error}", "bad")

    def _edit(self, event: dict[str, Any]) -> None:
        changes, seq = event.get("changes"), event.get("seq")
        if not isinstance(changes, dict) or not all(isinstance(name, str) for name in changes):
            return
        seq = seq if isinstance(seq, int) else 0
        # What a slider only passes leaves no trace: its values are those of one edit.
        base = self._desk
        if self._dragged is not None and set(changes) == self._dragged[0]:
            base = self._dragged[1]
        passing = event.get("done") is False
        self._dragged = (set(changes), base) if passing else None
        try:
            desk = base.edited(**changes)
        except InputError as error:
            name = next(iter(changes), "")
            self._lay(self._desk, (name, str(error)), seq)
            if name in ("spans", "axis", "across", "up", "plate", "quantity"):
                self._header.notify(str(error), "bad")
            return
        self._put(desk, seq)

    def _preset(self, event: dict[str, Any]) -> None:
        view = self._desk.view
        try:
            chosen = preset(str(event.get("name")))
        except InputError as error:
            self._header.notify(str(error), "bad")
            return
        self._dragged = None
        self._put(chosen.desk().edited(ghost=view.ghost, shown=view.shown), chosen=chosen.name)

    def _upload(self, event: dict[str, Any]) -> None:
        name, text = event.get("name"), event.get("text")
        if not isinstance(name, str) or not isinstance(text, str):
            return
        name = name[:60]
        if len(text.encode(errors="replace")) > MOST_UPLOAD:
            self._header.notify(f"{name}: is larger than {MOST_UPLOAD} bytes.", "bad")
            return
        try:
            study = read_study(text)
            desk = opened(study, self._desk.view)
        except InputError as error:
            self._header.notify(f"{name}: {error}", "bad")
            return
        self._dragged = None
        self._put(desk)
        self._header.choose("")
        if study.run.periods not in (None, desk.periods):
            limits = f"{name}: run here for {desk.periods} periods instead of {study.run.periods}."
            self._header.notify(limits, "warn")
        else:
            self._header.notify(f"{name} lies on the desk.", "good")

    def _deliver(self, event: dict[str, Any]) -> None:
        if len(self._files) >= MOST_FILES:
            self._header.notify(f"{MOST_FILES} files are being prepared; wait for one.", "warn")
            return
        lane = file_turns().lane(self._post)
        self._files.append(lane)
        self._say_files()
        lane.start(
            _exported(self._desk, str(event.get("format")), lane), self._header.deliver,
            partial(self._not_delivered, lane), finished=partial(self._delivered, lane),
        )  # fmt: skip

    def _delivered(self, lane: Lane) -> None:
        self._files.remove(lane)
        self._say_files()

    def _not_delivered(self, lane: Lane, words: str) -> None:
        self._delivered(lane)
        self._header.notify(words, "bad")

    def _say_files(self) -> None:
        self._header.busy("Preparing the file ..." if self._files else None)

    def _tapped(self, event: Tap) -> None:
        if event.x is None or event.y is None:
            return
        plate = self._plate(self._desk.view.plate)
        try:
            changes = plate.pick(self._desk, float(event.x), float(event.y))
        except InputError:  # there is no picture, and why is said there
            return
        if changes:
            self._edit({"changes": changes})

    # What is shown

    def _put(self, desk: Desk, seq: int = 0, chosen: str = "") -> None:
        """Put something else on the desk: show its values, and compute what follows from them."""
        with pn.io.hold():
            self._lay(desk, seq=seq)
            if (desk.study, chosen) != (self._desk.study, ""):
                self._header.choose(chosen)
            before, self._desk = self._desk, desk
            self._number += 1
            if _seen(desk) != _seen(before) or self._number == 1:
                self._strip.pending()
                self._motion.start(
                    _moments(desk), partial(self._show_moment, self._number),
                    partial(self._no_moment, self._number),
                    urgency=_MOTION, later=_SETTLED, pause=_STILL,
                )  # fmt: skip
            self._draw(desk)

    def _lay(self, desk: Desk, refusal: tuple[str, str] | None = None, seq: int = 0) -> None:
        """Show the values on a desk wherever they can be changed."""
        self._machine.show(desk, refusal, seq)
        self._header.show(desk)
        self._atlas.show(desk)

    def _show_moment(self, number: int, moment: Moment) -> None:
        with pn.io.hold():
            self._say_files()
            ghost = moment.ghost.figures if moment.ghost is not None else None
            for chart in self._charts:
                chart.show(moment.figures, ghost)
            self._stage.show(self._desk, moment)
            self._strip.show(verdict(self._desk, moment))
            self._page.seen(motion=number)

    def _no_moment(self, number: int, words: str) -> None:
        with pn.io.hold():
            for chart in self._charts:
                chart.say("No run.")
            self._say_files()
            self._strip.show({"headline": words, "tone": "bad", "tiles": []})
            self._page.seen(motion=number)

    def _draw(self, desk: Desk) -> None:
        """Mark the present value in the open picture, and draw it anew if it depends on more."""
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
        if before == key:  # it still stands there from when it was open before
            self._picture.stop()
            self._tell(plate, picture)
            self._page.seen(picture=self._number)
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
            plate.mark(self._desk)
            self._tell(plate, picture)
            self._page.seen(picture=number)

    def _plate(self, name: str) -> Any:
        """Return a plate, created on first use: each costs as much as all charts of a motion."""
        if name not in self._plates:
            plate = self._plates[name] = ParameterPlot(name)
            plate.figure.on_event(Tap, self._tapped)
            self._atlas.hang(name, plate.figure)
        return self._plates[name]

    def _tell(self, plate: Any, picture: Any) -> None:
        """What colours mean, and how much of the picture is known."""
        self._atlas.legend(plate.legend(picture))
        self._atlas.progress(plate.progress(picture))

    def _keep(self, plate: Any, key: Any) -> None:
        """A picture is whole."""
        self._drawn[plate.name] = (key, self._shown)

    def _forget(self, plate: Any) -> None:
        self._drawing = None
        self._drawn.pop(plate.name, None)

    def _no_picture(self, plate: Any, words: str) -> None:
        with pn.io.hold():
            self._forget(plate)
            plate.say(words)
            self._atlas.legend([])
            self._atlas.progress("")


def _moments(desk: Desk) -> Iterator[Moment]:
    """At once, and when the sliders are still with the transient judged."""
    yield look(desk)
    yield look(desk, settle=True)


def _exported(desk: Desk, kind: str, lane: Lane) -> Iterator[File]:
    def heed(_: Any) -> None:
        """Cancel a sweep whose result is no longer needed."""
        if not lane.busy:
            raise InputError("export: cancelled. Save the file again.")

    yield export(desk, kind, heed)


def _seen(desk: Desk) -> Any:
    """What the motion and its pictures depend on."""
    return desk.study, desk.view.ghost, desk.view.shown


def _pane(figure: Any) -> pn.pane.Bokeh:
    return pn.pane.Bokeh(figure, sizing_mode="stretch_both", margin=0)

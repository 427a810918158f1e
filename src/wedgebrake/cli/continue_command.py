"""The work of ``wedgebrake continue``: options checked before the work, the work, progress."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.cli.interrupts import Interrupted, announce_compilation
from wedgebrake.cli.overrides import in_options
from wedgebrake.cli.progress import watched
from wedgebrake.cli.ranges import parse_range
from wedgebrake.errors import InputError
from wedgebrake.model.study import Study
from wedgebrake.orbits.branch import Branch, check_step
from wedgebrake.orbits.codim2 import boundary
from wedgebrake.orbits.diagram import Followed, assemble, follow
from wedgebrake.orbits.orbit import BranchPoint, Orbit, OrbitStatus
from wedgebrake.orbits.problem import Range, make_ranges, value_of
from wedgebrake.orbits.shooting import check, orbit_to_follow
from wedgebrake.sweeps.progress import Progress
from wedgebrake.sweeps.sweep import bifurcation, regime_map

if TYPE_CHECKING:
    import xarray as xr

# Settings of [run] that apply to the points beneath a picture.
_OF_RUN = ("initial", "method", "rtol", "max_events", "max_steps")
# Columns of points beneath branches of the exact method. With smooth friction they take a minute,
# and a map has many cells: these are drawn on request alone.
_COLUMNS, _MOST_COLUMNS = 200, 10_000
# Largest number of periods in which a point of a map must settle.
_PATIENCE = 2000


@dataclass(frozen=True)
class Order:
    """A checked order of the command line.

    over, second : the parameter that orbits are followed over, and that for their bifurcations
    settings     : of the branches: switch, step, points
    order        : of the first orbit; None: that of the motion that settles
    columns      : of simulated points beneath the picture; of a map, and rows
    """

    study: Study
    over: Range
    second: Range | None
    order: int | None
    settings: dict[str, Any]
    columns: int

    @property
    def orbit(self) -> dict[str, Any]:
        """Arguments of ``wb.orbit`` that the study sets."""
        run = self.study.run
        given = {"method": run.method}
        return given | {
            name: getattr(run, name) for name in ("initial", "rtol") if name in run.model_fields_set
        }

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Of both parameters."""
        both = [self.over, *([] if self.second is None else [self.second])]
        return {one.name: (one.first, one.last) for one in both}


@dataclass(frozen=True)
class Outcome:
    """The results.

    start      : the orbit that it begins with
    followed   : the branches, and all of them as a dataset
    boundaries : (bifurcation, its boundary); None where there is no second parameter
    beneath    : the sweep beneath the picture, if there is one
    seconds    : how long it took; ``compiled``: with compilation of the kernels
    """

    start: Orbit
    followed: list[Followed]
    dataset: xr.Dataset
    boundaries: list[tuple[BranchPoint, xr.Dataset]] | None
    beneath: xr.Dataset | None
    seconds: float
    compiled: bool

    @property
    def picture(self) -> dict[str, Any]:
        """Arguments of ``wb.plot``: branches, or the boundaries if they were followed.

        Raises ``InputError`` where there is nothing to draw.
        """
        if self.boundaries is None:
            return {"dataset": self.dataset, "beneath": self.beneath}
        curves = [curve for _, curve in self.boundaries]
        if self.beneath is not None:
            return {"dataset": self.beneath, "boundaries": curves}
        if not curves:
            raise InputError(
                "--plot: there is no boundary to draw, as nothing bifurcates that can be followed."
                " Widen --over, raise --switch, or draw a map with --beneath."
            )
        return {"dataset": curves[0], "boundaries": curves[1:]}


def ordered(
    study: Study,
    over: list[str] | None,
    second: str | None,
    order: int | None,
    settings: dict[str, Any],
    beneath: int | None,
    *,
    picture: bool,
) -> Order:
    """The order, checked before any work is done.

    Raises ``InputError`` that names the option and the way out.
    """
    if len(over or ()) != 1:
        many = "not given" if not over else f"given {len(over)} times"
        raise InputError(
            f"--over: {many}, must be one parameter with its ends, for example --over eta=12:-60."
            " A second one, for the boundaries of the motions, is --and."
        )
    system, run = study.system, study.run
    if run.start_time != 0.0:
        raise InputError(
            f"run.start_time = {run.start_time!r}: must be 0, where orbits are looked for. Set it"
            " with --set start_time=0."
        )
    first = parse_range("--over", (over or [""])[0], system)
    other = None if second is None else parse_range("--and", second, system)
    if other is not None:
        _check_second(study, first, other)
    try:
        method = check(system, order, run.method, run.rtol)
        check_step(settings["step"], settings["points"])
    except InputError as error:
        raise InputError(in_options(str(error), "order|switch|step|points")) from None
    given = _COLUMNS if beneath is None and method == "exact" and other is None else beneath or 0
    if not (given == 0 or 2 <= given <= _MOST_COLUMNS):
        raise InputError(
            f"--beneath {given}: must be a whole number of columns, 2 to {_MOST_COLUMNS}, or 0 for"
            " none."
        )
    if beneath and not picture:
        raise InputError(
            f"--beneath {beneath}: is drawn beneath the picture. Give --plot PICTURE.png, or leave"
            " it out."
        )
    return Order(study, first, other, order, settings, given if picture else 0)


def _check_second(study: Study, first: Range, second: Range) -> None:
    """Refuse a second parameter that the first one's bifurcations cannot be followed over."""
    if first.name == second.name:
        raise InputError(f"--and {second.name}: is that of --over. Give another parameter.")
    both = {one.name: (one.first, one.last) for one in (first, second)}
    try:
        make_ranges(study.system, both, 2)
    except InputError as error:
        raise InputError(f"--and {second.name}: {error}") from None
    value, (low, high) = value_of(study.system, second.name), second.bounds
    if not low <= value <= high:
        raise InputError(
            f"--and {second.name}={second.first:g}:{second.last:g}: must contain {value:g}, where"
            f" the orbits are followed over {first.name}. Widen it, or --set {second.name}=VALUE."
        )


def carry_out(order: Order) -> Outcome:
    """Follow, and simulate what comes beneath; progress goes to standard error.

    Raises ``Interrupted`` with a note, ``InputError`` where there is no orbit to begin with, and
    as ``wb.branches``.
    """
    begin = time.perf_counter()
    try:
        with announce_compilation("about half a minute") as compilation:
            start, followed = watched(lambda hear: _branches(order, hear))
            boundaries = None
            if order.second is not None:
                boundaries = watched(lambda hear: _boundaries(order, followed, hear))
            beneath = None
            if order.columns:
                beneath = watched(lambda hear: _simulated(order, hear))
    except Interrupted as interrupt:
        interrupt.add_note("Nothing is kept.")
        raise
    except InputError as error:
        raise InputError(in_options(str(error), "order|switch|step|points")) from None
    dataset = assemble(order.study.system, order.over, followed)
    seconds = time.perf_counter() - begin
    return Outcome(start, followed, dataset, boundaries, beneath, seconds, compilation.said)


def _branches(order: Order, hear: Callable[[Progress], None]) -> tuple[Orbit, list[Followed]]:
    """The first orbit, and the branches."""
    name, first = order.over.name, order.over.first
    system = order.study.system.replace(**{name: first})
    begin = orbit_to_follow(system, order.order, **order.orbit)
    if not begin.found:
        raise InputError(
            f"--over {name}: at {name} = {first:g} there is no orbit to begin with."
            f" {begin.message}{_ways_out(begin)}"
        )
    told = _Told(order.over, hear)
    followed = follow(begin, order.over, **order.settings, progress=told.point)
    told.end(followed)
    return begin, followed


def _ways_out(start: Orbit) -> str:
    if start.status is OrbitStatus.AT_REST:
        return ""
    return " In options: --order N, --set initial=[ANGLE,VELOCITY], or another FROM."


def _boundaries(
    order: Order, followed: list[Followed], hear: Callable[[Progress], None]
) -> list[tuple[BranchPoint, xr.Dataset]]:
    """The bifurcations with their boundaries over both parameters."""
    points = [
        point for one in followed for point in one.branch.bifurcations if point.can_be_followed
    ]
    limits: dict[str, Any] = {name: order.settings[name] for name in ("step", "points")}
    found = []
    for number, point in enumerate(points):
        hear(_Boundaries(number, len(points), 0, 0.0))
        found.append((point, boundary(point, **limits | order.ranges)))
    if points:
        hear(_Boundaries(len(points), len(points), 0, 0.0))
    return found


def _simulated(order: Order, hear: Callable[[Progress], None]) -> xr.Dataset:
    """Sweep or map that is drawn beneath the picture."""
    run = order.study.run
    settings: dict[str, Any] = {name: getattr(run, name) for name in _OF_RUN}
    for name, ends in order.ranges.items():
        settings[name] = np.linspace(*ends, order.columns)
    if order.second is None:
        return bifurcation(order.study.system, **settings, progress=hear)
    # Near a boundary motions settle slowly.
    settings |= {"transient": "auto", "limit": _PATIENCE}
    return regime_map(order.study.system, **settings, progress=hear)


@dataclass(frozen=True)
class _Branches(Progress):
    """How far a branch has come, in percent of the range: its words."""

    words: str = ""

    def __str__(self) -> str:
        return self.words


class _Boundaries(Progress):
    """How many boundaries are done."""

    def __str__(self) -> str:
        return f"{self.done} of {self.total} boundaries"


class _Told:
    """Counts points and branches, and tells of them."""

    def __init__(self, over: Range, hear: Callable[[Progress], None]) -> None:
        self._over, self._hear = over, hear
        self._branch: Branch | None = None
        self._branches = self._points = 0

    def point(self, branch: Branch) -> None:
        """One more point."""
        if branch is not self._branch:
            self._branch = branch
            self._branches += 1
        self._points += 1
        value = branch.points[-1].value
        share = abs(value - self._over.first) / self._over.scale
        words = f"{self._points} orbits, branch {self._branches} at {self._over.name} = {value:.6g}"
        self._hear(_Branches(min(int(100.0 * share), 99), 100, 0, 0.0, words=words))

    def end(self, followed: list[Followed]) -> None:
        """All are done."""
        count = sum(len(one.branch.points) for one in followed)
        branches = "1 branch" if len(followed) == 1 else f"{len(followed)} branches"
        self._hear(_Branches(100, 100, 0, 0.0, words=f"{count} orbits of {branches}"))

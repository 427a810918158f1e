"""Implementation of ``wedgebrake continue``: checks of options, computation, progress."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.linear_stability.hopf import StabilityLimit, hopf
from wedgebrake.cli.assignments import parse_range
from wedgebrake.cli.compilation import announce_compilation
from wedgebrake.cli.continue_report import continue_report, continue_text
from wedgebrake.cli.interrupts import Interrupted
from wedgebrake.cli.output import Output
from wedgebrake.cli.overrides import (
    check_repeats,
    in_options,
    named_as_in_study,
    refuse_unused,
    settings_of,
)
from wedgebrake.cli.progress import ProgressDisplay, Stage
from wedgebrake.errors import InputError
from wedgebrake.model.studies.study import Study
from wedgebrake.orbits.branches.branch import Branch
from wedgebrake.orbits.branches.hopf_start import first_cycle
from wedgebrake.orbits.codim2 import boundary
from wedgebrake.orbits.continuation import check_step
from wedgebrake.orbits.diagram import Followed, assemble, follow
from wedgebrake.orbits.orbit import BranchPoint, Orbit
from wedgebrake.orbits.orbit_status import OrbitStatus
from wedgebrake.orbits.problems.choose_problem import orbit_problem
from wedgebrake.orbits.problems.problem import OrbitProblem
from wedgebrake.orbits.ranges import Range, make_ranges
from wedgebrake.orbits.shooting import orbit_to_follow
from wedgebrake.sweeps.progress import Progress
from wedgebrake.sweeps.sweep import bifurcation, regime_map

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.model.machine import Machine
    from wedgebrake.model.system import BrakedDriveline

_Hear = Callable[[Progress], None]
# Columns of points beneath branches of the exact method. With smooth friction they take a minute,
# and a map has many cells: these are drawn on request only.
_COLUMNS, _MOST_COLUMNS = 200, 10_000
# Settings of [run] for the first orbit.
# Largest number of periods in which a point of a map must settle.
_PATIENCE = 2000


@dataclass(frozen=True)
class ContinueRequest:
    """Options of the command line.

    over, second : texts of the parameter over which orbits are followed, and of that for their
                   bifurcations
    order        : of the first orbit; None: that of the steady motion
    hopf         : whether the first branch begins at a Hopf point
    settings     : settings of the branches: switch, step, points
    beneath      : columns of simulated points beneath the picture; of a map, and rows
    """

    study: Study
    over: list[str] | None
    second: str | None
    order: int | None
    hopf: bool
    settings: dict[str, Any]
    beneath: int | None
    output: Output

    @cached_property
    def problem(self) -> OrbitProblem:
        """The problem of the orbits."""
        check_repeats(self.study, "an orbit closes after a period of all signals")
        names = [text.partition("=")[0].strip() for text in self.over or ()]
        run = self.study.run
        return orbit_problem(self.study.system, run.method, getattr(run, "rtol", 1e-10), names)

    @property
    def system(self) -> BrakedDriveline | Machine:
        """The system whose orbits are followed."""
        return self.study.system


def run(asked: ContinueRequest) -> None:
    """Check, follow, and simulate the points beneath; then write and print the results.

    Raises ``InputError`` that names the option and a remedy, ``Interrupted`` with a note, and
    as ``wb.branches``.
    """
    begin = time.perf_counter()
    try:
        over, second = _ranges(asked)
        columns = _checked(asked, second)
        watch = ProgressDisplay()
        named = named_as_in_study(asked.system)
        with named, announce_compilation() as announced:
            start, followed = watch.wait(lambda: _branches(asked, over, watch.hear))
            boundaries = beneath = None
            if second is not None:
                ranges = _ends(over, second)
                boundaries = watch.wait(lambda: _boundaries(asked, ranges, followed, watch.hear))
            if columns:
                ranges = _ends(over, *[] if second is None else [second])
                beneath = watch.wait(lambda: _simulated(asked.study, ranges, columns, watch.hear))
    except Interrupted as interrupt:
        interrupt.add_note("Nothing is kept.")
        raise
    except InputError as error:
        raise in_options(error, ("order", "switch", "step", "points")) from None
    dataset = assemble(asked.study.system, over, followed)
    speed = {"seconds": time.perf_counter() - begin, "with_compilation": bool(announced)}
    report = continue_report(asked.study.system, over, start, followed, boundaries, speed)
    report |= {"kind": dataset.attrs["kind"], "settings": asked.settings}
    curves = None if boundaries is None else [curve for _, curve in boundaries]
    asked.output.finish(
        report,
        lambda: continue_text(asked.study.system, report, dataset.attrs["section"] == "crossing"),
        dataset,
        lambda: _picture(dataset, curves, beneath),
    )


def _ends(*ranges: Range) -> dict[str, tuple[float, float]]:
    return {one.name: (one.first, one.last) for one in ranges}


def _ranges(asked: ContinueRequest) -> tuple[Range, Range | None]:
    """The parameters with their ends, checked."""
    over, system = asked.over or [], asked.system
    if len(over) != 1:
        many = f"given {len(over)} times" if over else "not given"
        raise InputError(
            f"--over: {many}, must be one parameter with its ends, for example --over eta=12:-60."
            " A second one, for the boundaries of the motions, is --and."
        )
    first = parse_range("--over", over[0], system)
    if asked.second is None:
        return first, None
    second = parse_range("--and", asked.second, system)
    if first.name == second.name:
        raise InputError(f"--and {second.name}: is that of --over. Give another parameter.")
    try:
        make_ranges(system, _ends(first, second), 2)
    except InputError as error:
        raise InputError(f"--and {second.name}: {error}") from None
    value, (low, high) = system.value(second.name), second.bounds
    if not low <= value <= high:
        raise InputError(
            f"--and {second.name}={second.first:g}:{second.last:g}: must contain {value:g}, where"
            f" the orbits are followed over {first.name}. Widen it, or --set {second.name}=VALUE."
        )
    return first, second


def _checked(asked: ContinueRequest, second: Range | None) -> int:
    """The columns beneath the picture; the other options are checked as well."""
    system, beneath = asked.system, asked.beneath
    problem = asked.problem
    refuse_unused(asked.study, problem.unused, "the orbits of a system that is solved by series")
    check_step(asked.settings["step"], asked.settings["points"])
    crosses = problem.self_excited
    if asked.hopf and not crosses:
        varying = [name for name, signal in system.signals().items() if signal.varies]
        raise InputError(
            "--hopf: needs a system in which no signal varies in time, so that steady sliding"
            f" exists. Signals that vary: {', '.join(varying)}. Leave it out."
        )
    if asked.hopf and asked.order is not None:
        raise InputError(
            f"--order {asked.order}: belongs to an orbit at FROM, but with --hopf the branch begins"
            " at the Hopf point. Leave one of them out."
        )
    if beneath is None:
        columns = _COLUMNS if problem.method == "exact" and second is None and not crosses else 0
    elif beneath and crosses:
        raise InputError(
            f"--beneath {beneath}: limit cycles are drawn by their amplitudes, for which there are"
            " no simulated points. Leave it out."
        )
    elif beneath == 0 or 2 <= beneath <= _MOST_COLUMNS:
        columns = beneath
    else:
        raise InputError(
            f"--beneath {beneath}: must be a whole number of columns, 2 to {_MOST_COLUMNS}, or 0"
            " for none."
        )
    if beneath and asked.output.picture is None:
        raise InputError(
            f"--beneath {beneath}: is drawn beneath the picture. Give --plot PICTURE.png, or leave"
            " it out."
        )
    return columns if asked.output.picture is not None else 0


def _solver(study: Study) -> tuple[str | None, float]:
    return study.run.method, getattr(study.run, "rtol", 1e-10)


def _first(asked: ContinueRequest, over: Range) -> Orbit | StabilityLimit:
    run, system = asked.study.run, asked.system
    if asked.hopf:
        try:
            return hopf(system, over.name, between=(over.first, over.last))
        except InputError as error:
            raise InputError(f"--hopf: {error}") from None
    initial = run.initial if "initial" in run.model_fields_set else None
    problem = asked.problem.of(system.replace(**{over.name: over.first}))
    begin = orbit_to_follow(problem, asked.order, initial)
    if not begin.found:
        state = " --set initial=[ANGLE,VELOCITY]," if "initial" in type(run).model_fields else ""
        ways_out = f" In options: --order N,{state} or another FROM."
        if begin.status is OrbitStatus.STEADY_SLIDING:
            ways_out = " In options: --hopf, another FROM, or --set another initial speed."
        raise InputError(
            f"--over {over.name}: at {over.name} = {over.first:g} there is no orbit to begin with."
            f" {begin.message}{'' if begin.status is OrbitStatus.AT_REST else ways_out}"
        )
    return begin


def _branches(
    asked: ContinueRequest, over: Range, hear: _Hear
) -> tuple[Orbit | StabilityLimit, list[Followed]]:
    """The first orbit, or the Hopf point, and the branches."""
    begin = _first(asked, over)
    branches: list[Branch] = []
    count = 0

    def tell(branch: Branch) -> None:
        nonlocal count
        count += 1
        if not branches or branch is not branches[-1]:
            branches.append(branch)
        value = branch.points[-1].value
        done = min(int(100.0 * abs(value - over.first) / over.scale), 99)
        words = f"{count} orbits, branch {len(branches) - 1} at {over.name} = {value:.6g}"
        hear(Stage(done, 100, words=words))

    solver = _solver(asked.study)
    first = begin if isinstance(begin, Orbit) else first_cycle(begin, over, *solver)
    followed = follow(first, over, **asked.settings, progress=tell)
    count = sum(len(one.branch.points) for one in followed)
    many = "1 branch" if len(followed) == 1 else f"{len(followed)} branches"
    hear(Stage(100, 100, words=f"{count} orbits of {many}"))
    return begin, followed


def _boundaries(
    asked: ContinueRequest,
    ranges: dict[str, tuple[float, float]],
    followed: list[Followed],
    hear: _Hear,
) -> list[tuple[BranchPoint, xr.Dataset]]:
    """The bifurcations with their boundaries over both parameters."""
    points = [
        point for one in followed for point in one.branch.bifurcations if point.can_be_followed
    ]
    limits: dict[str, Any] = {name: asked.settings[name] for name in ("step", "points")}
    found: list[tuple[BranchPoint, xr.Dataset]] = []

    def tell() -> None:
        done, total = len(found), len(points)
        hear(Stage(done, total, words=f"{done} of {total} boundaries"))

    for point in points:
        tell()
        found.append((point, boundary(point, **limits | ranges)))
    if points:
        tell()
    return found


def _simulated(
    study: Study, ranges: dict[str, tuple[float, float]], columns: int, hear: _Hear
) -> xr.Dataset:
    settings = settings_of(study, "continue")
    over = {name: np.linspace(*ends, columns) for name, ends in ranges.items()}
    if len(ranges) == 1:
        return bifurcation(study.system, over, **settings, progress=hear)
    # Near a boundary motions settle slowly.
    settings |= {"transient": "auto", "limit": _PATIENCE}
    return regime_map(study.system, over, **settings, progress=hear)


def _picture(
    dataset: xr.Dataset, curves: list[xr.Dataset] | None, beneath: xr.Dataset | None
) -> tuple[xr.Dataset, dict[str, Any]]:
    """The branches, or the boundaries if they were followed; and options of the picture.

    Raises ``InputError`` if there is nothing to draw.
    """
    if curves is None:
        return dataset, {"beneath": beneath}
    if beneath is not None:
        return beneath, {"boundaries": curves}
    if not curves:
        raise InputError(
            "--plot: there is no boundary to draw: no bifurcation can be followed."
            " Widen --over, raise --switch, or draw a map with --beneath."
        )
    return curves[0], {"boundaries": curves[1:]}

"""``branches``: all branches from the ends of a range, and their dataset."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.linear_stability.hopf import StabilityLimit
from wedgebrake.analysis.responses.datasets import labelled
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.studies.sweep_settings import joined
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.system_base import own_names
from wedgebrake.model.validation import check_instance, check_whole, wrong
from wedgebrake.orbits.branches.branch import Branch
from wedgebrake.orbits.branches.branch_switching import CLOSED, leaving, lies_on, marks
from wedgebrake.orbits.branches.hopf_start import first_cycle
from wedgebrake.orbits.continuation import (
    POINTS,
    STEP,
    NotFollowedError,
    branch_from,
    check_step,
    continuation,
)
from wedgebrake.orbits.orbit import BranchPoint, Orbit
from wedgebrake.orbits.problems.choose_problem import orbit_problem
from wedgebrake.orbits.problems.problem import OrbitProblem
from wedgebrake.orbits.ranges import Range, check_samplings, make_ranges
from wedgebrake.orbits.shooting import orbit, orbit_to_follow

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.solvers.machine.final_state import FinalState

SWITCH = 2
_AT_FIRST, _AT_LAST = "start of the range", "end of the range"
# Values between the ends of a range at which branches begin too, as shares of the range.
_BEGINNINGS = (0.5, 0.25, 0.75, 0.125, 0.375, 0.625, 0.875)
_MOST_LEVELS = 20
# Largest number of periods of orbits that are searched for where branches leave.
_MOST_ORDER = 16
# Distance beyond a jump at which the motion is searched for, as a share of the range.
_ONWARD = 1e-6
# Poincare points nearer than this share of their size may belong to one orbit at
# another value nearby.
_LIKE = 0.02
# Largest distance of the end of a branch from the branch that it meets, as a share of the range.
_NEAR = 1e-3
# Distance from the end of a branch at which the branch that it met is started (share of range).
_ASIDE = 1e-3
# Measures of a point, with unit and meaning.
MEASURES = {
    "velocity_amplitude": ("rad/s", "half the range of the velocity"),
    "angle_amplitude": ("rad", "half the range of the angle"),
    "stick_share": ("1", "share of time at rest relative to the brake"),
    "sticks_forward": ("1", "sticks entered from v > 0, per return"),
    "sticks_backward": ("1", "sticks entered from v < 0, per return"),
    "events": ("1", "events per return"),
    "peak_torque": ("N m", "largest |R F_mu|"),
}
# Of the twist q_a - ratio q_b of each shaft of a machine.
_TWISTS = {
    "twist_amplitude": "half the range of the twist of the shaft",
    "peak_twist": "largest magnitude of the twist of the shaft",
}
# Measures of which several inertias or contacts have values of their own.
_OF_INERTIAS, _OF_CONTACTS = (
    ("velocity_amplitude", "angle_amplitude"),
    ("stick_share", "peak_torque"),
)


@dataclass(frozen=True)
class Followed:
    """A branch of a bifurcation diagram.

    origin : number, among all bifurcations in their order, of the one it leaves; -1: none
    begin  : reason why it begins there
    """

    branch: Branch
    origin: int
    begin: str


def branches(
    system: BrakedDriveline | Machine | StabilityLimit,
    over: Mapping[str, tuple[float, float]] | None = None,
    *,
    order: int | None = None,
    initial: tuple[float, float] | FinalState | None = None,
    method: str | None = None,
    rtol: float = 1e-10,
    switch: int = SWITCH,
    opposite: bool = True,
    step: float = STEP,
    points: int = POINTS,
    progress: Callable[[Branch], None] | None = None,
    **parameter: tuple[float, float],
) -> xr.Dataset:
    """Branches of periodic orbits over one parameter, stable and unstable, with bifurcations.

    Parameters
    ----------
    system : BrakedDriveline, Machine or StabilityLimit
        System whose parameter varies; or a Hopf point of its steady sliding, as found by
        ``wb.hopf``, at which the first branch begins. The parameter must be that of the Hopf
        point.
    over : mapping
        The parameter and its ends, instead of a keyword, for names with a dot: for example
        ``{"belt.base_speed": (0.3, 1.4)}``.
    **parameter : (float, float)
        One SI parameter or group with its ends, for example ``eta=(12, -60)``. The first
        branch begins at the first end.
    order, initial, method, rtol
        Of the first orbit, as for ``wb.orbit``; from a Hopf point only ``method`` and ``rtol``.
        If the motion is still irregular after the longest transient of ``wb.orbit``, the first
        orbit is a stable one near that motion.
    switch : int
        Levels of branches that leave other branches (at period doublings, symmetry breakings,
        branch points, and where the motion jumps): 0 none, 1 those that leave the first, ...
        Orbits of more than 16 periods are not followed.
    opposite : bool
        Also follow a branch from the other end, with the motion that settles there, unless the
        first branch reaches it.
    step, points
        As for ``wb.continuation``, for each branch.
    progress : callable
        Called with the ``Branch`` after each of its points.

    Returns
    -------
    xarray.Dataset
        Over ``point``, branch after branch: the parameter, ``branch``, ``order``, ``stable``,
        ``sequence``, Floquet multipliers, amplitudes, sticks and events per return (a period of the
        torque, or a crossing of the section), Poincare points. Over ``bifurcation``: kind, value
        (located to 1e-8 of the range or better), effect. Over ``branch_number``: origin of each
        branch and why it ends. On a system with odd symmetry, a branch and its mirror image
        -x(t + T/2) are listed once.

    Raises ``InputError`` for invalid arguments, and if there is no orbit at the first end.
    """
    settings: Any = {"switch": switch, "opposite": opposite, "step": step, "points": points}
    if progress is not None and not callable(progress):
        raise wrong("progress", progress, "a callable, or None")
    if isinstance(system, StabilityLimit):
        if order is not None or initial is not None:
            name = "order" if order is not None else "initial"
            given = initial if order is None else order
            raise wrong(name, given, "left out: the branch begins at the Hopf point")
        (along,) = make_ranges(system.system, joined(over, parameter), 1)
        first = first_cycle(system, along, method, rtol)
        followed = follow(first, along, **settings, progress=progress)
        return assemble(system.system, along, followed)
    parameter = joined(over, parameter)
    with own_names(system):
        problem = orbit_problem(system, method, rtol, parameter)
    (along,) = make_ranges(problem.base, parameter, 1)
    with own_names(system):
        check_samplings(problem, along)
        begin = first_orbit(problem, along, order, initial)
        followed = follow(begin, along, **settings, progress=progress)
    return assemble(system, along, followed)


def first_orbit(problem: OrbitProblem, over: Range, order: int | None, initial: Any) -> Orbit:
    """The orbit at the first end of a range; ``InputError`` where there is none."""
    begin = problem.base.replace(**{over.name: over.first})
    first = orbit_to_follow(problem.of(begin), order, initial)
    if not first.found:
        raise InputError(
            f"{over.name} = {over.first:g}: there is no orbit to begin with. {first.message}",
            name=over.name, value=over.first, allowed="a value at which there is an orbit",
        )  # fmt: skip
    return first


def follow(
    first: Orbit | BranchPoint,
    over: Range,
    *,
    switch: int = SWITCH,
    opposite: bool = True,
    step: float = STEP,
    points: int = POINTS,
    progress: Callable[[Branch], None] | None = None,
) -> list[Followed]:
    """The branches themselves, in the order in which they were found.

    first : an orbit at the first end of the range; or the first limit cycle at a Hopf point
    """
    check_whole("switch", switch, 0, _MOST_LEVELS)
    check_instance("opposite", opposite, bool)
    diagram = _Diagram(over, {"step": step, "points": points}, progress)
    if isinstance(first, Orbit):
        branch = diagram.add_from(first, (over.first, over.last), -1, _AT_FIRST)
    else:
        branch = diagram.add_limit_cycles(first)
    like = branch.points[0]
    diagram.add_descendants(switch)
    if opposite:
        diagram.add_at(like.problem, over.last, None, switch)
    return diagram.followed


def follow_across(
    problem: OrbitProblem,
    over: Range,
    order: int | None,
    *,
    switch: int,
    step: float,
    points: int,
    progress: Callable[[Branch], None] | None = None,
) -> tuple[list[Followed], str]:
    """The branches of a range in which orbits need not exist everywhere, and why there are none.

    Branches begin at both ends of the range, and at values between them over which none has passed.
    """
    check_whole("switch", switch, 0, _MOST_LEVELS)
    diagram = _Diagram(over, {"step": step, "points": points}, progress)
    reasons: dict[str, list[str]] = {}
    ends = over.first, over.last
    between = [over.first + share * (over.last - over.first) for share in _BEGINNINGS]
    for value in (*ends, *between):
        if value in ends or not diagram.covers(value):
            try:
                why = diagram.add_at(problem, value, order, switch).message
            except NotFollowedError as error:
                why = str(error)
            if why:
                reasons.setdefault(why, []).append(f"{value:g}")
    each = list(reasons)
    if len(reasons) > 1:
        each = [f"At {over.name} = {', '.join(at)}: {why}" for why, at in reasons.items()]
    return diagram.followed, "" if diagram.followed else " ".join(each)


class _Diagram:
    """The branches followed so far.

    settings : of ``continuation``
    """

    def __init__(
        self,
        over: Range,
        settings: dict[str, Any],
        progress: Callable[[Branch], None] | None,
    ) -> None:
        self.followed: list[Followed] = []
        self._over, self._settings, self._progress = over, settings, progress

    def add_at(self, problem: OrbitProblem, value: float, order: int | None, levels: int) -> Orbit:
        """Follow the orbit at a value, unless it is known, in both directions; return the orbit.

        order  : as for ``wb.orbit``
        levels : of the branches that leave it
        """
        over = self._over
        found = orbit_to_follow(problem.of(problem.base.replace(**{over.name: value})), order)
        if not found.found or not found.isolated or self.contains(found, value):
            return found
        words = {over.first: _AT_FIRST, over.last: _AT_LAST}
        begin = words.get(value, f"{over.name} = {value:.6g}")
        for ends in ((over.first, over.last), (over.last, over.first)):
            if value != ends[1]:
                branch = self.add_from(found, ends, -1, begin)
                self.add_descendants(levels)
                if branch.end == CLOSED:
                    # One direction covers all of it.
                    break
        return found

    def covers(self, value: float) -> bool:
        """Return True if one of the branches passes over a value."""
        spans = [[point.value for point in one.branch.points] for one in self.followed]
        return any(min(span) <= value <= max(span) for span in spans)

    def contains(self, found: Orbit | BranchPoint, value: float) -> bool:
        """Return True if an orbit, or its mirror image, is on one of the branches."""
        if not self.followed:
            return False
        if self._on_a_branch(found.points, value):
            return True
        ends = (self._over.first, self._over.last)
        # A system that is symmetric at one value only has no branches of mirror images.
        odd = all(self.followed[0].branch.start.problem.has_odd_symmetry((one,)) for one in ends)
        return odd and self._on_a_branch(found.mirror_points(), value)

    def _on_a_branch(self, points: FloatArray, value: float) -> bool:
        """Return True if an orbit, by its Poincare points, is on one of the branches."""
        return any(lies_on(points, value, one.branch.points) for one in self.followed)

    def add_from(self, found: Orbit, ends: tuple[float, float], origin: int, begin: str) -> Branch:
        """Follow the branch of an orbit."""
        branch = continuation(found, {self._over.name: ends}, **self._settings)
        return self._add(branch, origin, begin)

    def add_limit_cycles(self, first: BranchPoint) -> Branch:
        """Follow the branch of limit cycles that begins at a Hopf point."""
        check_step(**self._settings)
        branch = branch_from(first, self._over, **self._settings)
        return self._add(branch, -1, "Hopf point of steady sliding")

    def _add(self, branch: Branch, origin: int, begin: str) -> Branch:
        """Follow a branch to its end; it does not retrace the others."""
        for number, one in enumerate(self.followed):
            branch.marks += marks(one.branch.points, f"goes on as branch {number}")
        for _ in branch:
            if self._progress is not None:
                self._progress(branch)
        self.followed.append(Followed(branch, origin, begin))
        return branch

    def add_descendants(self, levels: int) -> None:
        """Follow the branches that leave the last one, those that leave these, and so on."""
        begin, end = len(self.followed) - 1, len(self.followed)
        for _ in range(levels):
            for place in range(begin, end):
                number = sum(len(one.branch.bifurcations) for one in self.followed[:place])
                branch = self.followed[place].branch
                for point in branch.bifurcations:
                    self._add_leaving(point, number)
                    number += 1
                if branch.jumps:
                    self._add_beyond_jump(branch, number - 1)
                if branch.met:
                    self._add_parents(branch, place)
            begin, end = end, len(self.followed)

    def _add_leaving(self, point: BranchPoint, number: int) -> None:
        """Follow the branches that leave a bifurcation and are not known yet."""
        if 2 * point.order > _MOST_ORDER or self._ends_at(point):
            return
        first = self.followed[0].branch
        begin = point.bifurcation.kind.value if point.bifurcation is not None else ""
        for origin, start in leaving(point):
            if not self.contains(start, start.value):
                rising = start.direction[-1] > 0.0
                branch = Branch(start, first.bounds, rising, first.largest, first.most, [origin])
                self._add(branch, number, begin)

    def _ends_at(self, point: BranchPoint) -> bool:
        """Return True if a branch that leaves a bifurcation ends there, coming from elsewhere."""
        for one in self.followed:
            last = one.branch.points[-1]
            near = abs(last.value - point.value) <= _NEAR * self._over.scale
            if near and one.branch.met and last.order in (point.order, 2 * point.order):
                repeated = np.tile(point.points, (last.order // point.order, 1))
                if point.section.same_orbit(last.points, repeated, _LIKE):
                    return True
        return False

    def _add_beyond_jump(self, branch: Branch, number: int) -> None:
        """Follow the branch of the motion just beyond a jump, if it is not known yet."""
        before, last = branch.points[-2:]
        low, high = branch.bounds
        onward = math.copysign(_ONWARD * (high - low), last.value - before.value)
        value = last.value + onward
        if not low < value < high:
            return
        # Over the whole range: beyond a fold the branch may return to its initial value.
        ends = (low, high) if onward > 0.0 else (high, low)
        for found in self._new_orbit(last, value, None):
            self.add_from(found, ends, number, "beyond a jump")

    def _add_parents(self, branch: Branch, place: int) -> None:
        """Follow in both directions the branch that another met at its end, unless known."""
        last, (low, high) = branch.points[-1], branch.bounds
        # Slightly beside, so that one direction passes the bifurcation where they meet.
        inwards = 1.0 if last.value < 0.5 * (low + high) else -1.0
        value = last.value + _ASIDE * (high - low) * inwards
        begin = f"beside the end of branch {place}"
        for found in self._new_orbit(last, value, last.prime_order(_LIKE)):
            for ends in ((high, low), (low, high)):
                further = self.add_from(found, ends, -1, begin)
                if further.end == CLOSED:
                    # One direction covers all of it.
                    break

    def _new_orbit(self, near: BranchPoint, value: float, order: int | None) -> Iterator[Orbit]:
        """The orbit from the state of another one at a value of the parameter, unless known."""
        problem = near.problem
        found = orbit(
            problem.base.replace(**{self._over.name: value}), order,
            initial=near.initial,
            method=problem.method, rtol=problem.rtol,
        )  # fmt: skip
        if found.found and found.isolated and not self.contains(found, value):
            yield found


def assemble(
    system: BrakedDriveline | Machine, over: Range, followed: list[Followed]
) -> xr.Dataset:
    """One dataset of all branches, see ``branches``."""
    import xarray as xr

    points = [point for one in followed for point in one.branch.points]
    numbers = np.repeat(np.arange(len(followed)), [len(one.branch.points) for one in followed])
    numbers = numbers.astype(np.int32)
    places = [place for place, point in enumerate(points) if point.bifurcation is not None]
    found = [point.bifurcation for point in points if point.bifurcation is not None]
    words = {
        "bifurcation_kind": [one.kind.value for one in found],
        "bifurcation_effect": [one.effect for one in found],
        "bifurcation_scenario": [one.scenario.value for one in found],
        "bifurcation_sentence": [one.sentence for one in found],
    }
    of_branches: dict[str, tuple[list[Any], Any]] = {
        "branch_order": ([one.branch.points[-1].order for one in followed], np.int16),
        "branch_origin": ([one.origin for one in followed], np.int32),
        "branch_begin": ([one.begin for one in followed], object),
        "branch_end": ([one.branch.end for one in followed], object),
    }
    values = np.array([point.value for point in points])
    problem = points[0].problem
    return xr.Dataset(
        {
            **_of_points(points),
            **{
                name: ("branch_number", np.array(column, dtype=kind))
                for name, (column, kind) in of_branches.items()
            },
            **{
                name: ("bifurcation", np.array(texts, dtype=object))
                for name, texts in words.items()
            },
            "bifurcation_value": ("bifurcation", values[places], over.attributes()),
            "bifurcation_point": ("bifurcation", np.array(places, dtype=np.int64)),
            "bifurcation_branch": ("bifurcation", numbers[places]),
        },
        coords={
            over.dim: ("point", values, over.attributes()),
            "branch": ("point", numbers, {"long_name": "number of the branch, from 0"}),
            **({"inertia": list(problem.inertias)} if problem.inertias else {}),
            **({"shaft": list(points[0].twists)} if points[0].twists else {}),
        },
        attrs={
            "kind": "orbits",
            "parameter": over.dim,
            "range": [over.first, over.last],
            "section": "crossing" if problem.self_excited else "period",
            **problem.attributes(system),
        },
    )


def multiplier_columns(points: list[BranchPoint]) -> dict[str, Any]:
    """Real and imaginary parts of the multipliers."""
    values = np.array([point.multipliers for point in points])
    about = "1", "Floquet multipliers, the larger modulus first"
    dims = ("point", "multiplier")
    return {
        "multiplier_real": labelled(dims, values.real, *about),
        "multiplier_imag": labelled(dims, values.imag, *about),
    }


def _of_points(points: list[BranchPoint]) -> dict[str, Any]:
    longest, states = max(point.order for point in points), points[0].points.shape[1]
    section = np.full((len(points), longest, states), np.nan)
    for row, point in zip(section, points, strict=True):
        row[: point.order] = point.points
    with np.errstate(divide="ignore"):
        exponents = [
            np.log(max(map(abs, point.multipliers), default=0.0)) / point.period for point in points
        ]
    orders = np.array([point.order for point in points], dtype=np.int16)
    sequences = np.array([point.sequence for point in points], dtype=object)
    angle, velocity = points[0].problem.kinematics(section)
    returns = ("point", "return", "inertia")[: angle.ndim]
    where = "at t = 0, T, 2 T, ..." if angle.ndim == 2 else "at the section"
    words = "segments in order: + forwards, - backwards, 0 rest, +1 the next piece of the law"
    twists = np.array([list(one.twists.values()) for one in points])
    stable = {"long_name": "whether small deviations, that keep a rest, die out"}
    return {
        "stable": ("point", np.array([point.stable for point in points]), stable),
        "sequence": ("point", sequences, {"long_name": words}),
        **multiplier_columns(points),
        "angle": labelled(returns, angle, "rad", f"angle {where}"),
        "velocity": labelled(returns, velocity, "rad/s", f"velocity {where}"),
        "period": labelled("point", [one.period for one in points], "s", "period of the orbit"),
        "order": labelled("point", orders, "1", "number of returns to the section in an orbit"),
        "arclength": labelled(
            "point", [one.arclength for one in points], "1",
            "length along the branch, in the scales of its unknowns",
        ),
        "largest_exponent": labelled("point", exponents, "1/s", "largest Lyapunov exponent"),
        **{
            name: labelled("point", [getattr(one.measures, name) for one in points], *about)
            for name, about in described_measures(points[0].problem.base).items()
        },
        **{
            name: labelled(("point", "shaft"), twists[..., k], "rad", about)
            for k, (name, about) in enumerate(_TWISTS.items() if twists.size else ())
        },
    }  # fmt: skip


def described_measures(system: BrakedDriveline | Machine) -> dict[str, tuple[str, str]]:
    """Unit and meaning of each measure of an orbit, by name."""
    several = [
        (words, names)
        for words, names, parts in (
            ("inertias", _OF_INERTIAS, system.coords.get("inertia", ())),
            ("contacts", _OF_CONTACTS, system.coords.get("contact", ())),
        )
        if len(parts) > 1
    ]
    largest = {name: f", the largest of all {words}" for words, names in several for name in names}
    return {
        name: (unit, meaning + largest.get(name, "")) for name, (unit, meaning) in MEASURES.items()
    }

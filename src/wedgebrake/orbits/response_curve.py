"""``response_curve``: amplitude and phase over one parameter, at several values of another."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.responses.datasets import labelled
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.studies.sweep_settings import joined, refuse_doubled
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.system_base import own_names
from wedgebrake.model.validation import (
    check_instance,
    check_whole,
    is_finite,
    is_number,
    wrong,
)
from wedgebrake.orbits.bifurcation_types import Kind, Scenario
from wedgebrake.orbits.branches.branch import Branch
from wedgebrake.orbits.codim2 import boundary_curve
from wedgebrake.orbits.continuation import POINTS, STEP, check_step
from wedgebrake.orbits.cycle import cycle_of
from wedgebrake.orbits.diagram import MEASURES, Followed, assemble, follow_across
from wedgebrake.orbits.orbit import BranchPoint
from wedgebrake.orbits.problems.choose_problem import orbit_problem
from wedgebrake.orbits.problems.problem import sample_times
from wedgebrake.orbits.ranges import Range, check_samplings, followable, make_ranges, make_span

if TYPE_CHECKING:
    import xarray as xr

_MOST_LEVELS, MOST_SAMPLINGS = 100, 100_000
# A fold is on a curve of folds if it is nearer than these shares: of the range, and of its size.
_NEAR, _LIKE = 2e-3, 0.05
# Measures of each inertia or contact, of which ``branches`` gives the largest, and of the cycle:
# the parts, unit and meaning.
_PARTS = {
    "velocity_amplitude": "inertia", "angle_amplitude": "inertia",
    "stick_share": "contact", "peak_torque": "contact",
}  # fmt: skip
_MEASURES = {name: (part, *MEASURES[name]) for name, part in _PARTS.items()} | {
    "angle_fundamental": ("inertia", "rad", "amplitude of the fundamental of the angle"),
    "angle_phase": ("inertia", "rad", "phase of the fundamental of the angle"),
    "twist_fundamental": ("shaft", "rad", "amplitude of the fundamental of the twist"),
    "twist_phase": ("shaft", "rad", "phase of the fundamental of the twist"),
    "friction_heat": ("contact", "J", "heat of the brake in a cycle"),
    "equivalent_damping": ("contact", "N m s/rad", "equivalent viscous damping of the brake"),
}


def response_curve(
    system: BrakedDriveline | Machine,
    over: Mapping[str, tuple[float, float]] | None = None,
    *,
    levels: Sequence[float] | Mapping[str, Sequence[float]],
    order: int | None = 1,
    method: str | None = None,
    rtol: float = 1e-10,
    switch: int = 0,
    folds: bool = False,
    samplings: int | None = None,
    step: float = STEP,
    points: int = POINTS,
    progress: Callable[[Branch], None] | None = None,
    **parameter: tuple[float, float],
) -> xr.Dataset:
    """Amplitude and phase of the vibration over the frequency, at several levels of the torque.

    Periodic orbits, stable and unstable, are followed over one parameter, also through folds, at
    each of several values of a second one. Branches begin at both ends of the range, and between
    them where none has passed; a branch that is connected to none of these is not found.

    Parameters
    ----------
    system : BrakedDriveline or Machine
        System whose parameters vary.
    over : mapping
        The parameter and its ends, instead of a keyword, for names with a dot: for example
        ``{"torque.frequency": (5, 40)}``.
    **parameter : (float, float)
        One SI parameter or group with its ends; ``frequency`` is also that of the only torque of a
        machine.
    levels : sequence of float, or mapping
        Amplitudes of the torque [N m]; or one other parameter with its values, for example
        ``{"brake.initial_force": [300, 400]}``.
    order : int
        Periods of the torque in the orbits, as for ``wb.orbit``; None for those of the motion that
        settles.
    method, rtol
        As for ``wb.orbit``.
    switch, step, points, progress
        As for ``wb.branches``, for each level; by default branches that leave others are not
        followed.
    samplings : int
        Number of samplings in a period of the signals: at each point the ``sample_time`` of
        sampled actuations and digital controllers is the period divided by ``samplings``. Without
        it, curves over the frequency of such systems are refused, because they have periodic
        orbits only at frequencies at which a period is a whole number of sampling intervals.
    folds : bool
        Also follow the folds over both parameters, between the least and the largest level.

    Returns
    -------
    xarray.Dataset
        Over ``point``, level after level and branch after branch: both parameters and what
        ``wb.branches`` returns, but amplitudes (half ranges), shares of sticking and peak torques
        of each inertia and contact. In addition the amplitude [rad] and phase [rad] of the
        fundamental of each angle and twist, which has the frequency of the torque; the heat of
        each contact in a cycle [J]; and its equivalent viscous damping [N m s/rad],
        c = omega int tau (s - s_0) dt/(pi S^2) with the friction torque tau, the sliding speed s,
        its mean s_0 and the amplitude S of its fundamental. A phase is that of the angle ahead of
        ``attrs["phase_reference"]``, the torque. ``bifurcation_level`` is the level of each
        bifurcation. With ``folds`` also over ``fold_point``, curve after curve: ``fold_value`` and
        ``fold_level``, the number ``fold_curve``, and the same measures, as
        ``fold_angle_amplitude``. With ``samplings`` also ``sample_time`` [s], the sampling
        interval at each point, and ``attrs["samplings"]``. Where ``sample_time`` is that of the
        system, the orbit is one of the system itself. ``attrs["note"]`` says at which levels there
        is no orbit, and why.

    Raises ``InputError`` for invalid arguments, and if there is no orbit at any level.
    """
    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    check_instance("folds", folds, bool)
    check_step(step, points)
    names = _names(system, joined(over, parameter))
    along, level, values = ranges_of(system, names, levels)
    if folds and len(values) < 2:
        raise wrong("folds", folds, "False with a single level", "Give two levels or more.")
    count = _samplings(system, samplings, (along.name, level.name))
    settings: Any = {"switch": switch, "step": step, "points": points, "progress": progress}
    followed: list[Followed] = []
    notes: list[str] = []
    for value in values:
        at = system.replace(**{level.name: value})
        with own_names(at):
            problem = orbit_problem(at, method, rtol, (along.name, level.name))
            problem = replace(problem, samplings=count)
            check_samplings(problem, along)
            found, why = follow_across(problem, along, order, **settings)
        # Origins are numbers among the bifurcations of all levels.
        before = sum(len(one.branch.bifurcations) for one in followed)
        followed += [
            replace(one, origin=one.origin + before if one.origin >= 0 else -1) for one in found
        ]
        notes += [f"{level.name} = {value:g}: {why}"] if why else []
    if not followed:
        raise InputError(
            f"levels: there is no orbit at any of them. {notes[0]}",
            name="levels", value=values, allowed="levels at which there are orbits",
        )  # fmt: skip
    curves = _folds(followed, along, level, step, points) if folds else []
    dataset = _assembled(system, along, level, followed, curves)
    if count:
        systems = [point.system for one in followed for point in one.branch.points]
        used = np.array([max(sample_times(one).values()) for one in systems])
        dataset["sample_time"] = labelled("point", used, "s", "time between two samplings")
        dataset.attrs["samplings"] = count
    return dataset.assign_attrs(levels=values, note="\n".join(notes))


def _samplings(system: BrakedDriveline | Machine, samplings: Any, varied: tuple[str, str]) -> int:
    """Return the checked number of samplings in a period; 0 if the sample times do not change.

    varied : names of both parameters
    """
    if samplings is None:
        return 0
    times = sample_times(system)
    if not times.keys().isdisjoint(varied):
        raise wrong(
            "samplings", samplings, "None if a sample_time is one of the parameters",
            "Vary another parameter to use samplings.",
        )  # fmt: skip
    if len(set(times.values())) != 1:
        found = ", ".join(f"{name} = {value:g} s" for name, value in times.items())
        raise wrong(
            "samplings", samplings,
            "None unless the sampled actuations and digital controllers have the same sample_time",
            f"The sample times are: {found or 'none'}.",
        )  # fmt: skip
    return check_whole("samplings", samplings, 1, MOST_SAMPLINGS)


def ranges_of(
    system: BrakedDriveline | Machine,
    over: dict[str, tuple[float, float]],
    levels: Any,
) -> tuple[Range, Range, list[float]]:
    """The range of the first parameter, that of the levels, and the levels.

    Raises ``InputError`` as ``response_curve``.
    """
    if isinstance(levels, Mapping):
        if len(levels) != 1:
            raise wrong(
                "levels", levels, "one parameter with its values",
                'For example {"amplitude": [50, 150, 300]}.',
            )  # fmt: skip
        ((name, given),) = levels.items()
    else:
        name, given = _of_torque(system, "amplitude", "levels"), levels
    listed = isinstance(given, Sequence | np.ndarray) and not isinstance(given, str)
    numbers = list(given) if listed else []
    if not numbers or not all(is_number(one) and is_finite(one) for one in numbers):
        raise wrong(
            "levels", given, f"a list of values of {name}", "For example levels=[50, 150, 300]."
        )
    values = [float(one) for one in numbers]
    if len(set(values)) < len(values) or len(values) > _MOST_LEVELS:
        raise wrong("levels", values, f"different values, at most {_MOST_LEVELS}")
    (along,) = make_ranges(system, over, 1)
    if name == along.name:
        raise InputError(
            f"levels: {name}: is followed over its range. Give the levels of another parameter.",
            name="levels", value=name, allowed="another parameter",
        )  # fmt: skip
    level = make_span(system, name, values)
    refuse_doubled(level.name, (along.name, level.name))
    return along, level, values


def _names(
    system: BrakedDriveline | Machine, over: dict[str, tuple[float, float]]
) -> dict[str, tuple[float, float]]:
    """The parameter with its ends, by its name in the system."""
    if set(over) != {"frequency"} or "frequency" in followable(system):
        return over
    return {_of_torque(system, "frequency", "over"): over["frequency"]}


def _of_torque(system: BrakedDriveline | Machine, name: str, argument: str) -> str:
    """Name of the amplitude or frequency of the only torque; ``InputError`` if it is not clear."""
    allowed, torques = followable(system), [one.name for one in system.machine.torques]
    if name in allowed:
        return name
    found = [f"{one}.{name}" for one in torques if f"{one}.{name}" in allowed]
    if len(found) != 1:
        why = f"several torques have one: {', '.join(found)}" if found else "no torque has one"
        near = found or [one for one in allowed if one.endswith(f".{name}")] or list(allowed)
        raise InputError(
            f"{argument} = {name!r}: must be the name of a parameter with its part, because"
            f" {why}. Give a mapping, for example {{{near[0]!r}: ...}}.",
            name=argument, value=name, allowed=tuple(found or allowed),
        )  # fmt: skip
    return found[0]


def _turns(point: BranchPoint) -> bool:
    """Return True for a fold, also one of friction, that can be followed."""
    found = point.bifurcation
    folds = found is not None and (found.kind is Kind.FOLD or found.scenario is Scenario.FOLD)
    return folds and point.can_be_followed


def _folds(
    followed: list[Followed], along: Range, level: Range, step: float, points: int
) -> list[list[BranchPoint]]:
    """The curves of all folds over both parameters, each once."""
    ends = {one.name: (one.first, one.last) for one in (along, level)}
    curves: list[list[BranchPoint]] = []
    for one in followed:
        for point in filter(_turns, one.branch.bifurcations):
            if not any(_lies_on(point, curve, along, level) for curve in curves):
                curves.append(boundary_curve(point, step, points, ends)[0].followed()[0])
    return curves


def _lies_on(point: BranchPoint, curve: list[BranchPoint], along: Range, level: Range) -> bool:
    """Return True if a fold is on a curve of folds: at its level, in place and size."""
    height, size = point.system.value(level.name), point.measures.velocity_amplitude
    at = np.array([(*one.values, one.measures.velocity_amplitude) for one in curve])
    # A curve ends a little before the bounds of its ranges.
    apart = _NEAR * level.scale
    for begin, end in pairwise(at):
        low, high = sorted((begin[1], end[1]))
        if low - apart <= height <= high + apart and low < high:
            value, _, reach = begin + (height - begin[1]) / (end[1] - begin[1]) * (end - begin)
            if abs(value - point.value) <= _NEAR * along.scale and (
                abs(reach - size) <= _LIKE * size
            ):
                return True
    return False


def _assembled(
    system: BrakedDriveline | Machine,
    along: Range,
    level: Range,
    followed: list[Followed],
    curves: list[list[BranchPoint]],
) -> xr.Dataset:
    """The dataset of ``response_curve``."""
    points = [point for one in followed for point in one.branch.points]
    dataset = assemble(system, along, followed)
    heights = np.array([point.system.value(level.name) for point in points])
    measures, reference = _measures(system, points, "point")
    coords = {
        level.dim: ("point", heights, level.attributes()),
        **{dim: list(names) for dim, names in system.coords.items() if names},
    }
    at = heights[dataset["bifurcation_point"].to_numpy()]
    dataset = dataset.assign(measures).assign_coords(coords)
    dataset["bifurcation_level"] = "bifurcation", at, level.attributes()
    if curves:
        every = [point for curve in curves for point in curve]
        found = np.array([point.values for point in every])
        numbers = np.repeat(np.arange(len(curves), dtype=np.int32), [len(one) for one in curves])
        dataset = dataset.assign(
            {
                "fold_value": ("fold_point", found[:, 0], along.attributes()),
                "fold_level": ("fold_point", found[:, 1], level.attributes()),
                "fold_curve": labelled("fold_point", numbers, "1", "number of the curve, from 0"),
                **{
                    f"fold_{name}": one
                    for name, one in _measures(system, every, "fold_point")[0].items()
                },
            }
        )
    return dataset.assign_attrs(kind="response_curve", level=level.dim, phase_reference=reference)


def _measures(
    system: BrakedDriveline | Machine, points: list[BranchPoint], dim: str
) -> tuple[dict[str, Any], str]:
    """The measures of each part, and what phases refer to."""
    cycles = [cycle_of(point) for point in points]
    found = {}
    for name, (part, *about) in _MEASURES.items():
        sources = [point.part_measures for point in points] if name in _PARTS else cycles
        values = np.array([getattr(one, name) for one in sources])
        if part in system.coords and values.size:
            found[name] = labelled((dim, part), values, *about)
        elif part not in system.coords and part != "shaft":
            # Of a driveline, whose twist is its angle.
            found[name] = labelled(dim, values[:, 0], *about)
    return found, cycles[0].reference

"""Plots over parameters: their inputs, their computation in steps, and the call that makes them.

Each computes its coarse points first; every item of ``pictures`` is a complete picture.
"""

from __future__ import annotations

import json
import math
import time
from abc import ABC, abstractmethod
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.linear_stability import DirectionStability, linearisation_of, stability_map
from wedgebrake.analysis.linear_stability import stability as linear_stability
from wedgebrake.analysis.linear_stability.one_inertia import has_closed_form
from wedgebrake.errors import InputError
from wedgebrake.explorer.core.computation import (
    evaluation_settings,
    linked_friction,
    slow,
    sweep_settings,
)
from wedgebrake.explorer.core.fields import parameter_axis
from wedgebrake.explorer.core.fits import picture as trace_picture
from wedgebrake.explorer.core.limits import (
    COARSE_MAP,
    COARSE_POINTS,
    FINE_MAP,
    FINE_POINTS,
    LONGEST_CURVE,
)
from wedgebrake.explorer.core.progressive_sweep import STEP, ProgressiveSweep, followed
from wedgebrake.explorer.core.scheduler import is_wanted
from wedgebrake.explorer.core.state import PageState, axes, first_axis
from wedgebrake.explorer.core.values import following, groups_of, values_of, word_of
from wedgebrake.figures.data import basins as basins_data
from wedgebrake.figures.data import class_map
from wedgebrake.figures.data.axes import ParameterAxis, SweptAxis, grid_values, swept_parameters
from wedgebrake.figures.data.basins import nearest_known
from wedgebrake.figures.data.bifurcation import BifurcationDiagram
from wedgebrake.figures.data.class_map import ClassMap
from wedgebrake.figures.data.class_styles import (
    LIMIT_ENTRY,
    MOTIONS,
    LegendEntry,
    class_entries,
    motion_codes,
)
from wedgebrake.figures.data.partial import (
    MEASURES,
    QUANTITIES,
    PartialCurve,
    PartialDiagram,
    PartialMap,
    hover_boxes,
)
from wedgebrake.figures.data.parts import with_one_part
from wedgebrake.figures.data.response_curve import ResponseCurves
from wedgebrake.figures.data.response_diagram import with_amplitude
from wedgebrake.figures.data.stability_limit import limit_lines
from wedgebrake.figures.data.trace import TracePicture
from wedgebrake.figures.style import number
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.validation import is_number
from wedgebrake.orbits.response_curve import response_curve
from wedgebrake.sweeps.basins import label

if TYPE_CHECKING:
    import xarray as xr

# Time of the first step of a diagram [s]: enough for all coarse points, except with a slow solver.
_FIRST_STEP = 0.25
# Steps of maps are longer by this factor with a slow solver; those of basins shorter by the other,
# for the time that it takes to distinguish attractors.
_SLOW, _BASINS = 2.5, 0.7
# Time between two identifications of the attractors, as a multiple of the duration of one.
_LABELLING = 3.0
# Cells of the stability map across and up; fewer if each is computed individually, the first ones
# fewer still.
_CELLS, _FEW_CELLS, _FIRST_CELLS = (280, 120), (56, 30), (14, 10)

# Levels of an amplitude curve, as multiples of the present value.
_LEVELS = (0.5, 1.0, 1.5)

# The limit on a shaft that does not turn; on one that turns it may be that of the release.
_HOPF_ENTRY = LegendEntry(f"{LIMIT_ENTRY.label} (Hopf bifurcation)", LIMIT_ENTRY.style)

Picture = PartialDiagram | PartialMap | PartialCurve | TracePicture


@dataclass(frozen=True)
class Call:
    """The call of a public function that computes a plot.

    function : its name
    axes     : parameters with (first, last, number, scale); the number is 0 for an amplitude
               curve, whose points are not given
    options  : other arguments than their defaults
    """

    function: str
    axes: dict[str, tuple[float, float, int, str]]
    options: dict[str, Any]


class ParameterPlot(ABC):
    """A plot over one or two parameters: across, and up."""

    function: str
    """Name of the public function that computes it."""
    from_initial = True
    """False if the initial state of the run is not an input."""

    @abstractmethod
    def parameters(self, state: PageState) -> tuple[str, ...]:
        """The parameters: the selected ones, or others that the system has."""

    @abstractmethod
    def pictures(self, state: PageState) -> Iterator[Picture]:
        """Compute the plot, coarse before fine.

        Raises ``InputError`` where the system has no such plot, for two parameters one of which
        sets the other, or if no value of a parameter is allowed.
        """

    def axes(self, state: PageState) -> list[ParameterAxis]:
        """The axes of the parameters; raises ``InputError`` where there is no such plot."""
        return [parameter_axis(state, name) for name in self.parameters(state)]

    def pick(self, state: PageState, x: float, y: float) -> dict[str, float]:
        """Values of the parameters at a point; empty for a point outside."""
        axes = self.axes(state)
        pairs = list(zip(axes, (x, y), strict=False))
        if not all(axis.contains(position) for axis, position in pairs):
            return {}
        return {axis.name: axis.rounded(position) for axis, position in pairs}

    def inputs(self, state: PageState) -> Hashable:
        """All inputs of the plot; for its own parameters only the ends of the axes.

        Raises ``InputError`` where the system has no such plot.
        """
        run = sweep_settings(state)
        if not self.from_initial:
            run.pop("initial")
        return (
            *self.axes(state),
            _without(state, self.parameters(state)),
            tuple(evaluation_settings(state).items()),
            tuple(run.items()),
        )

    def call(self, state: PageState, options: dict[str, Any]) -> Call:
        """The call that computes as many values as the page shows after refinement.

        options : options of a sweep of this study
        """
        if not self.from_initial:
            options = {name: value for name, value in options.items() if name != "initial"}
        return self._call(state, COARSE_MAP if slow(state) else FINE_MAP, options)

    def _call(self, state: PageState, counts: tuple[int, ...], options: dict[str, Any]) -> Call:
        scaled = {
            one.name: (one.low, one.high, count, "log" if one.log else "linear")
            for one, count in zip(self.axes(state), counts, strict=True)
        }
        return Call(self.function, scaled, options)

    def _sweep(
        self, state: PageState, levels: Sequence[tuple[int, ...]], **options: Any
    ) -> ProgressiveSweep:
        """A sweep over the axes, up before across, with successive numbers of values."""
        values = {
            axis.name: axis.values(count)
            for axis, count in zip(reversed(self.axes(state)), levels[-1], strict=True)
        }
        arguments = {**evaluation_settings(state), **sweep_settings(state), **options}
        return ProgressiveSweep(linked_friction(state, values), values, levels, **arguments)


class _Diagram(ParameterPlot):
    """The bifurcation diagram: Poincare points or amplitudes over one parameter, by class."""

    function = "bifurcation"

    def parameters(self, state: PageState) -> tuple[str, ...]:
        possible = axes(state.system)
        return (state.view.axis if state.view.axis in possible else possible[-1],)

    def pictures(self, state: PageState) -> Iterator[PartialDiagram]:
        (axis,), few = self.axes(state), slow(state)
        sweep = self._sweep(
            state, [(COARSE_POINTS,)] if few else [(COARSE_POINTS,), (FINE_POINTS,)]
        )
        for _ in sweep.steps(_FIRST_STEP, 2.0 * STEP if few else STEP):
            known = np.flatnonzero(sweep.known)
            dataset = sweep.dataset().isel({sweep.dims[0]: known})
            yield _diagram(state, axis, dataset, known, sweep.known.size, follows=state.view.follow)
        if state.view.follow:
            count = sweep.known.size
            settings = {**evaluation_settings(state), **sweep_settings(state)}
            values = {axis.name: axis.values(count)}
            dataset = followed(linked_friction(state, values), values, **settings)
            yield _diagram(state, axis, dataset, np.arange(count), count)

    def inputs(self, state: PageState) -> Hashable:
        return super().inputs(state), state.view.follow, state.inertia, state.contact

    def call(self, state: PageState, options: dict[str, Any]) -> Call:
        if state.view.follow:
            options = {**options, "follow": True}
        return self._call(state, (COARSE_POINTS if slow(state) else FINE_POINTS,), options)


class _Regimes(ParameterPlot):
    """The regime map: the class of motion over two parameters."""

    function = "regime_map"

    def parameters(self, state: PageState) -> tuple[str, ...]:
        possible = axes(state.system)
        across = state.view.across if state.view.across in possible else possible[-1]
        wanted = (state.view.up, "F0", "eta", *possible)
        return across, next(one for one in wanted if one in possible and one != across)

    def pictures(self, state: PageState) -> Iterator[PartialMap]:
        x, y = self.axes(state)
        sweep = self._sweep(state, _levels(state), keep_points=False)
        limit: list[NDArray[np.float64]] = []
        level = sweep.level
        step = STEP * (_SLOW if slow(state) else 1.0)
        for _ in sweep.steps(step, step):
            dataset = with_one_part(sweep.dataset(), state.inertia, state.contact)
            if sweep.level != level:
                level = sweep.level
                up, across = sweep.complete_places()
                complete = dataset.isel(dict(zip(sweep.dims, (up, across), strict=True)))
                limit = limit_lines(complete, *_swept_axes(complete))
            columns, rows = _swept_axes(dataset)
            found = grid_values(motion_codes(dataset), columns, rows).astype(np.int64)
            legend = class_entries(found[sweep.known], MOTIONS, shares=True)
            legend += [LIMIT_ENTRY if _turns(state) else _HOPF_ENTRY] if limit else []
            codes = nearest_known(found, sweep.known)
            data = ClassMap(columns, rows, codes, MOTIONS, legend, limit)
            known, whole = int(sweep.known.sum()), sweep.known.size
            yield PartialMap((x, y), data, hover_boxes((x, y), data), known, whole)


class _Stability(ParameterPlot):
    """Linear stability of sliding over two groups: margins, and regions of self-locking."""

    function = "stability_map"

    def parameters(self, state: PageState) -> tuple[str, ...]:
        groups = groups_of(state.system)
        if not groups:
            return regimes.parameters(state)
        return "eta", "kinetic" if groups["alpha"] is None else "alpha"

    def axes(self, state: PageState) -> list[ParameterAxis]:
        groups = groups_of(state.system)
        if groups and groups["eta"] is None:
            raise InputError(
                "eta: not defined without damping or friction, and so no margin in it. Raise them;"
                " without damping sliding is linearly stable exactly where the slope of the"
                " actuation force is positive."
            )
        if groups and state.value("stiffness") == 0.0:
            raise InputError(
                "No map: without a spring there is no restoring torque. Raise the stiffness."
            )
        if self.parameters(state)[1] not in axes(state.system):
            raise InputError(
                "No map: an axis would be the kinetic friction coefficient, but a table of friction"
                " has several. Choose Coulomb friction, or a wedge brake, whose map is over its"
                " angle."
            )
        return super().axes(state)

    def inputs(self, state: PageState) -> Hashable:
        """The axes, and the system without its torque and the values on the axes."""
        still = state.edited(amplitude=0.0, frequency=1.0) if state.counted else state
        return *self.axes(state), _without(still, self.parameters(state))

    def pictures(self, state: PageState) -> Iterator[PartialMap]:
        x, y = self.axes(state)
        at_once = state.counted and has_closed_form(state.system)
        (most_wide, most_high), few = _CELLS if at_once else _FEW_CELLS, _FIRST_CELLS
        for wide, high in [(most_wide, most_high)] if at_once else [few, (most_wide, most_high)]:
            over = {x.name: x.values(wide), y.name: y.values(high)}
            dataset = stability_map(linked_friction(state, over), over)
            held = np.zeros(high, dtype=bool)
            if y.name == "alpha" and not _turns(state):
                held = y.values(high) <= (groups_of(state.system)["static_ratio"] or 1.0)
            data = class_map.stability_map(dataset, held)
            yield PartialMap((x, y), data, None, data.codes.size, most_wide * most_high)

    def call(self, state: PageState, options: dict[str, Any]) -> Call:  # noqa: ARG002
        return self._call(state, FINE_MAP, {})


class _Basins(ParameterPlot):
    """Basins of attraction: the steady motion that each initial state leads to."""

    function = "basins"
    from_initial = False

    def parameters(self, state: PageState) -> tuple[str, ...]:
        names: tuple[str, ...] = state.system.initial_conditions
        if state.inertia is None:
            return names
        # Of the inertia that is shown, or of another one if it follows others or is driven.
        known = set(names) - following(state.system)
        pairs = [(f"{one}.angle", f"{one}.speed") for one in state.system.inertia_names]
        own = [pair for pair in pairs if pair[0] == f"{state.inertia}.angle"]
        return next(pair for pair in [*own, *pairs] if set(pair) <= known)

    def pictures(self, state: PageState) -> Iterator[PartialMap]:
        axes = x, y = self.axes(state)
        sweep = self._sweep(state, _levels(state))
        step = STEP * (_SLOW if slow(state) else _BASINS)
        labelled, cost = -math.inf, 0.0
        for _ in sweep.steps(step, step):
            start = time.perf_counter()
            # Attractors are identified again when the computation has taken longer than that.
            if start - labelled >= _LABELLING * cost or sweep.known.all():
                found = label(sweep.dataset()).transpose(x.name, y.name, ...)
                data = basins_data.of_dataset(found, sweep.known, numbered=False)
                known, whole = int(sweep.known.sum()), sweep.known.size
                picture = PartialMap((x, y), data, hover_boxes(axes, data), known, whole, "starts")
                labelled = time.perf_counter()
                cost = labelled - start
            yield picture


class _Curve(ParameterPlot):
    """Amplitude curves: stable and unstable periodic orbits over a parameter, level by level."""

    function = "response_curve"
    from_initial = False

    def parameters(self, state: PageState) -> tuple[str, ...]:
        possible, known = axes(state.system), values_of(state.system)
        frequencies = [
            one for one in possible
            if one in known and word_of(state.system, one) == "frequency"
            and state.value(_beside(one, "amplitude"))
        ]  # fmt: skip
        return (state.view.over or next(iter(frequencies), None) or first_axis(state.system),)

    def level(self, state: PageState) -> str:
        """The parameter of the levels."""
        (over,) = self.parameters(state)
        possible = [one for one in axes(state.system) if one != over]
        forces = [one for one in possible if word_of(state.system, one) == "initial_force"]
        wanted = (_beside(over, "amplitude"), *forces, *possible)
        acting = (one for one in wanted if one in possible and state.value(one))
        return state.view.level or next(acting, possible[0])

    def levels(self, state: PageState) -> tuple[float, ...]:
        """Return the levels that were entered, or multiples of the present value.

        Raises ``InputError`` if none were entered and the present value is zero or not a number.
        """
        name = self.level(state)
        here = state.value(name)
        if not state.view.levels and not (is_number(here) and here):
            raise InputError(
                f"levels: none follow from {name} = {here!r}. Enter levels of {name}, for example"
                " 250, 500."
            )
        return state.view.levels or tuple(float(f"{share * here:.5g}") for share in _LEVELS)

    def inputs(self, state: PageState) -> Hashable:
        names = (*self.parameters(state), self.level(state))
        return (
            *self.axes(state), names, self.levels(state), _without(state, names),
            tuple(self._options(state).items()), state.inertia, state.contact,
        )  # fmt: skip

    def pictures(self, state: PageState) -> Iterator[PartialCurve]:
        (axis,), name, levels = self.axes(state), self.level(state), self.levels(state)
        level, system = parameter_axis(state, name), linked_friction(state, [name])
        picture = PartialCurve((axis,), level, levels, ())
        error: InputError | None = None
        left = float(LONGEST_CURVE)
        yield picture  # without curves: no orbit is followed while a slider moves
        for value in levels:
            watch, done, notes = _Watch(left), picture.done, [picture.note] * bool(picture.note)
            try:
                dataset = response_curve(
                    system, {axis.name: (axis.low, axis.high)}, levels={name: [value]},
                    progress=watch.hear, **self._options(state),
                )  # fmt: skip
                done = (*done, _curves(dataset, state))
            except InputError as refused:
                error = error or refused
                done = (*done, {})
                notes.append(f"no orbit at {number(value)}")
            except _Ended:
                if not is_wanted():
                    return
                notes.append(f"stopped after {LONGEST_CURVE} s")
            if error is not None and len(done) == len(levels) and not any(done):
                raise error
            picture = replace(
                picture,
                done=done,
                note="; ".join(notes),
                reason="" if error is None else str(error),
            )
            yield picture
            left -= watch.elapsed
            if left <= 0.0:
                return

    def call(self, state: PageState, options: dict[str, Any]) -> Call:  # noqa: ARG002
        (axis,) = self.axes(state)
        ends = (axis.low, axis.high, 0, "linear")
        levels = {self.level(state): list(self.levels(state))}
        return Call(self.function, {axis.name: ends}, {"levels": levels, **self._options(state)})

    def _options(self, state: PageState) -> dict[str, Any]:
        settings = {**sweep_settings(state), "samplings": state.view.samplings}
        names = ("method", "rtol", "samplings")
        return {name: settings[name] for name in names if settings.get(name)}


class _Measured(ParameterPlot):
    """A measured trace and the motion of the machine, over time."""

    function = "fit"

    def parameters(self, state: PageState) -> tuple[str, ...]:  # noqa: ARG002
        return ()

    def inputs(self, state: PageState) -> Hashable:
        return (
            id(state.view.trace), tuple(state.view.observe.items()), _without(state, ()),
            tuple(sweep_settings(state).items()),
        )  # fmt: skip

    def pictures(self, state: PageState) -> Iterator[TracePicture]:
        yield trace_picture(state)

    def call(self, state: PageState, options: dict[str, Any]) -> Call:  # noqa: ARG002
        raise InputError(
            "The open plot shows a measured trace, which cannot be exported. Draw it with"
            " wb.plot(wb.fit(...)) or wedgebrake fit --plot."
        )


class _Ended(Exception):  # noqa: N818 - no error
    """The computation of a level ends early."""


class _Watch:
    """Ends a computation that is no longer wanted or exceeds a time limit [s]."""

    def __init__(self, longest: float) -> None:
        self._begun, self._longest = time.perf_counter(), longest

    @property
    def elapsed(self) -> float:
        """Time since the beginning [s]."""
        return time.perf_counter() - self._begun

    def hear(self, _: Any) -> None:
        """Raise ``_Ended`` if the computation must end."""
        if not is_wanted() or self.elapsed > self._longest:
            raise _Ended


def _beside(name: str, word: str) -> str:
    """Return the name of another value of the same part or signal."""
    first, dot, _ = name.rpartition(".")
    return f"{first}{dot}{word}"


def _curves(dataset: xr.Dataset, state: PageState) -> dict[str, ResponseCurves]:
    """Return the curves of one level, by measure."""
    parts = {"inertia": state.inertia, "contact": state.contact}
    known = [name for name in MEASURES if name in dataset]
    return {name: ResponseCurves.of(dataset, name, **parts) for name in known}


def _diagram(
    state: PageState, axis: ParameterAxis, dataset: xr.Dataset, known: NDArray[np.int64],
    whole: int, *, follows: bool = False,
) -> PartialDiagram:  # fmt: skip
    """The diagrams of all quantities of a dataset."""
    dataset = with_amplitude(with_one_part(dataset, state.inertia, state.contact))
    data = {name: BifurcationDiagram.of(dataset, name) for name in QUANTITIES if name in dataset}
    limits = [value for value, _ in data["velocity"].limits]
    words = [_limit_words(state, axis, value, dataset) for value in limits]
    return PartialDiagram.of(axis, known, whole, data, follows=follows, limit_words=words)


def _limit_words(state: PageState, axis: ParameterAxis, limit: float, dataset: xr.Dataset) -> str:
    """What changes at a linear stability limit, from the verdicts at the values on both sides."""
    (name,) = swept_parameters(dataset)
    values = dataset[name].to_numpy()
    damping = dataset["sliding_damping"].transpose(..., name).to_numpy()
    known = values[np.isfinite(damping.reshape(-1, values.size)[0])]
    above = int(np.clip(np.searchsorted(known, limit), 1, known.size - 1))
    system = linked_friction(state, [axis.name])
    method = linearisation_of(dataset.attrs["method"])
    here, there = (
        linear_stability(system.replace(**{axis.name: float(value)}), method=method)
        for value in known[above - 1 : above + 1]
    )
    changes = {
        way: _change(one, other)
        for way, one, other in (
            ("forwards", here.forward, there.forward), ("backwards", here.backward, there.backward)
        )
    }  # fmt: skip
    changes = {way: words for way, words in changes.items() if words}
    same = len(set(changes.values())) == 1
    both = len(changes) == 2 or _turns(state)
    if same and both:
        return next(iter(changes.values()))
    return "; ".join(f"{words}, {way}" for way, words in changes.items())


def _turns(state: PageState) -> bool:
    """True if a surface on which a brake slides moves."""
    return any(one.base_speed != 0.0 for one in state.system.machine.contacts)


def _change(one: DirectionStability, other: DirectionStability) -> str:
    """What happens between two verdicts on sliding in one direction; empty for nothing."""
    if one.locked != other.locked:
        return "self-locking"
    if one.damping is None or other.damping is None or (one.damping > 0.0) == (other.damping > 0.0):
        return ""
    return "release" if one.released != other.released else "Hopf bifurcation"


diagram, regimes, stability, basins = _Diagram(), _Regimes(), _Stability(), _Basins()
curve, measured = _Curve(), _Measured()
PARAMETER_PLOTS: dict[str, ParameterPlot] = {
    "diagram": diagram, "regimes": regimes, "stability": stability, "basins": basins,
    "curve": curve, "trace": measured,
}  # fmt: skip
"""All plots by their names in the state."""


def _without(state: PageState, names: Sequence[str]) -> str:
    """All of a system except the parameters that some names set, as text to be compared."""
    dropped = {SETTERS[name].target if name in SETTERS else name for name in names}
    system = linked_friction(state, names)
    for name in list(dropped):
        first, dot, last = name.rpartition(".")
        if last == "kinetic" and state.own_static(f"{first}{dot}static") is None:
            dropped.add(f"{first}{dot}static")
    values = {
        name: (type(one.owner).__name__, one.value)
        for name, one in values_of(system).items()
        if name not in dropped
    }
    return json.dumps(values)


def _levels(state: PageState) -> list[tuple[int, int]]:
    """Rows and columns of the successive grids of a map; fewer for a slow solver."""
    (width, height), (most_wide, most_high) = COARSE_MAP, FINE_MAP
    if slow(state):
        return [(height // 4, width // 4), (height // 2, width // 2), (height, width)]
    return [(height, width), (most_high // 2, most_wide // 2), (most_high, most_wide)]


def _swept_axes(dataset: xr.Dataset) -> tuple[SweptAxis, SweptAxis]:
    y, x = (SweptAxis.of(dataset, str(name)) for name in dataset["motion"].dims)
    return x, y

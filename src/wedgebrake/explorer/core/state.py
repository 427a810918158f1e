"""State of a page: the current study and the view of it. Every edit returns a new state."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from types import MappingProxyType
from typing import Any, Literal, get_args

from wedgebrake.errors import InputError, nearest
from wedgebrake.explorer.core.formatting import check_span
from wedgebrake.explorer.core.limits import (
    MOST_EVENTS,
    MOST_LEVELS,
    MOST_PERIODS,
    MOST_SHOWN,
    MOST_STEPS,
)
from wedgebrake.explorer.core.traces import MeasuredTrace, observed
from wedgebrake.explorer.core.values import (
    chosen_of,
    groups_of,
    nameable,
    values_of,
    word_of,
)
from wedgebrake.figures.data.partial import MEASURES, QUANTITIES
from wedgebrake.model.brakes import Brake, ConventionalBrake
from wedgebrake.model.friction import Friction, TabulatedFriction
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.machine_matrices import natural_frequencies
from wedgebrake.model.part import Part
from wedgebrake.model.studies.study import Study
from wedgebrake.model.studies.sweep_settings import sweepable
from wedgebrake.model.system import INITIAL
from wedgebrake.model.validation import (
    check_choice,
    check_instance,
    check_number,
    check_whole,
    is_number,
    labels,
    named,
    wrong,
)
from wedgebrake.orbits.problems.problem import sample_times
from wedgebrake.orbits.response_curve import MOST_SAMPLINGS

PlotName = Literal["diagram", "regimes", "stability", "basins", "curve", "trace"]
PLOTS: tuple[str, ...] = get_args(PlotName)
_FEWEST, _RECORD = 20, 50
# Settings of the run that can be edited; "initial" by its two components.
_SETTINGS = ("periods", "duration", "method")
# Cycles shown of a run that has more, and of one whose period is not known.
_SHOWN, _MOST_CYCLES = 12, 20
_CYCLES = 100
# A coefficient that falls with speed, for a table that begins from a constant one.
_FALLING = ((0.0, 1.2), (0.1, 1.1), (1.0, 1.0))
_LARGEST_COEFFICIENT = 5.0


@dataclass(frozen=True)
class PageView:
    """How a study is shown.

    comparison : True to show the conventional brake beside that of the study
    shown      : periods of the torque in history and phase portrait
    window     : the same in seconds, for a run whose length is given in seconds; None: the end of a
                 long run, all of a short one
    of_inertia, of_contact : the parts whose motion and torque are shown; None for the first
    plot       : the open plot over parameters
    quantity   : drawn in the bifurcation diagram, of ``QUANTITIES``
    follow     : True if the diagram also follows the motion up and down the parameter
    axis       : parameter of the bifurcation diagram
    across, up : parameters of the map of regimes
    over, level : parameter along the amplitude curves, and parameter of their levels; None: chosen
                 from the system
    levels     : values of the latter; empty: multiples of its present value
    samplings  : samplings in a period, which the sample times follow along the amplitude curves;
                 None: they do not change
    measure    : measure that the amplitude curves show, one of ``MEASURES``
    trace      : the measured trace; None if none is loaded
    column     : column of the trace that is drawn
    observe    : the quantity that each column of the trace measures
    free       : ranges of the parameters that are fitted to the trace
    spans      : (first, last) value of a parameter in plots, where the user set it
    """

    comparison: bool = False
    shown: int = _SHOWN
    window: float | None = None
    of_inertia: str | None = None
    of_contact: str | None = None
    plot: PlotName = "diagram"
    quantity: str = "velocity"
    follow: bool = False
    axis: str = "eta"
    across: str = "eta"
    up: str = "F0"
    over: str | None = None
    level: str | None = None
    levels: tuple[float, ...] = ()
    samplings: int | None = None
    measure: str = "angle_amplitude"
    trace: MeasuredTrace | None = None
    column: str = ""
    observe: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    free: Mapping[str, tuple[float, float]] = field(default_factory=lambda: MappingProxyType({}))
    spans: Mapping[str, tuple[float, float]] = field(default_factory=lambda: MappingProxyType({}))


@dataclass(frozen=True)
class PageState:
    """A study and its view; immutable.

    former : parts of other kinds with their last values, by (name, kind)
    static : static friction coefficients that were set, where kinetic friction has since raised
             them, by name
    origin : the system that the page was opened with, from which the ranges of sliders and plots
             follow: they do not move while the parameters are changed
    """

    study: Study
    view: PageView = PageView()
    former: Mapping[tuple[str, str], Part] = field(
        default_factory=lambda: MappingProxyType({}), repr=False
    )
    static: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    origin: Any = field(default=None, repr=False)

    @classmethod
    def of(cls, study: Study, view: PageView | None = None) -> PageState:
        """The state with a study, its run counted in periods and within the limits.

        A driveline with signals or stages of its actuator becomes the equivalent machine, whose
        numbers all have names.

        view : by default over the parameter that matters most in this study

        Raises ``InputError`` for brakes and friction laws that a study file cannot name.
        """
        study = nameable(study)
        for name, part in chosen_of(study.system).items():
            if not part.kind:
                raise InputError.of(
                    name, part, "the explorer takes parts that a study file can name. Give one with"
                    " a kind, or use wb.simulate and wb.plot.", said=type(part).__name__,
                )  # fmt: skip
        if view is None:
            view = replace(PageView(), axis=first_axis(study.system))
        view = _viewed(view, {}, study.system)
        run = study.run
        state = cls(study, view, origin=study.system)
        if not state.counted:
            duration = run.duration or state.system.default_length["duration"]
            if run.periods is not None:
                duration = run.periods * (study.system.period or duration)
            duration = min(duration, MOST_PERIODS * state.cycle)
            return replace(state, study=study.changed(duration=duration))
        periods = run.periods
        if run.duration is not None:
            periods = math.ceil(run.duration / state.cycle * (1.0 - 1e-12))
        periods = min(max(250 if periods is None else periods, _FEWEST), MOST_PERIODS)
        return replace(state, study=study.changed(periods=periods))

    @property
    def system(self) -> Any:
        """The system."""
        return self.study.system

    @property
    def counted(self) -> bool:
        """True if the run is counted in periods of the torque, False if it is given in seconds."""
        return "periods" in self.system.default_length

    @property
    def cycle(self) -> float:
        """The period of the torque or of all signals, otherwise of the slowest free vibration [s].

        A hundredth of the run where there is none of them.
        """
        if self.counted:
            return 1.0 / float(self.value("frequency"))
        natural = natural_frequencies(self.system)
        free = 2.0 * math.pi / float(natural[0]) if natural.size else 0.0
        return float(self.system.period or free or self.duration / _CYCLES or 1.0)

    @property
    def duration(self) -> float:
        """Length of the run [s]."""
        run: Any = self.study.run
        return self.periods * self.cycle if self.counted else float(run.duration)

    @property
    def window(self) -> float:
        """Length of the history and the phase portrait, at the end of the run [s]."""
        if self.counted:
            return min(self.view.shown, self.periods) * self.cycle
        if self.view.window is not None:
            return min(self.view.window, self.duration)
        long = self.system.period and self.duration > _MOST_CYCLES * self.cycle
        return _SHOWN * self.cycle if long else self.duration

    @property
    def comparable(self) -> bool:
        """True if the brake can be compared with a conventional one: of a driveline, another."""
        brake = chosen_of(self.system).get("brake")
        return brake is not None and not isinstance(brake, ConventionalBrake)

    @property
    def inertia(self) -> str | None:
        """The inertia whose motion is shown; None where there is only one, without a name."""
        return _part(self.view.of_inertia, self.system.coords.get("inertia", ()))

    @property
    def contact(self) -> str | None:
        """The contact whose torque is shown; None where there is only one, without a name."""
        return _part(self.view.of_contact, self.system.coords.get("contact", ()))

    @property
    def periods(self) -> int:
        """Periods of the torque, or other cycles, that are run."""
        if self.counted:
            return self.study.run.periods or 250
        return max(1, math.floor(self.duration / self.cycle * (1.0 + 1e-9)))

    @property
    def recorded(self) -> int:
        """Periods at the end of the run that are taken as the settled motion."""
        return max(min(_RECORD, self.periods // 2), 1)

    @property
    def transient(self) -> int:
        """Periods before them."""
        return self.periods - self.recorded

    @property
    def limits(self) -> dict[str, int]:
        """Largest numbers of events and steps: those of the study, within those of the explorer."""
        run = dict(self.study.run)
        most = {"max_events": MOST_EVENTS, "max_steps": MOST_STEPS}
        return {name: min(run[name], one) for name, one in most.items() if name in run}

    def own_static(self, name: str) -> float | None:
        """A static friction coefficient that does not follow the kinetic one; None if it does.

        name : of the static coefficient
        """
        found = values_of(self.system)
        if name not in found:
            return self.static.get(name)
        static = float(found[name].value)
        return self.static.get(name) if static == found[_kinetic(name)].value else static

    def value(self, name: str) -> Any:
        """The value of a parameter, group (None: not defined), setting or kind, by name."""
        run: Any = self.study.run
        if name in chosen_of(self.system):
            return chosen_of(self.system)[name].kind
        if name == "window":
            return self.window
        if name in (one.name for one in fields(PageView)):
            return getattr(self.view, name)
        groups = groups_of(self.system)
        if name in groups and name != "kinetic":
            return groups[name]
        if name in values_of(self.system):
            return values_of(self.system)[name].value
        if self.counted and name in INITIAL:
            return run.initial[list(INITIAL).index(name)]
        if name in type(run).model_fields:
            return getattr(run, name)
        raise InputError(f"{name}: no such parameter of this machine. Choose one that it has.")

    def edited(self, /, **changes: Any) -> PageState:
        """The state with changed parameters, groups, settings, kinds or view, by name.

        ``brake`` and ``friction`` take a kind; parameters that the kinds share are kept, and
        those of a kind used before are restored. ``initial_angle`` and
        ``initial_velocity`` set the start; ``spans`` are added to the others. Static friction
        stays equal to kinetic friction if it was equal, and is never below it; where kinetic
        friction has raised it, it returns to its own value together with kinetic friction.

        Raises ``InputError`` that names the parameter, the value and what is allowed.
        """
        state = self
        for name in chosen_of(self.system).keys() & changes.keys():
            state = state._with_kind(name, changes.pop(name))
        view = {one.name: changes.pop(one.name) for one in fields(PageView) if one.name in changes}
        state = state._with_values(changes) if changes else state
        if "window" in view:
            check_number("window", view["window"], 0.0, allowed="a positive number of seconds")
        return replace(state, view=_viewed(state.view, view, state.system))

    def _with_values(self, changes: dict[str, Any]) -> PageState:
        known = values_of(self.system)
        allowed = [
            *known, *groups_of(self.system).keys() & SETTERS.keys(),
            *(INITIAL if self.counted else ()),
            *(one for one in _SETTINGS if one in type(self.study.run).model_fields),
        ]  # fmt: skip
        for name in changes:
            if name not in allowed:
                hint = self.system.hint(name, allowed)
                raise InputError(f"{named(name)}: cannot be edited. {hint}")
        for place, name in enumerate(INITIAL):
            if name in changes:
                initial = list(changes.get("initial", self.study.run.initial))
                initial[place] = changes.pop(name)
                changes["initial"] = tuple(initial)
        if "periods" in changes:
            _check_whole("periods", changes["periods"], _FEWEST, MOST_PERIODS)
        if "duration" in changes:
            most = MOST_PERIODS * self.cycle
            check_number("duration", changes["duration"], 0.0, most, f"0 to {most:g} s")
        static, changes = self._with_static(changes)
        return replace(self, study=self.study.changed(**changes), static=static)

    def _with_static(self, changes: dict[str, Any]) -> tuple[Mapping[str, float], dict[str, Any]]:
        """Static friction coefficients that are raised, and the changes with the static ones."""
        known, static = values_of(self.system), dict(self.static)
        for name in [one for one in known if _kinetic(one) in known and _kinetic(one) != one]:
            kinetic: Any = changes.get(_kinetic(name))
            own = self.own_static(name)
            if name in changes:
                static.pop(name, None)
            elif is_number(kinetic):
                raised = kinetic if own is None else max(own, kinetic)
                changes = {**changes, name: raised}
                static.pop(name, None)
                if own is not None and raised != own:
                    static[name] = own
        return MappingProxyType(static), changes

    def _with_kind(self, name: str, kind: Any) -> PageState:
        before = chosen_of(self.system)[name]
        kinds: Mapping[str, type[Part]] = type(before).kinds
        check_choice(f"{name}.kind", kind, kinds)
        if before.kind == kind:
            return self
        former = {**self.former, (name, before.kind): before}
        known = former.get((name, kind))
        if isinstance(before, Brake):
            # As it was before, or as in the examples, with the same radius.
            values = {**_examples(kinds[kind]), **dict(known or ()), "radius": before.radius}
            study = self.study.changed(**{name: kinds[kind](**values)})
        else:  # the solver of the other law may not support it
            part = _friction(kinds[kind], before, known)
            study = self.study.changed(**{name: part, "method": None})
        return replace(self, study=study, former=MappingProxyType(former))


def _kinetic(name: str) -> str:
    """The name of the kinetic friction coefficient beside a static one; others are unchanged."""
    first, dot, last = name.rpartition(".")
    return f"{first}{dot}kinetic" if last == "static" else name


def _part(chosen: str | None, names: tuple[str, ...]) -> str | None:
    return chosen if chosen in names else next(iter(names), None)


def first_axis(system: Any) -> str:
    """The parameter of a first diagram: what excites this system."""
    possible, known = axes(system), values_of(system)

    def first(word: str, *, zero: bool = False) -> str | None:
        found = (one for one in possible if one in known and word_of(system, one) == word)
        return next((one for one in found if zero or known[one].value), None)

    slope = first("slope")
    return (
        ("eta" if slope and "eta" in possible else slope)
        or first("drive_speed")
        or first("base_speed")
        or (system.machine.period and first("amplitude") and first("frequency"))
        or first("proportional")
        or first("initial_force", zero=True)
        or first("kinetic")
        or first("stiffness")
        or first("inertia")
        or possible[-1]
    )


def _viewed(view: PageView, changes: dict[str, Any], system: Any) -> PageView:
    """A changed view, checked; its parameters are those of the system."""
    possible = axes(system)
    choices = {"plot": PLOTS, "quantity": tuple(QUANTITIES), "measure": tuple(MEASURES)}
    choices |= dict.fromkeys(("axis", "across", "up", "over", "level"), tuple(possible))
    choices |= {f"of_{kind}": system.coords.get(kind, ()) for kind in ("inertia", "contact")}
    for name in choices.keys() & changes.keys():
        check_choice(name, changes[name], choices[name])
    for name in ("comparison", "follow"):
        if name in changes:
            check_instance(name, changes[name], bool, "true or false")
    if "shown" in changes:
        _check_whole("shown", changes["shown"], 1, MOST_SHOWN)
    if "spans" in changes:
        new = _spans(changes["spans"], [*possible, *system.initial_conditions])
        changes["spans"] = MappingProxyType({**view.spans, **new})
    for name in ("observe", "free"):
        if name in changes:
            changes[name] = MappingProxyType(dict(changes[name]))
    view = replace(view, **{**changes, **_curves(view, changes)})
    # A parameter of the former brake or friction law may no longer exist.
    axis = view.axis if view.axis in possible else first_axis(system)
    across = view.across if view.across in possible else axis
    up = view.up if view.up in possible else across
    if across == up:
        up = next(one for one in ("F0", "eta", *possible) if one in possible and one != across)
    over, level = (one if one in possible else None for one in (view.over, view.level))
    levels = view.levels if level == view.level else ()
    samplings = view.samplings if sample_times(system) else None
    if view.trace is not None:
        found = observed(view.trace.trace, view.observe, system, new="trace" in changes)
        columns = list(view.trace.trace.columns)
        column = view.column if view.column in columns else next(iter(found), columns[0])
        view = replace(view, column=column, observe=MappingProxyType(found))
    return replace(
        view, axis=axis, across=across, up=up, over=over, level=level, levels=levels,
        samplings=samplings,
    )  # fmt: skip


def _curves(view: PageView, changes: dict[str, Any]) -> dict[str, Any]:
    """The levels and samplings of the amplitude curves among changes, checked."""
    found: dict[str, Any] = {}
    if "levels" in changes:
        found["levels"] = _levels(changes["levels"])
    elif "level" in changes and changes["level"] != view.level:
        found["levels"] = ()  # those of another parameter
    if changes.get("samplings") is not None:
        found["samplings"] = check_whole("samplings", changes["samplings"], 1, MOST_SAMPLINGS)
    return found


def _levels(given: Any) -> tuple[float, ...]:
    numbers = tuple(given) if isinstance(given, list | tuple) else ()
    right = all(map(is_number, numbers)) and 0 < len(set(numbers)) == len(numbers) <= MOST_LEVELS
    if not right:
        raise wrong(
            "levels", given, f"1 to {MOST_LEVELS} different numbers",
            "Enter for example 250, 500, 750.",
        )  # fmt: skip
    return tuple(map(float, numbers))


def axes(system: Any) -> list[str]:
    """Parameters that plots can go over: those of the system and the groups it has."""
    groups = groups_of(system)
    lost = {name for name, value in groups.items() if value is None}
    if groups.get("F0") == 0.0:  # no amplitude of the torque changes it
        lost.add("F0")
    known = {*values_of(system), *groups, *SETTERS}
    lost |= {name for name, one in values_of(system).items() if one.choices}
    return [name for name in sweepable(system) if name in known and name not in lost]


def _spans(given: Any, possible: list[str]) -> dict[str, tuple[float, float]]:
    check_instance("spans", given, Mapping, "from and to for each parameter")
    for name in given:
        if name not in possible:
            raise InputError(f"{named(str(name))}: no span. {nearest(str(name), possible)}")
    return {name: check_span(name, *span) for name, span in given.items()}


def _examples(model: type[Part]) -> dict[str, Any]:
    fields = {name: one for name, one in model.model_fields.items() if one.is_required()}
    return {
        name: labels(one)["example"] for name, one in fields.items() if "example" in labels(one)
    }


def _friction(model: type[Part], before: Friction, known: Part | None) -> Part:
    """A law of another kind with the coefficients of the one before."""
    if known is not None and TabulatedFriction in (model, type(before)):
        return known  # a table and a constant cannot be converted
    kinetic, static = before.reference, float(getattr(before, "static", before.reference))
    if isinstance(before, TabulatedFriction):
        static = before.breakaway
        kinetic = min(before.nodes()[-1][1], static)
    if issubclass(model, TabulatedFriction):
        speeds, shares = zip(*_FALLING, strict=True)
        coefficients = tuple(min(share * kinetic, _LARGEST_COEFFICIENT) for share in shares)
        static = max(static, coefficients[0])
        return model(speeds=speeds, coefficients=coefficients, static=static)
    common = {"kinetic": kinetic, "static": max(static, kinetic)}
    stated = {name: one for name, one in common.items() if name in model.model_fields}
    return model(**{**_examples(model), **dict(known or ()), **stated})


def _check_whole(name: str, value: Any, least: int, most: int) -> None:
    why = " This is a limit of the explorer; wb.simulate and wb.sweep allow more."
    check_whole(name, value, least, most, why=why)

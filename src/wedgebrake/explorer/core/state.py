"""State of a page: the current study and the view of it. Every edit returns a new state."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from types import MappingProxyType
from typing import Any, Literal, cast, get_args

from wedgebrake.errors import InputError, nearest
from wedgebrake.explorer.core.formatting import check_span
from wedgebrake.explorer.core.limits import MOST_EVENTS, MOST_PERIODS, MOST_SHOWN, MOST_STEPS
from wedgebrake.figures.data.partial import QUANTITIES
from wedgebrake.model.brakes import Brake
from wedgebrake.model.friction import Friction, TabulatedFriction
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.part import Part
from wedgebrake.model.studies.study import Study
from wedgebrake.model.studies.sweep_settings import sweepable
from wedgebrake.model.system import INITIAL, PARTS, BrakedDriveline, check_driveline
from wedgebrake.model.validation import (
    check_choice,
    check_instance,
    check_whole,
    is_number,
    labels,
    named,
)

PlotName = Literal["diagram", "regimes", "stability", "basins"]
PLOTS: tuple[str, ...] = get_args(PlotName)
_FEWEST, _RECORD = 20, 50
# Settings of the run that can be edited; "initial" by its two components.
_SETTINGS = ("periods", "method")
# A coefficient that falls with speed, for a table that begins from a constant one.
_FALLING = ((0.0, 1.2), (0.1, 1.1), (1.0, 1.0))
_LARGEST_COEFFICIENT = 5.0


@dataclass(frozen=True)
class View:
    """How a study is shown.

    comparison : True to show the conventional brake beside that of the study
    shown      : periods of the torque in history and phase portrait
    plot       : the open plot over parameters
    quantity   : drawn in the bifurcation diagram, of ``QUANTITIES``
    follow     : True if the diagram also follows the motion up and down the parameter
    axis       : parameter of the bifurcation diagram
    across, up : parameters of the map of regimes
    spans      : (first, last) value of a parameter in plots, where the user set it
    """

    comparison: bool = False
    shown: int = 12
    plot: PlotName = "diagram"
    quantity: str = "velocity"
    follow: bool = False
    axis: str = "eta"
    across: str = "eta"
    up: str = "F0"
    spans: Mapping[str, tuple[float, float]] = field(default_factory=lambda: MappingProxyType({}))


@dataclass(frozen=True)
class PageState:
    """A study and its view; immutable.

    former : parts of other kinds with their last values, by (table, kind)
    static : static friction coefficient that was set, where kinetic friction has since raised it;
             None where it has not
    origin : the system that the page was opened with, from which the ranges of sliders and plots
             follow: they do not move while the parameters are changed
    """

    study: Study
    view: View = View()
    former: Mapping[tuple[str, str], Part] = field(
        default_factory=lambda: MappingProxyType({}), repr=False
    )
    static: float | None = None
    origin: BrakedDriveline | None = field(default=None, repr=False)

    @classmethod
    def of(cls, study: Study, view: View | None = None) -> PageState:
        """The state with a study, its run counted in periods and within the limits.

        view : by default over the parameter that matters most in this study

        Raises ``InputError`` for brakes and friction laws that a study file cannot name.
        """
        system = check_driveline(study.system)
        for table, part in (("brake", system.brake), ("friction", system.friction)):
            if not part.kind:
                raise InputError(
                    f"{table} = {type(part).__name__}: the explorer takes parts that a study file"
                    f" can name. Give one with a kind, or use wb.simulate and wb.plot."
                )
        run = study.run
        periods = run.periods
        if run.duration is not None:
            periods = math.ceil(run.duration * system.excitation.frequency * (1.0 - 1e-12))
        periods = min(max(250 if periods is None else periods, _FEWEST), MOST_PERIODS)
        if view is None:
            view = replace(View(), axis=_first_axis(system))
        return cls(study.changed(periods=periods), view, origin=system)

    @property
    def system(self) -> BrakedDriveline:
        """The system."""
        return cast("BrakedDriveline", self.study.system)  # see ``of``

    @property
    def periods(self) -> int:
        """Periods of the torque that are run."""
        return self.study.run.periods or 250

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
        run = self.study.run
        return {
            "max_events": min(run.max_events, MOST_EVENTS),
            "max_steps": min(run.max_steps, MOST_STEPS),
        }

    @property
    def own_static(self) -> float | None:
        """Static friction coefficient that does not follow the kinetic one; None if it follows."""
        friction = self.system.friction
        static = getattr(friction, "static", None)
        return self.static if static == friction.reference else static

    def value(self, name: str) -> Any:
        """The value of a parameter, group (None: not defined), setting or kind, by name."""
        if name in ("brake", "friction"):
            return getattr(self.system, name).kind
        if name in INITIAL:
            return self.study.run.initial[list(INITIAL).index(name)]
        if name in (one.name for one in fields(View)):
            return getattr(self.view, name)
        groups = self.system.groups.as_dict()
        if name in groups and name != "kinetic":
            return groups[name]
        parts = (getattr(self.system, part) for part in reversed(PARTS))  # as in replace
        for part in (*parts, self.study.run):
            if name in type(part).model_fields:
                return getattr(part, name)
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
        for name in ("brake", "friction"):
            if name in changes:
                state = state._with_kind(name, changes.pop(name))
        view = {one.name: changes.pop(one.name) for one in fields(View) if one.name in changes}
        state = state._with_values(changes) if changes else state
        return replace(state, view=_viewed(state.view, view, state.system))

    def _with_values(self, changes: dict[str, Any]) -> PageState:
        parts = [getattr(self.system, part) for part in PARTS]
        names = [name for part in parts for name in type(part).model_fields]
        allowed = [*names, *SETTERS, *INITIAL, *_SETTINGS]
        for name in changes:
            if name not in allowed:
                hint = self.system.hint(name, allowed)
                raise InputError(f"{named(name)}: cannot be edited. {hint}")
        initial = list(self.study.run.initial)
        for place, name in enumerate(INITIAL):
            if name in changes:
                initial[place] = changes.pop(name)
                changes["initial"] = tuple(initial)
        if "periods" in changes:
            _check_whole("periods", changes["periods"], _FEWEST, MOST_PERIODS)
        kinetic: Any = changes.get("kinetic")
        kept = self.static
        if "static" in changes:
            kept = None
        elif is_number(kinetic) and hasattr(self.system.friction, "static"):
            own = self.own_static
            changes["static"] = kinetic if own is None else max(own, kinetic)
            kept = None if changes["static"] == own else own
        return replace(self, study=self.study.changed(**changes), static=kept)

    def _with_kind(self, table: str, kind: Any) -> PageState:
        kinds: Mapping[str, type[Part]] = Brake.kinds if table == "brake" else Friction.kinds
        check_choice(f"{table}.kind", kind, kinds)
        before: Brake | Friction = getattr(self.system, table)
        if before.kind == kind:
            return self
        former = {**self.former, (table, before.kind): before}
        known = former.get((table, kind))
        if isinstance(before, Brake):
            # As it was before, or as in the examples, with the same radius.
            values = {**_examples(kinds[kind]), **dict(known or ()), "radius": before.radius}
            study = self.study.changed(brake=kinds[kind](**values))
        else:  # the solver of the other law may not support it
            part = _friction(kinds[kind], before, known)
            study = self.study.changed(friction=part, method=None)
        return replace(self, study=study, former=MappingProxyType(former))


def _first_axis(system: BrakedDriveline) -> str:
    """The parameter of a first diagram: what excites this system."""
    if system.actuation.slope != 0.0:
        return "eta" if "eta" in axes(system) else "slope"
    if system.driveline.drive_speed != 0.0:
        return "drive_speed"
    return "frequency" if system.excitation.amplitude > 0.0 else "initial_force"


def _viewed(view: View, changes: dict[str, Any], system: BrakedDriveline) -> View:
    """A changed view, checked; its parameters are those of the system."""
    possible = axes(system)
    choices = {"plot": PLOTS, "quantity": tuple(QUANTITIES)}
    choices |= dict.fromkeys(("axis", "across", "up"), tuple(possible))
    for name in choices.keys() & changes.keys():
        check_choice(name, changes[name], choices[name])
    for name in ("comparison", "follow"):
        if name in changes:
            check_instance(name, changes[name], bool, "true or false")
    if "shown" in changes:
        _check_whole("shown", changes["shown"], 1, MOST_SHOWN)
    if "spans" in changes:
        new = _spans(changes["spans"], [*possible, *INITIAL])
        changes["spans"] = MappingProxyType({**view.spans, **new})
    view = replace(view, **changes)
    # A parameter of the former brake or friction law may no longer exist.
    axis, across, up = (
        name if name in possible else possible[-1] for name in (view.axis, view.across, view.up)
    )
    if across == up:
        up = next(name for name in ("F0", "eta", "amplitude") if name in possible and name != up)
    return replace(view, axis=axis, across=across, up=up)


def axes(system: BrakedDriveline) -> list[str]:
    """Parameters that plots can go over: those of the system and the groups it has."""
    groups = system.groups.as_dict()
    lost = {name for name, value in groups.items() if value is None}
    if groups["F0"] == 0.0:  # no amplitude of the torque changes it
        lost.add("F0")
    return [name for name in sweepable(system) if name not in INITIAL and name not in lost]


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

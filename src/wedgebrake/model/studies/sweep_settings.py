"""Parameters that can be swept, their values, and the [sweep] table of a study file."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import PlainValidator, WithJsonSchema, create_model

from wedgebrake.errors import InputError, nearest
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.machine import Machine
from wedgebrake.model.part import Part, parameter
from wedgebrake.model.studies.tables import FIXED, or_text, table_schema
from wedgebrake.model.system import CHOSEN, INITIAL, BrakedDriveline, quantities
from wedgebrake.model.units import ANY, with_unit
from wedgebrake.model.validation import NotAllowedError, check_number, named, unknown, wrong

MOST_VALUES = 10_000_000  # of one swept parameter
_MOST_WRONG = 8  # names of [sweep] in one error message
_LONGEST = 5_000_000  # periods


def sweepable(
    system: BrakedDriveline | Machine, names: Iterable[str] = ()
) -> dict[str, tuple[str, str]]:
    """Return (unit, meaning) of everything that can be swept on a system, by name.

    names : those of parameters that are tied, "c1.base_speed,c2.base_speed", are added; raises
            ``InputError`` for ties that are not possible
    """
    found = {name: (one.unit, one.meaning) for name, one in system.quantities().items()}
    return found | {name: _tied(name, found) for name in names if len(untied(name)) > 1}


def untied(name: str) -> tuple[str, ...]:
    """The parameters that have the same value in a sweep over ``name``, usually one."""
    return tuple(one.strip() for one in name.split(","))


def tied_names(given: Mapping[Any, Any]) -> dict[str, Any]:
    """Swept values by name, with a text in place of a tuple of names that are tied."""
    return {
        ",".join(map(str, name)) if isinstance(name, tuple) else name: values
        for name, values in given.items()
    }


def _tied(name: str, known: Mapping[str, tuple[str, str]]) -> tuple[str, str]:
    names = untied(name)
    for one in names:
        allowed = [other for other in known if other not in SETTERS and other not in INITIAL]
        if one not in allowed:
            raise InputError(
                f"{name}: {one!r} cannot be tied; only parameters can. {nearest(one, allowed)}",
                name=name, value=one, allowed=tuple(allowed),
            )  # fmt: skip
        if names.count(one) > 1:
            raise wrong(name, one, "a name given once")
    units = {known[one][0] for one in names}
    if len(units) > 1:
        raise InputError(
            f"{name}: must have one unit to be tied, not {' and '.join(sorted(units))}.",
            name=name, allowed="parameters of one unit",
        )  # fmt: skip
    return units.pop(), " and ".join(f"{known[one][1]} ({one})" for one in names)


def dimension_of(system: Any, name: str, taken: Collection[str]) -> str:
    """Return the name of the dimension of a swept parameter: with its part if results have it."""
    return f"{system.owner(name)}_{name}" if name in taken else name


def refuse_doubled(name: str, names: Collection[str], where: str = "") -> None:
    """Raise ``InputError`` for a parameter that two swept names set, as a group does."""
    for other in names:
        both = set(untied(name)) & set(untied(other))
        if other != name and both:
            one = both.pop()
            raise InputError(
                f"{where}{name} and {where}{other}: both vary {one}. Vary it once.",
                name=f"{where}{name}", allowed="each parameter once",
            )  # fmt: skip
    target = SETTERS[name].target if name in SETTERS else None
    if any(target in untied(other) for other in names):
        raise InputError(
            f"{where}{name} and {where}{target}: both vary, but {name} sets {target}. Vary one of"
            " them.",
            name=f"{where}{name}", allowed=f"{name} or {target}",
        )  # fmt: skip


def joined(over: Any, parameters: dict[str, Any]) -> dict[str, Any]:
    """Combine parameters given as a mapping and as keywords.

    Raises ``InputError`` for anything but a mapping of names, or a parameter given twice.
    """
    if over is None:
        return parameters
    if not isinstance(over, Mapping):
        raise wrong(
            "over", over, "a mapping of parameters to their values",
            'For example {"slope": np.linspace(-60, 0, 50)}.',
        )  # fmt: skip
    for name in over:
        names = name if isinstance(name, tuple) else (name,)
        if not names or not all(isinstance(one, str) for one in names):
            raise wrong("over", name, "names, each with its values", "Write a name as a text.")
        if name in parameters:
            raise InputError(
                f"{name}: given twice, in the mapping and as a keyword. Give it once.",
                name=name, value=parameters[name], allowed="one of the two",
            )  # fmt: skip
    return {**over, **parameters}


# `from` cannot be the name of an attribute in a class statement.
_END: dict[str, Any] = {"unit": "-", "ge": -1e300, "le": 1e300}
_SPAN: dict[str, Any] = {
    "from": (float, parameter("first value", example=-60.0, **_END)),
    "to": (float, parameter("last value", example=12.0, **_END)),
    "points": (int, parameter("number of values", example=400, ge=2, le=MOST_VALUES)),
    "scale": (Literal["linear", "log"], parameter(
        "equal steps ('linear') or equal ratios ('log')", unit="-", example="log",
        default="linear",
    )),
}  # fmt: skip
Span: type[Part] = create_model("Span", __base__=Part, __doc__="Evenly spaced values.", **_SPAN)


def swept_values(given: Any, where: str, unit: str = "-") -> Part | tuple[float, ...]:
    """Validate the values of a swept parameter: a list, or a table (from, to, points).

    where : prefix of the name of an invalid value in a message, as "sweep.eta."
    unit  : SI unit of the parameter, in whose other units values may be given as texts

    Raises ``InputError``.
    """
    if isinstance(given, dict):
        ends = {
            key: with_unit(f"{where}{key}", given[key], unit)
            for key in ("from", "to")
            if key in given
        }
        return _span({**given, **ends}, where)
    name = where.rstrip(". :")
    if not isinstance(given, list | tuple):
        raise wrong(
            name, given, "a list of values, as in [-30, -20, -10], or evenly spaced ones,"
            " { from = -60, to = 12, points = 400 }",
        )  # fmt: skip
    if not given:
        raise wrong(name, given, "a list of values, at least one")
    allowed = "a finite number"
    given = with_unit(name, given, unit)
    return tuple(check_number(f"{name}[{i}]", one, allowed=allowed) for i, one in enumerate(given))


def _span(given: dict[str, Any], where: str) -> Part:
    try:
        span = Span(**given)
    except InputError as error:
        raise error.renamed(lambda name: f"{where}{name}") from None
    first, last, scale = (dict(span)[name] for name in ("from", "to", "scale"))
    if first == last:
        raise InputError(
            f"{where}from = {first!r} and to = {last!r}: are equal. Change one of them.",
            name=f"{where}from", value=first, allowed="different from to",
        )  # fmt: skip
    if scale == "log" and not (min(first, last) > 0.0 or max(first, last) < 0.0):
        raise InputError(
            f"{where}from = {first!r} and to = {last!r}: must both lie above 0, or both below,"
            " for equal ratios. Take equal steps instead of 'log', or move the end.",
            name=f"{where}from", value=first, allowed="on the same side of 0 as to",
        )  # fmt: skip
    return span


def _transient(value: Any) -> Any:
    whole = isinstance(value, int) and not isinstance(value, bool)
    if value == "auto" or (whole and 0 <= value < _LONGEST):
        return value
    raise NotAllowedError(f"a whole number of periods, 0 to {_LONGEST - 1}, or 'auto'")


class Sweep(Part):
    """Definition of a sweep: the axes and some arguments of ``wb.sweep``, with its defaults.

    axes : (name, values) of each swept parameter, in order; values are a tuple of numbers or
           a ``Span``: first, last, number and scale
    """

    table: ClassVar[str] = "sweep"

    axes: tuple[tuple[str, Any], ...] = ()
    periods: int | None = parameter(
        "number of recorded periods (50); with a number for transient that of the last one (250)",
        example=50, default=None, gt=0, le=_LONGEST,
    )  # fmt: skip
    crossings: int | None = parameter(
        "the same where no signal varies in time: returns to the section of the motion",
        example=50, default=None, gt=0, le=_LONGEST,
    )  # fmt: skip
    transient: Annotated[
        int | Literal["auto"] | None,
        PlainValidator(_transient),
        WithJsonSchema(
            {"anyOf": [{"type": "integer", "minimum": 0, "maximum": _LONGEST - 1},
                       {"const": "auto"}]}
        ),
    ] = parameter(
        "number of the first recorded period, or 'auto': until each point has settled (default)",
        example=200, default=None,
    )  # fmt: skip
    limit: int | None = parameter(
        "largest number of periods to wait for a point to settle, with transient = 'auto' (2048)",
        example=20_000, default=None, gt=0, le=_LONGEST,
    )  # fmt: skip
    follow: str | None = parameter(
        "swept parameter along which each point starts where its neighbour ended, once up"
        " and once down", unit="-", example="eta", default=None,
    )  # fmt: skip
    keep_points: bool | None = parameter(
        "whether the Poincare points are part of the result", unit="-", example=True, default=None
    )

    def parameters(self) -> dict[str, NDArray[np.float64]]:
        """Return the swept values by name, (n,) each, in order."""
        return {name: expanded(values) for name, values in self.axes}

    def arguments(self) -> dict[str, Any]:
        """Return the keyword arguments of ``wb.sweep`` that are set, without the parameters."""
        given = {name: getattr(self, name) for name in SWEEP_SETTINGS}
        return {name: value for name, value in given.items() if value is not None}


SWEEP_SETTINGS = tuple(name for name in Sweep.model_fields if name != "axes")


def expanded(values: Part | tuple[float, ...]) -> NDArray[np.float64]:
    """The values that ``swept_values`` has validated, (n,)."""
    if isinstance(values, tuple):
        return np.array(values)
    span = dict(values)
    spread = np.geomspace if span["scale"] == "log" else np.linspace
    return np.asarray(spread(span["from"], span["to"], span["points"]))


def parse_sweep(table: dict[str, Any], system: BrakedDriveline | Machine) -> Sweep:
    """Parse the [sweep] table: settings, and everything else is a swept parameter.

    Raises ``InputError`` with the first few errors.
    """
    settings = {name: table[name] for name in SWEEP_SETTINGS if name in table}
    allowed = sweepable(system, table)
    axes: dict[str, Any] = {}
    wrong: list[InputError] = []
    for name, given in table.items():
        if name not in settings and len(wrong) < _MOST_WRONG:
            try:
                _check_name(name, allowed, system)
                refuse_doubled(name, table, "sweep.")
                axes[name] = swept_values(given, f"sweep.{name}.", allowed[name][0])
            except InputError as error:
                wrong.append(error)
    try:
        sweep = Sweep(**settings, axes=tuple(axes.items()))
    except InputError as error:
        wrong.append(error)
    if wrong:
        raise InputError.joined(wrong)
    if axes and sweep.follow not in (None, *axes):
        raise unknown("sweep.follow", sweep.follow, axes, "must be a parameter that is swept")
    return sweep


def _check_name(name: str, allowed: Collection[str], system: BrakedDriveline | Machine) -> None:
    if name not in allowed:
        raise InputError(
            f"sweep.{named(name)}: neither a parameter that can be swept nor a setting."
            f" {system.hint(name, [*allowed, *SWEEP_SETTINGS])}"
        )


def sweep_schema() -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the schema of [sweep] for all brakes and laws, and the definitions it refers to."""
    table = table_schema(Sweep)
    del table["properties"]["axes"]
    kinds = [model for kinds in CHOSEN.values() for model in kinds.values()]
    example = {"from": 0.1, "to": 1.0, "points": 100}
    for name, one in quantities([*FIXED.values(), *kinds]).items():
        table["properties"][name] = {
            "symbol": one.symbol,
            "unit": one.unit,
            "example": example,
            "description": f"swept: {one.meaning}",
            "$ref": "#/$defs/swept_values",
        }
    value = {"anyOf": [{"type": "number"}, {"type": "string", "pattern": ANY}]}
    listed = {"type": "array", "items": value, "minItems": 1}
    span = Span.model_json_schema()
    for end in ("from", "to"):
        span["properties"][end] = or_text(span["properties"][end], value["anyOf"][1])
    return table, {"swept_values": {"oneOf": [span, listed]}}

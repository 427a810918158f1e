"""Validation by pydantic: one check for each kind of argument, and its errors in our words.

Every message has one form: the argument, its value, what is allowed, and the way out, as in
"periods = 0: must be a whole number, 1 to 1000." ``check_number``, ``check_whole``,
``check_instance`` and ``check_choice`` check an argument of a public function; ``explain`` words
what pydantic finds wrong in a ``Part``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import lru_cache
from importlib.util import find_spec
from typing import Annotated, Any, TypeVar, get_args

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from wedgebrake.errors import ELSEWHERE, InputError, nearest
from wedgebrake.errors import shown as shown

_T = TypeVar("_T")
SECONDS = "a finite number of seconds, or None"
# Most lines of an error message.
_MOST_LINES = 8
_RIGHT_ANGLE = math.pi / 2
_SPEEDS = ("speed", "base_speed", "drive_speed")


def plain(value: Any) -> Any:
    """Convert a NumPy scalar to the number of Python that it is; leave anything else alone."""
    return value.item() if isinstance(value, np.generic) else value


def check_number(
    name: str,
    value: Any,
    low: float = -math.inf,
    high: float = math.inf,
    allowed: str = "",
    why: str = "",
) -> float:
    """Return a finite number in [low, high] as a float.

    allowed : what the value must be; by default the interval
    why     : a further sentence, after a space

    Raises ``InputError`` for anything else; True and False are no numbers.
    """
    allowed = allowed or f"a number in [{low:g}, {high:g}]"
    return float(_checked(float, name, value, low, high, allowed, why))


def check_whole(
    name: str, value: Any, least: int, most: int, what: str = "a whole number", why: str = ""
) -> int:
    """Return a whole number from ``least`` to ``most`` as an int; see ``check_number``."""
    return int(_checked(int, name, value, least, most, f"{what}, {least} to {most}", why))


def check_installed(what: str, packages: Sequence[str], extra: str) -> None:
    """Raise ``InputError`` unless the packages of an extra are installed."""
    missing = [name for name in packages if find_spec(name) is None]
    if missing:
        raise InputError(
            f"{what}: needs {' and '.join(missing)}. Install the extra: pip install"
            f" 'wedgebrake[{extra}]'."
        )


def _checked(kind: type, name: str, value: Any, low: Any, high: Any, allowed: str, why: str) -> Any:
    try:
        return _adapter(kind, low, high).validate_python(plain(value))
    except ValidationError:
        raise wrong(name, value, allowed, why.strip()) from None


@lru_cache(maxsize=128)
def _adapter(kind: Any, low: Any, high: Any) -> TypeAdapter[Any]:
    finite = {"allow_inf_nan": False} if kind is float else {}
    return TypeAdapter(Annotated[kind, Field(strict=True, ge=low, le=high, **finite)])


def check_instance(name: str, value: _T, kind: Any, allowed: str = "") -> _T:
    """Return an instance of a class, or of a union of classes; ``allowed`` describes it."""
    if not isinstance(value, kind):
        what = allowed or ("True or False" if kind is bool else f"a {kind.__name__}")
        raise wrong(name, value, what)
    return value


def check_choice(name: str, value: Any, allowed: Collection[str]) -> str:
    """Return one of the allowed words."""
    if not isinstance(value, str) or value not in allowed:
        raise unknown(name, value, allowed)
    return value


def wrong(name: str, value: Any, allowed: str, way_out: str = "") -> InputError:
    """Return the error "name = value: must be allowed. Way out", with these attributes."""
    return InputError.of(name, value, f"must be {allowed}. {way_out}".rstrip(), allowed=allowed)


class NotAllowedError(ValueError):
    """What a validator of a field raises: what is allowed, and the way out.

    ``explain`` adds the name and the value.
    """

    def __init__(self, allowed: str, way_out: str = "") -> None:
        super().__init__(f"must be {allowed}. {way_out}".rstrip())
        self.allowed = allowed


def unknown(name: str, value: Any, allowed: Collection[str], what: str = "not known") -> InputError:
    """Return the error for a word that is not allowed, with the nearest allowed words."""
    problem = f"{what}. {nearest(str(value), allowed)}"
    return InputError.of(name, value, problem, allowed=tuple(allowed))


# Largest usual value of a radius [m] and of a speed [rad/s], and the unit that was probably meant.
_USUAL = {"radius": (10.0, "mm"), **dict.fromkeys(_SPEEDS, (1000.0, "rpm"))}


def unusual(values: Mapping[str, float]) -> list[str]:
    """Sentences on values that were probably meant in another unit, by their dotted names."""
    found = []
    for name, value in values.items():
        most, unit = _USUAL.get(name.rpartition(".")[2], (math.inf, ""))
        if abs(value) > most:
            si = "m" if unit == "mm" else "rad/s"
            found.append(
                f"{name} = {value:g} {si} is unusually large. If it is in {unit}, write"
                f" '{value:g} {unit}'."
            )
    return found


def is_number(value: object) -> bool:
    """Return True for a number of Python or NumPy; True and False are none."""
    number = isinstance(value, int | float | np.integer | np.floating)
    return number and not isinstance(value, bool)


def is_finite(value: Any) -> bool:
    """Return True if a number lies among the finite floats."""
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer beyond all floats
        return False


def named(name: str) -> str:
    """Return a name as it was given, in quotation marks if it is not a plain word."""
    word = re.sub(r"[-_.]", "", name).isalnum() and len(name) <= 60
    return name if word and name.isascii() else shown(name)


def as_typed(text: str) -> str:
    """Return a word of the command line as it was typed, if that is one short printable line."""
    return text if text.isprintable() and len(text) <= 60 else shown(text)


def labels(field: FieldInfo) -> dict[str, Any]:
    """Return the symbol, SI unit and example of a field, as far as it has them."""
    return field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}


Location = tuple[int | str, ...]


def explain(
    error: ValidationError,
    table: str,
    fields: Mapping[str, FieldInfo],
    number: Callable[[Location], str],
) -> InputError:
    """Word a validation error: one line for each wrong field, the first few of them.

    table  : what stands before the names, as "driveline"; "" for nothing
    fields : of the model
    number : what a number at a place in the fields may be, with its units
    """
    found = error.errors(include_url=False)
    nested = {one["loc"][0] for one in found if len(one["loc"]) > 1}
    details = [one for one in found if not _follows(one, nested)]
    # A misspelt name first: it explains what is missing.
    details.sort(key=lambda detail: detail["type"] != "extra_forbidden")
    more = f"... and {len(details) - _MOST_LINES} more." if len(details) > _MOST_LINES else ""
    return InputError.joined(
        (_error(detail, table, fields, number) for detail in details[:_MOST_LINES]), more
    )


def _follows(detail: ErrorDetails, nested: Collection[int | str]) -> bool:
    """Return True for an error that follows from another one, such as of an entry of a list."""
    kind = detail["type"]
    return kind == "default_factory_not_called" or (
        kind == "too_short" and detail["loc"][0] in nested
    )


def _error(
    detail: ErrorDetails,
    table: str,
    fields: Mapping[str, FieldInfo],
    number: Callable[[Location], str],
) -> InputError:
    location, kind, value = detail["loc"], detail["type"], detail["input"]
    name = _path(table, location)
    field = fields.get(str(location[0])) if location else None
    way_out = _way_out(field)
    if kind == "extra_forbidden":
        text = f"{name}: no such parameter. {nearest(str(location[-1]), fields)}"
        return InputError(text, name=name, value=value, allowed=tuple(fields))
    if kind == "value_error":
        why = detail["ctx"]["error"]
        if not location:
            return why if isinstance(why, InputError) else InputError(str(why))
        if isinstance(why, InputError) and why.name:
            return moved(why, name)
        text = f"{name} = {shown(value)}: {why}{way_out}"
        return InputError(text, name=name, value=value, allowed=getattr(why, "allowed", None))
    if kind == "missing" and len(location) == 1:
        meaning = field.description if field is not None else None
        return InputError(f"{name}: missing.{way_out}", name=name, allowed=meaning)
    if kind == "missing":  # in a list of fixed length; the input is the list
        name = _path(table, location[:-1])
    text_for_number = kind == "float_type" and isinstance(value, str)
    allowed = number(location) if text_for_number else _allowed(detail, field)
    slip = _slip(kind, location, value)
    text = f"{name} = {shown(value)}: must be {allowed}.{slip}{way_out}"
    return InputError(text, name=name, value=value, allowed=allowed)


def moved(error: InputError, path: str) -> InputError:
    """The error of a part, with a path in place of the name of the part."""

    def name_of(name: str) -> str:
        part, dot, rest = name.partition(".")
        if not rest or part == path:
            return name
        return f"{path}{'' if rest.startswith('[') else dot}{rest}"

    return error.renamed(name_of)


def _path(table: str, location: Location) -> str:
    """Where a value stands: table.name, or table.name[index]."""
    text = table
    for step in location:
        text += f"[{step}]" if isinstance(step, int) else f".{named(step)}"
    return text.removeprefix(".")


def _way_out(field: FieldInfo | None) -> str:
    """The meaning of a parameter, its unit, and an example."""
    if field is None:
        return ""
    if not field.description:
        return f" Give one of class {getattr(field.annotation, '__name__', '')}."
    extra = labels(field)
    unit, example = extra.get("unit", "1"), extra.get("example")
    text = f" Meaning: {field.description}"
    if unit not in ("1", "-") and f"[{unit}]" not in text:
        text += f" in {unit}"
    if example is not None and not isinstance(example, bool):
        text += f", for example {example}"
    return text + "."


_RANGES = {"gt": "greater than", "ge": "at least", "lt": "below", "le": "at most"}
_KINDS = {
    "finite_number": "a finite number (not nan, not inf)",
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "bool_type": "true or false",
    "tuple_type": "a list, [a, b, ...]",
}


def _allowed(detail: ErrorDetails, field: FieldInfo | None) -> str:
    kind, context, value = detail["type"], detail.get("ctx", {}), detail["input"]
    for key, words in _RANGES.items():
        if key in context:
            return f"{words} {context[key]:.6g}"
    if kind == "float_type" and isinstance(value, int) and not isinstance(value, bool):
        return "a finite number (at most 1.8e308)"
    if kind in ("missing", "too_long", "too_short"):
        return _length(context, field, len(detail["loc"]) - (2 if kind == "missing" else 1))
    if kind == "is_instance_of":
        return f"of class {context['class']}"
    if kind == "literal_error":
        return str(context["expected"])
    words = detail["msg"].removeprefix("Input should be ")
    return _KINDS.get(kind, words[0].lower() + words[1:])


def _length(context: Mapping[str, Any], field: FieldInfo | None, depth: int) -> str:
    """The allowed length of a list, ``depth`` lists inside that of a field."""
    items = get_args(field.annotation) if field is not None else ()
    for _ in range(depth):
        inner = items[0]  # Annotated[tuple[...], ...], or tuple[...]
        items = get_args(getattr(inner, "__origin__", inner))
        items = items or get_args(inner)
    if items and items[-1] is not Ellipsis:
        return f"a list of {len(items)} values"
    bounds = {"min_length": "at least", "max_length": "at most"}
    words = [f"{word} {context[key]}" for key, word in bounds.items() if key in context]
    return f"a list of values, {' and '.join(words)} of them"


def _slip(kind: str, location: Location, value: object) -> str:
    """A hint at a likely slip: of unit, or of quotation marks."""
    name = str(location[-1]) if location else ""
    if isinstance(value, str):
        if kind == "literal_error" and value in ELSEWHERE:
            return f" {ELSEWHERE[value]}"
        if kind in ("float_type", "int_type") and re.match(r"[-+]?\.?\d", value):
            unit = "" if re.fullmatch(r"[-+.\de]+", value) else " and without a unit, in SI units"
            return f" Write the number without quotation marks{unit}."
        return " Write it without quotation marks." if kind == "bool_type" else ""
    if not isinstance(value, int | float):
        return ""
    if name in ("angle", "wrap_angle") and 2.0 <= value <= 1000.0:
        radians = math.radians(value)
        if name == "wrap_angle" or radians < _RIGHT_ANGLE:
            return f" {value:g} looks like degrees: write {radians:.6g}."
    if name in ("kinetic", "static") and 5.0 < value <= 100.0:
        return f" {value:g} looks like percent: write {value / 100.0:g}."
    return ""

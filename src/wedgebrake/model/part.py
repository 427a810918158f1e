"""The base of every part of the machine: immutable, validated, with units in its schema."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, ClassVar, get_args

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from wedgebrake.errors import InputError, nearest

SMALLEST = 1e-50
"""Smallest magnitude of a nonzero parameter of the machine.

Together with the largest magnitude of a parameter (1e15), it keeps the products of powers that the
solvers form within the range of doubles: the largest is (T_e k/J^2)^2.
"""

_MOST_LINES = 8
_RIGHT_ANGLE = math.pi / 2


def parameter(description: str, *, symbol: str, unit: str, example: Any, **constraints: Any) -> Any:
    """A field with its symbol, SI unit, an example and its range."""
    extra = {"symbol": symbol, "unit": unit, "example": example}
    return Field(description=description, json_schema_extra=extra, **constraints)


def labels(field: FieldInfo) -> dict[str, Any]:
    """The symbol, SI unit and example of a field, as far as it has them."""
    return field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}


class Part(BaseModel):
    """A validated, immutable part of a braked driveline, in SI units.

    Raises ``InputError`` that names the field, the value received, what is allowed and
    the way out.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, strict=True)

    table: ClassVar[str] = ""
    """Name of the part in a study file and in error messages."""

    def __init__(self, /, **data: Any) -> None:  # a study may say self = 1
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise InputError(explain(error, type(self))) from None

    @model_validator(mode="before")
    @classmethod
    def _plain_numbers(cls, data: Any) -> Any:
        """Accept NumPy scalars and arrays for what they are."""
        if not isinstance(data, dict):
            return data
        return {
            key: value.tolist() if isinstance(value, np.generic | np.ndarray) else value
            for key, value in data.items()
        }


class Member(Part):
    """A part of the machine itself, with parameters in the range that the solvers can handle."""

    @field_validator("*")
    @classmethod
    def _not_vanishing(cls, value: Any, info: ValidationInfo) -> Any:
        """Reject nonzero values whose powers and ratios would underflow or overflow."""
        for number in _flat(value):
            if isinstance(number, float) and 0.0 < abs(number) < SMALLEST:
                field = cls.model_fields[str(info.field_name)]
                positive = any(getattr(limit, "gt", None) == 0 for limit in field.metadata)
                least = f"{'' if positive else '0 or '}at least {SMALLEST:g}"
                raise ValueError(
                    f"must be {least} in magnitude. Powers and ratios of smaller numbers are"
                    " outside the range of floating-point numbers."
                )
        return value


def _flat(value: Any) -> Iterator[Any]:
    """Iterate over the entries of nested tuples."""
    if not isinstance(value, tuple):
        yield value
        return
    for entry in value:
        yield from _flat(entry)


def explain(error: ValidationError, model: type[Part]) -> str:
    """The validation error in one line for each wrong field, the first few of them."""
    details = [
        detail
        for detail in error.errors(include_url=False)
        if detail["type"] != "default_factory_not_called"  # it follows from another one
    ]
    # A misspelt name first: what is missing is then explained.
    details.sort(key=lambda detail: detail["type"] != "extra_forbidden")
    lines = [_line(detail, model) for detail in details[:_MOST_LINES]]
    if len(details) > _MOST_LINES:
        lines.append(f"... and {len(details) - _MOST_LINES} more.")
    return "\n".join(lines)


def shown(value: object) -> str:
    """A value as it was given, on one line, shortened where it is long."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # thousands of digits, or of nested tables
        return f"({type(value).__name__} too long to show)"
    return text if len(text) <= 60 else text[:57] + "..."


def named(name: str) -> str:
    """A name as it was given, in quotation marks if it is not a plain word."""
    plain = name.replace("-", "").replace("_", "").isalnum() and len(name) <= 60
    return name if plain and name.isascii() else shown(name)


def is_number(value: object) -> bool:
    """Whether it is a number of Python or NumPy; True and False are none."""
    number = isinstance(value, int | float | np.integer | np.floating)
    return number and not isinstance(value, bool)


def is_finite(value: Any) -> bool:
    """Whether a number lies among the finite floats."""
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer beyond all floats
        return False


def _line(detail: ErrorDetails, model: type[Part]) -> str:
    location, kind, value = detail["loc"], detail["type"], detail["input"]
    name = _path(model.table, location) or model.__name__
    field = model.model_fields.get(str(location[0])) if location else None
    way_out = _way_out(field)
    if kind == "extra_forbidden":
        return f"{name}: no such parameter. {nearest(str(location[-1]), model.model_fields)}"
    if kind == "value_error":
        why = str(detail["ctx"]["error"])
        return f"{name} = {shown(value)}: {why}{way_out}" if location else why
    if kind == "missing" and len(location) == 1:
        return f"{name}: missing.{way_out}"
    if kind == "missing":  # in a list of fixed length; the input is the list
        name = _path(model.table, location[:-1])
    allowed = _allowed(detail, field)
    return f"{name} = {shown(value)}: must be {allowed}.{_slip(kind, location, value)}{way_out}"


def _path(table: str, location: tuple[int | str, ...]) -> str:
    """Where a value stands: table.name, or table.name[index]."""
    text = table
    for step in location:
        text += f"[{step}]" if isinstance(step, int) else f".{named(step)}"
    return text.removeprefix(".")


def _way_out(field: FieldInfo | None) -> str:
    """What the parameter means, its unit, and an example."""
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
    "tuple_type": "a list of numbers, [a, b, ...]",
}


def _allowed(detail: ErrorDetails, field: FieldInfo | None) -> str:
    kind, context, value = detail["type"], detail.get("ctx", {}), detail["input"]
    for key, words in _RANGES.items():
        if key in context:
            return f"{words} {context[key]:.6g}"
    if kind == "float_type" and isinstance(value, int) and not isinstance(value, bool):
        return "a finite number (at most 1.8e308)"
    if kind in ("missing", "too_long", "too_short"):
        return _length(context, field)
    if kind == "literal_error":
        return str(context["expected"])
    words = detail["msg"].removeprefix("Input should be ")
    return _KINDS.get(kind, words[0].lower() + words[1:])


def _length(context: dict[str, Any], field: FieldInfo | None) -> str:
    """What length a list must have."""
    items = get_args(field.annotation) if field is not None else ()
    if items and items[-1] is not Ellipsis:
        return f"a list of {len(items)} values"
    bounds = {"min_length": "at least", "max_length": "at most"}
    words = [f"{word} {context[key]}" for key, word in bounds.items() if key in context]
    return f"a list of values, {' and '.join(words)} of them"


def _slip(kind: str, location: tuple[int | str, ...], value: object) -> str:
    """A word on a likely slip: of unit, or of quotation marks."""
    name = str(location[-1]) if location else ""
    if isinstance(value, str):
        if kind == "float_type" or kind == "int_type":
            return " Write the number without quotation marks or units."
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

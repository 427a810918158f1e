"""The base of every part of the machine: immutable, validated, with units in its schema."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic_core import ErrorDetails

from wedgebrake.errors import InputError, nearest


def parameter(
    description: str, *, symbol: str, unit: str, example: float | bool, **constraints: Any
) -> Any:
    """A field with its symbol, SI unit, an example and its range."""
    extra = {"symbol": symbol, "unit": unit, "example": example}
    return Field(description=description, json_schema_extra=extra, **constraints)


class Part(BaseModel):
    """A validated, immutable part of a braked driveline, in SI units.

    Raises ``InputError`` that names the field, the value received, what is allowed and
    the way out.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, strict=True)

    table: ClassVar[str] = ""
    """Name of the part in a study file and in error messages."""

    def __init__(self, **data: Any) -> None:
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise InputError(explain(error, type(self))) from None

    @model_validator(mode="before")
    @classmethod
    def _plain_numbers(cls, data: Any) -> Any:
        """Accept NumPy scalars for what they are."""
        if not isinstance(data, dict):
            return data
        return {
            key: value.item() if isinstance(value, np.generic) else value
            for key, value in data.items()
        }


def explain(error: ValidationError, model: type[Part]) -> str:
    """The validation error in one line for each wrong field."""
    return "\n".join(_line(detail, model) for detail in error.errors())


def _line(detail: ErrorDetails, model: type[Part]) -> str:
    location = [str(step) for step in detail["loc"]]
    name = ".".join([model.table, *location] if model.table else location) or model.__name__
    kind, value, context = detail["type"], detail["input"], detail.get("ctx", {})
    fields = model.model_fields
    field = fields.get(location[0]) if location else None
    if kind == "extra_forbidden":
        return f"{name}: no such parameter. {nearest(location[-1], fields)}"
    extra = field.json_schema_extra if field is not None else None
    extra = extra if isinstance(extra, dict) else {}
    unit, example = extra.get("unit", ""), extra.get("example")
    meaning = field.description if field is not None else ""
    way_out = f" Meaning: {meaning}" if meaning else ""
    way_out += f" in {unit}" if unit and unit != "1" else ""
    way_out += f", for example {example}." if example is not None else ("." if way_out else "")
    if kind == "missing":
        return f"{name}: missing.{way_out}"
    if kind == "value_error":
        return f"{name}: {context['error']}" if location else str(context["error"])
    allowed = _allowed(kind, context, detail["msg"])
    return f"{name} = {_shown(value)}: must be {allowed}.{_slip(location, value)}{way_out}"


def _allowed(kind: str, context: dict[str, Any], message: str) -> str:
    if kind in ("greater_than", "greater_than_equal", "less_than", "less_than_equal"):
        words = {"gt": "greater than", "ge": "at least", "lt": "below", "le": "at most"}
        key = next(key for key in words if key in context)
        return f"{words[key]} {context[key]:.6g}"
    if kind == "finite_number":
        return "a finite number (not nan, not inf)"
    if kind.startswith("float"):
        return "a number"
    if kind.startswith("bool"):
        return "true or false"
    return message[0].lower() + message[1:]


def _slip(location: list[str], value: Any) -> str:
    """A word on a likely slip of unit."""
    if location and location[-1] == "angle" and isinstance(value, int | float):
        if math.pi / 2 <= value < 90:
            return f" {value:g} looks like degrees: write {math.radians(value):.6g}."
    if isinstance(value, str):
        return " Write the number without quotation marks or units."
    return ""


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."

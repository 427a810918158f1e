"""The base of every part of the system: immutable, validated, with units in its schema."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping
from functools import cache
from keyword import iskeyword
from types import FunctionType, UnionType
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Union, get_args, get_origin

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

from wedgebrake.errors import InputError
from wedgebrake.model.units import UNITS, allowed_units, with_unit, with_units
from wedgebrake.model.validation import NotAllowedError, check_choice, explain, labels

SMALLEST = 1e-50
"""Smallest magnitude of a nonzero parameter of the system.

Together with the largest magnitude of a parameter (1e15), it keeps the products of powers that the
solvers form within the range of doubles: the largest is (T_e k/J^2)^2.
"""


def parameter(
    description: str,
    *,
    example: Any,
    symbol: str = "-",
    unit: str = "1",
    columns: tuple[str, ...] = (),
    **constraints: Any,
) -> Any:
    """State a parameter of a brake, friction law or other part of the system.

    Returns pydantic's ``Field``: range checks, error messages, the schema of study files and the
    labels of figures follow from it.

    description : its meaning, a noun phrase
    symbol      : in formulas; "-" for none
    unit        : SI unit; "1" for a plain number, "-" where it has none
    columns     : SI units of the values in a row, or in each of several rows
    example     : a usual value
    constraints : of pydantic: ``gt``, ``ge``, ``lt``, ``le``, ``default``, ...
    """
    extra = {"symbol": symbol, "unit": unit, "example": example}
    extra |= {"columns": columns} if columns else {}
    return Field(description=description, json_schema_extra=extra, **constraints)


class Quantity(NamedTuple):
    """A quantity that can be swept: symbol, unit and meaning."""

    symbol: str
    unit: str
    meaning: str

    @classmethod
    def of(cls, name: str, field: FieldInfo) -> Quantity:
        """The quantity of a field; its symbol is left out of the meaning."""
        extra = labels(field)
        symbol, unit = str(extra.get("symbol", "-")), str(extra.get("unit", "1"))
        words = [one for one in (field.description or name).split() if one != symbol]
        return cls(symbol, unit, " ".join(words))


if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(BaseModel)


class _Listed(ModelMetaclass):
    """Lists what wedgebrake defines in ``dir`` and ``help``, without the methods of pydantic."""

    def __dir__(cls) -> list[str]:  # noqa: N805 - of a metaclass
        hidden = {*dir(BaseModel), *vars(Part)}
        return [one for one in super().__dir__() if one not in hidden and not one.startswith("_")]


FIELDS = "Values:"
"""Line of the docstring of a part that begins the list of its fields."""


class Part(BaseModel, metaclass=_Listed):
    """A validated, immutable part of a braked driveline, in SI units.

    Raises ``InputError`` that names the field, its value, what is allowed and the way out.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, strict=True)

    table: ClassVar[str] = ""
    """Name of the part in a study file and in error messages."""
    later: ClassVar[frozenset[str]] = frozenset()
    """Fields that plain tables of the part omit at their default."""
    listed: ClassVar[frozenset[str]] = frozenset()
    """Fields that are short lists of numbers, each of which has a dotted name: "gap.0"."""
    plain_unit: ClassVar[str] = "1"
    """Key in ``UNITS`` of the units of fields that state none."""
    alternatives: ClassVar[dict[str, tuple[str, Any]]] = {}
    """Names that can be given instead of a field: the field, and the ``parameter`` of the name."""

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        super().__pydantic_init_subclass__(**kwargs)
        _document(cls)

    def __init__(self, /, *values: Any, **data: Any) -> None:  # a study may say self = 1
        if values:
            name, names = type(self).__name__, list(type(self).model_fields)
            raise InputError(
                f"{name}: {len(values)} given by position. Give values by name:"
                f" {name}({', '.join(f'{one}=...' for one in names)}).",
                name=name, value=values, allowed=tuple(names),
            )  # fmt: skip
        try:
            super().__init__(**data)
        except ValidationError as error:
            part = type(self)
            raise explain(error, self._label(data), part.model_fields, part._allowed) from None

    def __setattr__(self, name: str, value: Any) -> None:
        try:
            super().__setattr__(name, value)
        except (ValidationError, ValueError):
            raise self._fixed(name, value) from None

    def __delattr__(self, name: str) -> None:
        try:
            super().__delattr__(name)
        except (ValidationError, AttributeError):
            raise self._fixed(name) from None

    def _fixed(self, name: str, value: Any = None) -> InputError:
        """The error for an attribute that is assigned or deleted."""
        label = f"{self._label(dict(self))}.{name}".removeprefix(".")
        return InputError(
            f"{label}: cannot be changed, as parts and systems are immutable. Make a changed copy:"
            " system.replace(...) of a driveline or a machine, or a new part.",
            name=label, value=value, allowed="left unchanged",
        )  # fmt: skip

    @classmethod
    def _allowed(cls, location: tuple[int | str, ...]) -> str:
        """What a number may be that is at a place in the fields, with its units."""
        columns = column_units(cls, str(location[0]))
        if columns:
            last = location[-1] if len(location) > 1 else 0
            return allowed_units(columns[last] if isinstance(last, int) else "1")
        return allowed_units(text_unit(cls, str(location[0])) or "-")

    @classmethod
    def _label(cls, data: dict[str, Any]) -> str:  # noqa: ARG003 - parts with names use it
        """The prefix of field names in error messages."""
        return cls.table

    @model_validator(mode="before")
    @classmethod
    def _plain_numbers(cls, data: Any) -> Any:
        """Convert NumPy scalars and arrays, and texts with a unit where a number is wanted."""
        if not isinstance(data, dict):
            return data
        found = {
            key: value.tolist() if isinstance(value, np.generic | np.ndarray) else value
            for key, value in data.items()
        }
        for key, value in found.items():
            if not isinstance(value, str | list | tuple):
                continue
            unit, columns = text_unit(cls, key), column_units(cls, key)
            if unit is None and not columns:
                continue
            name = f"{cls._label(data)}.{key}".removeprefix(".")
            if columns:
                found[key] = with_units(name, value, columns)
            elif unit is not None:
                found[key] = with_unit(name, value, unit)
        return cls._completed(found)

    def inner(self) -> dict[str, Part]:
        """The inner parts whose values are named as those of the part itself, in order."""
        return {}

    @classmethod
    def _completed(cls, data: dict[str, Any]) -> dict[str, Any]:
        """The values with fields in place of ``alternatives``."""
        return data


@cache
def text_unit(part: type[Part], name: str) -> str | None:
    """Key in ``UNITS`` of the units in which a field can be given as a text; None: it cannot."""
    unit = labels(_field(part, name)).get("unit")
    if unit == "1" or (unit == "-" and part.plain_unit != "1"):
        unit = part.plain_unit
    return str(unit) if unit in UNITS else None


@cache
def column_units(part: type[Part], name: str) -> tuple[str, ...]:
    """Keys in ``UNITS`` of the values in a row of a field; empty for a field without rows."""
    return tuple(labels(_field(part, name)).get("columns", ()))


def _field(part: type[Part], name: str) -> FieldInfo:
    """A field, or a name that can be given instead of one; an empty field for other names."""
    if name in part.alternatives:
        found: FieldInfo = part.alternatives[name][1]
        return found
    return part.model_fields.get(name, FieldInfo())


def _document(part: type[Part]) -> None:
    """Give a class the signature of its fields, and list them in its docstring."""
    positional = issubclass(part, globals().get("Positional", ()))
    kinds = inspect.Parameter.KEYWORD_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD
    kind = kinds[int(positional)]
    found, lines = [], []
    for name, field in part.model_fields.items():
        default = inspect.Parameter.empty if field.is_required() else field.default
        default = default if field.default_factory is None else ...
        if name.isidentifier() and not iskeyword(name):
            found.append(inspect.Parameter(name, kind, default=default))
        unit = labels(field).get("unit", "-")
        words = field.description or getattr(field.annotation, "__name__", "")
        lines.append(f"{name} : {words}{'' if unit in ('1', '-') else f' [{unit}]'}")
    part.__signature__ = inspect.Signature(found, __validate_parameters__=False)
    own = vars(part).get("__doc__")
    if own and lines:
        meaning = inspect.cleandoc(own).partition(f"\n\n{FIELDS}")[0]
        part.__doc__ = "\n".join([meaning, "", FIELDS, *(f"    {line}" for line in lines)])


def given(part: Part) -> dict[str, Any]:
    """Values that a part was given, in the order of its fields; defaults are left out."""
    names, stated = type(part).model_fields, part.model_fields_set
    return {name: getattr(part, name) for name in names if name in stated}


def is_numeric(field: FieldInfo) -> bool:
    """Return True for a field that is a float, or a float or a signal."""
    union = get_origin(field.annotation) in (Union, UnionType)
    kinds = get_args(field.annotation) if union else (field.annotation,)
    return float in kinds and type(None) not in kinds


def plain_fields(part: Part) -> dict[str, Any]:
    """The values of a part as numbers, texts, lists and tables; without functions.

    Inner parts become tables with their kind. The fields in ``later`` of a part are omitted at
    their default.
    """
    fields = type(part).model_fields
    return {
        name: _plain(value)
        for name, value in dict(part).items()
        if not _is_function(value) and (name not in part.later or value != fields[name].default)
    }


def plain_table(part: Part) -> dict[str, Any]:
    """``plain_fields``, preceded by the kind of the part if it is one of several kinds."""
    kind = {"kind": part.kind_or_class} if isinstance(part, Chosen) else {}
    return kind | plain_fields(part)


def _plain(value: Any) -> Any:
    if isinstance(value, Part):
        return plain_table(value)
    return [_plain(one) for one in value] if isinstance(value, tuple | list) else value


def _is_function(value: Any) -> bool:
    return callable(value) and not isinstance(value, Part)


class Member(Part):
    """A part of the system itself, with parameters in the range that the solvers can handle."""

    @field_validator("*")
    @classmethod
    def _not_vanishing(cls, value: Any, info: ValidationInfo) -> Any:
        """Reject nonzero values whose powers and ratios would underflow or overflow."""
        for number in (value,) if isinstance(value, float) else _flat(value):
            if isinstance(number, float) and 0.0 < abs(number) < SMALLEST:
                field = cls.model_fields[str(info.field_name)]
                positive = any(getattr(limit, "gt", None) == 0 for limit in field.metadata)
                least = f"{'' if positive else '0 or '}at least {SMALLEST:g}"
                raise NotAllowedError(
                    f"{least} in magnitude",
                    "Powers and ratios of smaller numbers are outside the range of floating-point"
                    " numbers.",
                )
        return value


class Positional(Member):
    """A part whose values can also be given by position, in the order of its fields."""

    def __init__(self, /, *values: Any, **data: Any) -> None:
        super().__init__(**_by_position(type(self), values, data))


def _by_position(part: type[Part], values: tuple[Any, ...], data: dict[str, Any]) -> dict[str, Any]:
    names = list(part.model_fields)
    given = dict(zip(names, values, strict=False))
    twice = [name for name in given if name in data]
    if len(values) > len(names) or twice:
        what = f"{twice[0]}: given twice." if twice else f"{len(values)} values given."
        raise InputError(
            f"{part.__name__}: {what} It takes {', '.join(names)}, each once, by position or name.",
            name=twice[0] if twice else part.__name__, allowed=tuple(names),
            value=data[twice[0]] if twice else values,
        )  # fmt: skip
    return {**given, **data}


class Chosen(Member):
    """A part of several kinds: a brake or a friction law.

    A subclass that states ``kind`` can be named in study files by it.
    """

    kind: ClassVar[str] = ""
    kinds: ClassVar[dict[str, type[Any]]] = {}
    """Every subclass that states a kind, by that kind; each base has its own."""

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        super().__pydantic_init_subclass__(**kwargs)
        # So that a subclass may state a property as a plain value.
        properties = {name for name, value in vars(cls).items() if isinstance(value, property)}
        cls.__class_vars__ = cls.__class_vars__ | properties
        if "kind" not in vars(cls):
            cls.kind = ""  # that of the parent would name the parent
        if cls.kind:
            _check_kind(cls, cls.kinds)
            cls.kinds[cls.kind] = cls
        if isinstance(vars(cls).get("law"), FunctionType):
            name, allowed = f"{cls.__name__}.law", "a static method"
            raise InputError(
                f"{name}: must be {allowed}, as it is compiled. Write @staticmethod above it, and"
                " take the parameters from shape.",
                name=name, allowed=allowed,
            )  # fmt: skip

    @property
    def kind_or_class(self) -> str:
        """The kind, or the class of a part that states none."""
        return self.kind or type(self).__name__


def _check_kind(part: type[Chosen], kinds: dict[str, type[Any]]) -> None:
    """Raise ``InputError`` for a kind of the package; a user's own class may be defined again."""
    other = kinds.get(part.kind)
    if other is None or (other.__module__, other.__qualname__) == (
        part.__module__, part.__qualname__
    ):  # fmt: skip
        return
    if other.__module__.startswith("wedgebrake."):
        raise InputError(
            f"{part.__name__}.kind = {part.kind!r}: must be another word than those of the package:"
            f" {', '.join(sorted(kinds))}.",
            name=f"{part.__name__}.kind", value=part.kind, allowed="another word",
        )  # fmt: skip


def of_kind(name: str, table: Mapping[str, Any], kinds: Mapping[str, type[Any]]) -> Any:
    """The part that a table of a study file describes, of the kind that it names.

    name : of the part, for messages

    Raises ``InputError`` for an unknown kind or wrong values.
    """
    values, words = dict(table), sorted(kinds)
    if "kind" not in values:
        raise InputError(
            f"{name}.kind: missing. Allowed: {', '.join(map(repr, words))}.",
            name=f"{name}.kind", allowed=tuple(words),
        )  # fmt: skip
    return kinds[check_choice(f"{name}.kind", values.pop("kind"), words)](**values)


def _flat(value: Any) -> Iterator[Any]:
    """Iterate over the entries of nested tuples."""
    if not isinstance(value, tuple):
        yield value
        return
    for entry in value:
        yield from _flat(entry)

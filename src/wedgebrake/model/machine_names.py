"""Dotted names of parameters of a machine: "brake.slope", "disc.inertia", "engine.amplitude".

The first word is the name of an inertia, shaft, contact or torque, the next one a field of it. The
brake, friction and actuation of a contact and the signal of a torque are omitted. Further words
name parameters of signals: "brake.initial_force.amplitude", "engine.signals.0.frequency"; a number
names a value of a list: "stop.gap.1".
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from pydantic.fields import FieldInfo

from wedgebrake.errors import InputError, nearest
from wedgebrake.model.machine_parts import Factors, Named
from wedgebrake.model.part import Part, given
from wedgebrake.model.validation import check_instance, is_number, moved, named, unknown

_FEW = 12
"""Most values of a list that have names."""
_Changes = list[tuple[list[str], Any]]


class Value(NamedTuple):
    """A value of a system, the field that describes it, and the part that has the field."""

    value: Any
    field: FieldInfo
    owner: Part


def numbers(parts: Mapping[str, Part]) -> dict[str, Value]:
    """All numbers by dotted name, in order."""
    found = {name: one for part in parts.values() for name, one in values(part).items()}
    return {
        name: one
        for name, one in found.items()
        if is_number(one.value)
        and name.rpartition(".")[2] not in getattr(one.owner, "unlisted", ())
    }


def values(part: Part) -> dict[str, Value]:
    """All values of a part and of its inner parts, by the names that ``replace`` takes."""
    prefix = getattr(part, "name", "")
    return {name.removeprefix("."): one for name, one in _values(part, prefix)}


def _values(part: Part, prefix: str) -> Iterator[tuple[str, Value]]:
    inner = part.inner()
    taken = set(type(part).model_fields)
    for name, field in type(part).model_fields.items():
        value = getattr(part, name)
        if name in inner:
            for dotted, one in _values(value, ""):
                # A name that an earlier part also has is preceded by the name of its own part.
                doubled = dotted.split(".")[1] in taken
                yield f"{prefix}.{name}{dotted}" if doubled else f"{prefix}{dotted}", one
            taken |= set(type(value).model_fields)
        elif isinstance(value, Part):
            yield from _values(value, f"{prefix}.{name}")
        elif isinstance(value, tuple) and any(isinstance(one, Part) for one in value):
            for i, one in enumerate(value):
                yield from _values(one, f"{prefix}.{name}.{i}")
        else:
            yield f"{prefix}.{name}", Value(value, field, part)
            factors = value if isinstance(value, Factors) else {}
            for quantity, factor in factors.items():
                yield f"{prefix}.{name}.{quantity}", Value(factor, field, part)
            entries = value if name in part.listed and value is not None else ()
            for i, one in enumerate(entries if len(entries) <= _FEW else ()):
                yield f"{prefix}.{name}.{i}", Value(one, field, part)


def replaced(parts: Mapping[str, Named], changes: Mapping[str, Any]) -> dict[str, Named]:
    """Copies of the parts with other values, by dotted name.

    Raises ``InputError`` for an unknown name and for a value that is not allowed.
    """
    of_part: dict[str, _Changes] = {}
    new = dict(parts)
    for name, value in changes.items():
        check_instance("changes", name, str, "names, each with its value")
        first, *rest = name.split(".")
        if first not in parts:
            hint = nearest(first, parts)
            meant = [one for one in numbers(parts) if one.endswith(f".{first}")]
            if meant and not rest:
                hint = nearest(meant[0], meant[:3])
            raise InputError(
                f"{named(first)}: no such part of the machine. {hint}",
                name=name, value=value, allowed=tuple(parts),
            )  # fmt: skip
        if rest:
            of_part.setdefault(first, []).append((rest, value))
        else:
            new[first] = value
    for first, own in of_part.items():
        new[first] = _changed(new[first], own, first)
    return new


def _changed(part: Any, changes: _Changes, path: str) -> Any:
    """A copy of a part, or of a tuple of parts, with other values."""
    if isinstance(part, tuple):
        return _changed_items(part, changes, path)
    if isinstance(part, Factors):
        return _changed_factors(part, changes, path)
    if not isinstance(part, Part):
        words, value = changes[0]
        raise InputError(
            f"{path}.{words[0]}: no such parameter. {path} is a value without parameters; replace"
            " it with a signal, or leave out what follows its name.",
            name=f"{path}.{words[0]}", value=value, allowed=(path,),
        )  # fmt: skip
    own = {
        words[0]: value
        for words, value in changes
        if len(words) == 1 and words[0] in type(part).model_fields
    }
    values = {**given(part), **own}
    deeper: dict[str, _Changes] = {}
    for words, value in changes:
        if words[0] in type(part).model_fields:
            if len(words) > 1:
                deeper.setdefault(words[0], []).append((words[1:], value))
        else:
            child = _child_with(part, own, words[0], value, path)
            deeper.setdefault(child, []).append((words, value))
    for child, more in deeper.items():
        where = path if child in part.inner() else f"{path}.{child}"
        values[child] = _changed(values.get(child, getattr(part, child)), more, where)
    try:
        return type(part)(**values)
    except InputError as error:
        raise moved(error, path) from None


def _changed_factors(part: Factors, changes: _Changes, path: str) -> dict[str, Any]:
    found: dict[str, Any] = dict(part)
    for words, value in changes:
        name = ".".join(words)
        if name not in part:
            raise unknown(f"{path}.{name}", value, part, "no such factor")
        found[name] = value
    return found


def _changed_items(parts: tuple[Any, ...], changes: _Changes, path: str) -> tuple[Any, ...]:
    items = list(parts)
    deeper: dict[int, _Changes] = {}
    for words, value in changes:
        number = words[0]
        if not number.isdecimal() or int(number) >= len(items):
            allowed = tuple(str(i) for i in range(len(items)))
            raise InputError(
                f"{path}.{named(number)}: no such number. It counts from 0 to {len(items) - 1}.",
                name=f"{path}.{number}", value=value, allowed=allowed,
            )  # fmt: skip
        if words[1:]:
            deeper.setdefault(int(number), []).append((words[1:], value))
        else:
            items[int(number)] = value
    for at, more in deeper.items():
        items[at] = _changed(items[at], more, f"{path}.{at}")
    return tuple(items)


def _child_with(part: Part, own: Mapping[str, Any], name: str, value: Any, path: str) -> str:
    """The name of the inner part that has a parameter, after the changes in ``own``."""
    allowed = list(type(part).model_fields)
    for child, old in part.inner().items():
        fields = getattr(type(own.get(child, old)), "model_fields", {})
        if name in fields:
            return child
        allowed += fields
    raise InputError(
        f"{path}.{named(name)}: no such parameter. {nearest(name, allowed, f'{path}.')}",
        name=f"{path}.{name}", value=value, allowed=tuple(allowed),
    )  # fmt: skip

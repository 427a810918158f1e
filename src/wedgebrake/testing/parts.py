"""Checks of any part: its parameters, equality, copies, names in a system, and study files."""

from __future__ import annotations

import contextlib
import copy
import json
import math
import pickle
import sys
from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from wedgebrake.errors import InputError
from wedgebrake.model.actuation import Actuation
from wedgebrake.model.brakes import Brake, ConventionalBrake
from wedgebrake.model.controller import TORQUE, Controller
from wedgebrake.model.display import Tabular
from wedgebrake.model.driveline import Driveline
from wedgebrake.model.friction import CoulombFriction, Friction
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_parts import (
    GROUND,
    Contact,
    Driven,
    Inertia,
    Joint,
    OverState,
    Shaft,
    Stages,
    Torque,
)
from wedgebrake.model.part import Chosen, Part, given, is_numeric, text_unit
from wedgebrake.model.signals.excitation import HarmonicTorque
from wedgebrake.model.signals.signal_tables import FEW
from wedgebrake.model.signals.signals import Signal
from wedgebrake.model.studies.study import Study, read_study
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.torque_contacts import TorqueContact
from wedgebrake.model.units import UNITS
from wedgebrake.model.validation import check_instance, is_number, labels


def check_part(part: Part) -> None:
    """Check that a part behaves as every part of the package does.

    part : a brake, friction law, signal, inertia, ..., or a whole system

    - The example of each numeric parameter lies in its range, nan is refused by the name of the
      parameter, and a text with its unit gives the same part.
    - Parts of equal values are equal and have the same hash; another value makes them unequal.
    - Copies and pickles are equal to the part, and so is what its ``repr`` evaluates to.
    - No attribute can be assigned.
    - In a system, each number can be read and replaced by its dotted name.
    - A study file gives the part back, if it has a ``kind`` and holds no function.

    Classes and functions that no module has by their names cannot be pickled; that check is then
    left out.

    Raises ``AssertionError`` for a part that does not, ``InputError`` for what is no part.
    """
    check_instance("part", part, Part, "a part, for example a brake, a signal or an inertia")
    _check_parameters(part)
    _check_equality(part)
    _check_copies(part)
    _check_fixed(part)
    system = system_with(part)
    if system is not None:
        _check_names(part, system)
        if _can_be_written(part):
            _check_study(part, system)


def claim(fulfilled: object, sentence: str) -> None:
    """Raise ``AssertionError`` with a sentence unless a condition is fulfilled."""
    if not fulfilled:
        raise AssertionError(sentence)


def _check_parameters(part: Part) -> None:
    kind, values = type(part), given(part)
    for name, field in kind.model_fields.items():
        if not is_numeric(field):
            continue
        where = f"{kind.__name__}.{name}"
        example = labels(field).get("example")
        if example is not None:
            allowed: Any = Annotated[(field.annotation, Field(), *field.metadata)]
            adapter = TypeAdapter[Any](
                allowed, config=ConfigDict(strict=True, arbitrary_types_allowed=True)
            )
            try:
                adapter.validate_python(float(example))
            except ValidationError as error:
                why = error.errors()[0]["msg"]
                raise AssertionError(
                    f"{where}: its example {example!r} is out of its range ({why})."
                ) from None
        try:
            kind(**{**values, name: math.nan})
        except InputError as error:
            claim(
                name in (error.name or "").split("."),
                f"{where} = nan: must be refused with the name of the parameter, but the error"
                f" names {error.name!r}.",
            )
        else:
            raise AssertionError(f"{where} = nan: must be refused, but is accepted.")
        unit, value = text_unit(kind, name), getattr(part, name)
        word = next((one for one, si in UNITS.get(unit or "", {}).items() if si == 1.0), None)
        if word and is_number(value):
            text = f"{value!r} {word}"
            claim(
                kind(**{**values, name: text}) == part,
                f"{where} = {text!r}: must give the same part as the number.",
            )


def _check_equality(part: Part) -> None:
    kind, values = type(part), given(part)
    again = kind(**values)
    claim(again == part, f"{kind.__name__}: two parts of the same values must be equal.")
    claim(hash(again) == hash(part), f"{kind.__name__}: equal parts must have the same hash.")
    claim(part != object(), f"{kind.__name__}: must be unequal to other objects.")
    for name, field in kind.model_fields.items():
        value = getattr(part, name)
        if not is_numeric(field) or not is_number(value):
            continue
        for other in _neighbours(value):
            with contextlib.suppress(InputError):
                changed = kind(**{**values, name: other})
                claim(
                    changed != part,
                    f"{kind.__name__}: parts whose {name} is {value!r} and {other!r} must not be"
                    " equal.",
                )
                break


def _neighbours(value: float) -> tuple[float, ...]:
    """Other values of a parameter, of which one is perhaps allowed."""
    others = (value + 0.5, value * 1.0009765625, value * 0.9990234375, 1.0)
    return tuple(one for one in others if one != value)


def _check_copies(part: Part) -> None:
    name = type(part).__name__
    claim(copy.copy(part) == part, f"{name}: a copy must be equal.")
    claim(copy.deepcopy(part) == part, f"{name}: a deep copy must be equal.")
    if all(map(_is_importable, _classes_and_functions(part))):
        pickled = pickle.loads(pickle.dumps(part))  # noqa: S301 - our own
        claim(pickled == part, f"{name}: its pickle must give an equal part.")
    if isinstance(part, Tabular) or _is_shortened(part):
        return
    known = {one.__name__: one for one in _classes_and_functions(part)}
    try:
        read = eval(repr(part), known)  # noqa: S307 - our own
    except (SyntaxError, NameError, TypeError, InputError) as error:
        raise AssertionError(
            f"{name}: repr must be Python that makes the part, but it gives {error!r}: {part!r}"
        ) from None
    claim(read == part, f"{name}: repr must be Python that makes an equal part, not {part!r}.")


def _is_shortened(part: Part) -> bool:
    """Whether a part holds a function or a long list, which ``repr`` does not give in full."""
    return any(callable(one) or (isinstance(one, tuple) and len(one) > FEW)
               for one in _values(part))  # fmt: skip


def _values(part: Part) -> Iterator[Any]:
    """All values in a part and in its inner parts, the inner parts left out."""
    for value in dict(part).values():
        for one in value if isinstance(value, tuple) else (value,):
            if isinstance(one, Part):
                yield from _values(one)
        if not isinstance(value, Part):
            yield value


def _inner_parts(part: Part) -> Iterator[Part]:
    yield part
    for value in dict(part).values():
        for one in value if isinstance(value, tuple) else (value,):
            if isinstance(one, Part):
                yield from _inner_parts(one)


def _classes_and_functions(part: Part) -> Iterator[Any]:
    yield from map(type, _inner_parts(part))
    yield from filter(callable, _values(part))


def _is_importable(one: Any) -> bool:
    found: Any = sys.modules.get(getattr(one, "__module__", ""))
    for word in getattr(one, "__qualname__", "").split("."):
        found = getattr(found, word, None)
    return found is one


def _check_fixed(part: Part) -> None:
    for name in type(part).model_fields:
        try:
            setattr(part, name, getattr(part, name))
        except InputError:
            continue
        raise AssertionError(f"{type(part).__name__}.{name}: must not be assigned to.")


def system_with(part: Part) -> BrakedDriveline | Machine | None:
    """A small system that has a part; None for parts of no system, such as a disc's material."""
    if isinstance(part, BrakedDriveline | Machine):
        return part
    if isinstance(part, Driveline):
        return BrakedDriveline(driveline=part, excitation=HarmonicTorque(500.0, 10.0), **_PRESSED)
    if isinstance(part, Inertia):
        return Machine(inertias=[part])
    if isinstance(part, Shaft | Contact | TorqueContact | Torque):
        ends = [part.on, part.relative_to] if isinstance(part, Torque) else [part.a, part.b]
        inertias = [Inertia(one, 1.0) for one in ends if one and one != GROUND]
        kind = "contact" if isinstance(part, TorqueContact) else part.table
        return Machine(inertias=inertias, **{f"{kind}s": [part]})
    if isinstance(part, Joint):
        inertias = [Inertia(getattr(part, end), 1.0) for end in part.ends]
        return Machine(inertias=inertias, joints=[part])
    disc = [Inertia("disc", 1.0)]
    if isinstance(part, Driven):
        shaft = Shaft("disc", part.name, stiffness=900.0, damping=2.0)
        return Machine(inertias=[*disc, part], shafts=[shaft])
    if isinstance(part, Controller):
        return _controlled(part)
    if isinstance(part, Stages):
        return Machine(inertias=disc, shafts=[Shaft("disc", GROUND, part)])
    if isinstance(part, Signal | OverState):
        return Machine(inertias=disc, torques=[Torque("disc", part, name="engine")])
    if isinstance(part, Brake | Friction | Actuation):
        contact = Contact("disc", name="brake", **{**_PRESSED, part.table: part})
        return Machine(inertias=disc, contacts=[contact])
    return None


def _controlled(loop: Controller) -> Machine:
    """A machine with all that a controller measures and acts on."""
    names: dict[str, list[str]] = {"inertia": [], "torque": [], "contact": []}
    kinds = {"angle": "inertia", "speed": "inertia", "force": "contact"}
    for name in loop.measured:
        part, _, what = name.rpartition(".")
        names[kinds.get(what, what)].append(part)
    part, what = loop.acts_on
    names["inertia" if what == TORQUE else "contact"].append(part)
    bodies = list(dict.fromkeys(names["inertia"])) or ["disc"]
    pressed = {**_PRESSED, "actuation": Actuation(initial_force=300.0, lag=0.02)}
    return Machine(
        inertias=[Inertia(one, 1.0) for one in bodies],
        shafts=[
            Shaft(bodies[0], GROUND, stiffness=400.0, damping=1.0, name=one)
            for one in names["torque"]
        ],
        contacts=[
            Contact(bodies[0], name=one, **pressed) for one in dict.fromkeys(names["contact"])
        ],
        controllers=[loop],
    )


_PRESSED: dict[str, Any] = {
    "brake": ConventionalBrake(radius=0.2), "friction": CoulombFriction(kinetic=0.3),
    "actuation": Actuation(initial_force=300.0),
}  # fmt: skip


def _check_names(part: Part, system: BrakedDriveline | Machine) -> None:
    name = type(part).__name__
    for dotted, value in system.machine.parameters().items():
        same = system.machine.replace({dotted: value})
        claim(
            same == system.machine,
            f"{name}: a system in which {dotted} is replaced by its own value must be equal.",
        )
        for other in _neighbours(value):
            with contextlib.suppress(InputError):
                changed = system.machine.replace({dotted: other})
                claim(
                    changed.value(dotted) == other,
                    f"{name}: a system in which {dotted} is replaced by {other!r} must have that"
                    f" value, not {changed.value(dotted)!r}.",
                )
                break


def _can_be_written(part: Part) -> bool:
    """Whether a part and its inner parts have a kind, and hold no function."""
    kinds = all(one.kind for one in _inner_parts(part) if isinstance(one, Chosen))
    return kinds and not any(map(callable, _values(part)))


def _check_study(part: Part, system: BrakedDriveline | Machine) -> None:
    name = type(part).__name__
    try:
        text = Study(system).to_toml()
        read = read_study(text).system
        json.dumps(system.as_dict())
    except (InputError, TypeError) as error:
        raise AssertionError(f"{name}: a study file must hold it, but: {error}") from None
    claim(read == system, f"{name}: its study file must give it back, but gives {read!r}.")

"""The system as rows of the parameter panel: names, values, units and ranges."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from typing import Any

from pydantic.fields import FieldInfo

from wedgebrake.errors import InputError
from wedgebrake.explorer.core.parameter_ranges import extended, field, scale, span
from wedgebrake.explorer.core.state import PageState
from wedgebrake.figures.data.axes import ParameterAxis
from wedgebrake.figures.data.caption import capitalized
from wedgebrake.model.brakes import Brake
from wedgebrake.model.display import unit_of
from wedgebrake.model.friction import Friction
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.part import Part, is_numeric
from wedgebrake.model.studies.sweep_settings import sweepable
from wedgebrake.model.system import INITIAL

# Symbol and short label, by name.
_WORDS: dict[str, tuple[str, str]] = {
    "eta": ("η", "force slope"),
    "f": ("f", "frequency"),
    "F0": ("F₀", "initial force"),
    "alpha": ("α", "wedge angle"),
    "loss_factor": ("c/√(kJ)", "loss factor"),
    "static_ratio": ("μₛ/μₖ", "static over kinetic"),
    "drive": ("Ω√(kJ)/Tₑ", "drive"),
    "brake": ("", "kind"),
    "radius": ("R", "radius"),
    "angle": ("α_w", "wedge angle"),
    "wrap_angle": ("β", "wrap angle"),
    "actuation_arm": ("a", "force arm"),
    "normal_arm": ("b", "normal arm"),
    "friction_arm": ("d", "friction arm"),
    "initial_force": ("Fₐ₀", "initial force"),
    "slope": ("δ", "slope"),
    "release": ("", "releases below zero force"),
    "amplitude": ("Tₑ", "amplitude"),
    "frequency": ("fₑ", "frequency"),
    "natural": ("fₙ", "natural frequency"),
    "friction": ("", "law"),
    "kinetic": ("μₖ", "kinetic"),
    "static": ("μₛ", "static"),
    "decay": ("ς", "peak decay"),
    "steepness": ("ξ", "steepness"),
    "speed": ("v₀", "decay speed"),
    "tolerance": ("ε", "largest error of the lines"),
    "speeds": ("vᵣ", "speeds"),
    "coefficients": ("μₖ", "coefficients"),
    "inertia": ("J", "inertia"),
    "damping": ("c", "damping"),
    "stiffness": ("k", "stiffness"),
    "drive_speed": ("Ω", "shaft speed"),
    "periods": ("", "periods run"),
    "shown": ("", "periods shown"),
    "initial_angle": ("θ₀", "start angle"),
    "initial_velocity": ("θ\N{PRIME}₀", "start velocity"),
}
_KINDS = {
    "leading-shoe": "leading shoe",
    "coulomb": "Coulomb, exact",
    "stribeck": "Stribeck (true sticks)",
    "smoothed": "smoothed (tanh)",
    "tabulated": "table over speed",
}
# Printed form of words in formulas; other words only lose their underscore.
_GREEK = {"delta": "δ", "mu_k": "μk", "mu_s": "μs", "sqrt": "√"}
_HINTS = {
    "loss_factor": "Loss factor of the driveline, c/√(kJ)",
    "static_ratio": "Static over kinetic friction coefficient, μs/μk",
    "drive": "Shaft speed over the velocity that the torque gives, Ω√(kJ)/Te",
    "natural": "Natural frequency of the driveline, √(k/J)/2π",
    "brake": "The kind of brake",
    "friction": "The friction law: Coulomb and tables are solved exactly, event by event",
    "periods": "Periods of the torque that are run; the last of them, up to 50, are evaluated",
    "shown": "Periods of the torque in the time history and the phase portrait",
}


@dataclass(frozen=True)
class Row:
    """One parameter with its display and its input.

    kind      : "number", "choice", "switch", "list", or "fixed" for a value that cannot be set
    low, high : ends of the slider of a number; ``log``: along equal ratios
    choices   : (kind, words) of a choice
    enabled   : False if a group cannot be set for this machine; ``hint`` says why
    """

    name: str
    kind: str
    value: Any
    unit: str = ""
    hint: str = ""
    low: float = 0.0
    high: float = 1.0
    log: bool = False
    whole: bool = False
    choices: tuple[tuple[str, str], ...] = ()
    enabled: bool = True

    @property
    def title(self) -> str:
        """Symbol and words."""
        return f"{symbol(self.name)}  {label(self.name)}".strip()


def sections(state: PageState) -> dict[str, list[Row]]:
    """Return the rows of the system by section title.

    Groups and values that are not defined for this machine have no row.
    """
    system = state.system
    groups = system.groups.as_dict()
    natural = system.driveline.natural_frequency / (2.0 * math.pi)
    torque = _of_part(state, system.excitation)
    torque += [Row("natural", "fixed", natural, "Hz", _HINTS["natural"])] if natural > 0.0 else []
    return {
        "Normalised groups": [
            *(_group(state, name) for name in SETTERS if groups[name] is not None),
            *(
                Row(name, "fixed", groups[name], "", _HINTS[name])
                for name in ("loss_factor", "static_ratio", "drive")
                if groups[name] is not None
            ),
        ],
        "Brake": [_choice("brake", system.brake.kind, Brake.kinds), *_of_part(state, system.brake)],
        "Actuation": _of_part(state, system.actuation),
        "Torque": torque,
        "Friction": [
            _choice("friction", system.friction.kind, Friction.kinds),
            *_of_part(state, system.friction),
        ],
        "Driveline": _of_part(state, system.driveline),
        "Run": [_number(state, name) for name in ("periods", "shown", *INITIAL)],
    }


def symbol(name: str) -> str:
    """Return the symbol of a parameter; empty if it has none."""
    return _WORDS[name][0] if name in _WORDS else ""


def label(name: str) -> str:
    """Return the short label of a parameter."""
    return _WORDS[name][1] if name in _WORDS else name.replace("_", " ")


def parameter_axis(state: PageState, name: str) -> ParameterAxis:
    """The range of a parameter as an axis of a plot.

    Raises ``InputError`` for a parameter that the system does not have.
    """
    low, high = span(state, name)
    unit = sweepable(state.system).get(name, ("1", ""))[0]
    log = scale(name) == "log" and low > 0.0
    return ParameterAxis(name, low, high, log, symbol(name), label(name), unit)


def _of_part(state: PageState, part: Part) -> list[Row]:
    """Return rows of all fields of a part; the radius, common to all brakes, is last."""
    # Fields that the solvers of the page do not support keep their defaults.
    names = [name for name in type(part).model_fields if name not in part.later]
    if isinstance(part, Brake):
        names.sort(key=lambda name: name == "radius")
    return [_of_field(state, name, type(part).model_fields[name]) for name in names]


def _of_field(state: PageState, name: str, one: FieldInfo) -> Row:
    if is_numeric(one):
        return _number(state, name)
    value, hint = state.value(name), _sentence(one)
    if one.annotation is bool:
        return Row(name, "switch", bool(value), hint=hint)
    return Row(name, "list", tuple(value), _unit(one), hint)


def _unit(one: FieldInfo) -> str:
    return unit_of(one).replace("^2", "²")


def _number(state: PageState, name: str) -> Row:
    """Return a row whose slider includes the value even if it lies outside the plots."""
    value, log = float(state.value(name)), scale(name) == "log"
    low, high = extended(span(state, name), value, scale(name))
    one = field(state.system, name)
    unit, hint = (_unit(one), _sentence(one)) if one is not None else ("", "")
    if name in INITIAL:
        unit, hint = INITIAL[name].unit, capitalized(INITIAL[name].meaning)
    if unit == "rad":
        hint += f". {value:.6g} rad = {math.degrees(value):.4g}°"
    whole = name in ("periods", "shown")
    return Row(
        name, "number", value, unit, _HINTS.get(name, hint), low, high, log, whole
    )  # fmt: skip


def _group(state: PageState, name: str) -> Row:
    setter, row = SETTERS[name], _number(state, name)
    try:
        setter.value(state.system, row.high)
    except InputError as error:
        return replace(row, enabled=False, hint=str(error).removeprefix("groups."))
    target = field(state.system, setter.target)
    sets = label(setter.target) if target is None else _printed(target.description or "")
    hint = f"{capitalized(_printed(setter.meaning))}. Setting it changes the {sets}"
    return replace(row, hint=hint)


def _choice(name: str, kind: str, kinds: dict[str, Any]) -> Row:
    # The paper's own brake first; the others as they were declared.
    ordered = sorted(kinds, key=lambda one: one != "wedge")
    choices = tuple((one, _KINDS.get(one, one.replace("-", " "))) for one in ordered)
    return Row(name, "choice", kind, hint=_HINTS[name], choices=choices)


def _sentence(one: FieldInfo) -> str:
    words = _printed(one.description or "")
    return words if words.startswith("tan(") else capitalized(words)


def _printed(words: str) -> str:
    """Return words with their symbols as printed."""
    for word, greek in _GREEK.items():
        words = re.sub(rf"\b{word}\b", greek, words)
    return re.sub(r"(?<=[A-Za-z])_(?=[a-z0-9])", "", words)

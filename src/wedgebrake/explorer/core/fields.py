"""The machine as rows of a panel: what can be changed, in which words and within which range."""

from __future__ import annotations

import math
import re
from typing import Any

from pydantic.fields import FieldInfo

from wedgebrake.errors import InputError
from wedgebrake.explorer.core.parameter_ranges import field, reaching, scale, span
from wedgebrake.explorer.core.state import Desk
from wedgebrake.model.brakes import Brake
from wedgebrake.model.friction import Friction
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.part import Part
from wedgebrake.model.sweep_settings import INITIAL
from wedgebrake.model.validation import labels

__all__ = ["label", "scale", "sections", "span", "symbol"]

Row = dict[str, Any]

# Symbol (HTML) and a word or two, by name.
_WORDS: dict[str, tuple[str, str]] = {
    "eta": ("&eta;", "force slope"),
    "f": ("f", "frequency"),
    "F0": ("F<sub>0</sub>", "initial force"),
    "alpha": ("&alpha;", "wedge angle"),
    "loss_factor": ("c/&radic;<span class='over'>kJ</span>", "loss factor"),
    "static_ratio": ("&mu;<sub>s</sub>/&mu;<sub>k</sub>", "static over kinetic"),
    "drive": ("&Omega;&radic;<span class='over'>kJ</span>/T<sub>e</sub>", "drive"),
    "brake": ("", "kind"),
    "radius": ("R", "radius"),
    "angle": ("&alpha;<sub>w</sub>", "wedge angle"),
    "wrap_angle": ("&beta;", "wrap angle"),
    "actuation_arm": ("a", "force arm"),
    "normal_arm": ("b", "normal arm"),
    "friction_arm": ("d", "friction arm"),
    "initial_force": ("F<sub>a0</sub>", "initial force"),
    "slope": ("&delta;", "slope"),
    "release": ("", "releases below zero force"),
    "amplitude": ("T<sub>e</sub>", "amplitude"),
    "frequency": ("f<sub>e</sub>", "frequency"),
    "natural": ("f<sub>n</sub>", "natural frequency"),
    "friction": ("", "law"),
    "kinetic": ("&mu;<sub>k</sub>", "kinetic"),
    "static": ("&mu;<sub>s</sub>", "static"),
    "decay": ("&sigmaf;", "peak decay"),
    "steepness": ("&xi;", "steepness"),
    "speeds": ("v<sub>r</sub>", "speeds"),
    "coefficients": ("&mu;<sub>k</sub>", "coefficients"),
    "inertia": ("J", "inertia"),
    "damping": ("c", "damping"),
    "stiffness": ("k", "stiffness"),
    "drive_speed": ("&Omega;", "shaft speed"),
    "periods": ("", "periods run"),
    "shown": ("", "periods shown"),
    "initial_angle": ("&theta;<sub>0</sub>", "start angle"),
    "initial_velocity": ("&theta;&prime;<sub>0</sub>", "start velocity"),
}
_KINDS = {
    "leading-shoe": "leading shoe",
    "coulomb": "Coulomb, exact",
    "smoothed": "smoothed (tanh)",
    "tabulated": "table over speed",
}
# Words of formulas as they are printed; the others lose their underscore.
_GREEK = {"delta": "δ", "mu_k": "μk", "mu_s": "μs", "sqrt": "√"}
_HINTS = {
    "loss_factor": "Loss factor of the driveline, c/√(kJ)",
    "static_ratio": "Static over kinetic friction coefficient, μs/μk",
    "drive": "Shaft speed over the velocity that the torque gives, Ω√(kJ)/Te",
    "natural": "Natural frequency of the driveline, √(k/J)/2π",
    "brake": "The kind of brake",
    "friction": "The friction law: Coulomb and tables are solved exactly, event by event",
    "periods": "Periods of the torque that are run; the last of them, up to 50, are judged",
    "shown": "Periods of the torque in the time history and the phase portrait",
}
# A slider has so many steps, about; a step of a logarithmic one is this share of the value.
_STEPS, _SHARE = 200.0, 0.02


def sections(desk: Desk) -> list[dict[str, Any]]:
    """The machine in sections: {name, title, rows}, all plain for JSON.

    A row is {name, label, symbol, unit, kind, value, low, high, scale, step, whole, choices,
    hint, enabled}; ``kind`` is "number", "choice", "switch", "list" or "fixed". What is not
    defined for this machine has no row.
    """
    system = desk.system
    groups = system.groups.as_dict()
    numbers = [_group(desk, name) for name in SETTERS if groups[name] is not None]
    beside = [
        _fixed(name, "1", groups[name])
        for name in ("loss_factor", "static_ratio", "drive")
        if groups[name] is not None
    ]
    natural = system.driveline.natural_frequency / (2.0 * math.pi)
    torque = _of_part(desk, system.excitation)
    torque += [_fixed("natural", "Hz", natural)] if natural > 0.0 else []
    brake = [_choice("brake", system.brake.kind, Brake.kinds), *_of_part(desk, system.brake)]
    law = [_choice("friction", system.friction.kind, Friction.kinds)]
    run = [_number(desk, name) for name in ("periods", "shown", *INITIAL)]
    found = (
        ("groups", "Normalised groups", numbers + beside),
        ("brake", "Brake", brake),
        ("actuation", "Actuation", _of_part(desk, system.actuation)),
        ("torque", "Torque", torque),
        ("friction", "Friction", law + _of_part(desk, system.friction)),
        ("driveline", "Driveline", _of_part(desk, system.driveline)),
        ("run", "Run", run),
    )
    return [{"name": name, "title": title, "rows": rows} for name, title, rows in found]


def symbol(name: str) -> str:
    """The symbol of a parameter in HTML; empty where it has none."""
    return _WORDS[name][0] if name in _WORDS else ""


def label(name: str) -> str:
    """A parameter in a word or two."""
    return _WORDS[name][1] if name in _WORDS else name.replace("_", " ")


def _of_part(desk: Desk, part: Part) -> list[Row]:
    """Rows of all fields of a part; of a brake the radius, which all have, comes last."""
    names = list(type(part).model_fields)
    if isinstance(part, Brake):
        names.sort(key=lambda name: name == "radius")
    return [_of_field(desk, name, type(part).model_fields[name]) for name in names]


def _of_field(desk: Desk, name: str, one: FieldInfo) -> Row:
    if one.annotation is float:
        return _number(desk, name)
    value = desk.value(name)
    if one.annotation is bool:
        return _row(name, "1", "switch", bool(value), hint=_sentence(one))
    return _row(name, labels(one).get("unit", "1"), "list", list(value), hint=_sentence(one))


def _row(name: str, unit: str, kind: str, value: Any, **more: Any) -> Row:
    return {
        "name": name, "label": label(name), "symbol": symbol(name), "kind": kind,
        "unit": "" if unit in ("1", "-") else unit.replace("^2", "²"), "value": value,
        "low": None, "high": None, "scale": "linear", "step": None, "whole": False,
        "choices": [], "hint": _HINTS.get(name, ""), "enabled": True, **more,
    }  # fmt: skip


def _number(desk: Desk, name: str) -> Row:
    """A row with a slider, which reaches to the value even where pictures do not."""
    value, how = float(desk.value(name)), scale(name)
    low, high = reaching(span(desk, name), value, how)
    whole = name in ("periods", "shown")
    step = _SHARE * abs(value) if how == "log" else (high - low) / _STEPS
    one = field(desk.system, name)
    unit, hint = (labels(one).get("unit", "1"), _sentence(one)) if one is not None else ("1", "")
    if name in INITIAL:
        unit, hint = INITIAL[name].unit, _upper(INITIAL[name].meaning)
    if unit == "rad":
        hint += f". {value:.6g} rad = {math.degrees(value):.4g}°"
    return _row(
        name, unit, "number", value, low=low, high=high, scale=how, whole=whole,
        step=1.0 if whole else _round_step(step or low * _SHARE), hint=_HINTS.get(name, hint),
    )  # fmt: skip


def _group(desk: Desk, name: str) -> Row:
    setter = SETTERS[name]
    row = _number(desk, name)
    try:
        setter.value(desk.system, row["high"])
    except InputError as error:
        return {**row, "enabled": False, "hint": str(error).removeprefix("groups.")}
    target = field(desk.system, setter.target)
    sets = label(setter.target) if target is None else _printed(target.description or "")
    return {**row, "hint": f"{_upper(_printed(setter.meaning))}. Setting it changes the {sets}"}


def _fixed(name: str, unit: str, value: float | None) -> Row:
    return _row(name, unit, "fixed", value)


def _choice(name: str, kind: str, kinds: dict[str, Any]) -> Row:
    # The paper's own kinds first, as they were declared.
    choices = [[one, _KINDS.get(one, one.replace("-", " "))] for one in _ordered(kinds)]
    return _row(name, "1", "choice", kind, choices=choices)


def _ordered(kinds: dict[str, Any]) -> list[str]:
    return sorted(kinds, key=lambda kind: kind != "wedge")


def _sentence(one: FieldInfo) -> str:
    return _upper(_printed(one.description or ""))


def _upper(words: str) -> str:
    return words if words.startswith("tan(") else words[:1].upper() + words[1:]


def _printed(words: str) -> str:
    """Words with their symbols as one would print them."""
    for plain, greek in _GREEK.items():
        words = re.sub(rf"\b{plain}\b", greek, words)
    return re.sub(r"(?<=[A-Za-z])_(?=[a-z0-9])", "", words)


def _round_step(step: float) -> float:
    """The largest of 1, 2, 5, 10, ... times a power of ten that is not larger."""
    power = 10.0 ** math.floor(math.log10(step)) if step > 0.0 else 1.0
    fits = [one for one in (1.0, 2.0, 5.0) if one * power <= step * (1.0 + 1e-9)]
    return float(f"{fits[-1] * power:.9g}") if fits else power

"""Units of the values of a system, also of those whose unit depends on other parts."""

from __future__ import annotations

from typing import Any

from pydantic.fields import FieldInfo

from wedgebrake.explorer.core.values import values_of
from wedgebrake.model.controller import COMMAND, Controller
from wedgebrake.model.display import unit_of
from wedgebrake.model.machine_parts import Contact
from wedgebrake.model.part import Part
from wedgebrake.model.signals.signals import Product, Signal

# Units of signals by the names of the values that they replace, otherwise that of torques; and the
# fields of signals with these units.
_SIGNALS = {"initial_force": "N", "base_speed": "rad/s", "speed": "rad/s", "scale": ""}
_IN_UNITS = ("amplitude", "value", "values", "start", "end")
# Of what a controller measures; and of its gains, which follow the unit of its output.
_MEASURED = {"angle": "rad", "speed": "rad/s", "torque": "N m", "force": "N"}
_GAINS = {
    "proportional": {"angle": "/rad", "speed": " s/rad", "torque": "/(N m)", "force": "/N"},
    "integral": {"angle": "/(rad s)", "speed": "/rad", "torque": "/(N m s)", "force": "/(N s)"},
    "derivative": {
        "angle": " s/rad", "speed": " s²/rad", "torque": " s/(N m)", "force": " s/N",
    },
}  # fmt: skip
# Of the factors of a normal force.
_NORMAL = {"angle": "N/rad", "speed": "N s/rad"}


def unit(one: FieldInfo | None) -> str:
    """The unit of a field, empty for none."""
    return "" if one is None else unit_of(one).replace("^2", "²")


def unit_of_value(system: Any, name: str) -> str:
    """The unit of a value of a system by name, empty for none.

    That of a signal is the unit of the value that it replaces; units of controllers follow from
    what they measure and on what they act.
    """
    value = values_of(system)[name]
    own, part = unit(value.field), system.parts()[value.section]
    if own:
        return own
    if isinstance(value.owner, Contact) and value.word == "normal":
        return _NORMAL.get(name.rpartition(".")[2], "")
    is_signal = isinstance(value.owner, Signal)
    if is_signal and (value.word not in _IN_UNITS or _is_factor(part, value.owner)):
        return ""
    if isinstance(part, Controller):
        return _of_controller(part, "setpoint" if is_signal else value.word)
    if not is_signal:
        return ""
    words = name.split(".")[1:-1]
    holders = [_SIGNALS[word] for word in words if word in _SIGNALS]
    return holders[-1] if holders else "N m"


def _of_controller(loop: Controller, word: str) -> str:
    kinds = {name.rpartition(".")[2] for name in loop.measured}
    out = "N" if loop.acts_on[1] == COMMAND else "N m"
    if word in ("limits", "resolution"):
        return out
    if len(kinds) > 1:  # the factors have units
        return ""
    (kind,) = kinds
    if word == "setpoint":
        return _MEASURED[kind]
    return f"{out}{_GAINS[word][kind]}" if word in _GAINS else ""


def _is_factor(part: Any, owner: Part, *, within: bool = False) -> bool:
    """True for a part within a product of signals, whose factors have units of their own."""
    if part is owner:
        return within
    inner = dict(part).values() if isinstance(part, Part) else part
    within = within or isinstance(part, Product)
    return isinstance(part, Part | tuple) and any(
        _is_factor(one, owner, within=within) for one in inner
    )

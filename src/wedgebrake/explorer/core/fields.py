"""The system as rows of the parameter panel: names, values, units and ranges."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from typing import Any

from pydantic.fields import FieldInfo

from wedgebrake.errors import InputError
from wedgebrake.explorer.core.formatting import number_text
from wedgebrake.explorer.core.parameter_ranges import extended, field, scale, span
from wedgebrake.explorer.core.state import PageState, axes
from wedgebrake.explorer.core.units import unit as field_unit
from wedgebrake.explorer.core.units import unit_of_value
from wedgebrake.explorer.core.values import (
    ShownValue,
    chosen_of,
    entry_of,
    following,
    groups_of,
    values_of,
    word_of,
)
from wedgebrake.figures.data.axes import ParameterAxis
from wedgebrake.figures.data.caption import capitalized
from wedgebrake.model.brakes import Brake
from wedgebrake.model.controller import Controller
from wedgebrake.model.friction import Friction
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.machine import KIND_WORDS
from wedgebrake.model.machine_matrices import natural_frequencies
from wedgebrake.model.machine_parts import GROUND
from wedgebrake.model.part import Part
from wedgebrake.model.signals.signals import Signal
from wedgebrake.model.studies.sweep_settings import sweepable
from wedgebrake.model.system import INITIAL
from wedgebrake.model.validation import is_number, labels

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
    "initial_speed": ("ω₀", "start speed"),
    "base_speed": ("Ω", "base speed"),
    "ratio": ("r", "gear ratio"),
    "teeth": ("z", "teeth, ring over sun"),
    "driven_speed": ("ω", "speed"),
    "measured": ("", "×"),
    "normal": ("", "per"),
    "phase": ("φ", "phase"),
    "lag": ("τ", "lag"),
    "lag_frequency": ("ωₐ", "lag frequency"),
    "damping_ratio": ("ζ", "lag damping"),
    "duration": ("", "length of the run"),
    "window": ("", "time shown"),
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
    "window": "Length of the end of the run in the time history and the phase portrait",
}
# Titles of the sections of drivelines, which show groups and kinds first; the run is the last one.
_TITLES = {
    "brake": "Brake", "actuation": "Actuation", "excitation": "Torque", "friction": "Friction",
    "driveline": "Driveline",
}  # fmt: skip
# Rows of a table that are shown.
_MOST_ROWS = 6
# Words for the two entries of a range.
_ENDS = {"gap": ("lower limit", "upper limit"), "limits": ("lower", "upper")}
_RUNS = ("periods", "shown", *INITIAL), ("duration", "window")


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

    symbol: str = ""
    words: str = ""

    @property
    def title(self) -> str:
        """Symbol and words."""
        return f"{self.symbol}  {self.words}".strip()


def sections(state: PageState) -> dict[str, list[Row]]:
    """Return the rows of the system by section title: groups, one section for each part, the run.

    Groups and values that are not defined for this system have no row.
    """
    system = state.system
    parts, chosen = system.parts(), chosen_of(system)
    found: dict[str, list[Row]] = {}
    groups = groups_of(system)
    if groups:
        found["Normalised groups"] = [
            *(_group(state, name) for name in SETTERS if groups[name] is not None),
            *(
                _fixed(name, groups[name])
                for name in ("loss_factor", "static_ratio", "drive")
                if groups[name] is not None
            ),
        ]
    order = [*(one for one in _TITLES if one in parts and groups), *parts]
    for name in dict.fromkeys(order):
        kinds = {one: part for one, part in chosen.items() if name in (one, one.partition(".")[0])}
        rows = []
        for one, part in kinds.items():
            rows += [_choice(one, part), *_rows(state, name, part)]
        rows += [
            row
            for key, value in values_of(system).items()
            if value.section == name and value.owner not in kinds.values()
            for row in _of_value(state, key, value)
        ]
        found[_title(name, parts[name]) if not groups else _TITLES[name]] = rows
    natural = natural_frequencies(system.machine)
    if natural.size == len(system.machine.inertias) == 1:
        section = "Torque" if groups else next(iter(found))
        found[section].append(_fixed("natural", float(natural[0]) / (2.0 * math.pi), "Hz"))
    found["Run"] = [_number(state, name) for name in _RUNS[0 if state.counted else 1]]
    return {title: rows for title, rows in found.items() if rows}


def _rows(state: PageState, section: str, part: Part) -> list[Row]:
    """Return rows of all fields of a brake or friction law; the radius, common to all, is last."""
    found = [
        (name, one)
        for name, one in values_of(state.system).items()
        if one.section == section and one.owner == part
    ]
    found.sort(key=lambda pair: word_of(state.system, pair[0]) == "radius")
    return [row for name, one in found for row in _of_value(state, name, one)]


def _title(name: str, part: Any) -> str:
    """The title of the section of a part of a machine."""
    kind = capitalized(KIND_WORDS.get(part.table, (part.table, ""))[0])
    if isinstance(part, Controller):
        return f"{kind} {name} → {part.output}"
    given = getattr(part, "ends", ("on", "relative_to", "a", "b"))
    ends = [one for end in given if (one := getattr(part, end, None)) is not None]
    joined = [one for one in ends if one != GROUND]
    where = f" on {joined[0]}" if len(joined) == 1 else f" {' – '.join(joined)}" if joined else ""
    defaults = ("-".join(ends), f"{ends[0]}-{part.table}") if ends else ()
    return f"{kind}{where}" if name in defaults else f"{kind} {name}{where}"


def symbol(name: str) -> str:
    """Return the symbol of a parameter; empty if it has none."""
    return _WORDS[name][0] if name in _WORDS else ""


def _symbol_and_words(state: PageState, name: str) -> tuple[str, str]:
    """Return symbol and short label of a parameter, the latter without its part."""
    word = word_of(state.system, name)
    value = values_of(state.system).get(name)
    if word in _WORDS:
        found = _WORDS[word]
    else:
        sign = str(labels(value.field).get("symbol", "-")) if value is not None else "-"
        found = (
            sign if len(sign) < 2 and sign != "-" else "",
            word.removeprefix("signal ").replace("_", " "),
        )
    if value is None:
        return found
    entry = entry_of(state.system, name)
    if entry in ("0", "1") and value.word in _ENDS:
        found = (found[0], f"{found[1]}, {_ENDS[value.word][int(entry)]}")
    elif entry:
        found = (found[0], f"{found[1]} {_numbered(entry)}")
    inner = name.removesuffix(f".{entry}").split(".")[1:-1] if entry else name.split(".")[1:-1]
    within = [_numbered(one) for one in inner if one not in ("signals", "signal")]
    if not within:
        return found
    # The symbol of an amplitude is that of a torque.
    sign = "" if word == "amplitude" and isinstance(value.owner, Signal) else found[0]
    return sign, f"{' '.join(within)}, {found[1]}"


def _numbered(word: str) -> str:
    """A word of a dotted name, or the number of an entry, which counts from 1 in text."""
    return f"no. {int(word) + 1}" if word.isdecimal() else word.replace("_", " ")


def parameter_axis(state: PageState, name: str) -> ParameterAxis:
    """The range of a parameter as an axis of a plot.

    Raises ``InputError`` for a parameter that the system does not have.
    """
    low, high = span(state, name)
    known = name in values_of(state.system)
    unit = (unit_of_value if known else _unit_swept)(state.system, name)
    log = scale(state, name) == "log" and low > 0.0
    sign, words = _symbol_and_words(state, name)
    part, dot, _ = name.partition(".")
    if dot:
        # With their part, which distinguishes the parameters of a machine.
        sign, words = (f"{part} {sign}", words) if sign else ("", f"{part}: {words}")
    return ParameterAxis(name, low, high, log, sign, words, unit)


def axis_choices(state: PageState) -> dict[str, dict[str, str]]:
    """The parameters that plots can go over: symbol and words by heading, with their names."""
    found: dict[str, dict[str, str]] = {}
    for name in axes(state.system):
        sign, words = _symbol_and_words(state, name)
        part, dot, _ = name.partition(".")
        heading = part if dot else "Groups" if name in SETTERS else "Parameters"
        text = f"{part}: {words}  {sign}".strip() if dot else f"{sign}  {words}".strip()
        found.setdefault(heading, {})[text] = name
    return found


def _fixed(name: str, value: Any, unit: str = "") -> Row:
    return Row(name, "fixed", value, unit, _HINTS[name], symbol=symbol(name))


def _of_value(state: PageState, name: str, value: ShownValue) -> list[Row]:
    """Return the row of a value; none for names, ends of parts and other texts."""
    one, hint = value.value, _sentence(value.field)
    sign, words = _symbol_and_words(state, name)
    if value.choices:
        return [Row(name, "choice", one, hint=hint, choices=value.choices, symbol=sign,
                    words=words)]  # fmt: skip
    if isinstance(one, bool):
        return [Row(name, "switch", one, hint=hint, symbol=sign, words=words)]
    if is_number(one):
        return [_number(state, name)]
    if isinstance(one, tuple):
        if f"{name}.0" in values_of(state.system):
            return []  # each of its numbers has a row
        unit = unit_of_value(state.system, name)
        if isinstance(value.owner, Signal) or not all(map(is_number, one)):
            return [Row(name, "text", _shown(one), unit, hint, symbol=sign, words=words)]
        return [Row(name, "list", one, unit, hint, symbol=sign, words=words)]
    return []


def _shown(rows: tuple[Any, ...]) -> str:
    """Return a table of a signal as text: it is shown, and not edited."""
    if len(rows) > _MOST_ROWS:
        return f"{len(rows)} values, {number_text(min(rows))} to {number_text(max(rows))}"
    texts = [
        " ".join(map(number_text, row)) if isinstance(row, tuple) else number_text(row)
        for row in rows
    ]
    return "; ".join(texts) if any(isinstance(row, tuple) for row in rows) else ", ".join(texts)


def _unit_swept(system: Any, name: str) -> str:
    """The unit of a group or another quantity that can be swept."""
    return sweepable(system).get(name, ("1", ""))[0]


def _number(state: PageState, name: str) -> Row:
    """Return a row whose slider includes the value even if it lies outside the plots."""
    value, log = float(state.value(name)), scale(state, name) == "log"
    low, high = extended(span(state, name), value, scale(state, name))
    one = field(state, name)
    known = name in values_of(state.system)
    unit = unit_of_value(state.system, name) if known else "" if one is None else field_unit(one)
    hint = _sentence(one) if one is not None else ""
    if state.counted and name in INITIAL:
        unit, hint = INITIAL[name].unit, capitalized(INITIAL[name].meaning)
    unit = "s" if name == "window" else unit
    if unit == "rad":
        hint += f". {value:.6g} rad = {math.degrees(value):.4g}°"
    whole = name in ("periods", "shown") or isinstance(state.value(name), int)
    sign, words = _symbol_and_words(state, name)
    hint, follows = _HINTS.get(name, hint), name in following(state.system)
    hint = f"{hint}. It follows from other bodies by a joint" if follows else hint
    return Row(
        name, "number", value, unit, hint, low, high, log, whole, enabled=not follows, symbol=sign,
        words=words,
    )  # fmt: skip


def _group(state: PageState, name: str) -> Row:
    setter, row = SETTERS[name], _number(state, name)
    try:
        setter.value(state.system, row.high)
    except InputError as error:
        return replace(row, enabled=False, hint=str(error).removeprefix("groups."))
    target = field(state, setter.target)
    sets = setter.target if target is None else _printed(target.description or "")
    hint = f"{capitalized(_printed(setter.meaning))}. Setting it changes the {sets}"
    return replace(row, hint=hint)


def _choice(name: str, part: Brake | Friction) -> Row:
    # The paper's own brake first; the others as they were declared.
    ordered = sorted(type(part).kinds, key=lambda one: one != "wedge")
    choices = tuple((one, _KINDS.get(one, one.replace("-", " "))) for one in ordered)
    table, (sign, words) = part.table, _WORDS[part.table]
    if name != table:
        words = f"{table} {words}" if words == "kind" else words
    return Row(name, "choice", part.kind, hint=_HINTS[table], choices=choices, symbol=sign,
               words=words)  # fmt: skip


def _sentence(one: FieldInfo) -> str:
    words = _printed(one.description or "")
    return words if words.startswith("tan(") else capitalized(words)


def _printed(words: str) -> str:
    """Return words with their symbols as printed."""
    for word, greek in _GREEK.items():
        words = re.sub(rf"\b{word}\b", greek, words)
    return re.sub(r"(?<=[A-Za-z])_(?=[a-z0-9])", "", words)

"""Captions of pictures: the system with its groups, the method, the run settings."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from wedgebrake.analysis.linear_stability import AXES as LINEAR
from wedgebrake.analysis.responses.spectrum import is_driven
from wedgebrake.figures import style
from wedgebrake.figures.data.parts import selected_part
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.system import PARTS
from wedgebrake.sweeps.plan import CROSSING
from wedgebrake.sweeps.results import CONTACT, INERTIA

if TYPE_CHECKING:
    import xarray as xr

# The SI parameters that each group depends on: a sweep over one of them changes the group.
_DEPENDS = {
    **{name: {setter.target, *setter.reads} for name, setter in SETTERS.items()},
    "loss_factor": {"damping", "stiffness", "inertia"},
    "kinetic": {"kinetic"},
    "static_ratio": {"static", "kinetic"},
    "drive": {"drive_speed", "stiffness", "inertia", "amplitude"},
}
_METHODS = {"exact": "exact solution", "smooth": "adaptive solution", "ode14x": "ODE14x scheme"}
# The method smooth where it has no tolerance: machines, and the curves of set-valued laws.
_CURVES = "Taylor series to rounding"
# Largest number of names of one kind in a sentence; more are counted.
_MOST_NAMES = 6
# Object that was continued over parameters, by the kind of dataset.
_FOLLOWED = {
    "orbits": "periodic orbits", "boundary": "a bifurcation", "response_curve": "periodic orbits",
}  # fmt: skip


def sentences(dataset: xr.Dataset, names: Sequence[str]) -> list[str]:
    """Sentences about a result: the system with its groups; method and run settings.

    names : the swept parameters
    """
    first = _system(dataset, names)
    return list(filter(None, (first, capitalized(method_and_settings(dataset, names)))))


def of_response(dataset: xr.Dataset) -> list[str]:
    """Sentences about one response: the system with its groups; method and initial state."""
    numbers = _system(dataset)
    if not method_words(dataset):
        return [numbers]
    options = _stated(dataset, "options")
    words = [method_words(dataset)]
    stated = (name for name in ("rtol", "step") if name in options)
    words += [f"{name} {style.number(options[name])}" for name in stated]
    if isinstance(options.get("initial"), list):
        words.append(f"from {_state(options['initial'])}")
    return list(filter(None, (numbers, capitalized(", ".join(words)))))


def of_stability(dataset: xr.Dataset, names: Sequence[str]) -> str:
    """The system of a map of linear stability, with the groups that it depends on."""
    groups = _stated(dataset, "groups")
    numbers = equations({name: groups.get(name) for name in LINEAR if name not in names})
    return ": ".join(filter(None, (machine(_stated(dataset, "system")), numbers)))


def method_and_settings(dataset: xr.Dataset, names: Sequence[str]) -> str:
    """Method and run settings, as a clause."""
    protocol = _stated(dataset, "protocol")
    parts = [method_words(dataset)]
    followed = _FOLLOWED.get(str(dataset.attrs.get("kind")))
    if followed:
        parts.append(f"{followed} followed over {' and '.join(map(style.symbol, names))}")
    if protocol.get("periods") is not None:
        swept = {_parameter(name) for name in (*names, *fixed_parameters(dataset))}
        returns = "crossings" if protocol.get("returns") == CROSSING else "periods"
        driven = "amplitude" in swept or is_driven(dataset) or returns == "crossings"
        absent = "" if driven else " of a torque that does not act"
        parts.append(f"{protocol['periods']} {returns}{absent}{_left_out(protocol)}")
    initial = protocol.get("initial")
    chosen = {"initial_angle", "initial_velocity"} & {*names, *fixed_parameters(dataset)}
    if protocol.get("follow"):
        parts.append("each point from the end of its neighbour")
    elif isinstance(initial, list) and not chosen:
        parts.append(f"from {_state(initial)}")
    return "; ".join(filter(None, parts))


def _system(dataset: xr.Dataset, names: Sequence[str] = ()) -> str:
    """A system: its named parts, or brake and friction with the groups; and the fixed values."""
    parts = _named_parts(dataset)
    if parts:
        return f"Machine: {'; '.join([*parts, *_fixed(dataset)])}"
    return _numbers(dataset, names)


def _named_parts(dataset: xr.Dataset) -> list[str]:
    """The inertias and contacts that have names, and which of them are shown."""
    system, words = _stated(dataset, "system"), []
    for part in (INERTIA, CONTACT):
        names = [str(one.get("name")) for one in system.get(part, [])]
        shown = selected_part(dataset, part) if len(names) > 1 else None
        words += [listed(part, names) + (f" (shown: {shown})" if shown else "")] if names else []
    return words


def listed(part: str, names: Sequence[str]) -> str:
    """The names of the parts of one kind; a number if there are many: "inertias disc, hub"."""
    plural = part if len(names) == 1 else f"{part}s"
    if len(names) > _MOST_NAMES:
        return f"{len(names)} {plural}"
    return f"{plural} {', '.join(names)}"


def _fixed(dataset: xr.Dataset) -> list[str]:
    return [
        _equation(name, float(dataset[name]), str(dataset[name].attrs.get("units", "1")))
        for name in fixed_parameters(dataset)
    ]


def direction(dataset: xr.Dataset, branch: str) -> str:
    """A branch in words: which parameter increases or decreases."""
    followed = _stated(dataset, "protocol").get("follow")
    if not (followed and branch):
        return branch
    words = {"up": "increasing", "down": "decreasing"}
    return f"{style.symbol(str(followed))} {words.get(branch, branch)}"


def machine(system: Mapping[str, Any]) -> str:
    """Brake and friction of a system, from its tables: "Wedge brake, Coulomb friction"."""
    words = []
    for part in ("brake", "friction"):
        table = system.get(part)
        if isinstance(table, dict) and "kind" in table:
            # The kind of a custom part is the name of its class: MyBrake, my brake.
            kind = re.sub(r"(?<=.)([A-Z])", r" \1", str(table["kind"])).replace("-", " ").lower()
            words.append(f"{kind.removesuffix(part).strip()} {part}".strip())
    return capitalized(", ".join(words)).replace("coulomb", "Coulomb")


def method_words(dataset: xr.Dataset) -> str:
    """The method of a result in words, or its name."""
    method = str(dataset.attrs.get("method", ""))
    if method == "smooth" and not _has_tolerance(dataset):
        return _CURVES
    return _METHODS.get(method, method)


def _has_tolerance(dataset: xr.Dataset) -> bool:
    """Return True if the method smooth integrated with a tolerance, not the solver of machines."""
    if _named_parts(dataset) or "returns" in _stated(dataset, "protocol"):
        return False
    return "options" not in dataset.attrs or "rtol" in _stated(dataset, "options")


def equations(groups: Mapping[str, float | None]) -> str:
    """Groups with their values, without undefined ones and the speed of a shaft at rest."""
    return ", ".join(
        _equation(name, value)
        for name, value in groups.items()
        if value is not None and not (name == "drive" and value == 0.0)
    )


def _equation(name: str, value: float, unit: str = "1") -> str:
    """A value for running text, with its unit."""
    text = f"{style.symbol(name)} = {style.number(value)}{'' if unit == '1' else f' {unit}'}"
    return text.replace(" ", "\N{NO-BREAK SPACE}")


def _numbers(dataset: xr.Dataset, names: Sequence[str] = ()) -> str:
    changed = {_parameter(name) for name in (*names, *fixed_parameters(dataset))}
    stated = _stated(dataset, "groups").items()
    groups = {key: value for key, value in stated if not changed & _DEPENDS.get(key, {key})}
    values = _fixed(dataset)
    # The steepness of a smoothed law changes its stability limits, and is not a group.
    steepness = _stated(dataset, "system").get("friction", {}).get("steepness")
    if steepness is not None and "steepness" not in changed:
        values.append(_equation("steepness", float(steepness), "s/m"))
    numbers = ", ".join(filter(None, (equations(groups), *values)))
    return ": ".join(filter(None, (machine(_stated(dataset, "system")), numbers)))


def fixed_parameters(dataset: xr.Dataset) -> list[str]:
    """Parameters with one value selected from the sweep."""
    return [
        str(name)
        for name, value in dataset.coords.items()
        if value.ndim == 0 and value.dtype.kind in "iuf" and name != "period"
    ]


def _parameter(name: str) -> str:
    """The SI parameter that a coordinate changes: set by a group, or of the same name."""
    return SETTERS[name].target if name in SETTERS else swept_name(name)


def swept_name(name: str) -> str:
    """The parameter or group of a coordinate.

    A coordinate begins with the part, as in "brake_angle", where a result has the parameter's
    name.
    """
    part, _, own = name.partition("_")
    return own if part in PARTS else name


def _left_out(protocol: Mapping[str, Any]) -> str:
    """The periods that the picture leaves out."""
    transient, most = protocol.get("transient"), protocol.get("limit")
    if transient is None:
        return ""
    if transient != "auto":
        return f", the first {transient} left out"
    longest = "" if most is None else f", at most {most}"
    return f" after a transient as long as needed{longest}"


def _state(values: Sequence[float]) -> str:
    return f"({', '.join(map(style.number, values))})"


def capitalized(words: str) -> str:
    """Words with a capital letter."""
    return words[:1].upper() + words[1:]


def _stated(dataset: xr.Dataset, name: str) -> dict[str, Any]:
    """An attribute that holds a JSON object; {} if it is missing or something else."""
    try:
        found = json.loads(dataset.attrs.get(name, "{}"))
    except (TypeError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}

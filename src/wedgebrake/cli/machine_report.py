"""Report on a response of a machine, as data for ``--json`` and as text."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.motion import motion
from wedgebrake.analysis.responses.contacts import contact_sentences, contact_summary
from wedgebrake.analysis.responses.machine_energy import energy_of_parts
from wedgebrake.analysis.responses.stopping import stopping
from wedgebrake.cli.output import describe, event_counts, events_line, header
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.solvers.machine.final_state import final_state

if TYPE_CHECKING:
    import xarray as xr

_STOPPING = (
    "stop_angle", "sliding_angle", "heat", "sliding_time", "mean_torque", "peak_torque", "rms_jerk",
    "peak_jerk",
)  # fmt: skip
# A speed below this share of the largest one is rounding, and printed as 0.
_ROUNDING = 1e-12
# Largest number of returns after a run in which its motion has to settle, for its class.
_MOST_RETURNS = 256
_ENERGIES = ("torque_work", "base_work", "friction_heat", "viscous_loss")


def response_report(machine: Machine, response: xr.Dataset) -> dict[str, Any]:
    """The data of ``simulate --json``."""
    attrs, state = response.attrs, final_state(response)
    contacts = contact_summary(response)
    names = response["contact"].to_numpy()
    balance = _balance(machine, response)
    return {
        **header(machine),
        "method": attrs["method"],
        "status": attrs["status"],
        "message": attrs["message"],
        "start_time": attrs["start_time"],
        "at_rest": bool(attrs["at_rest"]),
        "final": {"time": state.time, "angles": state.angles, "speeds": state.speeds},
        "largest_speed": float(np.max(np.abs(response["velocity"].to_numpy()), initial=0.0)),
        "contacts": {
            str(name): {str(key): contacts[key].to_numpy()[i] for key in contacts.data_vars}
            for i, name in enumerate(names)
        },
        "events": event_counts(response),
        "sticks": {
            "contact": names[response["stick_contact"].to_numpy()],
            **{
                name: response[f"stick_{name}"].to_numpy()
                for name in ("start", "end", "entry", "exit")
            },
        },
        "motion": _motion(machine, response),
        "energy": balance,
        "stopping": _stopping(response),
        "summary": contact_sentences(response),
    }


def _motion(machine: Machine, response: xr.Dataset) -> dict[str, Any] | None:
    """The class of the motion that a run leads to; None unless it soon settles."""
    if response.attrs["status"] != "completed" or response.attrs["at_rest"]:
        return None
    settings: Any = {"limit": _MOST_RETURNS, "method": response.attrs["method"]}
    try:
        found = motion(machine, initial=final_state(response), **settings)
    except InputError:  # signals that do not repeat
        return None
    return found.as_dict() if found.settled else None


def _stopping(response: xr.Dataset) -> dict[str, Any] | None:
    """Measures of the stop; None if the machine does not come to rest or cannot be repeated."""
    try:
        found = stopping(response, ringdown=0.0, windows=1)
    except InputError:
        return None
    found = found.isel(phase=0)  # of jerks, those of the braking
    by_part = {name: found[name].to_series().to_dict() for name in _STOPPING}
    for name in json.loads(found.attrs["moving_bases"]):
        by_part["stop_angle"].pop(name)  # it turns by its vibration only; its base slides
    return {"stop_time": float(found["stop_time"]), **by_part}


def _balance(machine: Machine, response: xr.Dataset) -> dict[str, Any] | None:
    """Work and heat of each part [J]; None if the run cannot be repeated."""
    try:
        energy = energy_of_parts(response)
    except InputError:
        return None
    found: dict[str, Any] = {name: energy[name].to_series().to_dict() for name in _ENERGIES}
    found |= {name: float(energy[name]) for name in ("stored_change", "residual", "rounding")}
    return found | {"note": energy.attrs["note"]}


def response_text(machine: Machine, report: dict[str, Any]) -> str:
    """The text of ``simulate``."""
    final = report["final"]
    span = f"{report['start_time']:.6g} to {final['time']:.6g} s"
    response = f"Response ({report['method']}), {span}: {report['message']}"
    lines = [describe(machine), "", response]
    lines += [f"  {sentence}" for sentence in report["summary"]]
    lines.append(events_line(report))
    if report["energy"]:
        lines += _energy_text(report["energy"])
    if report["stopping"]:
        lines.append(_stopping_text(report["stopping"]))
    least = _ROUNDING * report["largest_speed"]
    speeds = {name: 0.0 if abs(one) <= least else one for name, one in final["speeds"].items()}
    states = [
        f"{name} {angle:.9g} rad, {speeds[name]:.9g} rad/s"
        for name, angle in final["angles"].items()
    ]
    lines.append(f"  state at t = {final['time']:.6g} s: {'; '.join(states)}")
    if report["motion"]:
        lines.append(f"  if continued, the motion settles to: {_motion_text(report['motion'])}")
    return "\n".join(lines)


def _motion_text(found: dict[str, Any]) -> str:
    text = str(found["word"])
    if found["self_excited"] and found["order"]:
        text += f" of period {found['period']:.6g} s"
    same = (
        found["stick_class"] in ("not computed", found["word"]) or found["kind"] == "steady sliding"
    )
    return text if same else f"{text}, {found['stick_class']}"


def _stopping_text(found: dict[str, Any]) -> str:
    words = {
        "stop_angle": "rad turned", "sliding_angle": "rad of sliding",
        "mean_torque": "N m on average", "peak_torque": "N m at most",
    }  # fmt: skip
    parts = [f"  stop after {found['stop_time']:.6g} s"]
    for name, unit in words.items():
        values = {key: one for key, one in found[name].items() if np.isfinite(one)}
        if values:
            parts.append(", ".join(f"{key} {one:.5g} {unit}" for key, one in values.items()))
    return "; ".join(parts)


def _energy_text(energy: dict[str, Any]) -> list[str]:
    words = {
        "torque_work": "work of torques",
        "base_work": "work of moving bases",
        "friction_heat": "heat of contacts",
        "viscous_loss": "heat of shafts",
    }
    parts = []
    for name, meaning in words.items():
        values = {key: value for key, value in energy[name].items() if value != 0.0}
        if values:
            each = ", ".join(f"{key} {value:.5g} J" for key, value in values.items())
            parts.append(f"{meaning}: {each}")
    stored = f"stored energy changes by {energy['stored_change']:.5g} J"
    line = f"  energy: {'; '.join([*parts, stored])} (residual {energy['residual']:.1g} J)"
    return [line, f"  {energy['note']}"] if energy["note"] else [line]

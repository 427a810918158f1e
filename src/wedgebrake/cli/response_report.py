"""Report on a response, as data for ``--json`` and as text.

The run and its final state; then the steady vibration, where whole periods of signals that repeat
are recorded, otherwise the stop and the work and heat of each part.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.linear_stability import stability
from wedgebrake.analysis.responses.sticking import AT_REST, span, steady_start, sticks
from wedgebrake.analysis.responses.torque import brake_torque
from wedgebrake.cli.output import describe, event_counts, events_line, header, nearly_zero
from wedgebrake.errors import InputError
from wedgebrake.model.controller import COMMAND
from wedgebrake.model.friction import SmoothFriction
from wedgebrake.model.torque_contacts import Drag
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
# Work and heat of each part, with their words.
_ENERGIES = {
    "torque_work": "work of torques",
    "control_work": "work of controllers",
    "base_work": "work of moving bases",
    "drive_work": "work of driven bodies",
    "friction_heat": "heat of contacts",
    "viscous_loss": "heat of shafts",
}
_STICKS = ("start", "end", "entry", "exit")


def response_report(system: Any, response: xr.Dataset) -> dict[str, Any]:
    """The data of ``simulate --json``."""
    attrs, signals = response.attrs, system.signals().values()
    report = {
        **header(system),
        **{name: attrs[name] for name in ("method", "status", "message")},
        "events": event_counts(response),
        "sticks": _sticks(response),
        "final": _final(system, response),
    }
    recorded = system.view.recorded and system.period
    repeats = recorded and all(one.frequencies() is not None for one in signals)
    return report | (_steady if repeats else _transient)(system, response)


def response_text(system: Any, report: dict[str, Any]) -> str:
    """The text of ``simulate``."""
    transient = "contacts" in report
    lines = _transient_text(system, report) if transient else _steady_text(system, report)
    return "\n".join([describe(system), "", *lines])


def _sticks(response: xr.Dataset) -> dict[str, Any]:
    """The sticks; of several contacts, each with the name of its contact."""
    found = {name: response[f"stick_{name}"].to_numpy() for name in _STICKS}
    if "stick_contact" not in response:
        return found
    return {"contact": response["contact"].to_numpy()[response["stick_contact"]], **found}


def _final(system: Any, response: xr.Dataset) -> dict[str, Any]:
    """The final state, as the view of the system shows it."""
    if system.view.single:
        return {name: response.attrs[f"final_{name}"] for name in ("time", "angle", "velocity")}
    state = final_state(response)
    return {"time": state.time, "angles": state.angles, "speeds": state.speeds}


def _by_part(values: Mapping[str, float], unit: str = "") -> str:
    """Values of parts in words, those that are zero or unknown left out: "disc 3.2 J"."""
    return ", ".join(
        f"{name} {one:.5g} {unit}".strip()
        for name, one in values.items()
        if np.isfinite(one) and one != 0.0
    )


def _state(final: dict[str, Any], least: float = 0.0) -> str:
    """The line of the state at the end: angle and speed of each part.

    least : a lower speed is rounding [rad/s]
    """
    if "angles" not in final:
        words = [f"angle {final['angle']:.9g} rad, velocity {final['velocity']:.9g} rad/s"]
    else:
        speeds = {name: 0.0 if abs(v) <= least else v for name, v in final["speeds"].items()}
        words = [
            f"{name} {angle:.9g} rad, {speeds[name]:.9g} rad/s"
            for name, angle in final["angles"].items()
        ]
    return f"  state at t = {final['time']:.6g} s: {'; '.join(words)}"


# The steady vibration, over the last fifth of a run with a recorded section.


def _steady(system: Any, response: xr.Dataset) -> dict[str, Any]:
    attrs, steady_from = response.attrs, steady_start(response)
    steady = sticks(response, steady_from)
    try:
        torque = asdict(brake_torque(response, steady_from))
    except InputError:  # too few samples
        torque = None
    driven, turns = not system.autonomous, system.driveline.drive_speed != 0.0
    repeats = _repetition(system, response) if driven else None
    kind = steady.attrs["class"]
    exits = response["stick_exit"].values
    # A torque ends most rests; a rest over the last fifth of a run counts as permanent.
    rests = not turns and (kind == AT_REST or not driven) and exits.size > 0 and exits[-1] == 0
    report: dict[str, Any] = {
        "options": json.loads(attrs["options"]),
        "stability": stability(system).as_dict(),
        "steady_from": steady_from,
        "stick_slip_class": kind,
        "stick_share": steady.attrs["share"],
        "brake_torque": torque,
        "poincare": {
            "period": response["period"].values,
            **{name: response[f"poincare_{name}"].values for name in ("time", "angle", "velocity")},
        },
        "rest_from": float(response["stick_start"].values[-1]) if rests else None,
        "repeats_after": repeats and {"periods": repeats[0], "distance": repeats[1]},
    }
    said = str(attrs["message"])
    if attrs["status"] == "completed":
        said = _summary(report, response, driven=driven, turns=turns)
    return {**report, "summary": said}


def _longest(response: xr.Dataset) -> int:
    """Largest number of periods after which the run could show a repetition."""
    from wedgebrake.analysis.classify import LONGEST

    last = response.sizes["period"] - 1
    return min(LONGEST, last // 3, last - 8)


def _repetition(system: Any, response: xr.Dataset) -> tuple[int, float] | None:
    """Number of torque periods after which the motion repeats, and the distance of ``order_of``.

    None if the motion does not repeat, or if the run is too short to show a repetition.
    """
    from wedgebrake.analysis.classify import order_of

    states = ("angle", "velocity")
    points = np.column_stack([response[f"poincare_{name}"].values for name in states])
    scale = np.array([system.driveline.natural_frequency, 1.0])
    late = response["time"].values >= steady_start(response)
    ranges = [np.ptp(response[name].values[late]) if late.any() else 0.0 for name in states]
    n, distance = order_of(points, scale, max(0.5 * float(scale @ ranges), 1e-300))
    return (n, distance) if n else None


def _summary(report: dict[str, Any], response: xr.Dataset, *, driven: bool, turns: bool) -> str:
    """The motion in one or two sentences.

    driven, turns : whether a signal varies, and whether the shaft turns
    """
    begun, kind = report["rest_from"], report["stick_slip_class"]
    since = "" if begun is None or begun == span(response)[0] else f"at rest from {begun:.4g} s"
    if kind == AT_REST:
        return f"The brake holds the driveline{since and ','} {since or 'at rest'}."
    late = response["velocity"].values[response["time"].values >= report["steady_from"]]
    late = np.append(late, response.attrs["final_velocity"])  # there may be no sample in this part
    # A brake that sticks to a turning shaft is not at rest.
    resting = "stuck" if turns else "at rest"
    words = (
        f"{kind[0].upper()}{kind[1:]} vibration, velocity between {late.min():.4g} and"
        f" {late.max():.4g} rad/s, {resting} {100 * report['stick_share']:.3g} % of the time"
    )
    length = response.attrs["final_time"] - report["steady_from"]
    words += f" (over the last {length:.3g} s)"
    if not driven:
        ends = f" It ends {since}." if since else ""
        return f"{words}.{ends} No torque acts: no repetition is searched for."
    if report["repeats_after"] is None:
        looked = _longest(response)
        too_short = "The run is too short to find after how many periods it repeats."
        nothing = f"It does not repeat within {looked} torque periods."
        return f"{words}. {too_short if looked < 1 else nothing}"
    n, distance = report["repeats_after"].values()
    every = "every torque period" if n == 1 else f"every {n} periods"
    return f"{words}. It repeats {every}" + (f" (to {distance:.0e})." if distance > 1e-6 else ".")


def _steady_text(system: Any, report: dict[str, Any]) -> list[str]:
    from wedgebrake.solvers.log_reader import SHORTEST_STICK

    friction, torque = system.friction, report["brake_torque"]
    lines = [
        f"Linear stability: {report['stability']['verdict']}",
        f"Response ({report['method']}): {report['summary']}",
    ]
    if report["status"] == "completed":  # otherwise the summary contains it
        lines.append(f"  {report['message']}")
    if isinstance(friction, SmoothFriction) and report["stick_share"] > 0.0:
        speed = friction.transition  # docs/numerics.md, "Classes of stick-slip"
        lines.append(
            "  with smooth friction the brake never rests exactly; stick and rest mean |sliding"
            f" speed| below {speed:.4g} m/s ({speed / system.brake.radius:.4g} rad/s) for longer"
            f" than {100 * SHORTEST_STICK:g} % of a torque period"
        )
    if torque and math.isfinite(torque["peak"]):
        sizes = (
            f"{name.replace('_', ' ')} {nearly_zero(torque[name], torque['peak']):.4g} N m"
            for name in ("mean", "mean_size", "peak")
        )
        lines.append(f"  brake torque: {', '.join(sizes)}")
    return [*lines, events_line(report), _state(report["final"])]


# Any other run: its contacts and its stop, the work and heat of its parts.


def _transient(system: Any, response: xr.Dataset) -> dict[str, Any]:
    from wedgebrake.analysis.responses.contacts import contact_sentences, contact_summary

    attrs, contacts = response.attrs, contact_summary(response)
    return {
        "start_time": attrs["start_time"],
        "at_rest": bool(attrs["at_rest"]),
        "largest_speed": float(np.max(np.abs(response["velocity"].to_numpy()), initial=0.0)),
        "contacts": {
            str(name): {str(key): contacts[key].to_numpy()[i] for key in contacts.data_vars}
            for i, name in enumerate(contacts["contact"].to_numpy())
        },
        "motion": _motion(system, response),
        "energy": _balance(response),
        "stopping": _stopping(response),
        **_reactions(response),
        "summary": contact_sentences(
            contacts, [one.name for one in system.machine.contacts if isinstance(one, Drag)]
        ),
    }


def _reactions(response: xr.Dataset) -> dict[str, Any]:
    """Outputs of controllers, torques of joints and driven bodies; none if not repeated."""
    from wedgebrake.analysis.responses.reactions import reaction_summary

    try:
        return reaction_summary(response)
    except InputError:
        return {}


def _motion(system: Any, response: xr.Dataset) -> dict[str, Any] | None:
    """The class of the motion that a run leads to; None unless it soon settles."""
    if response.attrs["status"] != "completed" or response.attrs["at_rest"]:
        return None
    settings: Any = {"limit": _MOST_RETURNS, "method": response.attrs["method"]}
    from wedgebrake.analysis.motion import motion

    try:
        found = motion(system, initial=final_state(response), **settings)
    except InputError:  # signals that do not repeat
        return None
    return found.as_dict() if found.settled else None


def _stopping(response: xr.Dataset) -> dict[str, Any] | None:
    """Measures of the stop; None if the machine does not come to rest or cannot be repeated."""
    from wedgebrake.analysis.responses.stopping import stopping

    try:
        found = stopping(response, ringdown=0.0, windows=1)
    except InputError:
        return None
    found = found.isel(phase=0)  # of jerks, those of the braking
    by_part = {name: found[name].to_series().to_dict() for name in _STOPPING}
    for name in json.loads(found.attrs["moving_bases"]):
        by_part["stop_angle"].pop(name)  # it turns by its vibration only; its base slides
    return {"stop_time": float(found["stop_time"]), **by_part}


def _balance(response: xr.Dataset) -> dict[str, Any] | None:
    """Work and heat of each part [J]; None if the run cannot be repeated."""
    from wedgebrake.analysis.responses.machine_energy import energy_of_parts

    try:
        energy = energy_of_parts(response)
    except InputError:
        return None
    found: dict[str, Any] = {
        name: energy[name].to_series().to_dict() for name in _ENERGIES if name in energy
    }
    found |= {name: float(energy[name]) for name in ("stored_change", "residual", "rounding")}
    return found | {"note": energy.attrs["note"]}


def _transient_text(system: Any, report: dict[str, Any]) -> list[str]:
    final = report["final"]
    span = f"{report['start_time']:.6g} to {final['time']:.6g} s"
    lines = [f"Response ({report['method']}), {span}: {report['message']}"]
    lines += [f"  {sentence}" for sentence in report["summary"]]
    lines += _reactions_text(system, report)
    lines.append(events_line(report))
    lines += _energy_text(report["energy"]) if report["energy"] else []
    lines += [_stopping_text(report["stopping"])] if report["stopping"] else []
    lines.append(_state(final, _ROUNDING * report["largest_speed"]))
    if report["motion"]:
        lines.append(f"  if continued, the motion settles to: {_motion_text(report['motion'])}")
    return lines


def _motion_text(found: dict[str, Any]) -> str:
    text = str(found["word"])
    if found["self_excited"] and found["order"]:
        text += f" of period {found['period']:.6g} s"
    same = (
        found["stick_class"] in ("not computed", found["word"]) or found["kind"] == "steady sliding"
    )
    return text if same else f"{text}, {found['stick_class']}"


def _reactions_text(system: Any, report: dict[str, Any]) -> list[str]:
    """Controllers, joints and driven bodies, one line for each."""
    begin, end = report["start_time"], report["final"]["time"]
    lines = []
    for name, one in report.get("controllers", {}).items():
        loop = system.parts()[name]
        unit = "N" if loop.acts_on[1] == COMMAND else "N m"
        low, high = one["lowest_output"], one["highest_output"]
        last = nearly_zero(one["final_output"], max(-low, high))
        words = (
            f"  {name}: output from {low:.4g} to {high:.4g} {unit}, {last:.4g} {unit} at the end"
        )
        if loop.limits is not None and end > begin:
            words += f"; at its limits {100.0 * one['time_at_limits'] / (end - begin):.3g} % of the"
            words += " time"
        lines.append(words)
    for kind in ("joints", "driven"):
        drives = "of its drive " if kind == "driven" else ""
        for name, one in report.get(kind, {}).items():
            lines.append(f"  {name}: torque {drives}up to {one['peak_torque']:.4g} N m")
    return lines


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
    each = {
        words: _by_part(energy[name], "J") for name, words in _ENERGIES.items() if name in energy
    }
    parts = [f"{words}: {values}" for words, values in each.items() if values]
    stored = f"stored energy changes by {energy['stored_change']:.5g} J"
    line = f"  energy: {'; '.join([*parts, stored])} (residual {energy['residual']:.1g} J)"
    return [line, f"  {energy['note']}"] if energy["note"] else [line]

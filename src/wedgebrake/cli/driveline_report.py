"""Report on a response of a driveline, as data for ``--json`` and as text."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.linear_stability import (
    stability,
)
from wedgebrake.analysis.responses.sticking import AT_REST, span, steady_start, sticks
from wedgebrake.analysis.responses.torque import brake_torque
from wedgebrake.cli.output import describe, event_counts, events_line, header, nearly_zero
from wedgebrake.errors import InputError
from wedgebrake.model.friction import SmoothFriction
from wedgebrake.model.system import BrakedDriveline

if TYPE_CHECKING:
    import xarray as xr


def response_report(system: BrakedDriveline, response: xr.Dataset) -> dict[str, Any]:
    """The data of ``simulate --json``."""
    attrs, steady_from = response.attrs, steady_start(response)
    steady = sticks(response, steady_from)
    try:
        torque = asdict(brake_torque(response, steady_from))
    except InputError:  # too few samples
        torque = None
    driven = system.excitation.amplitude > 0.0
    repeats = repetition(system, response) if driven else None
    kind = steady.attrs["class"]
    exits = response["stick_exit"].values
    # A torque ends most rests; a rest over the last fifth of a run counts as permanent.
    rests = (
        system.driveline.drive_speed == 0.0
        and (kind == AT_REST or not driven)
        and exits.size > 0
        and exits[-1] == 0
    )
    report: dict[str, Any] = {
        **header(system),
        "method": attrs["method"],
        "options": json.loads(attrs["options"]),
        "status": attrs["status"],
        "message": attrs["message"],
        "final": {name: attrs[f"final_{name}"] for name in ("time", "angle", "velocity")},
        "stability": stability(system).as_dict(),
        "steady_from": steady_from,
        "stick_slip_class": kind,
        "stick_share": steady.attrs["share"],
        "brake_torque": torque,
        "events": event_counts(response),
        "sticks": {
            name: response[f"stick_{name}"].values for name in ("start", "end", "entry", "exit")
        },
        "poincare": {
            "period": response["period"].values,
            **{name: response[f"poincare_{name}"].values for name in ("time", "angle", "velocity")},
        },
        "rest_from": float(response["stick_start"].values[-1]) if rests else None,
        "repeats_after": repeats and {"periods": repeats[0], "distance": repeats[1]},
    }
    return {**report, "summary": summary(report, response)}


def _longest(response: xr.Dataset) -> int:
    """Largest number of periods after which the run could show a repetition."""
    from wedgebrake.analysis.classify import LONGEST

    last = response.sizes["period"] - 1
    return min(LONGEST, last // 3, last - 8)


def repetition(system: BrakedDriveline, response: xr.Dataset) -> tuple[int, float] | None:
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


def summary(report: dict[str, Any], response: xr.Dataset) -> str:
    """The motion in one or two sentences."""
    if report["status"] != "completed":
        return str(report["message"])
    begun, kind = report["rest_from"], report["stick_slip_class"]
    since = "" if begun is None or begun == span(response)[0] else f"at rest from {begun:.4g} s"
    if kind == AT_REST:
        return f"The brake holds the driveline{since and ','} {since or 'at rest'}."
    late = response["velocity"].values[response["time"].values >= report["steady_from"]]
    late = np.append(late, report["final"]["velocity"])  # there may be no sample in this part
    # A brake that sticks to a turning shaft is not at rest.
    resting = "stuck" if report["system"]["driveline"]["drive_speed"] != 0.0 else "at rest"
    words = (
        f"{kind[0].upper()}{kind[1:]} vibration, velocity between {late.min():.4g} and"
        f" {late.max():.4g} rad/s, {resting} {100 * report['stick_share']:.3g} % of the time"
    )
    words += f" (over the last {report['final']['time'] - report['steady_from']:.3g} s)"
    if report["system"]["excitation"]["amplitude"] == 0.0:
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


def response_text(system: BrakedDriveline, report: dict[str, Any]) -> str:
    """The text of ``simulate``."""
    from wedgebrake.solvers.log_reader import SHORTEST_STICK

    final, friction, torque = report["final"], system.friction, report["brake_torque"]
    lines = [
        describe(system),
        "",
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
    lines.append(events_line(report))
    lines.append(
        f"  state at t = {final['time']:.6g} s: angle {final['angle']:.9g} rad,"
        f" velocity {final['velocity']:.9g} rad/s"
    )
    return "\n".join(lines)

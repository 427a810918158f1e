"""Reports on linear stability and on a response: as data for ``--json``, and as text."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake._version import __version__
from wedgebrake.analysis.linear_stability import DirectionStability, Stability, stability
from wedgebrake.analysis.sticking import AT_REST, span
from wedgebrake.analysis.torque import brake_torque
from wedgebrake.cli.writing import describe, versions
from wedgebrake.errors import InputError
from wedgebrake.model.brakes import WedgeBrake
from wedgebrake.model.friction import SmoothFriction
from wedgebrake.model.study import Study
from wedgebrake.model.system import BrakedDriveline

if TYPE_CHECKING:
    import xarray as xr

# Largest number of torque periods after which a repetition is searched for.
_LONGEST = 24


def stability_report(system: BrakedDriveline, verdict: Stability) -> dict[str, Any]:
    """The data that ``stability --json`` prints."""
    about = {"wedgebrake": __version__, "system": system.as_dict()}
    return {**about, "groups": system.groups.as_dict(), **verdict.as_dict()}


def stability_text(system: BrakedDriveline, verdict: Stability) -> str:
    """The text that ``stability`` prints."""
    lines = [describe(system), "", f"Linear stability: {verdict.verdict}"]
    for name, one in (("forwards", verdict.forward), ("backwards", verdict.backward)):
        if one.speed is not None:
            lines += ["", *_direction_lines(name, one)]
    return "\n".join([*lines, *_angle_lines(system, verdict)])


def _angle_lines(system: BrakedDriveline, verdict: Stability) -> list[str]:
    """The angles of a wedge at which the verdict changes."""
    sliding, resting = verdict.kinetic_locking_angle, verdict.static_locking_angle
    if sliding is None or resting is None or not isinstance(system.brake, WedgeBrake):
        return []
    at_rest = f", at rest up to {resting:.6g} rad" if resting > sliding else ""
    lines = [
        "",
        f"Wedge angle, here {system.brake.angle:.6g} rad, with all else as it is:",
        f"  self-locking up to {sliding:.6g} rad{at_rest}",
    ]
    hopf = [
        f"{name} {one.hopf_angle:.6g} rad"
        for name, one in (("forwards", verdict.forward), ("backwards", verdict.backward))
        if one.hopf_angle is not None
    ]
    if hopf:
        lines.append(f"  Hopf: {', '.join(hopf)} (sliding decays above)")
    return lines


def _direction_lines(name: str, one: DirectionStability) -> list[str]:
    at = f" at {one.speed:.6g} rad/s" if one.speed else ""
    if one.locked or one.eigenvalues is None:
        return [f"Sliding {name}{at}: does not exist (self-locking)."]
    roots = ", ".join(f"{value.real:.6g}{value.imag:+.6g}i" for value in one.eigenvalues)
    lines = [f"Sliding {name}{at}:"]
    lines.append(f"  damping      {one.damping:.6g} N m s/rad: small vibration {one.state}")
    if one.released:
        lines.append(
            "  actuator     released at this speed; slopes given below are those of a pressed brake"
        )
    lines.append(f"  eigenvalues  {roots} 1/s")
    for label, stem in (
        ("Hopf", "hopf"),
        ("node-focus, stable side", "node_focus_stable"),
        ("node-focus, unstable side", "node_focus_unstable"),
    ):
        slope, eta = getattr(one, f"{stem}_slope"), getattr(one, f"{stem}_eta")
        if slope is None:
            continue
        in_eta = "" if eta is None else f"eta = {eta:.6g}, "
        lines.append(f"  {label}: {in_eta}slope = {slope:.6g} N s/rad")
    return lines


def simulated(study: Study) -> tuple[xr.Dataset, dict[str, Any]]:
    """Simulate a study; returns the response and the report on it."""
    from wedgebrake.cli.interrupts import announce_compilation
    from wedgebrake.solvers.simulate import simulate

    with announce_compilation():
        response = simulate(study.system, **study.run.arguments())
        return response, response_report(study.system, response)


def response_report(system: BrakedDriveline, response: xr.Dataset) -> dict[str, Any]:
    """The data that ``simulate --json`` prints."""
    from wedgebrake.analysis.sticking import steady_start, sticks
    from wedgebrake.dynamics.enums import EventKind

    steady_from = steady_start(response)
    steady = sticks(response, steady_from)
    kinds, counts = np.unique(response["event_kind"].values, return_counts=True)
    events = {EventKind(kind).name.lower(): int(n) for kind, n in zip(kinds, counts, strict=True)}
    attrs = response.attrs
    linear = stability(system)
    report: dict[str, Any] = {
        "wedgebrake": attrs["wedgebrake_version"],
        "versions": versions(),
        "system": json.loads(attrs["system"]),
        "groups": json.loads(attrs["groups"]),
        "method": attrs["method"],
        "options": json.loads(attrs["options"]),
        "status": attrs["status"],
        "message": attrs["message"],
        "final": {
            "time": attrs["final_time"],
            "angle": attrs["final_angle"],
            "velocity": attrs["final_velocity"],
        },
        "stability": linear.as_dict(),
        "steady_from": steady_from,
        "stick_slip_class": steady.attrs["class"],
        "stick_share": steady.attrs["share"],
        "events": events,
        "sticks": {
            name: response[f"stick_{name}"].values.tolist()
            for name in ("start", "end", "entry", "exit")
        },
        "poincare": {
            "period": response["period"].values.tolist(),
            "time": response["poincare_time"].values.tolist(),
            "angle": response["poincare_angle"].values.tolist(),
            "velocity": response["poincare_velocity"].values.tolist(),
        },
    }
    driven = report["system"]["excitation"]["amplitude"] > 0.0
    report["brake_torque"] = _torque(response, steady_from)
    repeats = repetition(response) if driven else None
    report["rest_from"] = _rest_from(report, response)
    report["repeats_after"] = repeats and {"periods": repeats[0], "distance": repeats[1]}
    report["summary"] = summary(report, response)
    return report


def _torque(response: xr.Dataset, start: float) -> dict[str, float] | None:
    """Mean, mean size and peak of the brake torque [N m]; None if there are too few samples."""
    try:
        return asdict(brake_torque(response, start))
    except InputError:
        return None


def _rest_from(report: dict[str, Any], response: xr.Dataset) -> float | None:
    """Beginning of the rest that lasts for good [s]; None if the driveline goes on to move."""
    machine = report["system"]
    exits = response["stick_exit"].values
    # A torque ends most rests; one that lasted for the last fifth of a run is taken as permanent.
    lasts = report["stick_slip_class"] == AT_REST or machine["excitation"]["amplitude"] == 0.0
    if machine["driveline"]["drive_speed"] != 0.0 or not (lasts and exits.size and exits[-1] == 0):
        return None
    return float(response["stick_start"].values[-1])


def _longest(response: xr.Dataset) -> int:
    """Largest number of periods that is tried; a short run has too few points for more."""
    return min(_LONGEST, max(2, response.sizes["period"] // 5) // 2)


def repetition(response: xr.Dataset) -> tuple[int, float] | None:
    """Number of torque periods after which the last Poincare points return, and the distance.

    The distance is relative to the size of the points. The smallest number whose points return
    within 1e-3 over the last fifth of the run; None if there is none up to 24, or too few points.
    This is an observation, not a classification of the motion.
    """
    points = np.column_stack(
        [response["poincare_angle"].values, response["poincare_velocity"].values]
    )
    tail = points[-max(2, len(points) // 5) :]
    scale = np.max(np.abs(points), axis=0, initial=1e-300)
    for n in range(1, min(_longest(response), len(tail) // 2) + 1):
        distance = float(np.max(np.abs(tail[n:] - tail[:-n]) / scale))
        if distance <= 1e-3:
            return n, distance
    return None


def summary(report: dict[str, Any], response: xr.Dataset) -> str:
    """The motion in one or two sentences."""
    if report["status"] != "completed":
        return str(report["message"])
    late = response["velocity"].values[response["time"].values >= report["steady_from"]]
    late = np.append(late, report["final"]["velocity"])  # samples may be too few to have one
    kind = str(report["stick_slip_class"])
    begun = report["rest_from"]
    since = "" if begun is None or begun == span(response)[0] else f"at rest from {begun:.4g} s"
    if kind == AT_REST:
        return f"The brake holds the driveline{since and ','} {since or 'at rest'}."
    words = f"{kind[0].upper()}{kind[1:]} vibration, velocity between {late.min():.4g} and"
    words += f" {late.max():.4g} rad/s,"
    # A brake that sticks to a turning shaft is not at rest.
    turning = report["system"]["driveline"]["drive_speed"] != 0.0
    words += f" {'stuck' if turning else 'at rest'} {100 * report['stick_share']:.3g} % of the time"
    looked = _longest(response)
    if looked < _LONGEST:
        words += f" (of the last {report['final']['time'] - report['steady_from']:.3g} s)"
    words += "."
    if report["system"]["excitation"]["amplitude"] == 0.0:
        words += f" It ends {since}." if since else ""
        return words + " No torque acts: no repetition is searched for."
    repeats = report["repeats_after"]
    if repeats is None and looked < _LONGEST:
        return words + " The run is too short to find after how many periods it repeats."
    if repeats is None:
        return words + f" It does not repeat within {_LONGEST} torque periods."
    n, distance = repeats["periods"], repeats["distance"]
    words += " It repeats every torque period" if n == 1 else f" It repeats every {n} periods"
    return words + (f" (to {distance:.0e})." if distance > 1e-6 else ".")


def _layer_line(system: BrakedDriveline, friction: SmoothFriction) -> str:
    """The meaning of rest with a smooth law, which has none (docs/theory.md, section 6)."""
    from wedgebrake.solvers.log_reader import SHORTEST_STICK

    speed = friction.transition
    return (
        f"  with smooth friction the brake never rests exactly; stick and rest mean |sliding speed|"
        f" below {speed:.4g} m/s ({speed / system.brake.radius:.4g} rad/s) for longer than"
        f" {100 * SHORTEST_STICK:g} % of a torque period"
    )


def response_text(system: BrakedDriveline, report: dict[str, Any]) -> str:
    """The text that ``simulate`` prints."""
    final = report["final"]
    events = ", ".join(f"{count} {name}" for name, count in report["events"].items()) or "none"
    lines = [
        describe(system),
        "",
        f"Linear stability: {report['stability']['verdict']}",
        f"Response ({report['method']}): {report['summary']}",
    ]
    if report["status"] == "completed":  # else the summary has said it
        lines.append(f"  {report['message']}")
    if isinstance(system.friction, SmoothFriction) and report["stick_share"] > 0.0:
        lines.append(_layer_line(system, system.friction))
    torque = report["brake_torque"]
    if torque and math.isfinite(torque["peak"]):
        words = ("mean", "mean size", "peak")
        sizes = (f"{word} {torque[word.replace(' ', '_')]:.4g} N m" for word in words)
        lines.append(f"  brake torque: {', '.join(sizes)}")
    lines.append(f"  events: {events}")
    lines.append(
        f"  state at t = {final['time']:.6g} s: angle {final['angle']:.9g} rad,"
        f" velocity {final['velocity']:.9g} rad/s"
    )
    return "\n".join(lines)

"""Measurement of the table: every program on every case, with its error."""

import os
import platform
from collections.abc import Callable, Iterator, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

import ours
import wedgebrake as wb
from peers import Peer, auto
from timing import best
from work import (
    CASES,
    DIAGRAM_COMPARED,
    ETAS,
    PERIODS,
    Case,
    beside,
    diagram,
    duration,
    neighbours,
    system,
    truth,
)

Row = dict[str, Any]
# How long a program may work on a diagram [s]; beyond, it gets a part of the points.
PATIENCE = 10.0
FEWEST = 4
# Errors below it cannot be told from those of the truth.
FLOOR = 1e-9


def machine() -> dict[str, Any]:
    """What was measured on, and with what."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    return {
        "processor": names[0] if names else platform.machine(),
        "processors": len(os.sched_getaffinity(0)),
        "load": os.getloadavg()[0],
        "python": platform.python_version(),
        "versions": {name: _version(name) for name in ("wedgebrake", "numba", "scipy", "heyoka")},
    }


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def errors(states: np.ndarray, truths: np.ndarray) -> dict[str, float]:
    """The largest over the states (n, 2), [rad] and [rad/s]."""
    angle, velocity = np.abs(np.atleast_2d(states) - np.atleast_2d(truths)).max(axis=0)
    return {"error_angle": float(angle), "error_velocity": float(velocity)}


def own_rows(case: Case, count: int = PERIODS) -> Iterator[Row]:
    """The package on one case: its kernel at every tolerance, and the front door."""
    expected = truth(case.system, case.compared)
    for rtol in ours.TOLERANCES[case.law]:
        seconds = best(ours.kernel(case.system, rtol, count))
        state = np.array(ours.kernel(case.system, rtol, case.compared)())
        asked = "exact" if rtol is None else f"rtol {rtol:g}"
        yield {
            "program": "wedgebrake", "asked": asked, "seconds": seconds, "own": True,
            "reference": rtol == ours.REFERENCE[case.law], **errors(state, expected),
        }  # fmt: skip
        if rtol is None:
            continue
        brakes = beside(case, ours.LANES)
        run = ours.kernel_in_lanes(brakes, rtol, case.compared)
        yield {
            "program": f"wedgebrake, {ours.LANES} lanes", "asked": asked, "own": True,
            "seconds": best(ours.kernel_in_lanes(brakes, rtol, count)) / ours.LANES,
            "reference": False, "lanes": ours.LANES, **errors(np.array(run()), expected),
        }  # fmt: skip


def peer_row(peer: Peer, case: Case, periods: int = PERIODS) -> Row:
    """One peer on one case; those that like several get the case and its neighbours."""
    brakes = neighbours(case, peer.lanes)
    run = _repeated(peer, brakes, duration(case.system, periods))
    states, seconds = run.states, run.seconds
    if case.compared != periods:
        states = peer.solve(brakes, duration(case.system, case.compared)).states
    return {
        "program": peer.name, "asked": peer.asked, "seconds": seconds / len(brakes), "own": False,
        "reference": False, "lanes": peer.lanes,
        **errors(states[0], truth(case.system, case.compared)),
    }  # fmt: skip


def _repeated(peer: Peer, brakes: Sequence[Any], until: float) -> Any:
    """The fastest of some runs; a slow program has one."""
    fastest = peer.solve(brakes, until)
    spent = fastest.seconds
    while spent < 1.0:
        again = peer.solve(brakes, until)
        spent += again.seconds
        fastest = min(fastest, again, key=lambda one: one.seconds)
    return fastest


def case_rows(case: Case, peers: Sequence[Peer], periods: int = PERIODS) -> list[Row]:
    """Everything on one case, with ratios."""
    rows = list(own_rows(case, periods))
    rows += [peer_row(peer, case, periods) for peer in peers]
    shared = {"law": case.law, "case": case.words, "compared": case.compared}
    return [{**shared, **row} for row in compared(rows)]


def compared(rows: list[Row]) -> list[Row]:
    """Rows with their ratios to ours.

    ratio       : of the time to that of our reference row
    ratio_equal : of the time to that of our fastest row whose error is not larger, or, where
                  all are larger, of our most accurate one; in lanes to those in lanes
    """
    # On all processors we are beside no one.
    own = [row for row in rows if row["own"] and not row.get("shared")]
    [reference] = [row for row in own if row["reference"]]
    made = []
    for row in rows:
        ratios = {"ratio": row["seconds"] / reference["seconds"]}
        if not row["own"]:
            ratios["ratio_equal"] = row["seconds"] / _as_right(row, own)["seconds"]
        made.append({**row, **ratios})
    return made


def _as_right(row: Row, own: list[Row]) -> Row:
    """Our row that a peer's is compared with, by errors on the points that it has."""
    wrong = {id(one): one["error_velocity"] for one in own}
    if "stride" in row:
        wrong = {id(one): max(one["wrong"][:: row["stride"]]) for one in own}
    allowed = max(row["error_velocity"], FLOOR)
    several = row.get("lanes", 1) > 1
    alike = [one for one in own if (one.get("lanes", 1) > 1) == several] or own
    fair = [one for one in alike if wrong[id(one)] <= allowed]
    return min(fair, key=lambda one: one["seconds"], default=None) or min(
        alike, key=lambda one: wrong[id(one)]
    )


def diagram_rows(law: str, peers: Sequence[Peer], known: dict[str, float]) -> list[Row]:
    """The bifurcation diagram: seconds are those of a point.

    known : seconds for a trajectory, by program and accuracy, to choose how many points it gets
    """
    truths = np.array([truth(system(law, float(eta)), DIAGRAM_COMPARED) for eta in ETAS])
    rows = list(_own_diagrams(law, truths))
    machine_of_law = system(law, 0.0)
    for peer in peers:
        stride = int(np.ceil(known[peer.name + peer.asked] * ETAS.size / PATIENCE))
        stride = min(stride, ETAS.size // FEWEST)
        brakes = diagram(law, stride)
        run = peer.solve(brakes, duration(machine_of_law, PERIODS))
        states = peer.solve(brakes, duration(machine_of_law, DIAGRAM_COMPARED)).states
        rows.append(
            {"program": peer.name, "asked": peer.asked, "own": False, "reference": False,
             "seconds": run.seconds / len(brakes), "points": len(brakes), "stride": stride,
             **errors(states, truths[::stride])}
        )  # fmt: skip
    shared = {"law": law, "case": "diagram", "compared": DIAGRAM_COMPARED}
    return [{**shared, **row} for row in compared(rows)]


def _own_diagrams(law: str, truths: np.ndarray) -> Iterator[Row]:
    """On one thread at every tolerance, and on all processors at that of the reference."""
    several = len(os.sched_getaffinity(0))
    for rtol in ours.TOLERANCES[law]:
        reference = rtol == ours.REFERENCE[law]
        states = ours.diagram_states(law, rtol)
        asked = "exact" if rtol is None else f"rtol {rtol:g}"
        for threads in dict.fromkeys((1, several) if reference else (1,)):

            def run(rtol: float | None = rtol, threads: int = threads) -> None:
                ours.bifurcation(law, rtol, threads)

            words = "1 thread" if threads == 1 else f"{threads} threads"
            yield {
                "program": f"wedgebrake, wb.bifurcation, {words}", "asked": asked, "own": True,
                "reference": reference and threads == 1, "seconds": best(run) / ETAS.size,
                "points": ETAS.size, "shared": threads > 1,
                "wrong": np.abs(states - truths)[:, 1].tolist(),
                **errors(states, truths),
            }  # fmt: skip


def branch_rows() -> list[Row]:
    """The synchronous orbit of the smoothed brake followed: seconds are those of an orbit.

    Where its period doubles is compared with AUTO's answer on twice as fine a mesh.
    """
    if auto.missing():
        return []
    start = system("smoothed", auto.START)
    first = wb.orbit(start)
    # AUTO's coarse and fine answers agree to the digits that it prints; ours must meet the fine.
    fine = auto.follow(start, 800).doubling
    theirs = min((auto.follow(start, 400) for _ in range(3)), key=lambda one: one.seconds)

    def follow() -> wb.Branch:
        branch = wb.continuation(first, step=0.005, eta=(auto.START, auto.END))
        for point in branch:
            assert np.isfinite(point.multipliers[0])
        return branch

    branch = follow()
    [doubling] = [
        point.value
        for point in branch.bifurcations
        if point.bifurcation is not None and point.bifurcation.kind.value == "period doubling"
    ]
    count = len(branch.points)
    return [
        {"program": "wedgebrake, wb.continuation", "asked": "rtol 1e-10", "orbits": count,
         "seconds": best(follow) / count, "error": abs(doubling - fine)},
        {"program": "AUTO-07p", "asked": "400 intervals", "orbits": theirs.orbits,
         "seconds": theirs.seconds / theirs.orbits, "error": abs(theirs.doubling - fine)},
    ]  # fmt: skip


def measure(peers: Sequence[Peer], *, quick: bool, say: Callable[[str], None]) -> dict[str, Any]:
    """The whole table as plain values; ``quick``: the first case of each law, no diagram."""
    absent = {peer.name: peer.missing() for peer in peers if peer.missing()}
    if auto.missing():
        absent["AUTO-07p"] = auto.missing()
    here = [peer for peer in peers if not peer.missing()]
    rows: list[Row] = []
    for law in dict.fromkeys(case.law for case in CASES):
        of_law = [peer for peer in here if peer.law == law]
        cases = [case for case in CASES if case.law == law]
        for case in cases[:1] if quick else cases:
            say(f"{law}, {case.words}")
            chosen = of_law if case is cases[0] else [one for one in of_law if not one.slow]
            rows += case_rows(case, chosen)
        if not quick:
            say(f"{law}, diagram")
            known = {one["program"] + one["asked"]: one["seconds"] for one in rows}
            rows += diagram_rows(law, [one for one in of_law if not one.slow], known)
    say("branch")
    branch = [] if quick else branch_rows()
    return {"machine": machine(), "rows": rows, "branch": branch, "left_out": absent}

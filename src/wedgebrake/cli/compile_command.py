"""The command ``compile``: short runs that call every kernel of a group."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

from wedgebrake.cli.compilation import announce_compilation
from wedgebrake.model.validation import check_choice
from wedgebrake.solvers.interrupts import interruptible


def _drivelines() -> None:
    """Braked drivelines: simulation, class of motion, sweeps and orbits."""
    _of_driveline("coulomb")


def _smooth() -> None:
    """Braked drivelines with smooth friction laws."""
    _of_driveline("smoothed")


def _machines() -> None:
    """Machines, and drivelines with signals or sampled actuations: runs, classes, orbits.

    Without the closed forms of one inertia, which ``_drivelines`` compiles.
    """
    for friction in ("coulomb", "smoothed"):
        _of_machine(friction)


GROUPS: dict[str, Callable[[], None]] = {
    "drivelines": _drivelines, "smooth": _smooth, "machines": _machines,
}  # fmt: skip


def _of_driveline(friction: str) -> None:
    import wedgebrake as wb

    system = wb.paper.system(friction=friction)
    wb.simulate(system, periods=2)
    wb.motion(system, periods=20)
    wb.bifurcation(system, slope=[-3.0, -2.0], periods=20, transient=10)
    wb.branches(system, slope=(-3.0, -2.9), points=3)


def _of_machine(friction: str) -> None:
    import wedgebrake as wb

    driven = wb.paper.system(friction=friction).machine
    free = driven.replace(torques=[], brake=_on_belt(driven.contacts[0]))
    wb.energy(wb.simulate(driven, duration=0.1))
    for machine in (free, driven.replace(torques=_in_halves(driven.torques[0]))):
        wb.motion(machine)
        wb.orbit(machine)


def _on_belt(contact: Any) -> Any:
    """The same contact on a base that moves."""
    return type(contact)(**{**dict(contact), "base_speed": 1.0})


def _in_halves(torque: Any) -> list[Any]:
    """Two torques whose sum is a given one: with a single sine the closed form would be used."""
    import wedgebrake as wb

    half = wb.Harmonic(0.5 * torque.signal.amplitude, torque.signal.frequency)
    return [wb.Torque(torque.on, half, name=name) for name in ("first", "second")]


def run(groups: Sequence[str]) -> dict[str, Any]:
    """Compile groups, all if none is given, and return the seconds that each took.

    Raises ``InputError`` for an unknown group.
    """
    for name in groups:
        check_choice("GROUP", name, GROUPS)
    seconds = {}
    for name in groups or GROUPS:
        begin = time.perf_counter()
        with announce_compilation():
            interruptible(GROUPS[name])
        seconds[name] = time.perf_counter() - begin
    return {"seconds": seconds}


def text(report: dict[str, Any]) -> str:
    """The report as text."""
    lines = [f"{name}: compiled, {taken:.1f} s" for name, taken in report["seconds"].items()]
    return "\n".join(lines)

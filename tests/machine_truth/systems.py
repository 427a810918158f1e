"""The cases that are judged, as truth.json holds them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import machine_plain

PATH = Path(__file__).parent / "truth.json"


def cases() -> list[dict[str, Any]]:
    """All cases with their verdicts: number, tables of the machine, and what the judge says.

    200 machines, drawn once by ``draw``, of one to three inertias. Half have no varying signal;
    the others a harmonic torque. Their bases move, or a rotor on a bearing is carried along by a
    torque; friction or the actuator's force falls with the speed; some actuators lag.
    """
    found: list[dict[str, Any]] = json.loads(PATH.read_text())["cases"]
    return found


def machine_of(case: dict[str, Any]) -> Any:
    """The ``wb.Machine`` of a case."""
    return machine_plain.machine(case["machine"])

"""The cases that are judged, as truth.json holds them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import wedgebrake as wb
from wedgebrake.model.friction import Friction

PATH = Path(__file__).parent / "truth.json"


def cases() -> list[dict[str, Any]]:
    """All cases with their verdicts; ``known`` is the answer and where it is known from, or None.

    Those chosen by hand are systems of the paper with other groups: closed forms, slow settling,
    chaotic transients, ends, lasting chaos, tori and coexisting attractors. The 200 of the group
    "random" were drawn once. Drawn again, with logarithms and exponentials, they would differ in
    their last bits on another processor, or with another NumPy.

    - brakes: 50 % wedges, 34 % conventional, 8 % band brakes, 8 % leading shoes; self-locking
      (alpha 0.8 to 1.05) in 15 %, otherwise alpha 1.05 to 3
    - friction: static over kinetic 1, 1.1 or 1.3; 8 % tables that fall or rise with speed
    - drivelines: damping 0.05 to 2 N m s/rad; 12 % turn, at 0.2 to 5 rad/s
    - actuation: eta -80 to 15, F0 0.005 to 0.2; 8 % never release
    - torque: f 0.2 to 2.5, half of them below 1, where the motion sticks most
    - start: half at rest, half anywhere within twice the static deflection
    """
    found: list[dict[str, Any]] = json.loads(PATH.read_text())["cases"]
    return found


def from_tables(tables: dict[str, dict[str, Any]]) -> wb.BrakedDriveline:
    """The system that ``as_dict`` gave, to the last bit."""
    brake, friction = dict(tables["brake"]), dict(tables["friction"])
    return wb.BrakedDriveline(
        driveline=wb.Driveline(**tables["driveline"]),
        brake=wb.Brake.kinds[brake.pop("kind")](**brake),
        friction=Friction.kinds[friction.pop("kind")](**friction),
        actuation=wb.Actuation(**tables["actuation"]),
        excitation=wb.HarmonicTorque(**tables["excitation"]),
    )

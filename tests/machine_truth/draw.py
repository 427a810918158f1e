"""Machines at random, as plain tables: prints them, one a line.

Units are scaled: torques of some N m, vibration of some rad/s. All classes of motion occur.
"""

from __future__ import annotations

import json
import math
import sys
from typing import Any

import numpy as np

Tables = dict[str, Any]


class _Draw:
    """One machine."""

    def __init__(self, number: int) -> None:
        self.rng = np.random.default_rng([20260714, number])
        self.driven = number % 2 == 1
        self.n = int(self.rng.choice([1, 2, 3], p=[0.4, 0.4, 0.2]))
        # Driven harder than friction holds, with a force that falls with the speed.
        self.forced = self.driven and self.chance(0.4)

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def log(self, low: float, high: float) -> float:
        return float(f"{math.exp(self.rng.uniform(math.log(low), math.log(high))):.6g}")

    def tables(self) -> Tables:
        rotor = not self.forced and self.chance(0.2)
        inertias = [
            {"name": f"i{k}", "inertia": self.log(0.4, 2.5), "angle": 0.0,
             "speed": round(float(self.rng.uniform(-1.0, 2.0)), 3)}
            for k in range(self.n)
        ]  # fmt: skip
        shafts = []
        for k in range(self.n):
            held = not (rotor and k == 0)
            if held and (k == 0 or self.chance(0.7) or (rotor and k == 1)):
                shafts.append(self.shaft(inertias[k]["inertia"], f"i{k}", "ground", 1.0))
            if k + 1 < self.n:
                shafts.append(self.shaft(1.0, f"i{k}", f"i{k + 1}", self.log(0.02, 1.0)))
        if rotor:
            # A rotor on a viscous bearing, carried along by a constant torque.
            shafts.append(
                {"a": "i0", "b": "ground", "stiffness": 0.0, "damping": self.log(0.05, 0.5),
                 "ratio": 1.0, "name": "bearing"}
            )  # fmt: skip
            inertias[0]["speed"] = self.log(0.5, 4.0)
        places = self.rng.permutation(self.n)[: max(1, int(self.rng.integers(1, self.n + 1)))]
        contacts = [self.contact(int(k), rotor) for k in sorted(places)]
        torques = []
        if rotor:
            drive = sum(one["actuation"]["initial_force"] for one in contacts) + self.log(0.2, 1.5)
            torques.append({"on": "i0", "signal": round(drive, 4), "name": "drive"})
        if self.driven:
            size = self.log(0.5, 4.0) if self.forced else self.log(0.03, 4.0)
            frequency = self.log(0.4, 2.5) / (2.0 * math.pi)
            wave = {"kind": "harmonic", "amplitude": size, "frequency": float(f"{frequency:.6g}"),
                    "phase": 0.0}  # fmt: skip
            torques.append({"on": f"i{self.rng.integers(self.n)}", "signal": wave, "name": "wave"})
        return {"inertias": inertias, "shafts": shafts, "contacts": contacts, "torques": torques}

    def shaft(self, inertia: float, a: str, b: str, factor: float) -> Tables:
        omega = self.log(0.7, 2.0) * math.sqrt(factor)
        damping = 2.0 * self.log(0.002, 0.1) * inertia * omega
        return {
            "a": a, "b": b, "stiffness": float(f"{inertia * omega**2:.6g}"),
            "damping": float(f"{damping:.6g}"), "ratio": 1.0, "name": f"{a}-{b}",
        }  # fmt: skip

    def contact(self, k: int, rotor: bool) -> Tables:
        kinetic = round(float(self.rng.uniform(0.2, 0.6)), 3)
        static = round(kinetic * float(self.rng.uniform(1.0, 2.2)), 3)
        actuation: Tables = {"initial_force": self.log(0.3, 3.0), "slope": 0.0, "release": True}
        law = int(self.rng.choice([0, 1, 2], p=[0.4, 0.35, 0.25]))
        speed = self.log(0.15, 1.0)
        if law == 0:
            friction: Tables = {
                "kind": "stribeck", "kinetic": kinetic, "static": static, "speed": speed,
                "tolerance": 1e-3,
            }  # fmt: skip
        elif law == 1:
            friction = {
                "kind": "tabulated", "speeds": [0.0, speed, 3.0 * speed, 8.0 * speed],
                "coefficients": [static, 0.5 * (static + kinetic), kinetic, 1.05 * kinetic],
                "static": round(1.05 * static, 4),
            }  # fmt: skip
        else:
            friction = {"kind": "coulomb", "kinetic": kinetic, "static": static}
        if law == 2 or self.chance(0.3):
            slope = -self.log(0.03, 6.0 if law == 2 else 0.3) * actuation["initial_force"]
            actuation["slope"] = float(f"{slope:.6g}")
            if law == 2 and self.chance(0.4):
                actuation["lag"] = self.log(0.05, 1.0)
        if self.forced:
            friction = {"kind": "coulomb", "kinetic": kinetic, "static": static}
            actuation = {
                "initial_force": self.log(0.1, 0.6), "slope": -self.log(0.05, 0.6), "release": True,
            }  # fmt: skip
        brake: Tables = {"kind": "conventional", "radius": 1.0}
        if self.chance(0.25):
            brake = {"kind": "wedge", "radius": 1.0, "angle": self.log(0.5, 1.2)}
        still = (rotor and k == 0) or self.chance(0.9 * self.forced)
        base = 0.0 if still else self.log(0.15, 3.0)
        return {
            "a": f"i{k}", "b": "ground", "name": f"c{k}", "brake": brake, "friction": friction,
            "actuation": actuation, "base_speed": base,
        }  # fmt: skip


def tables(number: int) -> Tables:
    """The machine of a number."""
    return _Draw(number).tables()


def main() -> None:
    """Print the machines."""
    for number in range(int(sys.argv[1])):
        sys.stdout.write(json.dumps(tables(number), separators=(",", ":")) + "\n")


if __name__ == "__main__":
    main()

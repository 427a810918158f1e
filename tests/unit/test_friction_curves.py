"""Pieces of friction curves in machines: their error is relative to the law at every speed."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from mpmath import mp
from scipy.integrate import solve_ivp

import wedgebrake as wb
from machines import contact, single
from wedgebrake.errors import InputError
from wedgebrake.solvers.machine.events.curves import curve_gain
from wedgebrake.solvers.machine.friction_lines import Sliding, curved_lines, lines_of


class Curve(wb.SetValuedFriction):
    """A set-valued law that is any function of the speed."""

    law: Callable[[float], float]
    bends_at: tuple[float, ...] = ()

    @property
    def breakaway(self) -> float:
        return self.law(0.0)

    @property
    def bends(self) -> tuple[float, ...]:
        return self.bends_at

    def kinetic_at(self, speed: float) -> float:
        return self.law(speed)


def steep(speed: float) -> float:
    return 0.3 * math.tanh(speed / 0.01) + 0.02 * speed


def drag(speed: float) -> float:
    return (speed / 100.0) * abs(speed / 100.0)


def custom(law: Callable[[float], float], width: float = 0.01) -> Any:
    return wb.CustomFriction(law=law, width=width)


def odd(law: Callable[[float], float]) -> Callable[[float], float]:
    return lambda speed: math.copysign(law(abs(speed)), speed)


SMOOTH = {
    "steep and viscous": custom(steep),
    "drag": custom(drag),
    "power": custom(odd(lambda v: v**1.5)),
    "rational": custom(lambda v: 0.3 * v / (abs(v) + 0.01)),
    "arctan": custom(lambda v: 0.2 * math.atan(v / 0.01)),
    "tanh": wb.SmoothedFriction(kinetic=0.3, static=0.4, decay=6.0, steepness=80.0),
}
SET_VALUED = {
    "small and quadratic": Curve(law=lambda v: 0.001 + 0.001 * math.exp(-v / 0.1) + 0.001 * v * v),
    "lubricated": Curve(law=lambda v: 0.2 + 0.1 * math.exp(-((v / 0.1) ** 2)) + 0.02 * v),
    "rational": Curve(law=lambda v: 0.2 + 0.1 / (1.0 + (v / 0.1) ** 2)),
    "power": Curve(law=lambda v: 0.2 + 0.1 * v**1.7),
}
POLYNOMIALS = {
    "constant": Curve(law=lambda _v: 0.3),
    "viscous": Curve(law=lambda v: 0.3 + 0.02 * v),
    "falling": Curve(law=lambda v: 0.3 - 0.02 * v + 0.01 * v * v),
    "quadratic": Curve(law=lambda v: 0.001 + 0.02 * v + 0.01 * v * v),
    "drag": custom(drag, 1.0),
}
BRAKES = [wb.ConventionalBrake(radius=0.1), wb.WedgeBrake(radius=0.2, angle=0.5)]


def coefficient(law: Any, speed: float) -> float:
    smooth = isinstance(law, wb.SmoothFriction)
    return law.coefficient(speed) if smooth else law.kinetic_at(speed)


def errors(law: Any, brake: Any, speeds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Relative errors of the pieces at speeds [m/s] where the brake slides, and the amplification.

    Evaluated as the kernels do.
    """
    given = Sliding("contact", brake, law, wb.Actuation(initial_force=1.0))
    lines = lines_of(given, curved=True)
    rows = lines.rows[: lines.forward]
    found = []
    for speed in speeds:
        line = rows[np.searchsorted(rows["start"], speed / brake.radius, side="right") - 1]
        value, _ = curve_gain(line, 1, speed / brake.radius)
        gain = brake.amplification(coefficient(law, speed))
        if math.isfinite(gain) and gain < 30.0 * max(coefficient(law, speed), 1.0):
            found.append((abs(value / (brake.radius * gain) - 1.0), gain))
    return np.array(found).T  # type: ignore[return-value]


def places(lowest: float) -> np.ndarray:
    """Speeds in no relation to those of the pieces [m/s]."""
    rng = np.random.default_rng(5)
    wide = 10.0 ** rng.uniform(math.log10(lowest), 5.9, 1500)
    return np.concatenate((wide, rng.uniform(2.0 * lowest, 2.0, 500)))


@pytest.mark.parametrize("brake", BRAKES, ids=["conventional", "wedge"])
@pytest.mark.parametrize("law", [*SMOOTH.values(), *SET_VALUED.values()])
def test_the_error_is_relative_at_every_speed(law: Any, brake: Any) -> None:
    """From the straight line near rest on; rounding grows with the amplification of a wedge."""
    lowest = 1.01e-8 if isinstance(law, wb.CustomFriction) else 1e-9
    found, gains = errors(law, brake, places(lowest))
    assert np.all(found <= 2.5e-14 * np.maximum(gains, 1.0))


@pytest.mark.parametrize("name", POLYNOMIALS)
def test_a_polynomial_is_exact_to_rounding(name: str) -> None:
    law = POLYNOMIALS[name]
    found, _ = errors(law, BRAKES[0], places(1.01e-6))
    assert np.max(found) <= 1e-15
    lines, _ = curved_lines(contact("disc", brake=BRAKES[0], friction=law))
    assert len(lines) <= 2


def test_a_law_with_rounding_of_its_own() -> None:
    """1 - exp(-v) has a rounding error of 1e-16, which is large relative to it near rest."""
    law = custom(odd(lambda v: 0.3 * (1.0 - math.exp(-v / 0.01))))
    speeds = places(1.01e-8)
    exact = -0.3 * np.expm1(-speeds / 0.01)
    found = errors(law, BRAKES[0], speeds)[0]
    assert np.all(found <= 2e-14 + 3e-16 / exact)


@pytest.mark.parametrize("width", [0.01, 1.0, 10.0, 100.0])
def test_drag_slows_down_as_the_closed_form_says(width: float) -> None:
    """v' = -v^2/100 from 100 rad/s: 100/(1 + t)."""
    held = contact("disc", radius=1.0, friction=custom(drag, width), force=100.0)
    found = wb.simulate(single(held, name="disc", inertia=1.0, speed=100.0), 1.0)
    assert found.attrs["status"] == "completed"
    assert float(found["velocity"][-1, 0]) == pytest.approx(50.0, rel=1e-14)


def test_coulomb_and_viscous_friction_slow_down_as_the_closed_form_says() -> None:
    """v' = -(0.3 + 0.02 v) stops after ln(1 + 0.02 v_0/0.3)/0.02."""
    held = contact("disc", radius=1.0, friction=POLYNOMIALS["viscous"], force=1.0)
    machine = single(held, name="disc", inertia=1.0, speed=5.0)
    found = wb.simulate(machine, 30.0, method="smooth", until="rest")
    assert float(found.attrs["final_time"]) == pytest.approx(50.0 * math.log(4.0 / 3.0), rel=1e-14)


def test_a_driveline_and_its_machine_move_as_scipy_says() -> None:
    system = wb.paper.system(eta=-10.0, F0=0.06, brake="wedge").replace(friction=custom(steep))
    line, actuation, wave = system.driveline, system.actuation, system.excitation
    radius, near = system.brake.radius, 1e-8

    def rates(t: float, u: Any) -> list[float]:
        speed = radius * u[1]
        m = steep(speed) if abs(speed) >= near else steep(near) / near * speed
        push = radius * actuation.force(u[1]) * system.brake.amplification(m)
        wave_now = wave.amplitude * math.sin(2.0 * math.pi * wave.frequency * t)
        return [u[1], (wave_now - line.damping * u[1] - line.stiffness * u[0] - push)
                / line.inertia]  # fmt: skip

    direct = wb.simulate(system, periods=1, rtol=1e-12)
    end = float(direct.time[-1])
    start = [float(direct.angle[0]), float(direct.velocity[0])]
    expected = solve_ivp(
        rates, (0.0, end), start, "Radau", rtol=1e-11, atol=1e-13, max_step=end / 1000.0
    ).y[0, -1]
    found = wb.simulate(system.machine, end, method="smooth")
    size = float(np.abs(direct.angle).max())
    assert float(found.angle[-1, 0]) == pytest.approx(float(direct.angle[-1]), abs=1e-11 * size)
    assert float(found.angle[-1, 0]) == pytest.approx(expected, abs=1e-8 * size)


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (lambda v: 0.3 / math.cosh(v), "OverflowError"),
        (lambda v: 0.3 - 0.01 * v, "not negative"),
        (lambda v: 0.3 if v < 0.7 else 0.2, "not smooth"),
    ],
    ids=["overflow", "negative", "jump"],
)
def test_laws_that_are_no_curves_are_refused(law: Any, words: str) -> None:
    held = contact("disc", friction=Curve(law=law))
    with pytest.raises(InputError, match=words) as refused:
        curved_lines(held)
    assert refused.value.name == f"{held.name}.friction"


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        (lambda v: 0.2 + 0.1 * math.exp(-v), []),
        (lambda v: 0.2 + 0.1 * abs(v - 1.0), [1.0]),
        (lambda v: 0.2 + 0.1 * max(v - 1.0, 0.0) ** 2, []),
    ],
    ids=["smooth", "kink", "curvature"],
)
def test_a_stated_bend_counts_where_the_slope_changes(law: Any, expected: list[float]) -> None:
    friction = Curve(law=law, bends_at=(1.0,))
    lines, _ = curved_lines(contact("disc", radius=1.0, friction=friction))
    assert [one.start for one in lines if one.bends] == expected


def test_bends_as_a_line_of_the_class() -> None:
    class Bent(wb.SetValuedFriction):
        breakaway = 0.4
        bends = (0.5, 2.0)

        def kinetic_at(self, speed: float) -> float:
            return 0.4 - 0.1 * min(max(speed - 0.5, 0.0), 1.5)

    lines, _ = curved_lines(contact("disc", radius=1.0, friction=Bent()))
    assert [one.start for one in lines if one.bends] == [0.5, 2.0]


@pytest.mark.parametrize("steepness", [60.0, 2000.0])
def test_a_smoothed_law_with_a_peak_moves_as_scipy_says(steepness: float) -> None:
    # Far from rest tanh is 1 to all digits: the cells there do not see that it will change.
    friction = wb.SmoothedFriction(kinetic=0.25, static=0.4, decay=8.0, steepness=steepness)
    brake = wb.LeadingShoeBrake(actuation_arm=0.2, normal_arm=0.1, friction_arm=0.06, radius=0.15)
    law = wb.Actuation(initial_force=80.0, slope=-2.0)
    machine = wb.Machine(
        inertias=[wb.Inertia("disc", 0.7, speed=6.0)],
        shafts=[wb.Shaft("disc", "ground", stiffness=300.0, damping=0.2)],
        contacts=[wb.Contact("disc", name="brake", brake=brake, friction=friction, actuation=law)],
        torques=[wb.Torque("disc", wb.Harmonic(90.0, 2.1), name="engine")],
    )  # fmt: skip

    def rates(t: float, y: np.ndarray) -> list[float]:
        v = 0.15 * y[1]
        m = (0.25 + 0.15 * math.exp(-8.0 * abs(v))) * math.tanh(steepness * v)
        push = 0.15 * m * 0.2 / (0.1 - 0.06 * m) * max(80.0 - 2.0 * abs(y[1]), 0.0)
        load = 90.0 * math.sin(2.0 * math.pi * 2.1 * t)
        return [y[1], (load - 300.0 * y[0] - 0.2 * y[1] - push) / 0.7]

    response = wb.simulate(machine, duration=1.0, method="smooth")
    events = np.unique(np.concatenate([[0.0, 1.0], response["event_time"].to_numpy()]))
    state = np.array([0.0, 6.0])
    for begin, end in pairwise(events):  # the force has a kink where the disc reverses
        found = solve_ivp(rates, (begin, end), state, method="DOP853", rtol=1e-12, atol=1e-14)
        state = found.y[:, -1]
    assert response.sizes["event"] >= 2
    assert response["angle"].to_numpy()[-1, 0] == pytest.approx(state[0], abs=2e-10)
    assert response["velocity"].to_numpy()[-1, 0] == pytest.approx(state[1], abs=2e-9)


def test_the_slope_of_a_smoothed_law_is_that_of_its_torque() -> None:
    friction = wb.SmoothedFriction(kinetic=0.25, static=0.4, decay=8.0, steepness=60.0)
    brake = wb.WedgeBrake(angle=0.5, radius=0.15)
    given = Sliding("brake", brake, friction, wb.Actuation(initial_force=1.0))
    line = lines_of(given, curved=True).rows[0]
    with mp.workdps(40):
        for speed in (-9.0, -0.4, -0.02, 1e-6, 0.03, 0.7, 12.0):

            def gain(v: Any) -> Any:
                u = mp.mpf(0.15) * v
                m = (0.25 + mp.mpf(0.4 - 0.25) * mp.exp(-8 * abs(u))) * mp.tanh(60 * u)
                return mp.mpf(0.15) * m / (mp.tan(mp.mpf(0.5)) - m)

            side = 1 if speed > 0.0 else -1
            value, slope = curve_gain(line, side, speed)
            assert value == pytest.approx(float(gain(mp.mpf(speed))), rel=4e-15)
            assert slope == pytest.approx(float(mp.diff(gain, mp.mpf(speed))), rel=1e-13)

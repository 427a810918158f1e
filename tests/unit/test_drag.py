"""Drag over the speed, against closed forms and another integrator."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import wedgebrake as wb
from machines import pressed


def wheel(*contacts: Any, speed: float = 100.0, torque: Any = None) -> wb.Machine:
    """An inertia of 2 kg m^2."""
    return wb.Machine(
        inertias=[wb.Inertia("wheel", 2.0, speed=speed)], contacts=contacts,
        torques=[] if torque is None else [wb.Torque("wheel", torque, name="load")],
    )  # fmt: skip


def speeds(machine: wb.Machine, times: Any) -> Any:
    found = wb.simulate(machine, float(times[-1]), times=times, method="smooth")
    return found["velocity"].to_numpy()[:, 0]


TIMES = np.linspace(0.0, 40.0, 41)


class TestMotion:
    @pytest.mark.parametrize("speed", [100.0, -100.0, 1e-3])
    def test_quadratic(self, speed: float) -> None:
        right = speed / (1.0 + 0.02 * abs(speed) * TIMES / 2.0)
        found = speeds(wheel(wb.Drag("wheel", quadratic=0.02), speed=speed), TIMES)
        assert found == pytest.approx(right, rel=1e-13)

    def test_linear(self) -> None:
        found = speeds(wheel(wb.Drag("wheel", 0.5)), TIMES)
        assert found == pytest.approx(100.0 * np.exp(-0.25 * TIMES), rel=1e-12)

    def test_both(self) -> None:
        """1/omega obeys a linear equation."""
        a, b = 0.5 / 2.0, 0.02 / 2.0
        right = a / ((a / 100.0 + b) * np.exp(a * TIMES) - b)
        found = speeds(wheel(wb.Drag("wheel", 0.5, 0.02)), TIMES)
        assert found == pytest.approx(right, rel=1e-12)

    def test_towards_the_terminal_speed(self) -> None:
        end = math.sqrt(8.0 / 0.02)
        found = speeds(
            wheel(wb.Drag("wheel", 0.0, 0.02), speed=0.0, torque=wb.Constant(8.0)), TIMES
        )
        assert found == pytest.approx(end * np.tanh(8.0 / 2.0 / end * TIMES), rel=1e-12, abs=1e-13)

    def test_none_is_none(self) -> None:
        given = wheel(wb.Drag("wheel"), torque=wb.Harmonic(3.0, 0.2))
        plain = wb.simulate(wheel(torque=wb.Harmonic(3.0, 0.2)), 40.0, times=TIMES)
        assert speeds(given, TIMES) == pytest.approx(plain["velocity"].to_numpy()[:, 0], rel=1e-13)

    @pytest.mark.parametrize("method", [None, "smooth"])
    def test_back_and_forth(self, method: str | None) -> None:
        """The direction changes with every half period; the integrator knows no events."""
        given = wheel(wb.Drag("wheel", 0.3, 0.7), speed=0.0, torque=wb.Harmonic(20.0, 0.25))

        def rates(t: float, w: Any) -> Any:
            load = 20.0 * math.sin(0.5 * math.pi * t)
            return (load - 0.3 * w - 0.7 * abs(w) * w) / 2.0

        right = solve_ivp(rates, (0.0, 40.0), [0.0], t_eval=TIMES, method="DOP853", rtol=1e-12,
                          atol=1e-13)  # fmt: skip
        found = wb.simulate(given, 40.0, times=TIMES, **({"method": method} if method else {}))
        assert found["velocity"].to_numpy()[:, 0] == pytest.approx(right.y[0], abs=1e-9)
        assert found.attrs["method"] == "smooth"
        assert wb.energy(found)["residual"] == pytest.approx(0.0, abs=1e-12)

    def test_between_two_inertias(self) -> None:
        """A fluid coupling: the relative speed has the reduced inertia, the mean speed is kept."""
        given = wb.Machine(
            inertias=[wb.Inertia("pump", 2.0, speed=90.0), wb.Inertia("turbine", 1.0)],
            contacts=[wb.Drag("pump", quadratic=0.04, relative_to="turbine", name="coupling")],
        )
        found = wb.simulate(given, 40.0, times=TIMES, method="smooth")["velocity"].to_numpy()
        assert found @ [2.0, 1.0] == pytest.approx(180.0, rel=1e-14)
        relative = 90.0 / (1.0 + 0.04 * 90.0 * TIMES / (2.0 / 3.0))
        assert found[:, 0] - found[:, 1] == pytest.approx(relative, rel=1e-12)

    def test_with_a_brake(self) -> None:
        """A wheel that slows down under both stops: 2 w' = -5 - 0.02 w^2."""
        given = wheel(wb.Drag("wheel", 0.0, 0.02), pressed("wheel", force=5.0))
        found = wb.simulate(given, 100.0, until="rest", method="smooth", times=[])
        root = math.sqrt(5.0 * 0.02)
        right = 2.0 / root * math.atan(100.0 * 0.02 / root)
        assert found["event_time"].to_numpy()[-1] == pytest.approx(right, rel=1e-13)

    def test_relative_to_a_driven_body(self) -> None:
        given = wb.Machine(
            inertias=[wb.Inertia("boat", 2.0), wb.Driven("stream", 3.0)],
            contacts=[wb.Drag("boat", quadratic=0.5, relative_to="stream", name="hull")],
        )
        found = wb.simulate(given, 40.0, times=TIMES, method="smooth")["velocity"].to_numpy()
        right = 3.0 - 3.0 / (1.0 + 0.5 * 3.0 * TIMES / 2.0)
        assert found[:, 0] == pytest.approx(right, rel=1e-12, abs=1e-14)


class TestAnalysis:
    def test_exact_is_refused(self) -> None:
        with pytest.raises(wb.InputError) as caught:
            wb.simulate(wheel(wb.Drag("wheel", 0.3, 0.7)), 1.0, method="exact")
        assert caught.value.name == "method"

    def test_linear_stability(self) -> None:
        found = wb.stability(wheel(wb.Drag("wheel", 0.3, 0.7), speed=5.0))
        assert found.growth_rate == pytest.approx(-(0.3 + 2.0 * 0.7 * 5.0) / 2.0, rel=1e-8)

    def test_steady_sliding(self) -> None:
        given = wheel(wb.Drag("wheel", 0.3, 0.7), torque=wb.Constant(20.0))
        (found,) = wb.steady_sliding(given)
        right = (math.sqrt(0.3**2 + 4.0 * 0.7 * 20.0) - 0.3) / (2.0 * 0.7)
        assert found["wheel"] == pytest.approx(right, rel=1e-13)

    def test_study(self, tmp_path: Path) -> None:
        file = tmp_path / "drag.toml"
        given = wheel(wb.Drag("wheel", 0.3, 0.7), speed=5.0)
        text = wb.save_study(wb.Study(given), file).read_text()
        assert "[[drag]]" in text
        assert wb.read_study(text).system == given
        assert given.replace({"wheel-drag.quadratic": 0.9}).value("wheel-drag.quadratic") == 0.9

    @pytest.mark.parametrize(
        ("values", "name"),
        [
            ({"on": "ground"}, "drag.on"),
            ({"relative_to": "wheel"}, "drag.relative_to"),
            ({"linear": -1.0}, "drag.linear"),
            ({"quadratic": math.inf}, "drag.quadratic"),
            ({"on": "nobody"}, "drag.on"),
            ({"relative_to": "nobody"}, "drag.relative_to"),
        ],
    )
    def test_wrong(self, values: Any, name: str) -> None:
        with pytest.raises(wb.InputError) as caught:
            wheel(wb.Drag(**({"on": "wheel", "name": "drag"} | values)))
        assert caught.value.name == name


def test_derivatives_beside_an_equilibrium() -> None:
    """The motion does not change, but its neighbours approach it: cells must resolve them."""
    machine = wb.Machine(
        inertias=[wb.Inertia("wheel", 1.0, speed=2.0)],
        contacts=[wb.Drag("wheel", linear=5.0, name="air")],
        torques=[wb.Torque("wheel", 10.0, name="engine")],
    )
    times = np.array([0.5, 1.0, 3.0])
    names = ["wheel.speed", "engine.value", "air.linear"]
    found = wb.sensitivity(machine, names, 3.0, times=times)["velocity"][..., 0]
    decay = np.exp(-5.0 * times)
    expected = np.array([decay, (1.0 - decay) / 5.0, -2.0 * (1.0 - decay) / 5.0])
    assert found.to_numpy() == pytest.approx(expected, rel=1e-10)

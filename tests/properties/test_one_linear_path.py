"""Linear stability of drivelines with any actuator, against matrices that are assembled here."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.linalg import expm

import wedgebrake as wb
from wedgebrake.analysis.linear_stability import sliding_damping

TABLE = wb.TabulatedFriction(speeds=(0.0, 0.5, 2.0), coefficients=(0.35, 0.25, 0.3))
FRICTIONS = {
    "coulomb": wb.CoulombFriction(kinetic=0.3, static=0.35),
    "table": TABLE,
    "stribeck": wb.StribeckFriction(kinetic=0.25, static=0.35, speed=0.5),
}
FORCE = wb.Harmonic(50.0, 3.0, phase=0.5) + wb.Constant(400.0)
ACTUATIONS: dict[str, dict[str, Any]] = {
    "direct": {},
    "lag": {"lag": 0.02},
    "second order": {"frequency": 60.0, "damping_ratio": 0.7},
    "limits": {"limits": (100.0, 350.0)},
    "lag and limits": {"limits": (100.0, 500.0), "lag": 0.02},
    "sampling": {"sample_time": 0.004},
    "delay": {"sample_time": 0.004, "delay": 2},
    "sampling and lag": {"sample_time": 0.004, "lag": 0.02},
    "signal": {"initial_force": FORCE},
    "speed": {"drive_speed": wb.Ramp(6.0, 9.0, 2.0)},
}


class Numbers(NamedTuple):
    """Numbers of a driveline with a wedge brake."""

    inertia: float
    damping: float
    stiffness: float
    tangent: float
    force: float
    slope: float
    drive_speed: float


ROUND = (
    Numbers(1.0, 1.0, 1e4, 0.5, 300.0, 0.0, 0.0),
    Numbers(1.0, 0.5, 100.0, 0.5, 300.0, -20.0, 5.0),
    Numbers(2.0, 1.0, 400.0, 0.5, 300.0, 10.0, -5.0),
    Numbers(0.5, 0.0, 50.0, 0.75, 200.0, 4.0, 0.0),
)


def random_numbers(count: int) -> list[Numbers]:
    random = np.random.default_rng(5)
    found = []
    for _ in range(count):
        inertia, natural = random.uniform(0.1, 3.0), random.uniform(5.0, 150.0)
        found.append(
            Numbers(
                inertia, random.uniform(0.0, 2.0), inertia * natural**2, random.uniform(0.4, 1.0),
                random.uniform(150.0, 400.0), random.uniform(-20.0, 20.0),
                float(random.choice([0.0, random.uniform(-12.0, 12.0)])),
            )
        )  # fmt: skip
    return found


NUMBERS = [*ROUND, *random_numbers(8)]


def system_of(one: Numbers, friction: str, actuation: dict[str, Any]) -> wb.BrakedDriveline:
    given = {"drive_speed": one.drive_speed, "initial_force": one.force, **actuation}
    speed = given.pop("drive_speed")
    return wb.BrakedDriveline(
        driveline=wb.Driveline(
            inertia=one.inertia, damping=one.damping, stiffness=one.stiffness, drive_speed=speed
        ),
        brake=wb.WedgeBrake(angle=math.atan(one.tangent), radius=0.2),
        friction=FRICTIONS[friction],
        actuation=wb.Actuation(slope=one.slope, **given),
        excitation=wb.HarmonicTorque(amplitude=0.0, frequency=1.0),
    )


def at_start(value: Any) -> float:
    return float(value) if isinstance(value, float) else float(value(0.0))


class Expected(NamedTuple):
    """The linear system of a direction: eigenvalues or multipliers, and the steady damping."""

    values: np.ndarray
    damping: float


def expected(system: wb.BrakedDriveline, side: int) -> Expected:
    """J q'' + c q' + k q = -R g dF - b q', with g = m/(tan(a) - m) and b = R^2 F g'(m) mu'."""
    line, given, law = system.driveline, system.actuation, system.friction
    radius, tangent = system.brake.radius, math.tan(system.brake.angle)
    speed = abs(at_start(line.drive_speed))
    if isinstance(law, wb.CoulombFriction):
        mu, rise = 0.3, 0.0
    elif isinstance(law, wb.StribeckFriction):
        mu = 0.25 + 0.1 * math.exp(-radius * speed / 0.5)
        rise = -(mu - 0.25) / 0.5
    else:
        low = radius * speed < 0.5
        mu = 0.35 - 0.2 * radius * speed if low else 0.25 + (radius * speed - 0.5) / 30.0
        rise = -0.2 if low else 1.0 / 30.0
        if radius * speed >= 2.0:
            mu, rise = 0.3, 0.0
    m = side * mu
    gain = radius * m / (tangent - m)
    low_limit, high_limit = given.limits or (0.0, math.inf)
    command = at_start(given.initial_force) + given.slope * speed
    force = min(max(command, low_limit), high_limit)
    feedback = side * given.slope if low_limit < command < high_limit else 0.0
    b = radius**2 * force * tangent / (tangent - m) ** 2 * rise
    lag: np.ndarray = np.zeros((0, 0))
    if given.lag > 0.0:
        lag = np.array([[-1.0 / given.lag]])
    elif given.frequency is not None:
        square = given.frequency**2
        lag = np.array([[0.0, 1.0], [-square, -2.0 * given.damping_ratio * given.frequency]])
    n = 2 + len(lag)
    a, by_command = np.zeros((n, n)), np.zeros(n)
    a[:2, :2] = [[0.0, 1.0], [-line.stiffness, -(line.damping + b)]]
    a[2:, 2:] = lag
    a[1, :2] /= line.inertia
    if len(lag):
        follows = low_limit < command < high_limit
        a[1, 2] = -gain * follows / line.inertia
        by_command[-1] = -lag[-1, 0]
    else:
        by_command[1] = -gain / line.inertia
    damping = line.damping + b + gain * feedback
    commanded = np.zeros(n)
    commanded[1] = feedback if not len(lag) or feedback else side * given.slope
    if given.sample_time is None or feedback == 0.0:
        if given.sample_time is None:
            a = a + np.outer(by_command, commanded)
        return Expected(np.linalg.eigvals(a), damping)
    held = expm(np.block([[a, by_command[:, None]], [np.zeros((1, n + 1))]]) * given.sample_time)
    step, acting = held[:n, :n], held[:n, n]
    # The state, and the commands that wait for ``delay`` samples, the next to act first.
    total = n + given.delay
    matrix = np.zeros((total, total))
    matrix[:n, :n] = step
    if given.delay == 0:
        matrix[:n, :n] += np.outer(acting, commanded)
    else:
        matrix[:n, n] = acting
        matrix[n : total - 1, n + 1 :] = np.eye(given.delay - 1)
        matrix[-1, :n] = commanded
    return Expected(np.linalg.eigvals(matrix), damping)


def ordered(values: Any) -> np.ndarray:
    """Values in an order that does not depend on rounding."""
    return np.array(sorted(values, key=lambda one: (round(abs(one), 6), round(one.imag, 6))))


@pytest.mark.parametrize("actuation", ACTUATIONS)
@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("one", NUMBERS)
def test_eigenvalues(one: Numbers, friction: str, actuation: str) -> None:
    system = system_of(one, friction, ACTUATIONS[actuation])
    found = wb.stability(system)
    speed = at_start(system.driveline.drive_speed)
    dampings, states = [], []
    for direction in (found.forward, found.backward):
        if speed * direction.direction < 0.0:
            assert direction.speed is None
            continue
        truth = expected(system, direction.direction)
        assert direction.speed == abs(speed)
        assert not direction.locked
        assert direction.damping == pytest.approx(truth.damping, rel=1e-6, abs=1e-6)
        dampings.append(direction.damping)
        states.append(direction.state)
        (case,) = (one for one in found.cases if one.directions["brake"] == direction.direction)
        assert direction.eigenvalues == case.eigenvalues
        values = case.eigenvalues if case.multipliers is None else case.multipliers
        scale = np.abs(truth.values).max()
        np.testing.assert_allclose(ordered(values), ordered(truth.values), atol=1e-6 * scale)
        if case.multipliers is None:
            growth = truth.values.real.max()
        else:
            growth = math.log(np.abs(truth.values).max()) / system.actuation.sample_time
        assert case.growth_rate == pytest.approx(growth, rel=1e-6, abs=1e-6)
        if abs(growth) > 1e-6:
            assert direction.stable == (growth < 0.0)
    assert found.stable == all(one == "decays" for one in states)
    assert found.damping == sliding_damping(system) == min(dampings)


@pytest.mark.parametrize("method", ["curve", "exact"])
@pytest.mark.parametrize("actuation", ACTUATIONS)
@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("one", NUMBERS)
def test_a_driveline_and_its_machine(
    one: Numbers, friction: str, actuation: str, method: Any
) -> None:
    """The verdict on a driveline is that on the machine that is written as such."""
    system = system_of(one, friction, ACTUATIONS[actuation])
    machine = wb.Machine(
        inertias=[wb.Inertia("disc", one.inertia)],
        shafts=[wb.Shaft("disc", "ground", stiffness=one.stiffness, damping=one.damping)],
        contacts=[
            wb.Contact(
                "disc", name="brake", brake=system.brake, friction=system.friction,
                actuation=system.actuation,
                base_speed=-1.0 * system.driveline.drive_speed,
            )
        ],
    )  # fmt: skip
    lined = method == "exact" and friction != "coulomb"
    if lined and not system.actuation.straight:
        for given in (system, machine):
            with pytest.raises(wb.InputError, match=r"^brake\.friction = .*'curve'"):
                wb.stability(given, method=method)
        return
    found, expected_ = wb.stability(system, method=method), wb.stability(machine, method=method)
    assert found.stable == expected_.stable
    assert [one.as_dict() for one in found.cases] == [one.as_dict() for one in expected_.cases]
    assert found.growth_rate == expected_.growth_rate
    assert found.method == expected_.method == method
    if friction == "coulomb":
        assert found.as_dict() == wb.stability(system).as_dict() | {"method": method}


class TestLag:
    """Limits of a driveline with a lag: R delta |g| = -c [1 + k T^2/(J + c T)]."""

    SYSTEM = wb.paper.system(eta=-1.0).replace(lag=0.02)

    def limit(self, side: int) -> tuple[float, float]:
        line, lag = self.SYSTEM.driveline, 0.02
        total = line.inertia + line.damping * lag
        torque = -line.damping * (1.0 + line.stiffness * lag**2 / total)
        gain = 0.2 * abs(self.SYSTEM.brake.amplification(0.3 * side))
        return torque / gain, math.sqrt(line.stiffness / total) / math.tau

    def test_hopf(self) -> None:
        slope, frequency = self.limit(1)
        found = wb.hopf(self.SYSTEM, "slope", between=(0.0, 2.1 * slope))
        assert (found.kind, found.below, found.above) == ("hopf", "unstable", "stable")
        assert found.value == pytest.approx(slope, rel=1e-9)
        assert found.frequency == pytest.approx(frequency, rel=1e-9)
        for share, stable in ((1.0 + 1e-6, False), (1.0 - 1e-6, True)):
            verdict = wb.stability(self.SYSTEM.replace(slope=share * slope))
            assert verdict.stable == stable
            assert verdict.forward.hopf_slope is None

    def test_the_map(self) -> None:
        slope, _ = self.limit(1)
        eta = self.SYSTEM.replace(slope=slope).groups.eta
        chart = wb.stability_map(self.SYSTEM, eta=[eta * (1.0 + 1e-6), eta * (1.0 - 1e-6)])
        assert chart.stable.values.tolist() == [False, True]
        assert np.sign(chart.growth.values).tolist() == [1.0, -1.0]
        assert not chart.locked.any()

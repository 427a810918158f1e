"""Bifurcations of the friction of machines over two parameters."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq, fsolve
from test_machine_orbits import controlled, train

import wedgebrake as wb
from machines import block, contact, general, in_row, pressed, stribeck

WEDGE = wb.paper.system(eta=-24.0, F0=0.09)
CONVENTIONAL = wb.paper.system(eta=0.0, F0=0.09, brake="conventional")


class Case(NamedTuple):
    """A bifurcation of a driveline, over one parameter and over two.

    over   : the first parameter, from where to where the branch goes
    ranges : of both parameters
    """

    kind: str
    system: Any
    order: int
    over: tuple[str, float, float]
    ranges: dict[str, tuple[float, float]]


SLOPES = {"slope": (-43.0, -37.0)}
CASES = [
    Case("grazing-sliding", WEDGE, 1, ("amplitude", 304.0, 314.0),
         {"amplitude": (290.0, 325.0), **SLOPES}),
    Case("switching-sliding", WEDGE, 1, ("amplitude", 296.0, 304.0),
         {"amplitude": (280.0, 318.0), **SLOPES}),
    Case("adding-sliding", wb.paper.system(eta=-36.0, F0=0.036), 2, ("slope", -36.0, -34.0),
         {"slope": (-36.0, -32.0), "amplitude": (480.0, 515.0)}),
    Case("crossing-sliding", CONVENTIONAL, 1, ("amplitude", 33.0, 28.0),
         {"amplitude": (20.0, 60.0), "initial_force": (270.0, 330.0)}),
]  # fmt: skip
NAMES = {
    "amplitude": "torque.amplitude", "slope": "brake.slope", "initial_force": "brake.initial_force",
}  # fmt: skip


def first(kind: str, branch: Any) -> Any:
    """The first bifurcation of a kind on a branch."""
    return next(p for p in branch if p.bifurcation and p.bifurcation.kind.value == kind)


def inner(curve: Any) -> list[int]:
    """Numbers of some points of a curve that are not its ends."""
    count = curve.sizes["point"]
    assert count > 4
    return [count // 3, 2 * count // 3]


@pytest.mark.parametrize("case", CASES, ids=[case.kind for case in CASES])
def test_curves_of_a_machine_are_those_of_its_driveline(case) -> None:
    """At the same second parameter, the driveline's segments give the same value to 1e-8."""
    name, begin, end = case.over
    system = case.system.replace(**{name: begin})
    orbit = wb.orbit(general(system.machine), case.order)
    branch = wb.continuation(orbit, {NAMES[name]: (begin, end)}, step=0.1)
    ranges = {NAMES[one]: ends for one, ends in case.ranges.items()}
    curve = wb.boundary(first(case.kind, branch), step=0.2, **ranges)
    assert curve.attrs["bifurcation"] == case.kind
    (second,) = (one for one in case.ranges if one != name)
    width = abs(case.ranges[name][1] - case.ranges[name][0])
    for k in inner(curve)[1:]:
        value, other = float(curve[NAMES[name]][k]), float(curve[NAMES[second]][k])
        there = system.replace(**{second: other, name: value + 3e-4 * width})
        state = float(curve["angle"][k]), float(curve["velocity"][k])
        near = wb.orbit(there, case.order, initial=state)
        along = wb.continuation(
            near, step=0.05, **{name: (value + 1e-3 * width, value - 1e-3 * width)}
        )
        values = [p.value for p in along if p.bifurcation and p.bifurcation.kind.value == case.kind]
        assert np.min(np.abs(np.array(values) - value)) <= 1e-8 * width


STIFFNESS, DAMPING, INERTIA = (4.0, 6.0), (0.125, 0.0625), (1.0, 0.5)
FREQUENCY, PHASE, CLUTCH = 0.25, 0.3, 0.5


def pair(amplitude: float = 2.0, second: float = 0.0) -> Any:
    """Two inertias, a brake on the first and a clutch between them.

    second : amplitude of a second harmonic, with which no half of an orbit mirrors the other
    """
    return in_row(
        pressed("a"), pressed("b", "a", force=CLUTCH, name="clutch"),
        inertia=INERTIA, stiffness=STIFFNESS, damping=DAMPING,
        engine=wb.Harmonic(amplitude, FREQUENCY, PHASE),
        second=wb.Harmonic(second, 2.0 * FREQUENCY),
    )  # fmt: skip


FORCES = {"engine.amplitude": (0.8, 3.0), "brake.initial_force": (0.8, 1.25)}


@cache
def of_pair(kind: str, begin: float, end: float, second: float) -> Any:
    """The curve of the first bifurcation of a kind of two inertias and two contacts."""
    orbit = wb.orbit(pair(begin, second))
    branch = wb.continuation(orbit, {"engine.amplitude": (begin, end)}, step=0.1)
    return wb.boundary(first(kind, branch), step=0.1, points=6, **FORCES)


def located(kind: str, machine: Any, value: float) -> Iterator[float]:
    """Amplitudes of the torque near a value where branches from either side find a kind."""
    for side in (1e-3, -1e-3):
        near = wb.orbit(machine.replace({"engine.amplitude": value + side}))
        ends = {"engine.amplitude": (value + side, value - side)}
        for point in wb.continuation(near, ends, step=0.5):
            if point.bifurcation and point.bifurcation.kind.value == kind:
                yield point.value


@pytest.mark.parametrize(
    ("kind", "begin", "end", "second"),
    [
        ("grazing-sliding", 2.4, 2.6, 0.0), ("adding-sliding", 1.45, 1.35, 0.1),
        pytest.param("crossing-sliding", 1.2, 1.1, 0.1, marks=pytest.mark.slow),
        pytest.param("crossing-sliding", 1.2, 1.1, 0.0, marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_curves_of_two_inertias_go_through_points_located_over_one_parameter(
    kind, begin, end, second
) -> None:
    curve = of_pair(kind, begin, end, second)
    for k in inner(curve):
        value = float(curve["engine.amplitude"][k])
        there = pair(second=second).replace(
            {"brake.initial_force": float(curve["brake.initial_force"][k])}
        )
        assert any(abs(one - value) <= 1e-9 for one in located(kind, there, value))


SPEEDS = np.array([[0, 0, 1, 0, 0, 0, 0], [0, 0, -1, 1, 0, 0, 0]], float)


def rates(amplitude: float, force: float, sides: np.ndarray) -> np.ndarray:
    """Matrix of (angles, speeds, sine and cosine of the torque, 1), with contacts that slide."""
    (k, m), (c, d), omega = STIFFNESS, DAMPING, 2.0 * math.pi * FREQUENCY
    matrix = np.zeros((7, 7))
    matrix[0, 2] = matrix[1, 3] = 1.0
    matrix[2, :4], matrix[3, :4] = (-k - m, m, -c - d, d), (m, -m, d, -d)
    matrix[2, 6], matrix[3, 6] = -sides[0] * force + sides[1] * CLUTCH, -sides[1] * CLUTCH
    matrix[3, 4] = amplitude
    matrix[2:4] /= np.array(INERTIA)[:, None]
    matrix[4, 5], matrix[5, 4] = omega, -omega
    return matrix


def test_a_graze_of_two_inertias_is_a_root_of_matrix_exponentials() -> None:
    """The contacts only reverse; once, the clutch has neither sliding speed nor acceleration."""
    curve = of_pair("grazing-sliding", 2.4, 2.6, 0.0)
    amplitude, force = (float(curve[name][inner(curve)[1]]) for name in FORCES)
    machine = pair(amplitude + 1e-4).replace({"brake.initial_force": force})
    orbit = wb.orbit(machine)
    assert orbit.stick_share == 0.0
    response = wb.simulate(machine, 4.0, initial=orbit.initial, times=[])
    times = response["event_time"].values
    contacts = response["event_contact"].values.astype(int)
    begin = np.array([mode[0] for mode in orbit.initial.modes])
    inputs = [math.sin(PHASE), math.cos(PHASE), 1.0]

    def parts(ends: np.ndarray, amplitude: float) -> Any:
        """Duration, matrix and sides of each part between events."""
        sides = begin.copy()
        for number, length in enumerate(np.diff([0.0, *ends, 1.0 / FREQUENCY])):
            yield length, rates(amplitude, force, sides), sides.copy()
            if number < len(contacts):
                sides[contacts[number]] *= -1

    def at(state: np.ndarray, ends: np.ndarray, amplitude: float, time: float) -> Any:
        """State and matrix at a time."""
        for length, matrix, _ in parts(ends, amplitude):
            if time <= length:
                return expm(time * matrix) @ state, matrix
            state, time = expm(length * matrix) @ state, time - length
        raise AssertionError

    def equations(u: np.ndarray) -> np.ndarray:
        start, ends, instant, amplitude = np.append(u[:4], inputs), u[4:-2], u[-2], u[-1]
        state, values = start, []
        for number, (length, matrix, _) in enumerate(parts(ends, amplitude)):
            state = expm(length * matrix) @ state
            if number < len(contacts):
                values.append(SPEEDS[contacts[number]] @ state)
        touched, matrix = at(start, ends, amplitude, instant)
        graze = [SPEEDS[1] @ touched, SPEEDS[1] @ matrix @ touched]
        return np.array([*(state - start)[:4], *values, *graze])

    start = orbit.points[0]
    apart = np.linspace(0.0, 1.0 / FREQUENCY, 4001)[1:-1]
    apart = apart[np.min(np.abs(apart[:, None] - times[contacts == 1]), axis=1) > 0.02]
    slow = [abs(SPEEDS[1] @ at(np.append(start, inputs), times, amplitude, t)[0]) for t in apart]
    guess = np.array([*start, *times, apart[int(np.argmin(slow))], amplitude + 1e-4])
    root, *_, message = fsolve(equations, guess, xtol=1e-13, full_output=True)
    assert np.max(np.abs(equations(root))) <= 1e-11, message
    assert amplitude == pytest.approx(root[-1], abs=1e-9)


def test_a_cycle_on_a_smooth_curve_of_friction_grazes_where_scipy_says() -> None:
    """A cycle that begins at its graze, x'' = 0 at the speed of the belt, returns to it there."""
    machine = block(stribeck(), 1.25).replace({"block.angle": 0.8, "block.speed": 1.25})
    orbit = wb.orbit(machine, method="smooth")
    branch = wb.continuation(orbit, {"belt.base_speed": (0.5, 3.0)}, step=0.05)
    ends = {"belt.base_speed": (0.5, 3.0), "belt.kinetic": (0.4, 0.6)}
    curve = wb.boundary(first("grazing-sliding", branch), points=4, **ends)

    def excess(speed: float, kinetic: float) -> float:
        """Speed relative to the belt at the next maximum of the speed."""

        def acceleration(x: float, v: float) -> float:
            return kinetic + (1.0 - kinetic) * math.exp(-(speed - v) / 0.5) - 0.1 * v - x

        def peak(_: float, state: np.ndarray) -> float:
            return acceleration(*state)

        peak.direction, peak.terminal = -1.0, True  # type: ignore[attr-defined]
        start = np.array([1.0 - 0.1 * speed, speed])
        settings = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14}
        ahead = solve_ivp(lambda _, s: (s[1], acceleration(*s)), (0.0, 0.1), start, **settings).y[
            :, -1
        ]
        found = solve_ivp(
            lambda _, s: (s[1], acceleration(*s)), (0.1, 20.0), ahead, events=peak, **settings
        )
        return float(found.y_events[0][0, 1]) - speed

    for speed, kinetic in zip(
        curve["belt.base_speed"].values, curve["belt.kinetic"].values, strict=True
    ):
        root = brentq(excess, speed - 1e-3, speed + 1e-3, args=(kinetic,), xtol=1e-13)
        assert speed == pytest.approx(root, abs=1e-8)


def modulus_errors(curve: Any) -> np.ndarray:
    """Distance from 1 of the product of two multipliers, of the pair that is nearest to it."""
    multipliers = curve["multiplier_real"].values + 1j * curve["multiplier_imag"].values
    first, second = np.triu_indices(multipliers.shape[1], 1)
    return np.min(np.abs(multipliers[:, first] * multipliers[:, second] - 1.0), axis=1)


def test_a_torus_of_sliding_ends_where_sliding_ends() -> None:
    """The flow is linear up to there: neither slope nor shape depends on the amplitude."""
    machine = controlled(9.0, delay=3).replace(
        {"brake.initial_force": 20.0, "engine.amplitude": 0.2, "brake.slope": 0.1}
    )
    over = {"brake.slope": (0.1, 1.5)}
    torus = first("Neimark-Sacker", wb.continuation(wb.orbit(machine), over, step=0.1))

    def excess(slope: float) -> float:
        return (
            abs(wb.stability(machine.replace({"brake.slope": slope})).cases[0].multipliers[0]) - 1
        )

    run = wb.simulate(torus.system, 4.0, initial=torus.initial, times=np.linspace(0.0, 4.0, 8001))
    peak = float(run["velocity"].sel(inertia="a").max())
    ends = {"brake.slope": (0.1, 1.5), "engine.amplitude": (0.1, 4.0)}
    curve = wb.boundary(torus, step=0.2, points=60, **ends)
    assert np.max(modulus_errors(curve)) <= 1e-9
    slope = brentq(excess, 0.1, 1.5, xtol=1e-13)
    np.testing.assert_allclose(curve["brake.slope"].values, slope, rtol=1e-9)
    reasons = [curve.attrs[name] for name in ("begin", "end")]
    assert "it meets a bifurcation of friction" in reasons
    assert float(curve["engine.amplitude"].max()) == pytest.approx(0.2 * 9.0 / peak, rel=1e-5)


@pytest.mark.parametrize(
    ("ends", "step"),
    [
        ({"belt.base_speed": (0.25, 0.3), "belt.initial_force": (0.8, 1.2)}, 0.1),
        pytest.param(
            {"belt.base_speed": (0.2, 0.35), "b-a.stiffness": (2.0, 4.0)},
            0.05,
            marks=pytest.mark.slow,
        ),
    ],
    ids=["force", "stiffness"],
)
def test_multipliers_of_a_torus_have_the_product_one(ends, step) -> None:
    torus = first(
        "Neimark-Sacker",
        wb.continuation(wb.orbit(train(0.25)), {"belt.base_speed": (0.25, 0.3)}, step=0.1),
    )
    curve = wb.boundary(torus, step=step, points=30, **ends)
    assert curve.sizes["point"] > 5
    assert np.max(modulus_errors(curve)) <= 1e-9


SAMPLES = 16


def sampled(**more: Any) -> Any:
    """The pair, with a brake whose controller samples the sliding speed."""
    values = {"sample_time": 1.0 / (FREQUENCY * SAMPLES), "slope": -0.1, **more}
    return pair(second=0.1).replace({f"brake.{name}": value for name, value in values.items()})


def with_samples(kind: str, begin: float, end: float, delay: int) -> Any:
    """The first bifurcation of a kind over the amplitude of the torque."""
    machine = sampled(delay=delay).replace({"engine.amplitude": begin})
    return first(
        kind, wb.continuation(wb.orbit(machine), {"engine.amplitude": (begin, end)}, step=0.2)
    )


@pytest.mark.parametrize(
    ("kind", "begin", "end", "delay"),
    [
        ("grazing-sliding", 1.615, 1.605, 0),
        pytest.param("switching-sliding", 1.6, 1.59, 0, marks=pytest.mark.slow),
        ("adding-sliding", 1.18, 1.17, 0), ("crossing-sliding", 1.15, 1.14, 2),
        pytest.param("crossing-sliding", 1.137, 1.135, 0, marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_curves_with_samples_go_through_points_located_over_one_parameter(
    kind, begin, end, delay
) -> None:
    point = with_samples(kind, begin, end, delay)
    ranges = {"engine.amplitude": (0.8, 2.2), "brake.initial_force": (0.95, 1.05)}
    curve = wb.boundary(point, step=0.1, points=4, **ranges)
    count = curve.sizes["point"]
    assert count > 4
    for k in (1, count - 2):
        value = float(curve["engine.amplitude"][k])
        there = point.system.replace(
            {"brake.initial_force": float(curve["brake.initial_force"][k])}
        )
        assert any(abs(one - value) <= 1e-9 for one in located(kind, there, value))


def test_an_event_at_a_sampling_is_not_followed() -> None:
    """A reversal becomes a stick because the force jumps at the instant of the sampling."""
    point = with_samples("switching-sliding", 1.47, 1.455, 0)
    run = wb.simulate(point.system, 4.0, initial=point.initial, times=[])
    counts = run["event_time"].values * FREQUENCY * SAMPLES
    assert np.min(np.abs(counts - np.round(counts))) <= 1e-5
    curve = wb.boundary(point, **FORCES)
    assert curve.sizes["point"] == 1
    assert "sampling" in curve.attrs["begin"]


def drill_string() -> wb.Machine:
    """A rotary table that drives a bit by a drill string, with the numbers of Navarro-Lopez.

    E. M. Navarro-Lopez and D. Cortes, Avoiding harmful oscillations in a drillstring through
    dynamical analysis, Journal of Sound and Vibration 307 (2007), 152-171: inertias, stiffness and
    radius. The friction of the rock falls with the speed and is smooth, except for v |v| at rest.
    """
    radius = 0.155575

    def rock(v: float) -> float:
        w = v / 0.155575
        return math.tanh(50.0 * w) * (0.5 + 0.3 / (1.0 + w * w)) + 5e-4 * w * abs(w)

    return wb.Machine(
        inertias=[wb.Inertia("table", 2122.0), wb.Inertia("bit", 471.9698)],
        shafts=[
            wb.Shaft("table", "ground", 0.0, 425.0),
            wb.Shaft("bit", "table", 861.5336, 30.0),
            wb.Shaft("bit", "ground", 0.0, 50.0),
        ],
        contacts=[
            contact("bit", name="rock", radius=radius, force=110000.0,
                    friction=wb.CustomFriction(law=rock, width=0.02 * radius)),
        ],
        torques=[wb.Torque("table", wb.Constant(12000.0), name="motor")],
    )  # fmt: skip


@pytest.mark.slow
def test_a_fold_where_multipliers_bend_within_a_millionth_is_followed_to_the_end() -> None:
    """Its points are those of branches over one parameter, and its steps remain long."""
    branch = wb.continuation(wb.orbit(drill_string()), {"motor.value": (12000.0, 15000.0)})
    ends = {"motor.value": (12500.0, 14900.0), "rock.initial_force": (100000.0, 130000.0)}
    curve = wb.boundary(first("fold", branch), step=0.1, points=100, **ends)
    assert {curve.attrs["begin"], curve.attrs["end"]} == {"left the range of motor.value"}
    forces, torques = curve["rock.initial_force"].values, curve["motor.value"].values
    last = int(np.argmax(torques))
    there = drill_string().replace(
        {"rock.initial_force": float(forces[last]), "motor.value": 0.95 * torques[last]}
    )
    over = {"motor.value": (0.95 * torques[last], 1.05 * torques[last])}
    again = first("fold", wb.continuation(wb.orbit(there), over))
    assert again.value == pytest.approx(torques[last], rel=1e-8)

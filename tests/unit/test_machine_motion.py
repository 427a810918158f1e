"""Classes of motion of machines: periods, exponents, symmetry, basins, bad input, stores."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import wedgebrake as wb
from differences import jacobian
from machines import contact, in_row, numbers, single, stribeck, with_numbers
from stick_slip import stick_slip
from wedgebrake.analysis.classify import SETTLED, Window
from wedgebrake.analysis.evaluate import Evaluator, classify_machine
from wedgebrake.analysis.machine_motion.coordinates import coordinates
from wedgebrake.analysis.run_settings import protocol
from wedgebrake.analysis.settling import approach_of
from wedgebrake.dynamics.enums import MotionClass
from wedgebrake.errors import InputError
from wedgebrake.figures.data import basins as basins_data
from wedgebrake.sweeps.results import VARIABLES

DAMPING_RATIO = 0.05


TWO = wb.Machine(
    inertias=[wb.Inertia("a", 1.0), wb.Inertia("b", 1.0)],
    shafts=[wb.Shaft("a", "b", stiffness=100.0)],
    torques=[wb.Torque("a", wb.Harmonic(1.0, 2.0))],
)


def belt(speed: float, tolerance: float = 1e-3, **start: float) -> wb.Machine:
    """A mass on a belt with friction that falls with the sliding speed."""
    law = wb.StribeckFriction(kinetic=0.5, static=1.0, speed=0.5, tolerance=tolerance)
    brake = contact("mass", name="belt", friction=law, base_speed=speed)
    return single(brake, name="mass", stiffness=1.0, damping=2.0 * DAMPING_RATIO, **start)


def slow_belt(speed: float) -> wb.Machine:
    """An undamped mass on a belt with Coulomb friction, J = k = 1."""
    friction = wb.CoulombFriction(kinetic=0.5, static=1.0)
    brake = contact("mass", name="belt", friction=friction, base_speed=speed)
    return single(brake, name="mass", stiffness=1.0, damping=0.0)


def beating(limit: float, beat: float) -> wb.Machine:
    """A held inertia under two torques of 1 N m that cancel at first and add up to 2 N m later."""
    torques = [wb.Torque("disc", wb.Harmonic(1.0, 1.0), name="one"),
               wb.Torque("disc", wb.Harmonic(1.0, 1.0 + beat, math.pi), name="other")]  # fmt: skip
    friction = wb.CoulombFriction(kinetic=1.0)
    held = wb.Contact(
        "disc", name="brake", brake=wb.ConventionalBrake(radius=1.0), friction=friction,
        actuation=wb.Actuation(initial_force=limit),
    )  # fmt: skip
    return wb.Machine(
        inertias=[wb.Inertia("disc", 1.0)], contacts=[held], torques=torques,
        shafts=[wb.Shaft("disc", "ground", stiffness=50.0)],
    )  # fmt: skip


@pytest.mark.parametrize("load", [0.0, 0.7, 1e-9])
def test_rest_at_the_holding_limit_is_rest(load: float) -> None:
    """Without force and load, too: the limit is then 0."""
    held = wb.Contact(
        "disc", name="brake", brake=wb.ConventionalBrake(radius=1.0),
        friction=wb.CoulombFriction(kinetic=1.0), actuation=wb.Actuation(initial_force=load),
    )  # fmt: skip
    machine = wb.Machine(
        inertias=[wb.Inertia("disc", 1.0)], contacts=[held],
        shafts=[wb.Shaft("disc", "ground", stiffness=9.0)],
        torques=[wb.Torque("disc", load, name="load")],
    )  # fmt: skip
    assert wb.motion(machine).kind == "at rest"


@pytest.mark.parametrize("beat", [1e-3, 1e-3 / math.pi])
def test_rest_is_claimed_only_if_no_contact_will_ever_slip(beat: float) -> None:
    assert wb.motion(beating(2.1, beat)).kind == "at rest"
    assert wb.motion(beating(1.9, beat)).kind != "at rest"
    later = wb.simulate(beating(1.9, beat), duration=0.6 / beat, times=[])
    assert later.sizes["stick"] > 1


def slow_driveline(speed: float) -> wb.BrakedDriveline:
    return wb.BrakedDriveline(
        driveline=wb.Driveline(inertia=1.0, damping=0.0, stiffness=1.0, drive_speed=speed),
        brake=wb.ConventionalBrake(radius=1.0),
        friction=wb.CoulombFriction(kinetic=0.5, static=1.0),
        actuation=wb.Actuation(initial_force=1.0),
        excitation=wb.HarmonicTorque(amplitude=0.0, frequency=1.0),
    )


def slow_period(speed: float) -> float:
    """The slip is a turn of a free oscillator but for two arcs; the belt winds the rest up."""
    return 2.0 * (math.pi - math.atan(0.5 / speed)) + 1.0 / speed


SLOW = [0.1, 0.05, 0.02, 0.01, 1e-3, 1e-5]


@pytest.mark.parametrize("system", [slow_belt, slow_driveline])
@pytest.mark.parametrize("speed", SLOW)
def test_slow_stick_slip_is_waited_for(system, speed: float) -> None:
    """A stick lasts as long as the base needs to wind up the shaft, whatever the natural period."""
    found = wb.motion(system(speed))
    assert (found.kind, found.stick_class) == ("limit cycle", "unidirectional stick-slip")
    assert found.period == pytest.approx(slow_period(speed), rel=1e-8)
    fixed = wb.motion(system(speed), crossings=20, transient=8)
    assert (fixed.kind, fixed.judged) == ("limit cycle", 12)
    orbit = wb.orbit(system(speed))
    assert orbit.stable
    assert orbit.period == pytest.approx(slow_period(speed), rel=1e-12)


@pytest.mark.parametrize("section", ["mass", "belt", None])
@pytest.mark.parametrize("speed", [0.02, 1e-3, 1e-5])
def test_slow_returns_are_waited_for(speed: float, section: str | None) -> None:
    points = wb.poincare(slow_belt(speed), crossings=5, transient=1, section=section)
    assert points.sizes["crossing"] == 5
    assert np.diff(points["time"]) == pytest.approx(slow_period(speed), rel=1e-8)


@pytest.mark.parametrize("speed", [0.02, 1e-3])
def test_slow_orbit_near_a_guess(speed: float) -> None:
    machine = slow_belt(speed)
    state = wb.final_state(wb.simulate(machine, duration=3.0 / speed))
    found = wb.orbit(machine, 1, initial=state)
    assert found.period == pytest.approx(slow_period(speed), rel=1e-12)


def test_scaled_coordinates_measure_energy() -> None:
    """Half the square of their norm is the energy over the largest inertia."""
    machine = in_row(inertia=(4.0, 9.0), stiffness=(7.0, 11.0), damping=(0.0, 0.0))
    space = coordinates(machine)
    angles, speeds = np.array([0.3, -0.2]), np.array([1.1, 0.7])
    scaled = space.to @ np.concatenate((angles, speeds))
    stiffness = np.array([[18.0, -11.0], [-11.0, 11.0]])
    energy = 0.5 * (angles @ stiffness @ angles + np.array([4.0, 9.0]) @ speeds**2)
    assert 0.5 * scaled @ scaled == pytest.approx(energy / 9.0, rel=1e-13)
    squares = np.linalg.eigvals(stiffness / np.array([[4.0], [9.0]]))
    assert space.frequency == pytest.approx(math.sqrt(squares.min()), rel=1e-13)


def pair(
    *, coupling: float = 0.3, damping: float = 0.02, time: float = 1.0, sign: float = 1.0,
    swapped: bool = False, lag: float = 0.0, base: float = 0.8,
) -> wb.Machine:  # fmt: skip
    """Two masses on belts, joined by a shaft; in other units of time, mirrored, or renumbered."""
    falling = {"speeds": (0.0, 0.5 / time, 2.0 / time), "coefficients": (0.9, 0.6, 0.4)}
    # A force that lags needs a coefficient that does not vary.
    law: Any = wb.CoulombFriction(kinetic=0.5) if lag else wb.TabulatedFriction(**falling)

    def brake(name: str, force: float, speed: float, slope: float = 0.0) -> wb.Contact:
        return contact(
            name, name=f"belt-{name}", friction=law, force=force / time**2, slope=slope / time,
            lag=lag * time, base_speed=sign * speed / time,
        )  # fmt: skip

    shaft: dict[str, Any] = {"damping": damping / time}
    parts = {
        "inertias": [
            wb.Inertia("a", 1.0, speed=sign * 0.1 / time),
            wb.Inertia("b", 1.7, angle=sign * 0.3),
        ],
        "shafts": [
            wb.Shaft("a", "ground", stiffness=1.0 / time**2, **shaft),
            wb.Shaft("b", "ground", stiffness=2.4 / time**2, **shaft),
            wb.Shaft("a", "b", stiffness=coupling / time**2, **shaft),
        ],
        "contacts": [
            brake("a", 0.7, base, -0.12 if lag else -0.05),
            brake("b", 0.5, 1.3 * base, -0.07 if lag else 0.0),
        ],
    }
    return wb.Machine(**{name: one[:: -1 if swapped else 1] for name, one in parts.items()})


def driven(frequency: float = 0.21, amplitude: float = 0.4, **more: Any) -> wb.Machine:
    """The pair with a harmonic torque."""
    one = pair(**more)
    torque = wb.Torque("a", wb.Harmonic(amplitude, frequency), name="wave")
    return wb.Machine(
        inertias=one.inertias, shafts=one.shafts, contacts=one.contacts, torques=[torque]
    )


# Periods and exponents.


@pytest.mark.parametrize(
    "machine",
    [belt(0.5), belt(1.0), pair(), pair(lag=0.4), pair(base=0.4), driven(1.0 / 7.0)],
    ids=["belt", "fast belt", "pair", "lag", "leisurely", "driven"],
)
def test_period_is_that_of_the_events(machine) -> None:
    found = wb.motion(machine)
    assert found.order > 0, found.verdict
    settled = wb.final_state(wb.simulate(machine, 4000.0, times=[4000.0]))
    late = wb.simulate(machine, 12.0 * found.period, initial=settled, times=[settled.time])
    labels = np.column_stack([
        late[f"event_{name}"].values for name in ("contact", "kind", "before", "after")
    ])  # fmt: skip
    times = late["event_time"].values
    # After whole numbers of periods the same events happen again.
    own = times[(labels == labels[-1]).all(axis=1)]
    apart = own[-1] - own
    number = np.rint(apart / found.period)
    again = np.abs(apart - number * found.period) < 1e-5 * found.period
    assert set(number[again]) >= set(range(11))
    assert apart[again] == pytest.approx(number[again] * found.period, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("lag", [0.0, 0.3])
def test_exponents_of_steady_sliding_are_real_parts_of_eigenvalues(lag) -> None:
    machine = pair(base=3.0, damping=0.2, lag=lag)
    found = wb.motion(machine)
    assert found.kind == "steady sliding"
    eigenvalues = np.array(wb.stability(machine).eigenvalues)
    # Without a lag the forces are no states of their own.
    expected = np.sort(eigenvalues.real)[::-1]
    count = len(found.exponents)
    assert count == (6 if lag else 4)
    assert found.exponents == pytest.approx(expected[:count], rel=1e-9)


@pytest.mark.parametrize("machine", [pair(), pair(base=0.4), driven(1.0 / 7.0)])
def test_exponents_of_an_orbit_are_those_of_differences(machine) -> None:
    """Of the states after one period, by states nearby; of a self-excited one 1 is among them."""
    found = wb.motion(machine)
    assert found.order > 0, found.verdict
    state = wb.final_state(wb.simulate(machine, 4000.0, times=[4000.0]))
    # From where all contacts slide.
    for _ in range(200):
        if all(mode[0] != 0 for mode in state.modes):
            break
        later = wb.simulate(machine, 0.0371 * found.period, initial=state, times=[state.time])
        state = wb.final_state(later)

    def returned(values: np.ndarray) -> np.ndarray:
        start = with_numbers(state, values)
        return numbers(
            wb.final_state(wb.simulate(machine, found.period, initial=start, times=[state.time]))
        )

    matrix = jacobian(returned, numbers(state), 1e-6)
    values = np.sort(np.abs(np.linalg.eigvals(matrix)))[::-1]
    if found.self_excited:
        nearest = int(np.abs(values - 1.0).argmin())
        assert values[nearest] == pytest.approx(1.0, abs=1e-4)
    exponents = np.array(found.exponents)
    finite = np.isfinite(exponents)
    assert finite.any()
    expected = np.exp(exponents[finite] * found.period)
    assert values[: finite.sum()] == pytest.approx(expected, rel=1e-3, abs=1e-4)
    assert np.all(values[finite.sum() :] < 1e-3)


class Leine(wb.SetValuedFriction):
    """Friction that falls as 1/(1 + 3 v)."""

    kind = ""

    @property
    def breakaway(self) -> float:
        return 1.0

    def kinetic_at(self, speed: float) -> float:
        return 1.0 / (1.0 + 3.0 * speed)


def test_mass_on_a_belt_without_damping() -> None:
    """Period and furthest deflection of Leine's block (its lines: test_machine_solver)."""
    belt = contact("block", name="belt", friction=Leine(), base_speed=0.2)
    block = single(belt, name="block", stiffness=1.0, speed=0.2)
    cycle = stick_slip(Leine().kinetic_at, 0.2)
    found = wb.motion(block, method="smooth")
    assert found.kind == "limit cycle"
    assert found.period == pytest.approx(cycle.period, abs=1e-11)
    assert found.exponents == (0.0, -math.inf)
    # The first slip begins at 5 s; after the tenth period, at its turning point.
    times = 10.0 * found.period + np.linspace(5.9, 6.0, 20_001)
    late = wb.simulate(block, times[-1], times=times, method="smooth")
    assert late["angle"].values.max() == pytest.approx(cycle.highest, abs=1e-11)
    assert late["angle"].values[[0, -1]].max() < late["angle"].values.max()


@pytest.mark.parametrize("inertia", [1e8, 1e9])
def test_a_belt_that_is_a_free_inertia_slows_down_by_what_the_verdict_says(inertia: float) -> None:
    """The mean torque is k times the mean angle, 1, about which stick and slip are symmetric.

    The cycle is that of a belt at 0.5 rad/s: Coulomb friction of 1 and 1.5 N m, J = k = 1.
    """
    law = wb.CoulombFriction(kinetic=0.5, static=0.75)
    pad = contact("mass", "belt", name="pad", radius=2.0, friction=law)
    machine = wb.Machine(
        inertias=[wb.Inertia("mass", 1.0), wb.Inertia("belt", inertia, speed=0.5)],
        shafts=[wb.Shaft("mass", "ground", 1.0)], contacts=[pad],
    )  # fmt: skip
    found = wb.motion(machine, limit=64)
    assert found.kind == "undecided"
    period = 1.5 * math.pi + 2.0
    assert found.drifts == {"belt": pytest.approx(-period / inertia, rel=1e-3)}
    assert f"the speed of belt changes by {found.drifts['belt']:.3g} rad/s" in found.verdict
    # At a constant speed the motion repeats.
    pad = contact("mass", name="pad", radius=2.0, friction=law, base_speed=0.5)
    driven = wb.motion(single(pad, name="mass", stiffness=1.0))
    assert (driven.kind, driven.drifts) == ("limit cycle", {})
    assert driven.period == pytest.approx(period, rel=1e-9)


@pytest.mark.parametrize("rate", [0.001, 0.0015, 0.0025])
def test_a_free_vibration_that_decays_slowly_is_no_torus(rate: float) -> None:
    """It is a small part of the motion; a linear machine always approaches the forced motion."""
    machine = wb.Machine(
        inertias=[wb.Inertia("a", 1.0), wb.Inertia("b", 1.0)],
        shafts=[
            wb.Shaft("a", "ground", stiffness=30.0, damping=2.0 * rate),
            wb.Shaft("b", "ground", stiffness=50.0, damping=5.0),
        ],
        torques=[wb.Torque("a", wb.Harmonic(2.0, 3.0)), wb.Torque("b", wb.Harmonic(200.0, 3.0))],
    )
    assert wb.motion(machine).kind in ("synchronous", "undecided")


def test_a_vibration_that_grows_slowly_without_limit_is_not_chaotic() -> None:
    """Its deviations grow, but only as fast as the motion itself."""
    machine = wb.Machine(
        inertias=[wb.Inertia("a", 1.0)],
        shafts=[wb.Shaft("a", "ground", stiffness=400.0)],
        torques=[wb.Torque("a", wb.Harmonic(1.0, 1.0))],
        controllers=[
            wb.Controller("loop", {"a.speed": 1.0}, 0.0, "a.torque", proportional=-0.0032)
        ],
    )
    assert wb.motion(machine).kind == "undecided"


def test_a_slow_focus_is_an_orbit_of_one_period() -> None:
    """Distances after one period shrink unevenly; those after two shrink evenly but are larger."""
    machine = wb.Machine(
        inertias=[wb.Inertia("a", 0.175089, speed=1.0), wb.Inertia("b", 0.352111)],
        shafts=[
            wb.Shaft("a", "ground", stiffness=3.41718, damping=0.0165322),
            wb.Shaft("b", "a", stiffness=18.3434, damping=0.022684),
        ],
        torques=[wb.Torque("a", wb.Harmonic(0.140625, 10.0))],
        controllers=[
            wb.Controller(
                "loop", {"b.angle": 1.0}, 0.1, "b.torque", proportional=0.2, sample_time=0.025
            )
        ],
    )
    assert wb.motion(machine).kind == "synchronous"


def test_growth_without_limit_is_divergence() -> None:
    """Of a force that falls with the speed and may become negative."""
    machine = belt(0.5).replace(
        {
            "belt.friction": wb.CoulombFriction(kinetic=0.5),
            "belt.slope": -1.0,
            "belt.release": False,
            "mass.speed": 9.0,
        }
    )
    assert wb.motion(machine).kind == "diverged"


def test_exponents_that_are_not_resolved_are_the_least() -> None:
    found = np.array(wb.motion(pair()).exponents)
    assert found[0] == 0.0
    unknown = np.flatnonzero(~np.isfinite(found))
    assert unknown.size
    assert list(unknown) == list(range(found.size - unknown.size, found.size))


# Symmetry, order of parts, units of time.


@pytest.mark.parametrize("make", [pair, driven])
@pytest.mark.parametrize("base", [0.5, 0.8, 3.0])
def test_mirror_image(make, base) -> None:
    machine = make(base=base)
    changes = {"wave.phase": math.pi} if make is driven else {}
    other = make(base=base, sign=-1.0).replace(changes)
    found, mirrored = wb.motion(machine), wb.motion(other)
    assert mirrored.kind == found.kind
    if found.order:
        assert mirrored.period == pytest.approx(found.period, rel=1e-9)
        assert mirrored.exponents == pytest.approx(found.exponents, rel=1e-5, abs=1e-8, nan_ok=True)
        assert mirrored.sticks_forward == found.sticks_backward
        assert mirrored.sticks_backward == found.sticks_forward


@pytest.mark.parametrize("make", [pair, driven])
def test_order_of_parts(make) -> None:
    found, other = wb.motion(make()), wb.motion(make(swapped=True))
    assert other.kind == found.kind
    assert [one.name for one in other.contacts] == [one.name for one in found.contacts][::-1]
    if found.order:
        assert other.period == pytest.approx(found.period, rel=1e-9)
        assert other.exponents == pytest.approx(found.exponents, rel=1e-5, abs=1e-8, nan_ok=True)
        for one, two in zip(found.contacts, other.contacts[::-1], strict=True):
            assert two.stick_class == one.stick_class
            assert two.friction_power == pytest.approx(one.friction_power, rel=1e-7)


@pytest.mark.parametrize("time", [1e-3, 37.0])
def test_unit_of_time(time) -> None:
    found, other = wb.motion(pair()), wb.motion(pair(time=time))
    assert other.kind == found.kind == "limit cycle"
    assert other.period == pytest.approx(time * found.period, rel=1e-9)
    scaled = np.array(other.exponents) * time
    assert scaled == pytest.approx(np.array(found.exponents), rel=1e-5, abs=1e-8, nan_ok=True)
    slow = wb.motion(pair(base=3.0, damping=0.2))
    fast = wb.motion(pair(base=3.0, damping=0.2, time=time))
    assert np.array(fast.exponents) * time == pytest.approx(np.array(slow.exponents), rel=1e-9)


# Basins.


def lines_of(machine: wb.Machine) -> tuple[np.ndarray, np.ndarray]:
    """Sliding speeds and coefficients at the ends of the lines of the first contact."""
    friction: Any = machine.contacts[0].friction
    speeds, coefficients = np.array(friction.nodes()).T
    return speeds, coefficients


@cache
def separatrix(speed: float, tolerance: float) -> np.ndarray:
    """(n, 2) angle and speed on the unstable cycle about steady sliding, by shooting with SciPy."""
    speeds, coefficients = lines_of(belt(speed, tolerance))
    ends = np.interp(speed, speeds, coefficients)

    def rate(_, y):
        return y[1], -2.0 * DAMPING_RATIO * y[1] - y[0] + np.interp(
            speed - y[1], speeds, coefficients
        )

    def top(_, y):
        return y[1]

    top.direction = -1.0
    options: dict[str, Any] = {"method": "DOP853", "rtol": 1e-9, "atol": 1e-11, "max_step": 0.1}

    def returns(amplitude: float) -> Any:
        # Begin a little after the turning point, which is an event itself.
        return solve_ivp(
            rate, (0.0, 8.0), (ends + amplitude, 0.0), events=[top], dense_output=True, **options
        )

    def gain(amplitude: float) -> float:
        path = returns(amplitude)
        turned = path.t_events[0] > 1.0
        return float(path.y_events[0][turned][0][0] - ends - amplitude)

    amplitude = brentq(gain, 0.02, 0.99 * speed, xtol=1e-10)
    path = returns(amplitude)
    period = path.t_events[0][path.t_events[0] > 1.0][0]
    return path.sol(np.linspace(0.0, period, 2000)).T


def inside(loop: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Whether points lie inside a loop, by their winding numbers."""
    turned = loop[None] - points[:, None]
    angles = np.unwrap(np.arctan2(turned[..., 1], turned[..., 0]), axis=1)
    return np.abs(angles[:, -1] - angles[:, 0]) > math.pi


# The nearer the Hopf point, the finer must the lines be, and the longer the motions last.
@pytest.mark.parametrize(
    ("speed", "tolerance"),
    [
        pytest.param(1.16, 1e-6, marks=pytest.mark.slow),
        pytest.param(1.25, 1e-5, marks=pytest.mark.slow),
        (1.35, 1e-4),
        pytest.param(1.45, 1e-4, marks=pytest.mark.slow),
        pytest.param(1.6, 1e-4, marks=pytest.mark.slow),
    ],
)
def test_basin_of_steady_sliding_ends_at_the_unstable_cycle(speed, tolerance) -> None:
    """Both of the same piecewise-linear friction, so that there is no error but that of SciPy."""
    loop = separatrix(speed, tolerance)
    centre, reach = loop.mean(axis=0), 1.25 * np.abs(loop - loop.mean(axis=0)).max()
    across = centre[0] + reach * np.linspace(-1.0, 1.0, 12)
    up = reach * np.linspace(-0.97, 0.95, 11)
    found = wb.basins(belt(speed, tolerance), {"mass.angle": across, "mass.speed": up})
    kinds = found["attractor_kind"].values
    assert set(kinds) == {MotionClass.STEADY_SLIDING, MotionClass.LIMIT_CYCLE}
    steady = kinds[found["attractor"].values.ravel()] == MotionClass.STEADY_SLIDING
    points = np.stack(np.meshgrid(across, up, indexing="ij"), axis=-1).reshape(-1, 2)
    gap = np.sqrt(((points[:, None] - loop[None]) ** 2).sum(axis=2)).min(axis=1)
    clear = gap > 1e-3
    assert clear.mean() > 0.9
    np.testing.assert_array_equal(steady[clear], inside(loop, points)[clear])


# Sweeps: labels, stores.

SPEEDS = np.array([0.4, 0.7, 1.4])


def test_labels_of_a_sweep() -> None:
    found = wb.sweep(pair(), {"belt-a.base_speed": SPEEDS}, crossings=7, limit=20_000)
    assert found["velocity"].dims == ("belt-a.base_speed", "crossing", "inertia")
    assert found["stick_share"].dims == ("belt-a.base_speed", "contact")
    assert found["exponents"].dims == ("belt-a.base_speed", "exponent")
    assert found.sizes["crossing"] == 8
    assert list(found["inertia"].values) == ["a", "b"]
    assert list(found["contact"].values) == ["belt-a", "belt-b"]
    periods = wb.sweep(driven(), {"wave.amplitude": [0.1, 0.2]}, periods=5)
    assert periods["velocity"].dims == ("wave.amplitude", "period", "inertia")
    for place, speed in enumerate(SPEEDS):
        alone = wb.motion(pair().replace({"belt-a.base_speed": speed}))
        point = found.isel({"belt-a.base_speed": place})
        assert MotionClass(int(point["motion"])).word == alone.kind
        assert point["motion_period"].item() == pytest.approx(alone.period, nan_ok=True)
        assert point["exponents"].values == pytest.approx(alone.exponents, nan_ok=True)


def test_store_resumes_with_the_same_bits(tmp_path) -> None:
    axes = {"belt.base_speed": np.linspace(0.3, 1.8, 24), "mass.angle": [0.0, 1.0]}
    whole = wb.sweep(belt(0.5), axes, crossings=5).load()

    class StopError(Exception):
        pass

    def stop(seen: Any) -> None:
        if seen.done:
            raise StopError

    path = tmp_path / "belt.zarr"
    with pytest.raises(StopError):
        wb.sweep(belt(0.5), axes, crossings=5, store=path, progress=stop, threads=1)
    resumed = wb.sweep(belt(0.5), axes, crossings=5, store=path, resume=True)
    xr.testing.assert_identical(resumed.load(), whole)
    with xr.open_dataset(path, engine="wedgebrake") as opened:
        one = {"belt.base_speed": 3, "mass.angle": 1}
        xr.testing.assert_identical(opened.isel(one).load(), whole.isel(one))
        xr.testing.assert_identical(opened.load(), whole)
    with pytest.raises(InputError):
        wb.sweep(belt(0.6), axes, crossings=5, store=path, resume=True)


@pytest.mark.parametrize("transient", [0, 3])
def test_record_of_a_sweep_begins_at_its_first_return(transient) -> None:
    wave = driven()
    found = wb.sweep(wave, {"wave.amplitude": [0.4]}, periods=8, transient=transient)
    times = found["period"].values * wave.period
    expected = wb.simulate(wave, times[-1], times=times)
    for name in ("angle", "velocity"):
        np.testing.assert_allclose(found[name].values[0], expected[name].values, atol=1e-9)


def test_record_of_a_self_excited_motion_holds_crossings_only() -> None:
    for transient in (0, 3):
        found = wb.sweep(belt(0.5), {"belt.base_speed": [0.5]}, crossings=8, transient=transient)
        crossings, speeds = found["crossing"].values, found["velocity"].values[0, :, 0]
        np.testing.assert_array_equal(np.isfinite(speeds), crossings > 0)
        assert np.ptp(speeds[crossings > 0]) < 1e-12


def test_basins_state_each_attractor() -> None:
    found = wb.basins(
        belt(1.3), {"mass.speed": np.linspace(-2.0, 2.0, 5), "mass.angle": [0.5, 2.0]}
    )
    kinds = [MotionClass(int(one)).word for one in found["attractor_kind"].values]
    assert sorted(kinds) == ["limit cycle", "steady sliding"]
    assert found["attractor_angle"].dims == ("attractor_id", "orbit_point", "inertia")
    place = kinds.index("steady sliding")
    speeds = found["attractor_velocity"].values[place]
    assert np.nanmax(np.abs(speeds)) < 1e-9
    expected = np.interp(1.3, *lines_of(belt(1.3)))
    assert np.nanmax(np.abs(found["attractor_angle"].values[place] - expected)) < 1e-9


def test_basins_of_one_torus_are_one() -> None:
    """A self-excited vibration that does not lock to the torque."""
    belt = contact("b", name="belt", friction=stribeck(1e-3), base_speed=0.8)
    wave = in_row(belt, wave=wb.Harmonic(0.15, 0.1 * math.sqrt(5.0)))
    found = wb.basins(wave, {"a.angle": [-1.0, 1.0], "b.speed": [-1.0, 0.0, 1.0]})
    words = [MotionClass(int(one)).word for one in found["attractor_kind"].values]
    assert words == ["quasi-periodic"]


@pytest.mark.parametrize("settings", [{}, {"periods": 80, "transient": 70}])
def test_basins_do_not_depend_on_the_angle_of_a_free_rotation(settings) -> None:
    """Two masses on a belt follow a torque: where they start does not matter."""
    wave = wb.Machine(
        inertias=[wb.Inertia("a", 1.0), wb.Inertia("b", 0.5)],
        shafts=[wb.Shaft("a", "b", stiffness=2.0, damping=0.5)],
        contacts=[contact("b", name="belt", base_speed=1.3)],
        torques=[wb.Torque("a", wb.Harmonic(2.0, 0.2), name="wave")],
    )
    found = wb.basins(wave, {"a.angle": [-3.0, 1.0], "a.speed": [-2.0, 0.0, 2.0]}, **settings)
    assert [MotionClass(int(one)).word for one in found["attractor_kind"].values] == ["synchronous"]
    assert found["attractor_share"].values == [1.0]


def test_basins_tell_free_vibration_from_undecided_points() -> None:
    """An undamped mass vibrates while the brake holds the other one."""
    machine = in_row(contact("b", name="brake", base_speed=0.0), damping=(0.0, 0.0))
    found = wb.basins(machine, {"a.angle": [0.01, 0.02], "a.speed": [0.0, 0.03]})
    assert (found["motion"] == MotionClass.FREE_VIBRATION).all()
    codes = found["attractor"].attrs
    number = codes["flag_values"][codes["flag_meanings"].split().index("free_vibration")]
    assert (found["attractor"] == number).all()
    assert basins_data.of_dataset(found).legend[0].label.startswith("free vibration")


# Bad input.

RAMP = wb.Ramp(0.0, 1.0, 2.0)


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: wb.motion(belt(0.5), 10), "periods"),
        (lambda: wb.motion(belt(0.5), periods=10), "periods"),
        (lambda: wb.motion(driven(), crossings=10), "crossings"),
        (lambda: wb.motion(wb.paper.system(), crossings=10), "crossings"),
        (lambda: wb.motion(belt(0.5), crossings=0), "crossings"),
        (lambda: wb.motion(belt(0.5), crossings=2.5), "crossings"),
        (lambda: wb.motion(driven(), periods=-1), "periods"),
        (lambda: wb.motion(TWO, initial=(0.0, 1.0)), "initial"),
        (lambda: wb.motion(belt(0.5), transient="long"), "transient"),
        (lambda: wb.motion(belt(0.5), crossings=5, transient=9), "transient"),
        (lambda: wb.motion(ramped()), "wave.signal"),
        (lambda: wb.sweep(ramped(), {"belt-a.base_speed": SPEEDS}), "wave.signal"),
        (lambda: wb.sweep(belt(0.5), {"belt.base_speed": SPEEDS}, periods=9), "periods"),
        (lambda: wb.sweep(driven(), {"wave.amplitude": SPEEDS}, crossings=9), "crossings"),
        (lambda: wb.sweep(wb.paper.system(), eta=[1.0], crossings=9), "crossings"),
        (lambda: wb.sweep(belt(0.5), {"belt.base_sped": SPEEDS}), "belt.base_sped"),
        (lambda: wb.sweep(TWO, {"a.angle": [0.1]}, initial=(0.0, 1.0)), "initial"),
        (lambda: wb.sweep(belt(0.5), {"base_speed": SPEEDS}), "base_speed"),
        (lambda: wb.sweep(belt(0.5), {"belt.friction": SPEEDS}), "belt.friction"),
        (lambda: wb.sweep(belt(0.5), {"mass.inertia": [-1.0]}), "mass.inertia"),
        (lambda: wb.sweep(belt(0.5), {"mass.inertia": ["1"]}), "mass.inertia"),
        (lambda: wb.basins(belt(0.5), {"mass.angle": SPEEDS}), "over"),
        (lambda: wb.basins(belt(0.5), {"mass.angle": [0.0], "mass.inertia": [1.0]}), "over"),
    ],
)  # fmt: skip
def test_bad_input(call, name) -> None:
    """Says which value is wrong, and what is allowed."""
    with pytest.raises(InputError) as caught:
        call()
    error = caught.value
    assert error.name == name
    assert error.allowed is not None


def ramped() -> wb.Machine:
    """The pair with a torque that does not repeat."""
    return driven().replace({"wave.signal": RAMP})


@pytest.mark.parametrize("machine", [belt(0.5), driven()], ids=["self-excited", "driven"])
def test_without_a_transient_the_record_begins_at_once(machine) -> None:
    """All returns asked for are classified, from the first one on."""
    returns = {"crossings" if machine.autonomous else "periods": 40}
    found = wb.motion(machine, transient=0, **returns)
    assert (found.transient, found.judged) == (0, 40)


# Windows, repeated starts, smooth laws.


@pytest.mark.parametrize("ratio", [0.5, 0.93, 0.99, -0.97])
def test_steady_approach_says_when_it_has_settled(ratio) -> None:
    """Distances of returns that decay like a geometric series."""
    count = 256
    points = ratio ** np.arange(count + 1)[:, None] * np.array([1.0, 0.3])
    none = np.full(count, math.nan)
    window = Window(points, np.ones(2), 1.0, none, math.nan, False)
    near = float(np.linalg.norm(points[-1] - points[-3]))
    waits = approach_of(window, near).waits
    # Of the limit, which is zero; an estimate from above, but not from far above.
    needed = math.log(near / SETTLED) / -math.log(abs(ratio))
    slack = math.log(4.0 / (1.0 - abs(ratio))) / -math.log(abs(ratio))
    assert max(needed, 0.0) <= waits <= max(needed, 0.0) + 1.05 * slack


def test_no_steady_approach_has_no_end() -> None:
    angles = 0.61803398875 * np.arange(257)
    points = np.column_stack([np.cos(angles), np.sin(angles)])
    window = Window(points, np.ones(2), 1.0, np.zeros(256), -0.1, False)
    assert math.isinf(approach_of(window, 0.01).waits)


@pytest.mark.parametrize("method", ["exact", "smooth"])
@pytest.mark.parametrize("machine", [belt(1.3), driven(0.21), pair(lag=0.4)])
def test_starts_of_one_machine_do_not_depend_on_each_other(machine, method) -> None:
    """The same bits as of a run of its own."""
    wanted = protocol(None, "auto", 2048)
    classifier = Evaluator(wanted, method)
    rng = np.random.default_rng(5)
    name = machine.inertias[0].name
    for _ in range(4):
        angle, speed = rng.uniform(-2.0, 2.0, 2)
        one = machine.replace({f"{name}.angle": angle, f"{name}.speed": speed})
        found, alone = classifier.result(one), classify_machine(one, wanted, None, method)
        assert found.motion == alone.motion
        np.testing.assert_array_equal(found.points, alone.points)
        np.testing.assert_array_equal(found.exponents, alone.exponents)
        np.testing.assert_array_equal(found.contacts.sticks, alone.contacts.sticks)
        assert found.final == alone.final
    # Another machine in between.
    other = machine.replace({f"{name}.inertia": 1.5})
    np.testing.assert_array_equal(
        classifier.result(other).points, classify_machine(other, wanted, None, method).points
    )


@pytest.mark.parametrize(("lag", "method"), [(0.0, "exact"), (0.4, "exact"), (0.0, "smooth")])
def test_contacts_do_not_depend_on_those_before(lag, method) -> None:
    """The same bits as of a run of its own, whether or not states and inputs are the same."""
    wanted, machine = protocol(30, 20), driven(lag=lag)
    friction, moving = wb.CoulombFriction(kinetic=0.3, static=0.5), wb.Harmonic(0.4, 0.21) + 0.8
    sampled = wb.Actuation(initial_force=0.6, slope=-0.1, sample_time=0.2)
    changes: list[dict[str, Any]] = [
        {"belt-a.initial_force": 0.8}, {"belt-a.slope": -0.2},
        {"belt-b.radius": 1.2, "belt-a.slope": 0.0},
        {"belt-b.friction": friction}, {"belt-a.base_speed": 0.0}, {"belt-a.base_speed": moving},
        {"belt-a.friction": friction, "belt-a.actuation": sampled},
        {"belt-a.friction": friction, "belt-a.actuation": sampled.model_copy(update={"delay": 1})},
        {"belt-b.a": "a"}, {},
    ]  # fmt: skip
    classifier = Evaluator(wanted, method)
    for change in [one for each in changes for one in (each, each | {"belt-b.initial_force": 0.4})]:
        one = machine.replace(change)
        found, alone = classifier.result(one), classify_machine(one, wanted, None, method)
        assert (found.motion, found.size) == (alone.motion, alone.size)
        for name in ("points", "exponents", "low", "high"):
            np.testing.assert_array_equal(getattr(found, name), getattr(alone, name))
        np.testing.assert_array_equal(found.vibration.rms_torque, alone.vibration.rms_torque)
        np.testing.assert_array_equal(found.contacts.friction_power, alone.contacts.friction_power)
        assert found.final == alone.final


def turning(speed: float) -> wb.BrakedDriveline:
    """A driveline without a torque, with a smooth law that falls with the sliding speed."""
    return wb.BrakedDriveline(
        driveline=wb.Driveline(inertia=1.0, stiffness=1.0, damping=0.1, drive_speed=speed),
        brake=wb.ConventionalBrake(radius=1.0),
        friction=wb.SmoothedFriction(kinetic=0.5, static=1.0, decay=2.0, steepness=20.0),
        actuation=wb.Actuation(initial_force=1.0, slope=0.0),
        excitation=wb.HarmonicTorque(amplitude=0.0, frequency=0.3),
    )


STICKING = turning(0.2).replace(friction=wb.CoulombFriction(kinetic=0.3, static=0.5))


@pytest.mark.parametrize("speed", [0.3, 0.7, 1.0])
def test_cycle_with_a_smooth_law_has_the_period_of_scipy(speed) -> None:
    def rate(_, y):
        v = speed + y[1]
        law = 0.5 * (1.0 + math.exp(-2.0 * abs(v))) * math.tanh(20.0 * v)
        return y[1], -0.1 * y[1] - y[0] - law

    def up(_, y):
        return y[1]

    up.direction = 1.0
    path = solve_ivp(
        rate, (0.0, 400.0), (0.0, 0.0), method="DOP853", rtol=1e-12, atol=1e-13, events=[up]
    )
    expected = np.diff(path.t_events[0])[-1]
    found = wb.motion(turning(speed))
    assert (found.kind, found.self_excited) == ("limit cycle", True)
    assert found.period == pytest.approx(expected, rel=1e-8)
    assert found.exponents[0] == 0.0


def test_sweep_with_a_smooth_law_tells_sliding_from_cycles() -> None:
    found = wb.sweep(turning(1.0), drive_speed=[0.7, 6.0], crossings=6)
    kinds = [MotionClass(int(one)) for one in found["motion"].values]
    assert kinds == [MotionClass.LIMIT_CYCLE, MotionClass.STEADY_SLIDING]
    assert found.sizes["crossing"] == 7
    points = wb.poincare(turning(0.7), crossings=40, transient=20)
    assert np.diff(points["time"].values)[-1] == pytest.approx(
        found["motion_period"].values[0], rel=1e-6
    )


def undamped(angle: float, *, further: bool = False, damping: float = 0.0) -> wb.Machine:
    """A block on a fast belt with constant friction, and perhaps a second block on it."""
    inertias, shafts = [wb.Inertia("block", 1.0, angle=angle)], []
    if further:
        inertias.append(wb.Inertia("further", 0.7))
        shafts.append(wb.Shaft("block", "further", stiffness=3.0, damping=damping))
    return wb.Machine(
        inertias=inertias,
        shafts=[*shafts, wb.Shaft("block", "ground", stiffness=1.0, damping=damping)],
        contacts=[contact("block", name="belt", friction=0.3, base_speed=10.0)],
    )


def pendulum(inertia: float, stiffness: float, damping: float = 0.0) -> wb.Machine:
    """A disc on a shaft, without contacts."""
    return single(inertia=inertia, stiffness=stiffness, damping=damping, speed=3.0)


def free_pair(first: float, second: float, damping: float = 0.0) -> wb.Machine:
    """Two inertias with given speeds on a shaft that nothing else holds."""
    return wb.Machine(
        inertias=[wb.Inertia("first", 1.0, speed=first), wb.Inertia("second", 2.0, speed=second)],
        shafts=[wb.Shaft("first", "second", stiffness=5.0, damping=damping)],
    )


def beside_a_brake(hub: float, disc: float) -> wb.Machine:
    """A disc on an undamped shaft, whose other end a brake stops."""
    return wb.Machine(
        inertias=[wb.Inertia("hub", 1.0, speed=hub), wb.Inertia("disc", 0.5, speed=disc)],
        shafts=[wb.Shaft("hub", "disc", stiffness=2.0)],
        contacts=[contact("hub", friction=0.3, force=100.0)],
    )


class TestFreeVibration:
    """Undamped vibration is one of a family of orbits, and no limit cycle."""

    @pytest.mark.parametrize("angle", [1.0, 3.0])
    def test_its_amplitude_is_that_of_the_start(self, angle) -> None:
        found = wb.motion(undamped(angle))
        assert found.kind == "free vibration"
        assert found.period == pytest.approx(2.0 * math.pi, rel=1e-12)
        assert found.exponents == (0.0, 0.0)
        assert found.stick_class == "non-stick-slip"
        assert wb.orbit(undamped(angle)).status.value == "not_isolated"
        swept = wb.sweep(undamped(angle), {"belt.base_speed": [10.0]})
        assert int(swept["motion"][0]) == MotionClass.FREE_VIBRATION
        # About the deflection at which the spring balances friction, 0.3 N m.
        amplitude = float(swept["highest_velocity"][0, 0])
        assert amplitude == pytest.approx(abs(angle - 0.3), rel=1e-12)

    def test_several_modes_and_a_fixed_transient(self) -> None:
        machine = undamped(1.0, further=True)
        for options in ({}, {"crossings": 60, "transient": 20}):
            found = wb.motion(machine, **options)
            assert found.kind == "free vibration"
            assert found.exponents == (0.0,) * 4
            assert found.stick_class == "non-stick-slip"

    def test_the_least_damping_ends_it(self) -> None:
        assert wb.motion(undamped(1.0, damping=1e-8)).kind == "steady sliding"

    def test_a_vibration_that_sticks_is_a_limit_cycle(self) -> None:
        slow = {"belt.base_speed": 0.2, "belt.kinetic": 0.3, "belt.static": 0.5}
        found = wb.motion(undamped(1.0).replace(slow))
        assert found.kind == "limit cycle"
        assert found.stick_class == "unidirectional stick-slip"

    @pytest.mark.parametrize(
        ("machine", "period"),
        [
            (pendulum(inertia=0.5, stiffness=8.0), 2.0 * math.pi * math.sqrt(0.5 / 8.0)),
            (free_pair(30.0, 31.0), 2.0 * math.pi * math.sqrt(1.0 * 2.0 / (1.0 + 2.0) / 5.0)),
        ],
        ids=["held by a shaft", "turning"],
    )
    @pytest.mark.parametrize("options", [{}, {"crossings": 60, "transient": 20}])
    def test_without_contacts(self, machine, period, options) -> None:
        found = wb.motion(machine, **options)
        assert found.kind == "free vibration"
        assert found.period == pytest.approx(period, rel=1e-11)
        assert set(found.exponents) == {0.0}
        assert found.stick_class == "not computed"
        assert found.stick_class not in found.verdict
        assert wb.orbit(machine).status.value == "not_isolated"

    def test_without_contacts_in_a_sweep(self) -> None:
        found = wb.sweep(pendulum(inertia=1.0, stiffness=8.0), {"disc.inertia": [0.5, 2.0]})
        assert found["motion"].values.tolist() == [MotionClass.FREE_VIBRATION] * 2
        expected = [2.0 * math.pi * math.sqrt(one / 8.0) for one in (0.5, 2.0)]
        np.testing.assert_allclose(found["motion_period"], expected, rtol=1e-11)
        np.testing.assert_allclose(found["highest_velocity"][:, 0], 3.0, rtol=1e-11)

    @pytest.mark.parametrize("method", ["exact", "smooth"])
    @pytest.mark.parametrize("speed", [0.0, 5.0])
    def test_while_a_brake_holds(self, speed, method) -> None:
        """Also after the brake has stopped its inertia."""
        found = wb.motion(beside_a_brake(speed, 0.1), method=method)
        assert found.kind == "free vibration"
        assert found.period == pytest.approx(2.0 * math.pi * math.sqrt(0.5 / 2.0), rel=1e-10)
        assert found.exponents == (0.0, 0.0, -math.inf)
        assert found.stick_class == "at rest"
        assert found.stick_share == pytest.approx(1.0, rel=1e-12)

    @pytest.mark.parametrize("clutch", [False, True])
    @pytest.mark.parametrize("order", [None, 1])
    def test_orbits_are_not_isolated_if_the_mean_speed_is_conserved(self, clutch, order) -> None:
        """Without shafts, dampers and contacts to the ground."""
        machine = wb.Machine(
            inertias=[wb.Inertia("a", 1.0, speed=2.0), wb.Inertia("b", 0.5), wb.Inertia("c", 2.0)],
            shafts=[
                wb.Shaft("b", "c", stiffness=400.0, damping=1.0),
                *([] if clutch else [wb.Shaft("a", "b", stiffness=300.0, damping=1.0)]),
            ],
            contacts=[contact("a", "b", name="clutch", friction=0.3, force=3.0)] if clutch else [],
            torques=[wb.Torque("a", wb.Harmonic(2.0, 3.0)), wb.Torque("c", wb.Harmonic(-2.0, 3.0))],
        )
        assert wb.orbit(machine, order).status.value == "not_isolated"
        damped = [*machine.shafts, wb.Shaft("c", "ground", stiffness=0.0, damping=0.5)]
        assert wb.orbit(machine.replace(shafts=damped), order).found


@pytest.mark.parametrize(
    ("machine", "kind"),
    [
        (free_pair(30.0, 30.0), "steady rotation"),
        (free_pair(30.0, 10.0, damping=0.5), "steady rotation"),
        (free_pair(-2.0, 1.0, damping=0.5), "at rest"),  # without momentum
        (free_pair(0.0, 0.0), "at rest"),
        (pendulum(inertia=1.0, stiffness=8.0, damping=0.5), "at rest"),
        (beside_a_brake(0.0, 0.0), "at rest"),
    ],
)
def test_without_vibration(machine, kind) -> None:
    """Turning is neither rest nor vibration."""
    found = wb.motion(machine)
    assert (found.kind, found.order) == (kind, 0)
    assert math.isnan(found.period)
    assert "not computed" not in found.verdict
    assert "crossings" not in found.verdict


@pytest.mark.parametrize("torque", [0.0, 2.0])
def test_a_free_rotation_is_neutral(torque) -> None:
    """A change of its speed stays; with a torque the speed grows without limit."""
    machine = wb.Machine(
        inertias=[wb.Inertia("wheel", 1.0, speed=3.0)],
        torques=[wb.Torque("wheel", wb.Constant(torque), name="drive")],
    )
    assert not wb.stability(machine).stable
    assert wb.stability(machine).critical.state == "does not decay"
    found = wb.motion(machine)
    assert found.kind == ("undecided" if torque else "steady rotation")
    assert "crossings" not in found.verdict


@pytest.mark.parametrize(
    ("system", "axis"),
    [(belt(0.9), {"mass.inertia": [1.0]}), (STICKING, {"drive_speed": [0.2]})],
    ids=["machine", "driveline"],
)
def test_a_sweep_assigns_every_variable(system, axis) -> None:
    """Of a motion that has them all: none keeps the value of points that are not computed."""
    for name, values in wb.sweep(system, axis, crossings=6).items():
        fill = VARIABLES[str(name)].fill
        left = np.isnan(values) if math.isnan(fill) else values == fill
        assert not left.all(), name


@pytest.mark.parametrize("speed", [0.0, 1.0])
@pytest.mark.parametrize("damping", [0.0, 1.0])
def test_a_locked_clutch_beside_a_shaft_rests(speed: float, damping: float) -> None:
    # Nothing changes the angle between the inertias, nor their common speed.
    machine = wb.Machine(
        inertias=[wb.Inertia("a", 1.0, speed=speed), wb.Inertia("b", 2.0, speed=speed)],
        shafts=[wb.Shaft("a", "b", stiffness=10.0, damping=damping)],
        contacts=[contact("a", "b", name="clutch", friction=0.3, force=10.0)],
    )
    motion = wb.motion(machine)
    assert motion.kind == "at rest"
    assert max(motion.exponents) == 0.0


@pytest.mark.parametrize("run", [{}, {"transient": 20, "periods": 30}], ids=["auto", "fixed"])
def test_rest_keeps_deviations_of_angles_and_loses_those_of_speeds(run: dict[str, int]) -> None:
    machine = wb.Machine(
        inertias=[wb.Inertia("a", 1.0), wb.Inertia("b", 2.0)],
        shafts=[wb.Shaft("a", "b", 300.0, 2.0), wb.Shaft("b", "ground", 100.0)],
        contacts=[contact("a", name="one", force=50.0), contact("b", name="two", force=50.0)],
        torques=[wb.Torque("a", wb.Harmonic(8.0, 6.0))],
    )
    found = wb.motion(machine, **run)
    assert found.kind == "at rest"
    np.testing.assert_array_equal(found.exponents, [0.0, 0.0, -np.inf, -np.inf])

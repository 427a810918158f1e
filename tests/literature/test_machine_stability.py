"""Linear stability of general machines, against closed forms and independent computations."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import wedgebrake as wb
from differences import jacobian
from machines import contact, in_row, single
from wedgebrake.analysis.linear_stability.linear_system import LinearSystem
from wedgebrake.analysis.linear_stability.modes import spectrum_of

TURN = 2.0 * np.pi


def one_inertia(inertia, stiffness, damping, *, radius=0.2, friction=0.3, force=300.0, **more):
    brake = contact(radius=radius, friction=friction, force=force, **more)
    return single(brake, inertia=inertia, stiffness=stiffness, damping=damping)


# Closed forms


def test_hopf_of_a_mass_on_a_belt_with_falling_friction():
    # x'' + 2 xi x' + x = mu(v), mu = 0.5 + 0.5 exp(-|v|/0.5): at v_d = ln(10)/2.
    friction = wb.StribeckFriction(kinetic=0.5, static=1.0, speed=0.5)
    machine = one_inertia(1.0, 1.0, 0.1, radius=1.0, force=1.0, friction=friction, base_speed=1.0)
    found = wb.hopf(machine, "brake.base_speed", between=(0.1, 3.0))
    assert found.kind == "hopf"
    assert found.value == pytest.approx(0.5 * np.log(10.0), rel=1e-14)
    assert found.frequency == pytest.approx(1.0 / TURN, rel=1e-14)
    assert not wb.stability(machine).stable
    assert wb.stability(machine.replace({"brake.base_speed": 1.2})).stable


@pytest.mark.parametrize("inertia", [0.02, 1.0, 30.0])
@pytest.mark.parametrize("lag", [1e-5, 0.003, 0.1, 2.0])
@pytest.mark.parametrize(
    "brake", [wb.ConventionalBrake(radius=0.2), wb.WedgeBrake(radius=0.2, angle=0.4)]
)
def test_hopf_of_an_actuator_with_a_lag(inertia, lag, brake):
    stiffness, damping = 250.0, 0.3
    machine = one_inertia(inertia, stiffness, damping, lag=lag, limits=(-1e9, 1e9))
    machine = machine.replace({"brake.brake": brake})
    gain = 0.2 * brake.amplification(0.3)
    critical = -damping * (1.0 + stiffness * lag**2 / (inertia + damping * lag)) / gain
    found = wb.hopf(machine, "brake.slope", between=(3.0 * critical, 0.0))
    assert found.value == pytest.approx(critical, rel=1e-10)
    assert TURN * found.frequency == pytest.approx(
        np.sqrt(stiffness / (inertia + damping * lag)), rel=1e-10
    )
    assert found.mode.fed_by == "brake"


@pytest.mark.parametrize("dead_time", [0.015, 0.05])
def test_a_fast_controller_approaches_a_dead_time(dead_time):
    inertia, stiffness, damping, gain = 1.0, 100.0, 0.5, 0.06
    omega = brentq(
        lambda w: stiffness - inertia * w * w - damping * w * np.tan(w * dead_time), 5.0, 11.0,
        xtol=1e-14,
    )  # fmt: skip
    critical = -damping / np.cos(omega * dead_time) / gain
    errors, frequencies = [], []
    delays = np.array([1, 2, 4, 8])
    for delay in delays.tolist():
        machine = one_inertia(
            inertia, stiffness, damping, sample_time=dead_time / (delay + 0.5), delay=delay
        )
        found = wb.hopf(machine, "brake.slope", between=(2.0 * critical, 0.5 * critical))
        assert abs(found.mode.multiplier) == pytest.approx(1.0, abs=1e-12)
        errors.append(abs(found.value / critical - 1.0))
        frequencies.append(abs(TURN * found.frequency / omega - 1.0))
    for error in (errors, frequencies):
        order = -np.diff(np.log(error)) / np.diff(np.log(delays + 0.5))
        np.testing.assert_allclose(order, 2.0, atol=0.05)
    assert errors[-1] < 1e-2


def coupled(mu):
    """Hoffmann 2002, minimal model: K = [[2, 1 - 4 mu/3], [1, 2]], flutter from mu = 3/4 on."""
    stiffness = np.array([[2.0, 1.0 - 4.0 * mu / 3.0], [1.0, 2.0]])
    matrix = np.block([[np.zeros((2, 2)), np.eye(2)], [-stiffness, np.zeros((2, 2))]])
    none = np.zeros((0, 4))
    system = LinearSystem(
        matrix, none, none, none, (), None, slice(2, 4), np.eye(2), np.eye(4), np.zeros((2, 0)), 0
    )
    return spectrum_of(system, ())


@pytest.mark.parametrize(("mu", "flutters"), [(0.7, False), (0.8, True)])
def test_mode_coupling(mu, flutters):
    found = coupled(mu)
    assert (found.modes[0].growth_rate > found.rounding) == flutters
    if flutters:
        for value in (-1, 1):
            for side in (-1, 1):
                expected = side * 0.09109828 + value * 1.41714463j
                assert min(abs(one - expected) for one in found.eigenvalues) < 1e-8


def test_mode_coupling_begins_at_three_quarters():
    assert coupled(0.75 - 1e-9).modes[0].growth_rate < 1e-9
    after = coupled(0.75 + 1e-6).modes[0]
    assert after.growth_rate == pytest.approx(np.sqrt(4e-6 / 3.0 / 8.0), rel=1e-3)
    assert TURN * after.frequency == pytest.approx(np.sqrt(2.0), rel=1e-6)


def test_a_lag_that_vanishes():
    system = wb.paper.system(eta=-3.0)
    expected = wb.stability(system).forward.eigenvalues[0]
    gaps = []
    for lag in (1e-5, 1e-6, 1e-7):
        found = wb.stability(system.replace(lag=lag)).forward
        gaps.append(abs(max(found.eigenvalues, key=lambda z: z.imag) - expected))
    assert gaps[2] < 1e-4 * abs(expected)
    np.testing.assert_allclose(np.diff(np.log10(gaps)), -1.0, atol=0.05)


def test_the_mode_of_a_lag_without_friction_moves_no_inertia():
    machine = one_inertia(1.0, 1e4, 1.0, friction=0.0, slope=-3.0, lag=0.1, base_speed=-5.0)
    [lag] = [one for one in wb.stability(machine).cases[0].modes if one.frequency == 0.0]
    assert lag.growth_rate == pytest.approx(-10.0, rel=1e-12)
    np.testing.assert_array_equal(lag.shape, 0.0)


# Random machines against a right-hand side stated again


def random_machine(seed, *, sampled=False):
    """Four inertias, some of them free, with brakes, a clutch, lags and falling friction."""
    rng = np.random.default_rng(seed)

    def pick(low, high):
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    names = ["a", "b", "c", "d"]
    inertias = [wb.Inertia(name, pick(0.1, 3.0)) for name in names]
    shafts = [
        wb.Shaft("a", "b", pick(50, 5000), pick(0.01, 1), name="ab", ratio=rng.choice([1.0, 2.5])),
        wb.Shaft("b", "c", pick(50, 5000), pick(0.01, 1), name="bc"),
    ]
    if rng.random() < 0.5:
        shafts.append(wb.Shaft("d", "ground", pick(50, 5000), pick(0.01, 1), name="spring"))
    if rng.random() < 0.5:
        shafts.append(wb.Shaft("c", "ground", 0.0, pick(0.01, 1), name="bearing"))
    brakes = [wb.WedgeBrake(radius=0.2, angle=0.6), wb.BandBrake(radius=0.15, wrap_angle=3.0)]
    lags = [{}, {"lag": pick(0.001, 0.1)}, {"frequency": pick(20, 200), "damping_ratio": 0.7}]

    def contact(a, b, name, held):
        friction = wb.StribeckFriction(kinetic=0.3, static=0.4, speed=pick(0.3, 3.0))
        if rng.random() < 0.5:
            friction = wb.CoulombFriction(kinetic=0.3)
        sampling = {"sample_time": 0.004, "delay": int(rng.integers(0, 3))} if held else {}
        return wb.Contact(
            a, b, name=name, brake=brakes[rng.integers(2)], friction=friction,
            actuation=wb.Actuation(
                initial_force=200.0, slope=rng.uniform(-5, 5), **lags[rng.integers(3)], **sampling
            ),
            base_speed=rng.uniform(-3, 3) if b == "ground" else 0.0,
        )  # fmt: skip

    contacts = [
        contact("a", "ground", "front", sampled),
        contact("c", "d", "clutch", False),
        contact("d", "ground", "rear", sampled and rng.random() < 0.5),
    ]
    speeds = (rng.uniform(4, 9, 4) * rng.choice([-1, 1], 4)).tolist()
    return wb.Machine(inertias=inertias, shafts=shafts, contacts=contacts), speeds


def states_of(machine):
    return 2 * len(machine.inertias) + sum(
        1 if c.actuation.lag else 2 if c.actuation.frequency else 0 for c in machine.contacts
    )


def rates(machine, x, held=None):
    """x' of angles, speeds and forces of actuators, from the definitions alone.

    held : commands of controllers by contact
    """
    n = len(machine.inertias)
    number = {one.name: i for i, one in enumerate(machine.inertias)}
    torque, dx, state = np.zeros(n), np.zeros(len(x)), 2 * n
    for one in machine.shafts:
        i = number[one.a]
        j = number.get(one.b)
        twist, rate = x[i], x[n + i]
        if j is not None:
            twist, rate = twist - one.ratio * x[j], rate - one.ratio * x[n + j]
        value = one.stiffness * twist + one.damping * rate
        torque[i] -= value
        if j is not None:
            torque[j] += one.ratio * value
    for one in machine.contacts:
        i, j, given = number[one.a], number.get(one.b), one.actuation
        v = x[n + i] - (one.base_speed if j is None else x[n + j])
        command = given.initial_force + given.slope * abs(v)
        if given.sample_time and held is not None:
            command = held[one.name]
        force = command
        if given.lag:
            force = x[state]
            dx[state] = (command - force) / given.lag
            state += 1
        elif given.frequency:
            force, w = x[state], given.frequency
            dx[state] = x[state + 1]
            dx[state + 1] = w * w * (command - force) - 2 * given.damping_ratio * w * x[state + 1]
            state += 2
        mu = 0.3
        if isinstance(one.friction, wb.StribeckFriction):
            mu += 0.1 * np.exp(-abs(v) * one.brake.radius / one.friction.speed)
        value = one.brake.radius * max(force, 0.0) * one.brake.amplification(mu * np.sign(v))
        torque[i] -= value
        if j is not None:
            torque[j] += value
    dx[:n] = x[n : 2 * n]
    dx[n : 2 * n] = torque / [one.inertia for one in machine.inertias]
    return dx


def steady_state(machine, speeds):
    n = len(machine.inertias)
    number = {one.name: i for i, one in enumerate(machine.inertias)}
    x = np.zeros(states_of(machine))
    x[n : 2 * n] = speeds
    state = 2 * n
    for one in machine.contacts:
        v = speeds[number[one.a]]
        v -= one.base_speed if one.b == "ground" else speeds[number[one.b]]
        if one.actuation.lag or one.actuation.frequency:
            x[state] = one.actuation.initial_force + one.actuation.slope * abs(v)
            state += 1 if one.actuation.lag else 2
    return x


def matched(found, expected, scale):
    """Largest distance of pairs of nearest values, relative to a scale."""
    expected = list(expected)
    worst = 0.0
    for one in found:
        nearest = min(expected, key=lambda other: abs(other - one))
        expected.remove(nearest)
        worst = max(worst, abs(nearest - one))
    assert not expected
    return worst / scale


@pytest.mark.parametrize("seed", range(40))
def test_eigenvalues_are_those_of_the_jacobian(seed):
    machine, speeds = random_machine(seed)
    x = steady_state(machine, speeds)
    steps = 1e-4 * np.maximum(1.0, np.abs(x))
    expected = np.linalg.eigvals(jacobian(lambda states: rates(machine, states), x, steps))
    found = wb.stability(machine, speeds=speeds)
    assert len(found.cases) == 1
    # The double eigenvalues 0 of a free rotation are those that differences resolve worst.
    assert matched(found.eigenvalues, expected, max(abs(expected))) < 1e-6
    assert found.stable == (max(z.real for z in found.eigenvalues if abs(z) > 1e-9) < 0.0)


@pytest.mark.parametrize("seed", range(40))
def test_modes_satisfy_the_equations_of_motion(seed):
    machine, speeds = random_machine(seed)
    n = len(machine.inertias)
    number = {one.name: i for i, one in enumerate(machine.inertias)}
    [case] = wb.stability(machine, speeds=dict(zip("abcd", speeds, strict=True))).cases
    assert len(case.eigenvalues) == states_of(machine)
    for mode in case.modes:
        s, shape = mode.eigenvalue, mode.shape
        assert np.max(np.abs(shape)) == pytest.approx(1.0)
        terms = [s * s * np.array([one.inertia for one in machine.inertias]) * shape]
        stiffest = 0.0  # torque of the angles of a shaft, which nearly cancel in slow modes
        for one in machine.shafts:
            row = np.zeros(n)
            row[number[one.a]] = 1.0
            if one.b in number:
                row[number[one.b]] = -one.ratio
            terms.append((one.stiffness + one.damping * s) * row * (row @ shape))
            stiffest = max(stiffest, one.stiffness * (np.abs(row) @ np.abs(shape)))
        for one in machine.contacts:
            row = np.zeros(n)
            row[number[one.a]] = 1.0
            if one.b in number:
                row[number[one.b]] = -1.0
            given, v = one.actuation, case.speeds[one.name]
            side, size = np.sign(v), abs(v)

            def torque(speed, force, one=one, side=side):
                mu = 0.3
                if isinstance(one.friction, wb.StribeckFriction):
                    mu += 0.1 * np.exp(-speed * one.brake.radius / one.friction.speed)
                return one.brake.radius * force * one.brake.amplification(side * mu)

            force = given.initial_force + given.slope * size
            h = 1e-3  # differences of fourth order, with less rounding
            near, far = (torque(size + k * h, force) - torque(size - k * h, force) for k in (1, 2))
            rise = side * (8 * near - far) / (12 * h)
            lag = 1.0 + given.lag * s
            if given.frequency:
                w = given.frequency
                lag = (s * s + 2 * given.damping_ratio * w * s + w * w) / (w * w)
            gain = torque(size, 1.0) * side * given.slope / lag
            terms.append((rise + gain) * s * row * (row @ shape))
        terms = np.array(terms)
        size = np.max(np.abs(terms)) + 1e-4
        assert np.max(np.abs(terms.sum(axis=0))) < 1e-7 * size + 1e-12 * stiffest


@pytest.mark.parametrize("seed", range(6))
def test_multipliers_are_those_of_the_map_from_sample_to_sample(seed):
    machine, speeds = random_machine(seed, sampled=True)
    x0 = steady_state(machine, speeds)
    n, number = len(machine.inertias), {one.name: i for i, one in enumerate(machine.inertias)}
    controllers = [one for one in machine.contacts if one.actuation.sample_time]

    def command(one, x):
        v = x[n + number[one.a]]
        v -= one.base_speed if one.b == "ground" else x[n + number[one.b]]
        return one.actuation.initial_force + one.actuation.slope * abs(v)

    steady = {one.name: command(one, x0) for one in controllers}

    def load(time):
        """What holds the machine at these speeds, also where they twist shafts."""
        x = x0.copy()
        x[:n] = time * x0[n : 2 * n]
        found = -rates(machine, x, steady)
        found[:n] = 0.0
        return found

    def step(state):
        x, queues = state[: x0.size], list(state[x0.size :])
        held, after = {}, []
        for one in controllers:
            waiting = [queues.pop(0) for _ in range(one.actuation.delay)] + [command(one, x)]
            held[one.name] = waiting[0]
            after += waiting[1:]
        path = solve_ivp(
            lambda t, y: rates(machine, y, held) + load(t), (0.0, 0.004), x, "DOP853",
            rtol=1e-12, atol=1e-12,
        )  # fmt: skip
        return np.concatenate([path.y[:, -1], after])

    queues = [command(one, x0) for one in controllers for _ in range(one.actuation.delay)]
    start = np.concatenate([x0, queues])
    steps = 1e-3 * np.maximum(1.0, np.abs(start))
    expected = np.linalg.eigvals(jacobian(step, start, steps))
    found = wb.stability(machine, speeds=speeds)
    assert len(found.multipliers) == start.size
    assert matched(found.multipliers, expected, 1.0) < 1e-7


# Free vibration


def grows_as(times, values):
    """Growth rate and frequency [rad/s] of one mode, from equidistant values with zero mean."""
    before, here, after = values[:-2], values[1:-1], values[2:]
    (a, b), *_ = np.linalg.lstsq(np.stack([here, before], 1), after, rcond=None)
    root = max(np.roots([1.0, -a, -b]), key=lambda z: z.imag)
    rate = np.log(root) / (times[1] - times[0])
    return rate.real, rate.imag


def deviation(machine, x0, duration, times):
    """Angle of the disc of two motions, of which one is disturbed, less each other."""
    disturbed = machine.replace({"disc.speed": x0})
    one, other = (wb.simulate(m, duration=duration, times=times) for m in (disturbed, machine))
    assert one.event_time.size == other.event_time.size == 0
    return (one.angle - other.angle).sel(inertia="disc").values


def belt_brake(**actuation):
    """A disc on a belt, with a torque that almost balances the friction."""
    wedge = wb.WedgeBrake(radius=0.2, angle=0.5)
    brake = contact(brake=wedge, friction=0.3, force=1000.0, base_speed=-30.0, **actuation)
    machine = in_row(
        brake, names=("disc", "motor"), inertia=(1.0, 0.3), stiffness=(400.0, 900.0),
        damping=(0.4, 2.0),
    )  # fmt: skip
    return machine.replace(torques=[wb.Torque("disc", 220.0)])


@pytest.mark.parametrize(
    "actuation",
    [
        {"slope": -5.0, "lag": 0.02},
        {"slope": -1.0, "frequency": 60.0, "damping_ratio": 0.6},
        {"slope": -4.0, "sample_time": 0.02},
        {"slope": -1.0, "sample_time": 0.02, "delay": 2, "lag": 0.01},
    ],
)
def test_growth_of_free_vibration(actuation):
    machine = belt_brake(**actuation)
    [case] = wb.stability(machine).cases
    mode = case.modes[0]
    # The other modes have died out.
    first = int(50 * 25.0 / (mode.growth_rate - case.modes[1].growth_rate)) + 1
    times = 0.02 * np.arange(first, first + 60)
    found = grows_as(times, deviation(machine, 1e-2, times[-1], times))
    assert found[0] == pytest.approx(mode.growth_rate, abs=1e-6)
    assert found[1] == pytest.approx(TURN * mode.frequency, rel=1e-7)

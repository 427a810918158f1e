"""Branches of limit cycles that begin at a Hopf point of steady sliding."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import wedgebrake as wb
from machines import block, contact, in_row, single, stribeck
from stick_slip import stick_slip
from wedgebrake.errors import InputError
from wedgebrake.orbits.bifurcation_types import Kind, Scenario

DAMPING, KINETIC, STATIC, SPEED = 0.1, 0.5, 1.0, 0.5


def pair(friction: Any) -> Any:
    """A second inertia on the block."""
    belt = contact("block", name="belt", friction=friction, base_speed=1.0)
    return in_row(belt, names=("block", "other"), stiffness=(1.0, 3.0), damping=(0.06, 0.03))


def branch_from(limit: Any, ends: tuple[float, float], method: str, **settings: Any) -> Any:
    branch = wb.continuation(limit, {limit.parameter: ends}, method=method, **settings)
    list(branch)
    return branch


def curvature(branch: Any) -> float:
    """(p - p_Hopf)/A^2 for A -> 0, A being the amplitude of the velocity."""
    begin = branch.points[0]
    assert begin.bifurcation.kind is Kind.HOPF
    squares, changes = np.array(
        [(one.measures.velocity_amplitude**2, one.value - begin.value) for one in branch.points[2:]]
    ).T
    few = squares <= 0.02
    assert few.sum() >= 4
    return float(np.polynomial.polynomial.polyfit(squares[few], (changes / squares)[few], 2)[0])


@pytest.fixture(scope="module")
def smooth() -> Any:
    """The branch over the speed of the belt."""
    limit = wb.hopf(block(stribeck()), "belt.base_speed", between=(0.8, 1.5))
    return branch_from(limit, (0.5, 3.0), "smooth")


def test_it_begins_at_the_closed_form(smooth) -> None:
    begin = smooth.points[0]
    assert begin.bifurcation.kind is Kind.HOPF
    assert begin.value == pytest.approx(0.5 * math.log(10.0), rel=1e-11)
    assert begin.period == pytest.approx(2.0 * math.pi, rel=1e-6)


def test_the_amplitude_grows_as_the_normal_form_says(smooth) -> None:
    """x'' + x = a y + b y^2 + c y^3 with y = x' has the cycle a + 3/4 c A^2 = 0 (b drops out).

    mu(v - y) gives a = -2 xi - mu'(v) and c = -mu'''(v)/6, with mu' = -e^(-2v) here.
    """
    slope = -2.0 * DAMPING  # da/dv at the Hopf point, where e^(-2v) = 0.1
    c = 4.0 / 6.0 * DAMPING
    assert curvature(smooth) == pytest.approx(-0.75 * c / slope, rel=1e-5)
    # It exists where sliding is stable, and is unstable: subcritical.
    assert not smooth.points[2].stable


def test_averaging_gives_the_unstable_cycle_approximately(smooth) -> None:
    """xi A = mu_d (mu_sd - 1) e^(-v/v_0) I_1(A/v_0)."""
    from scipy.special import i1

    for point in smooth.points[3:]:
        if point.measures.stick_share > 0.0 or point.value > 1.6:
            break
        a, v = point.measures.velocity_amplitude, point.value
        driving = (STATIC - KINETIC) * math.exp(-v / SPEED) * i1(a / SPEED)
        assert 0.5 * DAMPING * a == pytest.approx(driving, rel=0.02)


def grazing_speed() -> float:
    """Speed of the belt at which a cycle without sticking touches zero sliding speed.

    There the block has the speed of the belt and no acceleration, and again one cycle later.
    """

    def slip(_: float, state: Any, speed: float) -> list[float]:
        x, y = state
        mu = KINETIC + (STATIC - KINETIC) * math.exp(-(speed - y) / SPEED)
        return [y, mu - x - DAMPING * y]

    def excess(speed: float) -> float:
        def turns(t: float, state: Any) -> float:
            return slip(t, state, speed)[1]

        turns.direction = -1.0
        begin = [STATIC - DAMPING * speed, speed]
        run = solve_ivp(
            lambda t, z: slip(t, z, speed), (0.0, 9.0), begin, "DOP853", events=turns,
            rtol=1e-13, atol=1e-14,
        )  # fmt: skip
        late = run.t_events[0] > 3.0
        return float(run.y_events[0][late][0][1]) - speed

    return float(brentq(excess, 1.7, 1.95, xtol=1e-13))


def after_in_40_digits(point: Any) -> tuple[Any, Any, Any]:
    """(angle, velocity, growth of areas) a period after a point, by Taylor series of order 50.

    With e = exp(-(v - y)/v_0), e' = e y'/v_0, all terms follow from those before. Areas grow at the
    rate dy'/dy = -2 xi + (mu_s - mu_k) e/v_0 (Liouville); the multiplier in time is 1.
    """
    steps, terms = 48, 50
    peak, damping, scale = (mpf(repr(one)) for one in (STATIC - KINETIC, DAMPING, SPEED))
    h = mpf(point.period) / steps
    begin, speed, area = *map(mpf, point.points[0]), mpf(0)
    for _ in range(steps):
        x, y, e = [begin], [speed], [mp.exp((speed - mpf(point.value)) / scale)]
        for k in range(terms):
            push = (KINETIC if k == 0 else 0) + peak * e[k] - x[k] - damping * y[k]
            x.append(y[k] / (k + 1))
            y.append(push / (k + 1))
            e.append(mp.fsum(e[k - j] * (j + 1) * y[j + 1] for j in range(k + 1)) / scale / (k + 1))
        powers = [h**k for k in range(terms + 1)]
        begin, speed = mp.fdot(x, powers), mp.fdot(y, powers)
        area += peak / scale * mp.fsum(one * powers[k] * h / (k + 1) for k, one in enumerate(e))
        area -= damping * h
    return begin, speed, mp.exp(area)


def test_the_unstable_cycle_closes_in_40_digits(smooth) -> None:
    cycles = [one for one in smooth.points[1:] if not one.stable and not one.measures.stick_share]
    assert len(cycles) > 10
    for point in cycles[2::8]:
        with mp.workdps(45):
            angle, velocity, area = after_in_40_digits(point)
        size = point.measures.velocity_amplitude
        np.testing.assert_allclose(
            [float(angle), float(velocity)], point.points[0], rtol=0.0, atol=1e-11 * size
        )
        assert float(area) == pytest.approx(float(abs(point.multipliers[0])), rel=1e-10)


def test_it_turns_where_it_grazes_and_goes_on_as_stick_slip(smooth) -> None:
    grazing = next(p for p in smooth.bifurcations if p.bifurcation.kind is Kind.GRAZING_SLIDING)
    assert grazing.bifurcation.scenario is Scenario.FOLD
    assert grazing.value == pytest.approx(grazing_speed(), rel=1e-9)
    last = smooth.points[-1]
    assert last.value == 0.5
    assert last.stable
    assert last.measures.stick_share > 0.0
    # The motion that a simulation reaches from rest on the belt.
    settled = wb.motion(last.system.replace({"block.speed": 0.5}), method="smooth")
    assert settled.period == pytest.approx(last.period, rel=1e-9)


def test_the_exact_method_follows_its_lines(smooth) -> None:
    """Its branch begins at a kink near the Hopf point, and has the error of the lines."""
    limit = wb.hopf(block(stribeck(1e-4)), "belt.base_speed", between=(0.8, 1.5))
    found = branch_from(limit, (0.5, 3.0), "exact")
    kinks = [speed for speed, _ in stribeck(1e-4).nodes()]
    assert min(abs(found.points[0].value - one) for one in kinks) <= 1e-9
    graze = [
        next(p for p in one.bifurcations if p.bifurcation.kind is Kind.GRAZING_SLIDING).value
        for one in (smooth, found)
    ]
    assert graze[1] == pytest.approx(graze[0], abs=1e-3)
    assert found.points[-1].period == pytest.approx(smooth.points[-1].period, rel=1e-3)


def test_at_a_kink_cycles_grow_in_proportion() -> None:
    """Near the kink of a table nothing but the distance from it has a length."""
    table = wb.TabulatedFriction(speeds=(0.0, 1.0, 2.0), coefficients=(1.0, 0.8, 0.75))
    limit = wb.hopf(block(table), "belt.base_speed", between=(0.5, 1.5))
    assert not limit.continuous
    found = branch_from(limit, (0.25, 1.9), "exact", points=8)
    assert found.points[0].value == pytest.approx(1.0, abs=1e-12)
    ratios = [one.measures.velocity_amplitude / (one.value - 1.0) for one in found.points[1:5]]
    np.testing.assert_allclose(ratios, ratios[0], rtol=1e-9)
    assert all(one.stable for one in found.points[1:5]) == (ratios[0] < 0.0)


def test_cycles_beyond_a_stick_that_begins_at_a_holding_limit_that_grows() -> None:
    """At the bifurcation, the shaft torque is at the holding limit where the stick begins."""
    radius, kinetic = 0.2, 0.3
    system = wb.BrakedDriveline(
        driveline=wb.Driveline(inertia=1.0, damping=0.5, stiffness=1000.0, drive_speed=4.0),
        brake=wb.ConventionalBrake(radius=radius),
        friction=wb.CoulombFriction(kinetic=kinetic),
        actuation=wb.Actuation(initial_force=400.0, slope=-20.0, lag=0.02),
        excitation=wb.HarmonicTorque(amplitude=0.0, frequency=1.0),
    )
    branch = wb.continuation(wb.orbit(system, initial=(0.02, -3.0)), slope=(-20.0, -30.0))
    assert list(branch)[-1].value == -30.0
    (found,) = branch.bifurcations
    assert found.bifurcation.kind is Kind.SWITCHING_SLIDING
    machine = system.replace(slope=found.value).machine.replace({"driveline.speed": -3.0})
    begins = wb.simulate(machine, 20.0, times=[])["stick_start"].values[-1]
    state = wb.simulate(machine, 20.0, times=[begins])
    torque, force = (float(state[name][0, 0]) for name in ("shaft_torque", "actuation_force"))
    assert torque == pytest.approx(kinetic * radius * force, rel=1e-9)


def test_small_cycles_of_a_linear_system_share_one_value() -> None:
    """With Coulomb friction and a lag nothing is nonlinear until the block comes to rest.

    (J s^2 + c s + k)(1 + T s) + K s = 0 has s = i w at K = -c (1 + k T^2/(J + c T)).
    """
    lag, mu = 0.2, 0.4
    machine = block(wb.CoulombFriction(kinetic=mu), base_speed=2.0, force=20.0, lag=lag)
    limit = wb.hopf(machine, "belt.slope", between=(-2.0, 0.0))
    k = -DAMPING * (1.0 + lag**2 / (1.0 + DAMPING * lag))
    assert limit.value == pytest.approx(k / mu, rel=1e-12)
    found = branch_from(limit, (-2.0, 0.0), "exact", points=60)
    assert [one.bifurcation.kind for one in found.bifurcations[:2]] == [
        Kind.HOPF, Kind.GRAZING_SLIDING
    ]  # fmt: skip
    grazing = found.bifurcations[1]
    assert grazing.value == pytest.approx(limit.value, rel=1e-9)
    assert grazing.measures.velocity_amplitude == pytest.approx(2.0, rel=1e-7)
    assert grazing.period == pytest.approx(2.0 * math.pi * math.sqrt(1.0 + DAMPING * lag))
    assert found.points[-1].measures.stick_share > 0.0


def lyapunov_curvature(machine: Any, changed: Any, value: float) -> float:
    """(p - p_Hopf)/A^2, A being the amplitude of the first speed, from the normal form.

    Y. A. Kuznetsov, Elements of Applied Bifurcation Theory, section 5.4. Friction depends on the
    first speed alone, so that B and C have one entry.

    changed : matrix of a machine by the parameter
    """
    matrix = changed(value)
    values, vectors = np.linalg.eig(matrix)
    critical = int(np.argmin(np.abs(values.real) + (values.imag <= 0.0) * 1e3))
    omega, q = values[critical].imag, vectors[:, critical]
    left_values, lefts = np.linalg.eig(matrix.T)
    p = lefts[:, int(np.argmin(np.abs(left_values - values[critical].conjugate())))]
    p = p / np.conj(np.vdot(p, q))
    n = len(machine.inertias)
    v = abs(machine.contacts[0].base_speed)
    fall = (STATIC - KINETIC) * math.exp(-v / SPEED)
    # Torque mu(v - y): derivatives by y are fall/SPEED^k, all of one sign.
    place = np.zeros(2 * n)
    place[n] = 1.0 / machine.inertias[0].inertia

    def second(x: Any, y: Any) -> Any:
        return place * (fall / SPEED**2 * x[n] * y[n])

    def third(x: Any, y: Any, z: Any) -> Any:
        return place * (fall / SPEED**3 * x[n] * y[n] * z[n])

    unit = np.eye(2 * n)
    terms = third(q, q, q.conj())
    terms = terms - 2.0 * second(q, np.linalg.solve(matrix, second(q, q.conj())))
    terms = terms + second(
        q.conj(), np.linalg.solve(2j * omega * unit - matrix, second(q, q))
    )  # fmt: skip
    # z' = lambda z + g z |z|^2, with x = z q + conj
    g = 0.5 * np.vdot(p, terms)
    step = 1e-6 * value
    change = (changed(value + step) - changed(value - step)) / (2.0 * step)
    rate = np.vdot(p, change @ q).real
    return float(-g.real / rate / abs(2.0 * q[n]) ** 2)


def matrix_of(machine: Any) -> np.ndarray:
    """Derivative of the equations of motion about steady sliding."""
    n = len(machine.inertias)
    names = [one.name for one in machine.inertias]
    k, c = np.zeros((n, n)), np.zeros((n, n))
    for shaft in machine.shafts:
        row = np.zeros(n)
        row[names.index(shaft.a)] = 1.0
        if shaft.b in names:
            row[names.index(shaft.b)] = -1.0
        k += shaft.stiffness * np.outer(row, row)
        c += shaft.damping * np.outer(row, row)
    v = abs(machine.contacts[0].base_speed)
    c[0, 0] -= (STATIC - KINETIC) / SPEED * math.exp(-v / SPEED)
    inverse = np.diag([1.0 / one.inertia for one in machine.inertias])
    return np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ k, -inverse @ c]])


@pytest.mark.parametrize(
    ("parameter", "ends"), [("belt.base_speed", (0.3, 3.0)), ("block-ground.damping", (0.0, 1.0))]
)
def test_two_inertias_have_the_first_lyapunov_coefficient(parameter, ends) -> None:
    machine = pair(stribeck())
    limit = wb.hopf(machine, parameter, between=ends)
    found = branch_from(limit, ends, "smooth", points=12, step=0.008)

    def changed(value: float) -> np.ndarray:
        return matrix_of(machine.replace({parameter: value}))

    growth = np.linalg.eigvals(changed(found.points[0].value)).real
    assert np.min(np.abs(growth)) <= 1e-10
    expected = lyapunov_curvature(machine.replace({parameter: limit.value}), changed, limit.value)
    # Of the first speed, whose amplitude is the larger one in this mode or not.
    ratio = amplitude_ratio(changed(limit.value))
    assert curvature(found) == pytest.approx(expected / max(1.0, ratio) ** 2, rel=1e-4)


def amplitude_ratio(matrix: np.ndarray) -> float:
    """Amplitude of the second speed over that of the first one, in the critical mode."""
    values, vectors = np.linalg.eig(matrix)
    q = vectors[:, int(np.argmin(np.abs(values.real)))]
    return float(abs(q[3]) / abs(q[2]))


def test_a_machine_that_turns_freely() -> None:
    """A motor with a falling characteristic turns a disc with a brake; the shaft vibrates."""
    speed = 4.0
    torque = 3.0 * speed + 20.0 * stribeck().kinetic_at(0.2 * speed)
    machine = wb.Machine(
        inertias=[wb.Inertia("motor", 1.0, speed=speed), wb.Inertia("disc", 0.2, speed=speed)],
        shafts=[
            wb.Shaft("motor", "ground", stiffness=0.0, damping=3.0),
            wb.Shaft("motor", "disc", stiffness=100.0, damping=0.05),
        ],
        contacts=[contact(radius=0.2, friction=stribeck(), force=100.0)],
        torques=[wb.Torque("motor", wb.Constant(torque), name="drive")],
    )  # fmt: skip
    limit = wb.hopf(machine, "motor-disc.damping", between=(0.0, 5.0))
    found = branch_from(limit, (0.0, 5.0), "smooth", step=0.05)
    assert found.points[0].value == pytest.approx(limit.value, rel=1e-9)
    assert found.points[0].period == pytest.approx(1.0 / limit.frequency, rel=1e-5)
    assert [(one.bifurcation.kind, one.bifurcation.scenario) for one in found.bifurcations] == [
        (Kind.HOPF, Scenario.NONE), (Kind.GRAZING_SLIDING, Scenario.FOLD)
    ]  # fmt: skip
    last = found.points[-1]
    assert last.value == 0.0
    assert wb.motion(last.system, method="smooth").period == pytest.approx(last.period, rel=1e-9)


@pytest.mark.parametrize("end", [0.0, -1.0, 1e-5])
def test_a_cycle_that_shrinks_with_the_speed_meets_no_hopf_point(end) -> None:
    """On one line of the friction table, the speed of the belt is the only scale of the motion."""
    table = wb.TabulatedFriction(speeds=(0.0, 5.0), coefficients=(1.0, 0.0))
    cycle = wb.orbit(block(table, base_speed=1.0).replace({"block.speed": 1.0}))
    branch = wb.continuation(cycle, {"belt.base_speed": (1.0, end)})
    points = list(branch)
    assert not branch.bifurcations
    assert points[-1].value == end or 0.0 < points[-1].value < 1e-6
    one = stick_slip(lambda slip: 1.0 - 0.2 * slip, 1.0, damping=DAMPING)
    for point in points:
        amplitude = 0.5 * (one.fastest - one.slowest) * point.value
        assert point.measures.velocity_amplitude == pytest.approx(amplitude, rel=1e-4)


def test_a_branch_that_shrinks_to_a_hopf_point_ends_at_its_closed_form() -> None:
    start = block(stribeck(), base_speed=1.5).replace({"block.angle": 0.8, "block.speed": 1.5})
    cycle = wb.orbit(start, method="smooth")
    *_, before, last = wb.continuation(cycle, {"belt.base_speed": (1.0, 3.0)})
    assert last.bifurcation.kind is Kind.HOPF
    assert last.value == pytest.approx(0.5 * math.log(10.0), rel=1e-11)
    assert last.arclength == before.arclength


@pytest.fixture(scope="module")
def dataset() -> Any:
    """The branch of ``smooth`` as a dataset."""
    limit = wb.hopf(block(stribeck()), "belt.base_speed", between=(0.8, 1.5))
    return wb.branches(limit, {"belt.base_speed": (0.5, 3.0)}, method="smooth", switch=0)


def test_the_stable_stick_slip_cycle_is_that_of_scipy(dataset) -> None:
    stable = dataset.isel(point=dataset["stable"].values)
    speeds = stable["belt.base_speed"].values
    assert speeds.min() == 0.5
    # Where the cycle grazes, the stick is too short for the steps of SciPy.
    far = stable["stick_share"].values > 0.005
    assert speeds[far].max() > 1.8
    assert far.sum() >= 20
    for at in np.flatnonzero(far):
        cycle = stick_slip(
            lambda slip: KINETIC + (STATIC - KINETIC) * math.exp(-slip / SPEED),
            speeds[at], damping=DAMPING,
        )  # fmt: skip
        expected = {
            "period": cycle.period, "stick_share": 1.0 - cycle.slip / cycle.period,
            "angle_amplitude": 0.5 * (cycle.highest - cycle.lowest),
            "velocity_amplitude": 0.5 * (cycle.fastest - cycle.slowest),
        }  # fmt: skip
        for name, value in expected.items():
            assert stable[name].values[at] == pytest.approx(value, rel=1e-11), name


def test_branches_as_a_dataset(dataset) -> None:
    assert dataset.sizes["branch_number"] == 1
    assert dataset["bifurcation_kind"].values.tolist() == ["Hopf", "grazing-sliding"]
    assert dataset["branch_begin"].values.tolist() == ["Hopf point of steady sliding"]
    assert dataset["belt.base_speed"].values[0] == pytest.approx(0.5 * math.log(10.0), rel=1e-11)


def test_a_range_may_begin_or_end_at_the_hopf_point() -> None:
    """``wb.hopf`` and the branch compute this point differently: the values differ by rounding."""
    limit = wb.hopf(block(stribeck()), "belt.base_speed", between=(0.8, 1.5))
    # The cycles exist only above the Hopf point.
    for ends, count in [((limit.value, 3.0), 5), ((3.0, limit.value), 5), ((0.5, limit.value), 1)]:
        over = {"belt.base_speed": ends}
        points = list(wb.continuation(limit, over, method="smooth", points=5))
        assert points[0].value == pytest.approx(limit.value, rel=1e-12)
        assert len(points) == count
        found = wb.branches(limit, over, method="smooth", points=5, opposite=False)
        assert found["belt.base_speed"].values.tolist() == [one.value for one in points]


def test_with_lines_the_hopf_point_may_be_outside_the_range() -> None:
    limit = wb.hopf(block(stribeck()), "belt.base_speed", between=(0.8, 1.5))
    with pytest.raises(InputError) as caught:
        wb.continuation(limit, {"belt.base_speed": (limit.value, 3.0)}, method="exact")
    assert caught.value.name == "limit"
    assert caught.value.value == limit.value


def test_the_limit_carries_the_machine() -> None:
    limit = wb.hopf(block(stribeck()), "block-ground.damping", between=(0.0, 1.0))
    assert limit.machine.parameters()["block-ground.damping"] == limit.value
    assert wb.stability(limit.machine).growth_rate == pytest.approx(0.0, abs=1e-12)
    given = wb.hopf(
        block(stribeck()), "block-ground.damping", between=(0.0, 1.0), speeds={"block": -0.25}
    )
    assert given.machine.parameters()["block.speed"] == -0.25
    json.dumps(limit.as_dict())


def test_limit_cycles_have_no_periods_of_a_torque() -> None:
    """Nor has the text for the end of a branch where its orbits repeat after fewer returns."""
    cycle = wb.orbit(block(stribeck(), base_speed=0.5).replace({"block.speed": 0.5}))
    point = next(wb.continuation(cycle, {"belt.base_speed": (0.5, 0.6)}))
    assert point.problem.doubling_of(1) == "period doubling of a limit cycle"
    assert point.name in point.problem.doubling_of(1)


class TestErrors:
    limit = wb.hopf(block(stribeck()), "belt.base_speed", between=(0.8, 1.5))

    @pytest.mark.parametrize(
        "over",
        [
            {"block-ground.damping": (0.0, 1.0)},
            {"belt.base_speed": (1.2, 3.0)},
            {"belt.no": (1, 2)},
        ],
    )
    def test_the_parameter_is_that_of_the_limit(self, over) -> None:
        for function in (wb.continuation, wb.branches):
            with pytest.raises(InputError):
                function(self.limit, over)

    def test_settings(self) -> None:
        over = {"belt.base_speed": (0.5, 3.0)}
        with pytest.raises(InputError) as caught:
            wb.branches(self.limit, over, order=1)
        assert caught.value.name == "order"
        for method in ("exakt", "ode14x", 3):
            with pytest.raises(InputError) as caught:
                wb.continuation(self.limit, over, method=method)
            assert caught.value.name == "method"
        cycle = wb.orbit(block(stribeck(), base_speed=0.5).replace({"block.speed": 0.5}))
        with pytest.raises(InputError) as caught:
            wb.continuation(cycle, over, method="smooth")
        assert caught.value.name == "method"

    def test_tolerance(self) -> None:
        for rtol in (math.nan, 0.0, "a"):
            with pytest.raises(InputError) as caught:
                wb.continuation(self.limit, {"belt.base_speed": (0.5, 3.0)}, rtol=rtol)
            assert caught.value.name == "rtol"

    @pytest.mark.parametrize("ends", [(0.01, 0.0), (0.0, 0.1)])
    def test_a_lag_does_not_vanish(self, ends) -> None:
        """The shortest time scale of the motion would vanish with it."""
        start = block(stribeck(), base_speed=0.5, slope=-0.01, lag=0.01)
        cycle = wb.orbit(start.replace({"block.speed": 0.5}))
        with pytest.raises(InputError) as caught:
            wb.continuation(cycle, {"belt.lag": ends})
        assert (caught.value.name, caught.value.value) == ("belt.lag", ends)

    @pytest.mark.parametrize("between", [None, 1.0, "ab", ([1.0], 2.0), (1.0,), (1.0, math.nan)])
    def test_interval(self, between) -> None:
        with pytest.raises(InputError) as caught:
            wb.hopf(block(stribeck()), "belt.base_speed", between=between)
        assert caught.value.name == "between"

    def test_a_divergence_has_no_limit_cycles(self) -> None:
        belt = contact("block", name="belt", friction=stribeck(), slope=1.0)
        free = single(belt, name="block", speed=3.0)
        limit = wb.hopf(free, "belt.slope", between=(-3.0, 3.0))
        with pytest.raises(InputError):
            wb.continuation(limit, {"belt.slope": (-3.0, 3.0)})

    def test_a_speed_that_is_not_steady_has_none(self) -> None:
        machine = block(stribeck(), base_speed=0.0).replace({"block.speed": 2.0})
        limit = wb.hopf(machine, "block-ground.damping", between=(0.0, 0.5))
        with pytest.raises(InputError):
            wb.continuation(limit, {"block-ground.damping": (0.0, 0.5)})

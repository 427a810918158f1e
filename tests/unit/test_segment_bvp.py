"""The segment boundary-value problem of an orbit against independent statements of it."""

from __future__ import annotations

import math

import numpy as np
import pytest

import wedgebrake as wb
from differences import jacobian
from equations import angular_frequency, law
from wedgebrake.dynamics.enums import EventKind
from wedgebrake.orbits.equations.segment_bvp import SegmentBVP, run
from wedgebrake.orbits.equations.segment_orbit import QUANTITIES
from wedgebrake.solvers.event_driven.solve import problem

JUMP = wb.paper.system(static=0.33)
TABLE = wb.paper.system().replace(
    brake=wb.ConventionalBrake(radius=0.2),
    friction=wb.TabulatedFriction(speeds=(0.0, 0.5, 1.5), coefficients=(0.3, 0.25, 0.28)),
    slope=0.0,
)
TURNING = wb.paper.system(static=0.33).replace(drive_speed=3.0)
DAMPED = wb.paper.system().replace(damping=300.0)
SPRINGLESS = wb.paper.system().replace(stiffness=0.0)
UNDAMPED = wb.paper.system().replace(damping=0.0, slope=0.0, f=1.0)
SYSTEMS = {
    "wedge": wb.paper.system(),
    "static above kinetic": JUMP,
    "table": TABLE,
    "turning": TURNING,
    "overdamped": DAMPED,
    "no spring": SPRINGLESS,
    "resonance": UNDAMPED,
}
# Every two neighbours that there are, and slips that end where they began.
SEQUENCES = {
    "sticks": (1, 0, -1, 0),
    "reversals": (1, -1),
    "a slip inside a stick": (1, 0, -1, 0, -1, 0),
    "rest between slips one way": (1, 0),
    "reversal, then rest": (1, -1, 0),
    "rest, then reversal": (1, 0, -1),
    "a breakpoint and back": (1, 2, 1, -1, -2, -1),
    "between breakpoints only": (1, 2),
    "mark forwards": (1,),
    "mark backwards": (-1,),
    "mark beyond the breakpoint": (2,),
}


def _has_piece(system: wb.BrakedDriveline, code: int) -> bool:
    """Return True if the brake's law has the piece of this code: no kernel is compiled."""
    stated = system.characteristic
    return 0 <= stated.first_forward + code - (code > 0) < len(stated.slopes)


VALID = [
    (name, sequence)
    for name, system in SYSTEMS.items()
    for sequence, codes in SEQUENCES.items()
    if all(code == 0 or _has_piece(system, code) for code in codes)
]


def _unknowns(bvp: SegmentBVP, rng: np.random.Generator, gap: float | None = None) -> np.ndarray:
    """Phases in order, ``gap`` [rad] apart or across the orbit, and any angles."""
    count = len(bvp.codes)
    circle = 2.0 * math.pi * bvp.order
    apart = circle / count if gap is None else gap
    unknowns = np.empty(2 * count)
    unknowns[0::2] = 0.3 + apart * (np.arange(count) + 0.2 * rng.uniform(size=count) * (count > 1))
    unknowns[1::2] = 0.05 * rng.normal(size=count)
    if bvp.is_mark(0):
        unknowns[0] = 2.0 * bvp.codes[0]
    return unknowns


def _differences(bvp: SegmentBVP, unknowns: np.ndarray, given: tuple, step: float) -> np.ndarray:
    return jacobian(lambda there: bvp.residual(there, given), unknowns, step)


@pytest.mark.parametrize(("name", "sequence"), VALID)
def test_derivative_agrees_with_differences(name, sequence) -> None:
    """For every kind of node, away from solutions too."""
    bvp = SegmentBVP(SEQUENCES[sequence], 2)
    given = problem(SYSTEMS[name])
    rng = np.random.default_rng(3)
    for gap in (None, 0.05, 0.009):
        if gap is not None and bvp.is_mark(0):
            continue
        unknowns = _unknowns(bvp, rng, gap)
        # Far shorter than the shortest piece.
        step = 1e-3 if gap is None else 0.02 * gap
        _, matrix = bvp.linearize(unknowns, given)
        # At resonance the return is the identity, and the derivative of a mark's equations zero.
        rows = np.max(np.abs(matrix), axis=1, keepdims=True)
        rows = np.maximum(rows, 1.0) if bvp.is_mark(0) else rows
        # Quotients by the time, or its square, round the velocity and the angle so much more.
        error = np.abs(matrix - _differences(bvp, unknowns, given, step)) / rows
        assert np.max(error) <= 1e-6, (gap, np.argwhere(error > 1e-6))


@pytest.mark.parametrize("sequence", ["reversals", "rest between slips one way"])
@pytest.mark.parametrize("name", SYSTEMS)
def test_residual_and_derivative_are_continuous_in_the_length(name, sequence) -> None:
    """Across zero, and across the lengths where formulas change: no jump beyond their slope."""
    bvp, given = SegmentBVP(SEQUENCES[sequence], 1), problem(SYSTEMS[name])
    lengths = np.concatenate(
        (-np.geomspace(1e-1, 1e-12, 600), [0.0], np.geomspace(1e-12, 1e-1, 600))
    )
    answers = []
    for length in lengths:
        unknowns = np.tile([0.7, 0.004], len(bvp.codes))
        unknowns[2] += length
        unknowns[4::2] += 1.0
        values, matrix = bvp.linearize(unknowns, given)
        answers.append(np.concatenate((values, matrix.ravel())))
    found = np.array(answers)
    size = np.max(np.abs(found), axis=0) + 1e-300
    jumps = np.max(np.abs(np.diff(found, axis=0)) / size, axis=1)
    # The step of the lengths themselves, with room for slopes as fast as the fastest rate.
    room = 40.0 * np.abs(np.diff(lengths)) + 1e-6
    assert np.all(jumps <= room), (lengths[:-1][jumps > room], jumps[jumps > room])


def _orbit(**changes):
    order = changes.pop("order", None)
    found = wb.orbit(wb.paper.system().replace(**changes), order)
    assert found.found
    return found


def _whole(found: wb.Orbit) -> tuple[SegmentBVP, np.ndarray]:
    """The equations of all of the orbit, where the solver keeps half of a symmetric one."""
    solution = found._solution
    return solution.equations.whole(solution.unknowns)


ORBITS = {
    "2T": {"eta": -24.0, "F0": 0.067},
    "unstable T": {"eta": -24.0, "F0": 0.067, "order": 1},
    "releases": {"eta": -60.0, "F0": 0.036},
    "breakaway": {"eta": -24.0, "F0": 0.067, "static": 0.31, "order": 1},
    "conventional": {"eta": -6.0, "F0": 0.9, "brake": wb.ConventionalBrake(radius=0.2)},
    "no reversal": {"eta": 0.0, "F0": 0.067, "drive_speed": 20.0},
    "turning": {"eta": -6.0, "F0": 0.067, "drive_speed": 0.5},
    "slow torque": {"eta": -24.0, "F0": 0.067, "f": 0.15, "order": 1},
}


@pytest.fixture(scope="module", params=ORBITS)
def found(request) -> wb.Orbit:
    """Each of the orbits in its turn."""
    return _orbit(**ORBITS[request.param])


def test_orbit_solves_its_equations(found) -> None:
    """With the phases and angles at which the exact solver has its events."""
    bvp, unknowns = _whole(found)
    given = problem(found.system)
    values, matrix = bvp.linearize(unknowns, given)
    sizes = np.max(np.abs(matrix * bvp.scales(unknowns, given)), axis=1)
    assert np.max(np.abs(values) / sizes) <= 1e-10
    r = wb.simulate(
        found.system, periods=found.order, initial=(found.angle, found.velocity), times=()
    )
    circle = 2.0 * math.pi * found.order
    phases = np.mod(angular_frequency(found.system) * r.event_time.values, circle)
    wanted = unknowns.reshape(-1, 2)[[not bvp.is_mark(i) for i in range(len(bvp.codes))]]
    assert phases.size == len(wanted)
    order, other = np.argsort(phases), np.argsort(wanted[:, 0] % circle)
    np.testing.assert_allclose(phases[order], wanted[other, 0] % circle, atol=1e-6)
    angles = r.event_angle.values[order]
    np.testing.assert_allclose(angles, wanted[other, 1], atol=1e-8 * found.angle_amplitude)


def test_scales_are_of_the_size_of_the_orbit(found) -> None:
    """Largest angle and, at a mark, largest velocity of a dense sampling."""
    bvp, unknowns = _whole(found)
    scales = bvp.scales(unknowns, problem(found.system))
    state = (found.angle, found.velocity)
    r = wb.simulate(found.system, periods=found.order, initial=state, samples_per_period=4000)
    angle, velocity = abs(r.angle.values).max(), abs(r.velocity.values).max()
    np.testing.assert_allclose(scales[1::2], angle, rtol=1e-4)
    wanted = [velocity if bvp.is_mark(i) else 1.0 for i in range(len(bvp.codes))]
    np.testing.assert_allclose(scales[0::2], wanted, rtol=1e-4)


def test_written_log_is_the_solvers(found) -> None:
    """Row by row over one orbit, from the first node on."""
    bvp, unknowns = _whole(found)
    given, omega = problem(found.system), angular_frequency(found.system)
    wanted = bvp.log(unknowns, given).copy()
    seen = run(given, found.points[0], 3 * found.order).log
    circle = 2.0 * math.pi
    at = circle * seen["period"] + omega * seen["time"]
    begin = circle * wanted["period"][0] + omega * wanted["time"][0]
    turns = 0 if begin > 1e-6 else 1
    begin += turns * circle * found.order
    first = int(np.argmin(np.abs(at - begin) + 10.0 * (seen["kind"] == EventKind.START)))
    rows = seen[first : first + len(wanted)].copy()
    rows["period"] -= turns * found.order
    for column in ("kind", "period", "mode"):
        np.testing.assert_array_equal(rows[column], wanted[column])
    events = wanted["kind"] != EventKind.RETURN
    np.testing.assert_array_equal(rows["side"][events], wanted["side"][events])
    np.testing.assert_allclose(omega * rows["time"], omega * wanted["time"], atol=1e-6)
    for column, size in (
        ("angle", found.angle_amplitude), ("velocity", found.velocity_amplitude),
    ):  # fmt: skip
        np.testing.assert_allclose(rows[column], wanted[column], atol=1e-7 * size)


def _expected_margins(found) -> np.ndarray:
    """(pieces, 4) from a dense sampling of the motion, from the law stated in the tests."""
    bvp, unknowns = _whole(found)
    system, stated, omega = found.system, law(found.system), angular_frequency(found.system)
    line, amplitude = system.driveline, system.excitation.amplitude
    torque = max([amplitude] + [abs(e) for e in (stated.lower, stated.upper) if math.isfinite(e)])
    fastest = max(omega, math.sqrt(line.stiffness / line.inertia))
    circle, count = 2.0 * math.pi * found.order, len(bvp.codes)
    out = np.full((count, 4), math.inf)

    def pull(phase, angle, velocity):
        return amplitude * np.sin(phase) - line.damping * velocity - line.stiffness * angle

    for i, code in enumerate(bvp.codes):
        j = (i + 1) % count
        begin = 0.0 if bvp.is_mark(i) else unknowns[2 * i]
        end = (0.0 if bvp.is_mark(j) else unknowns[2 * j]) + (circle if j == 0 else 0.0)
        out[i, 0] = end - begin
        shift = circle * (1 + math.ceil(max(0.0, -begin) / circle))
        phases = np.linspace(begin, end, 20_001) + shift
        r = wb.simulate(system, periods=4 * found.order, initial=tuple(found.points[0]),
                        times=phases / omega)  # fmt: skip
        angle, w = r.angle.values, r.velocity.values
        v = w + line.drive_speed
        if code:
            piece = stated.at(float(v[10_000]))
            turns = np.flatnonzero(np.diff(np.sign(np.diff(v[2:-2])))) + 3
            gaps = [piece.high - v[k] if v[k] >= v[k - 5] else v[k] - piece.low
                    for k in turns]  # fmt: skip
            if gaps:
                out[i, 1] = min(gaps) * line.inertia * fastest / torque
            if bvp.is_mark(j):
                continue
            held = float(pull(phases[-1], angle[-1], w[-1]))
            law_end = piece.offset + piece.slope * v[-1]
            a = (held - law_end) / torque
            after = bvp.codes[j]
            out[i, 3] = a if after > code else -a
            if after == 0:
                out[i, 2] = (held - stated.lower if code > 0 else stated.upper - held) / torque
            elif code * after < 0:
                out[i, 2] = (held - stated.upper if after > 0 else stated.lower - held) / torque
        else:
            held = pull(phases, angle, w)[2:-2]
            turns = np.flatnonzero(np.diff(np.sign(np.diff(held)))) + 1
            gaps = [stated.upper - held[k] if held[k] >= held[k - 5] else held[k] - stated.lower
                    for k in turns if 5 < k]  # fmt: skip
            if gaps:
                out[i, 1] = min(gaps) / torque
    return out


def test_margins_against_a_dense_sampling(found) -> None:
    """Lengths, distances to limits, to what is held, and accelerations at ends."""
    bvp, unknowns = _whole(found)
    margins = bvp.margins(unknowns, problem(found.system))
    columns = np.stack([margins[name] for name in QUANTITIES], axis=-1)
    assert np.all(columns > 0.0)
    np.testing.assert_allclose(columns, _expected_margins(found), rtol=1e-5, atol=2e-5)


def test_points_of_an_orbit_whose_event_is_at_phase_zero() -> None:
    """No orbit any more, but the end of the last segment at the end of the period is its point."""
    found = _orbit(eta=-24.0, F0=0.067)
    bvp, unknowns = _whole(found)
    given = problem(found.system)
    moved = unknowns.copy()
    moved[0::2] -= unknowns[0]
    log = bvp.log(moved, given)
    assert log["time"][-1] == 0.0
    at_end = log[-2].copy()
    assert (at_end["kind"], at_end["period"]) == (EventKind.RETURN, found.order)
    points = bvp.points(moved, given)
    np.testing.assert_array_equal(points[0], [at_end["angle"], at_end["velocity"]])


@pytest.mark.parametrize("codes", [(1,), (1, 0), (1, 2, 1), (1, -1, 0), (0, 1)])
def test_half_a_symmetric_orbit_says_what_the_whole_does(codes) -> None:
    """Residual of the first half, and its derivative against differences."""
    system = wb.paper.system(eta=-6.0, F0=0.5, brake="conventional")
    given = problem(system)
    half = SegmentBVP(codes, 1, half=True)
    count = len(codes)
    unknowns = np.empty(2 * count)
    unknowns[0::2] = 0.3 + math.pi / count * np.arange(count)
    unknowns[1::2] = 0.01 * np.random.default_rng(1).normal(size=count)
    values, matrix = half.linearize(unknowns, given)
    whole, every = half.whole(unknowns)
    np.testing.assert_allclose(values, whole.residual(every, given)[: 2 * count], rtol=1e-12)
    rows = np.max(np.abs(matrix), axis=1, keepdims=True)
    assert np.max(np.abs(matrix - _differences(half, unknowns, given, 1e-3)) / rows) <= 1e-6

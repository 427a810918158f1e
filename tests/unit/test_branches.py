"""Branches of orbits: that their points are orbits, and that what bifurcates does so."""

from __future__ import annotations

import json
import math
from collections import Counter
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import wedgebrake as wb
from cases import ISLAND
from machines import general
from wedgebrake.dynamics.enums import EventKind
from wedgebrake.orbits.branches.branch import Branch
from wedgebrake.orbits.branches.branch_switching import leaving

WEDGE = wb.paper.system(eta=-24.0, F0=0.067)
CONVENTIONAL = wb.paper.system(eta=-6.0, F0=0.05, brake="conventional")
TURNED = WEDGE.replace(drive_speed=20.0)


def ended(branch: wb.Branch) -> wb.Branch:
    """The branch, followed to its end."""
    for _ in branch:
        pass
    return branch


def follow(system: wb.BrakedDriveline, order: int | None = 1, **arguments) -> wb.Branch:
    return ended(wb.continuation(wb.orbit(system, order), **arguments))


# Names of branches; each is followed once.
BRANCHES = {
    "wedge, all forces": lambda: follow(wb.paper.system(eta=-24.0, F0=0.095), F0=(0.095, 0.01)),
    "wedge, force rises": lambda: follow(WEDGE, F0=(0.067, 0.12)),
    "wedge, eta": lambda: follow(wb.paper.system(eta=-10.0, F0=0.036), eta=(-10.0, -40.0)),
    "wedge, slow torque": lambda: follow(WEDGE, f=(0.63, 0.15)),
    "wedge, shaft turns": lambda: follow(WEDGE, drive_speed=(0.0, 6.0)),
    "wedge, shaft turns fast": lambda: follow(TURNED, drive_speed=(20.0, 9.0)),
    "wedge, angle": lambda: follow(WEDGE, angle=(0.34, 1.4)),
    "conventional, eta": lambda: follow(CONVENTIONAL, eta=(12.0, -60.0)),
    "conventional, force": lambda: follow(CONVENTIONAL, F0=(0.05, 0.9)),
    "mirrored": lambda: follow(CONVENTIONAL.replace(eta=-10.0, f=0.55), f=(0.55, 0.48)),
    "breakaway": lambda: follow(WEDGE.replace(static=0.31), f=(0.63, 0.15)),
    "smooth": lambda: follow(
        wb.paper.system(eta=-10.0, F0=0.05, friction="smoothed"), eta=(-10.0, -11.0), step=0.5
    ),
}


@cache
def known(name: str) -> wb.Branch:
    return BRANCHES[name]()


@pytest.fixture(params=BRANCHES)
def branch(request) -> wb.Branch:
    """Each of the branches in its turn."""
    return known(request.param)


def _simulated_events(point: wb.BranchPoint) -> Counter[str]:
    r = wb.simulate(point.system, periods=point.order, initial=tuple(point.points[0]), times=())
    return Counter(EventKind(int(kind)).name for kind in r.event_kind.values)


def _events_of(sequence: str) -> Counter[str]:
    """Kinds of events of a cyclic sequence."""
    found: Counter[str] = Counter()
    segments = sequence.split()
    for before, after in zip(segments[-1:] + segments[:-1], segments, strict=True):
        if "0" in (before, after):
            found["STICK" if after == "0" else "SLIP"] += 1
        elif before != after:
            found["REVERSAL" if before[0] != after[0] else "BREAKPOINT"] += 1
    return found


def test_every_point_is_an_orbit(branch) -> None:
    """The motion comes back to it; its error grows with the multiplier."""
    for point in branch.points[::3]:
        order = point.order
        end = wb.simulate(
            point.system, periods=order, initial=tuple(point.points[0]), times=()
        ).attrs
        apart = np.abs(np.array([end["final_angle"], end["final_velocity"]]) - point.points[0])
        size = np.array([point.measures.angle_amplitude, point.measures.velocity_amplitude])
        room = (1e-8 if point.sequence else 1e-6) * (1.0 + abs(point.multipliers[0]))
        assert np.all(apart <= room * size + 1e-15), (point.value, point.sequence)


def test_simulated_events_are_those_of_the_sequence(branch) -> None:
    """Counted by kind beside every bifurcation of friction, on both sides of it."""
    for one, other in pairwise(branch.points):
        for at, beside in ((one, other), (other, one)):
            of_friction = at.bifurcation and at.bifurcation.kind.of_friction
            if of_friction and not beside.bifurcation and abs(beside.multipliers[0]) <= 1e4:
                assert _simulated_events(beside) == _events_of(beside.sequence), beside


def test_scenario_is_where_the_orbits_lie(branch) -> None:
    """Persistence: on both sides of the value. Non-smooth fold: both on one side."""
    points = branch.points
    for k in range(1, len(points) - 1):
        found = points[k].bifurcation
        scenario = found.scenario.value if found else ""
        if points[k - 1].bifurcation or points[k + 1].bifurcation:
            continue
        before, here, after = (points[k + i].value for i in (-1, 0, 1))
        across = (before - here) * (after - here) < 0.0
        if scenario in ("persistence", "non-smooth fold"):
            assert across == (scenario == "persistence"), (here, found.sentence)


def test_effect_is_a_difference_of_the_sequences(branch) -> None:
    points = branch.points
    for k in range(1, len(points) - 1):
        found = points[k].bifurcation
        if found is None or not found.kind.of_friction:
            continue
        before, after = (points[i].sequence.split() for i in (k - 1, k + 1))
        assert before != after
        for words, test in (
            ("sticking", lambda piece: piece == "0"),
            ("slip forwards", lambda piece: piece.startswith("+")),
            ("slip backwards", lambda piece: piece.startswith("-")),
        ):
            had, has = any(map(test, before)), any(map(test, after))
            assert (f"{words} begins" in found.effect) == (has and not had)
            assert (f"{words} ends" in found.effect) == (had and not has)


def test_smooth_bifurcations_are_where_multipliers_say(branch) -> None:
    for point in branch.bifurcations:
        first, second = point.multipliers
        kind = point.bifurcation.kind.value
        room = 1e-9 if point.sequence else 1e-5
        if kind in ("fold", "branch point", "symmetry breaking"):
            assert min(abs(first - 1.0), abs(second - 1.0)) <= 1e-7 + room
        elif kind == "period doubling":
            assert min(abs(first + 1.0), abs(second + 1.0)) <= room
        elif kind == "Neimark-Sacker":
            assert abs(first) == pytest.approx(1.0, abs=room)
            assert first.imag != 0.0


def test_stability_changes_only_at_bifurcations(branch) -> None:
    points = branch.points
    for before, after in pairwise(points):
        if before.stable != after.stable:
            assert before.bifurcation or after.bifurcation, (before.value, after.value)


def test_every_branch_says_why_it_ends(branch) -> None:
    """These stop at the end of their range, or where the motion itself does."""
    assert branch.end.startswith("left the range") or (
        branch.points[-1].bifurcation is not None
        and ("permanent sticking" in branch.end or "jump" in branch.end)
    ), (branch.end, branch.points[-1].value, branch.points[-1].sequence)


def test_a_fold_is_passed() -> None:
    """Its value is the extreme of the branch's, to second order in the distance."""
    points = known("wedge, force rises").points
    folds = [k for k, p in enumerate(points)
             if p.bifurcation and p.bifurcation.kind.value == "fold"]  # fmt: skip
    assert len(folds) == 2
    for k, side in zip(folds, (1.0, -1.0), strict=True):
        near = [p.value for p in points[k - 3 : k + 4]]
        assert side * points[k].value >= max(side * value for value in near)
    # Between both folds, three orbits at one force.
    force = 0.097
    assert points[folds[1]].value < force < points[folds[0]].value
    values = np.array([p.value for p in points]) - force
    assert np.count_nonzero(values[:-1] * values[1:] < 0.0) == 3


class TestClosedForms:
    def test_sliding_touches_rest_where_the_linear_oscillator_says(self) -> None:
        """Carried along by a shaft, unstable for its falling slope: grazing-sliding.

        While it slides, J theta'' + (c + R mu delta) theta' + k theta = T sin - M: the velocity
        amplitude is omega T/|Z|, and reaches Omega at T = Omega |Z|/omega. The multipliers
        until there are those of the free vibration.
        """
        system = wb.paper.system(eta=-1.5, F0=0.05, brake="conventional").replace(
            drive_speed=0.5, amplitude=10.0, release=False
        )
        line, omega = system.driveline, system.excitation.angular_frequency
        damping = line.damping * (1.0 - 1.5)
        z = line.stiffness - line.inertia * omega**2 + 1j * omega * damping
        wave = 10.0 / z  # of exp(i omega t), imaginary part
        law = system.characteristic
        mean = -(law.offsets[-1] + law.slopes[-1] * line.drive_speed) / line.stiffness
        state = (mean + wave.imag, (1j * omega * wave).imag)
        found = wb.orbit(system, 1, initial=state)
        assert found.found
        assert found.sequence == "+"
        growth = math.exp(-0.5 * damping / line.inertia / system.excitation.frequency)
        assert abs(found.multipliers[0]) == pytest.approx(growth, rel=1e-12)
        assert not found.stable
        limit = line.drive_speed * abs(z) / omega
        assert limit > 10.0
        branch = wb.continuation(found, amplitude=(10.0, 2.0 * limit))
        first = next(point for point in branch if point.bifurcation)
        assert first.bifurcation.kind.value == "grazing-sliding"
        assert first.value == pytest.approx(limit, rel=1e-10)

    @pytest.mark.parametrize("brake", ["wedge", "conventional"])
    def test_permanent_sticking(self, brake) -> None:
        """It begins where the torque's whole range can be held about one angle.

        2 T = M(forwards) + M(backwards): F0 = (alpha^2 - 1)/alpha times mu... for the wedge,
        F0 = 1 for a brake without amplification.
        """
        system = WEDGE if brake == "wedge" else CONVENTIONAL
        lower, upper = system.characteristic.holding
        limit = system.groups.F0 * 2.0 * system.excitation.amplitude / (upper - lower)
        closed = 0.3 * (1.18**2 - 1.0) / 1.18 if brake == "wedge" else 1.0
        assert limit == pytest.approx(closed, rel=1e-12)
        # Steeper and flatter laws alike: eta is no part of it.
        for eta in (-3.0, 0.0) if brake == "wedge" else (-6.0, 0.0):
            begin = system.replace(eta=eta, F0=0.97 * limit)
            found = follow(begin, F0=(0.97 * limit, 1.2 * limit), step=0.2)
            last = found.bifurcations[-1]
            assert "permanent sticking" in last.bifurcation.effect
            assert last.value == pytest.approx(limit, rel=1e-7)
            assert "permanent sticking" in found.end

    @pytest.mark.parametrize("brake", ["wedge", "conventional"])
    def test_permanent_sticking_of_a_general_machine(self, brake) -> None:
        """The same by the equations of machines of several inertias."""
        line = (WEDGE if brake == "wedge" else CONVENTIONAL).replace(eta=-3.0)
        lower, upper = line.characteristic.holding
        limit = 0.5 * (upper - lower)
        machine = general(line.machine).replace({"torque.amplitude": limit / 0.97})
        ends = {"torque.amplitude": (limit / 0.97, 0.9 * limit)}
        found = ended(wb.continuation(wb.orbit(machine, 1), ends, step=0.2))
        assert found.points[-1].value == pytest.approx(limit, rel=1e-12)
        assert "permanent sticking" in found.points[-1].bifurcation.effect
        assert "permanent sticking of brake" in found.end
        assert not found.jumps

    @pytest.mark.parametrize("over", ["engine.amplitude", "brake.initial_force"])
    @pytest.mark.parametrize("brake", ["wedge", "conventional"])
    def test_permanent_sticking_of_one_of_two_inertias(self, brake, over) -> None:
        """The torque of the shaft to the disc at rest has half the range that the brake holds."""
        friction, force, frequency = 0.3, 200.0 if brake == "wedge" else 1000.0, 7.0
        radius, angle = 0.2, 0.34
        of = wb.WedgeBrake(radius=radius, angle=angle)
        gain = radius * friction
        if brake == "wedge":
            there, back = math.tan(angle) - friction, math.tan(angle) + friction
            gain *= 0.5 * (1.0 / there + 1.0 / back)
        else:
            of = wb.ConventionalBrake(radius=radius)
        machine = wb.Machine(
            inertias=[wb.Inertia("disc", 1.0), wb.Inertia("hub", 0.4)],
            shafts=[
                wb.Shaft("disc", "hub", name="shaft", stiffness=3000.0, damping=1.0),
                wb.Shaft("hub", "ground", name="mount", stiffness=1500.0, damping=0.5),
            ],
            contacts=[
                wb.Contact(
                    "disc", name="brake", brake=of, friction=wb.CoulombFriction(kinetic=friction),
                    actuation=wb.Actuation(initial_force=force, slope=-5.0),
                )
            ],
            torques=[wb.Torque("hub", wb.Harmonic(300.0, frequency), name="engine")],
        )  # fmt: skip
        w = 2.0 * math.pi * frequency
        transfer = abs((3000.0 + 1j * w) / (4500.0 - 0.4 * w**2 + 1.5j * w))
        if over == "engine.amplitude":
            limit, last = gain * force / transfer, 1.0
        else:
            limit = 300.0 * transfer / gain
            last = 1.5 * limit
        found = ended(wb.continuation(wb.orbit(machine, 1), {over: (machine.value(over), last)}))
        assert found.points[-1].value == pytest.approx(limit, rel=1e-12)
        assert "permanent sticking of brake" in found.end

    def test_permanent_sticking_of_a_machine(self) -> None:
        """As above, by the amplitude of its torque; its states are given by inertia."""
        lower, upper = WEDGE.characteristic.holding
        limit = 0.5 * (upper - lower)
        machine = WEDGE.replace(eta=-3.0).machine.replace({"torque.amplitude": limit / 0.97})
        ends = {"torque.amplitude": (limit / 0.97, 0.9 * limit)}
        found = ended(wb.continuation(wb.orbit(machine, 1), ends, step=0.2))
        assert found.bifurcations[-1].value == pytest.approx(limit, rel=1e-7)
        assert "permanent sticking" in found.end
        point = found.points[0]
        assert list(point.twists) == ["shaft"]
        assert point.twists["shaft"][0] == point.measures.angle_amplitude
        run = wb.simulate(machine, point.period, initial=point.initial, times=())
        final = wb.final_state(run)
        assert final.angles["driveline"] == pytest.approx(point.points[0, 0], rel=1e-9)
        data = wb.branches(machine, ends, switch=0, opposite=False, step=0.2)
        assert data["angle"].dims == ("point", "return", "inertia")

    def test_symmetry_breaking(self) -> None:
        """The symmetric orbit of a symmetric brake goes on beyond it, unstable; a pair leaves.

        At f = 0.504 the motion from rest is not its own mirror image half a period later.
        """
        data = wb.branches(CONVENTIONAL, switch=1, f=(0.63, 0.45), points=300, step=0.05)
        kinds = list(data.bifurcation_kind.values)
        assert "symmetry breaking" in kinds
        assert data.branch_end.values[0].startswith("left the range")
        value = float(data.bifurcation_value[kinds.index("symmetry breaking")])
        assert 0.504 < value < 0.506

        def skew(f: float) -> float:
            found = wb.orbit(CONVENTIONAL.replace(f=f))
            half = 0.5 / found.system.excitation.frequency
            end = wb.simulate(found.system, half, initial=(found.angle, found.velocity),
                              times=()).attrs  # fmt: skip
            return abs(end["final_angle"] + found.angle) / found.angle_amplitude

        assert skew(value + 1e-3) <= 1e-8
        assert skew(value - 1e-3) > 1e-3


class TestJump:
    def test_beyond_a_jump_the_old_orbit_is_gone(self) -> None:
        """With static friction above kinetic a slip that begins inside a stick is long."""
        system = WEDGE.replace(static=0.31)
        found = follow(system, f=(0.63, 0.05))
        jumps = [p for p in found.bifurcations if p.bifurcation.scenario.value == "jump"]
        assert len(jumps) == 1
        at = jumps[0]
        assert "jump" in found.end
        before = found.points[-2]
        side = math.copysign(1e-7, at.value - before.value)
        counts = []
        for value in (at.value - side, at.value + side):
            r = wb.simulate(system.replace(f=value), periods=1, initial=tuple(at.points[0]),
                            times=())  # fmt: skip
            counts.append(r.sizes["event"])
        assert counts[0] != counts[1]


class TestEdges:
    @pytest.mark.parametrize(
        ("name", "last"),
        [("kinetic", 0.0), ("damping", 0.0), ("initial_force", 0.0)],
    )
    def test_a_range_may_end_where_the_parameter_does(self, name, last) -> None:
        """Zero is allowed: the branch reaches it, although there is nothing beyond."""
        system = wb.paper.system(eta=0.0, F0=0.05, brake="conventional").replace(
            damping=20.0, static=0.3
        )
        first = {"kinetic": 0.3, "damping": 20.0}.get(name, system.actuation.initial_force)
        branch = follow(system, **{name: (first, last)})
        assert branch.points[-1].value == pytest.approx(last, abs=1e-12 * first)
        assert branch.end.startswith("left the range")

    def test_from_no_torque_at_all(self) -> None:
        """An equilibrium is an orbit: its velocity, zero, is no scale."""
        system = wb.paper.system(eta=1.0, F0=0.067).replace(amplitude=0.0, drive_speed=3.0)
        branch = follow(system, None, amplitude=(0.0, 50.0), step=0.1)
        assert branch.end.startswith("left the range")
        line, omega = system.driveline, system.excitation.angular_frequency
        damping = line.damping + system.characteristic.slopes[-1]
        z = line.stiffness - line.inertia * omega**2 + 1j * omega * damping
        wave = (50.0 / z).imag
        law = system.characteristic
        mean = -(law.offsets[-1] + law.slopes[-1] * 3.0) / line.stiffness
        assert branch.points[-1].points[0, 0] == pytest.approx(mean + wave, rel=1e-9)

    def test_ranges_of_any_width(self) -> None:
        found = wb.orbit(WEDGE, 1)
        for ends in ((-24.0 - 1e-9, -24.0 + 1e-9), (-1e6, 1e6), (-24.0, 12.0)):
            branch = wb.continuation(found, eta=ends, step=0.1)
            ended(branch)
            assert branch.points[-1].value == pytest.approx(ends[1], rel=1e-14)
            assert branch.end.startswith("left the range")

    def test_alpha_through_self_locking(self) -> None:
        """The gain grows without bound towards alpha = 1: the branch ends before, and says so."""
        branch = follow(wb.paper.system(eta=0.0, F0=0.01), alpha=(1.18, 0.9), points=400)
        assert 1.0 < branch.points[-1].value < 1.18
        assert branch.end
        assert "left the range" not in branch.end


class TestSteering:
    def test_points(self) -> None:
        for most in (2, 5):
            branch = follow(WEDGE, eta=(-24.0, 12.0), points=most)
            assert len(branch.points) == most
            assert branch.end == f"stopped after {most} points"

    def test_step(self) -> None:
        """No step is longer than its share of the range."""
        branch = follow(WEDGE, eta=(-24.0, 12.0), step=0.01)
        values = np.array([point.value for point in branch.points])
        # But for the bend of the branch beside its direction, at most tan(18 degrees) squared.
        assert np.max(np.abs(np.diff(values))) <= 1.06 * 0.01 * 36.0
        assert np.all(np.diff([point.arclength for point in branch.points]) >= 0.0)

    def test_stop(self) -> None:
        branch = wb.continuation(wb.orbit(WEDGE, 1), eta=(-24.0, 12.0))
        assert branch.end == ""
        first, second = next(branch), next(branch)
        assert branch.points == [first, second]
        branch.stop()
        assert list(branch) == []
        assert branch.end == "stopped by the user"
        assert branch.points == [first, second]

    def test_begin_is_the_orbit(self) -> None:
        found = wb.orbit(WEDGE, 1)
        branch = wb.continuation(found, eta=(-30.0, 12.0))
        first = next(branch)
        assert first.value == -24.0
        np.testing.assert_allclose(first.points[0], (found.angle, found.velocity), rtol=1e-12)
        assert next(branch).value > -24.0
        assert next(wb.continuation(found, eta=(12.0, -30.0))).value == -24.0


@pytest.fixture(scope="module")
def data():
    return wb.branches(wb.paper.system(eta=-10.0, F0=0.036), switch=1, eta=(-14.0, -18.0))


class TestDataset:
    def test_dimensions_and_kinds_of_numbers(self, data) -> None:
        assert set(data.sizes) == {"point", "return", "multiplier", "branch_number", "bifurcation"}
        assert data.sizes["multiplier"] == 2
        assert data.sizes["return"] == int(data.order.max())
        assert data.order.dtype == np.int16
        assert data.stable.dtype == bool
        assert data["branch"].dtype.kind == "i"
        assert data.eta.attrs["units"] == "1"
        assert data.eta.attrs["long_name"]
        for name in ("velocity_amplitude", "angle_amplitude", "stick_share", "peak_torque",
                     "events", "largest_exponent", "arclength"):  # fmt: skip
            assert data[name].dims == ("point",)
            assert np.all(np.isfinite(data[name]))
        assert data.attrs["parameter"] == "eta"
        assert json.loads(data.attrs["system"])["driveline"]["inertia"] == 1.0

    def test_branches_are_contiguous_and_continuous(self, data) -> None:
        """Which return is the first does not change from point to point."""
        numbers = data["branch"].values
        assert np.all(np.diff(numbers) >= 0)
        assert set(numbers) == set(range(data.sizes["branch_number"]))
        for number, order in enumerate(data.branch_order.values):
            own = data.isel(point=numbers == number)
            assert set(own.order.values) == {order}
            assert np.all(np.diff(own.arclength) >= 0.0)
            moved = np.abs(np.diff(own.angle.values[:, :order], axis=0))
            assert np.max(moved) <= 0.2 * float(own.angle_amplitude.max())
            assert np.all(np.isfinite(own.velocity[:, :order]))
            assert np.all(np.isnan(own.velocity[:, order:]))

    def test_bifurcations_are_points(self, data) -> None:
        assert data.sizes["bifurcation"] >= 1
        for one in range(data.sizes["bifurcation"]):
            point = int(data.bifurcation_point[one])
            assert float(data.eta[point]) == float(data.bifurcation_value[one])
            assert int(data["branch"][point]) == int(data.bifurcation_branch[one])
            assert data.bifurcation_sentence.values[one].startswith(
                data.bifurcation_kind.values[one]
            )

    def test_origins(self, data) -> None:
        assert int(data.branch_origin[0]) == -1
        for number in range(1, data.sizes["branch_number"]):
            origin = int(data.branch_origin[number])
            if origin == -1:
                continue
            assert data.bifurcation_kind.values[origin] == data.branch_begin.values[number]
            first = data.isel(point=data["branch"].values == number).eta.values[0]
            assert first == pytest.approx(float(data.bifurcation_value[origin]), abs=1e-7)
            assert data.branch_end.values[number]

    def test_amplitudes_are_those_of_a_dense_sampling(self, data) -> None:
        """Half the range of velocity and angle."""
        for k in (0, data.sizes["point"] // 2, data.sizes["point"] - 1):
            system = wb.paper.system(eta=float(data.eta[k]), F0=0.036)
            start = float(data.angle[k, 0]), float(data.velocity[k, 0])
            r = wb.simulate(system, periods=int(data.order[k]), initial=start,
                            samples_per_period=20_000)  # fmt: skip
            for name in ("velocity", "angle"):
                expected = 0.5 * float(np.ptp(r[name].values))
                assert float(data[f"{name}_amplitude"][k]) == pytest.approx(expected, rel=1e-6)
            # Largest at an event, which the sampling meets to a step.
            brake = float(np.abs(r.brake_torque).max())
            assert float(data.peak_torque[k]) == pytest.approx(brake, rel=1e-4)


@pytest.fixture(scope="module")
def found():
    return wb.orbit(WEDGE, 1)


class TestArguments:
    @pytest.mark.parametrize(
        ("over", "name"),
        [
            ({}, "over"),
            ({"over": [("eta", (-30.0, 0.0))]}, "over"),
            ({"eta": (-30.0, 0.0), "F0": (0.01, 0.1)}, "over"),
            ({"over": {"eta": (-30.0, 0.0)}, "eta": (-30.0, 0.0)}, "eta"),
            ({"over": {3: (-30.0, 0.0)}}, "over"),
            ({"et": (-30.0, 0.0)}, "et"),
            ({"lag": (0.0, 0.1)}, "lag"),
            *(
                ({"eta": ends}, "eta")
                for ends in (
                    -24.0,
                    None,
                    "ab",
                    (),
                    (-24.0,),
                    (-30.0, 0.0, 1.0),
                    (-30.0, math.nan),
                    (-30.0, math.inf),
                    (-30, 10**400),
                    (-30.0, True),
                    (-24.0, -24.0),
                    (-20.0, -14.0),
                    ("-30", "0"),
                    np.array([-30.0, 0.0]),
                )
            ),
            ({"angle": ("20 deg", "22 deg")}, "angle"),
            ({"F0": (0.0, 0.1)}, "groups.F0"),
            ({"damping": (-1.0, 1.0)}, "driveline.damping"),
            ({"wrap_angle": (0.1, 1.0)}, "wrap_angle"),
            ({"initial_angle": (0.1, 1.0)}, "initial_angle"),
            ({"eta": (-30.0, 0.0), "step": 0.0}, "step"),
            ({"eta": (-30.0, 0.0), "step": True}, "step"),
            ({"eta": (-30.0, 0.0), "points": 1}, "points"),
            ({"eta": (-30.0, 0.0), "points": 2.0}, "points"),
            ({"eta": (-30.0, 0.0), "method": "exakt"}, "method"),
            ({"eta": (-30.0, 0.0), "method": 3}, "method"),
            ({"eta": (-30.0, 0.0), "method": "smooth"}, "method"),  # the orbit is of "exact"
            *(
                ({"eta": (-30.0, 0.0), "rtol": one}, "rtol")
                for one in (math.nan, 0.0, 1.0, "a", None, 1e-8)  # the orbit has another one
            ),
        ],
    )
    def test_continuation(self, found, over, name) -> None:
        with pytest.raises(wb.InputError) as caught:
            wb.continuation(found, **over)
        assert caught.value.name == name
        assert caught.value.allowed

    def test_orbit(self) -> None:
        for given in (WEDGE, None, wb.orbit(wb.paper.system(eta=0.0, F0=0.5))):
            with pytest.raises(wb.InputError) as caught:
                wb.continuation(given, eta=(-30.0, 0.0))
            assert caught.value.name == "orbit"
            assert caught.value.allowed

    @pytest.mark.parametrize("system", [None, "paper", 3])
    def test_system(self, system) -> None:
        for function in (wb.orbit, wb.branches, wb.boundaries):
            with pytest.raises(wb.InputError) as caught:
                function(system)
            assert caught.value.name == "system"

    @pytest.mark.parametrize("rtol", [math.nan, 0.0, 1.0, "a", None])
    @pytest.mark.parametrize("system", [WEDGE, WEDGE.machine])
    def test_tolerance(self, system, rtol) -> None:
        with pytest.raises(wb.InputError) as caught:
            wb.orbit(system, 1, rtol=rtol)
        assert caught.value.name == "rtol"

    @pytest.mark.parametrize("switch", [-1, 21, 1.0, True, "a"])
    def test_switch(self, switch) -> None:
        with pytest.raises(wb.InputError, match="switch"):
            wb.branches(WEDGE, eta=(-24.0, 0.0), switch=switch)

    def test_no_orbit_to_begin_with(self) -> None:
        with pytest.raises(wb.InputError) as caught:
            wb.branches(WEDGE, F0=(0.5, 0.01))
        assert (caught.value.name, caught.value.value) == ("F0", 0.5)

    def test_progress(self) -> None:
        with pytest.raises(wb.InputError) as caught:
            wb.branches(WEDGE, F0=(0.067, 0.06), progress=3)
        assert caught.value.name == "progress"


class TestReviewed:
    """What trial users and a hostile reader found wrong once."""

    def test_over_the_angle_of_the_brake(self) -> None:
        """Its name is that of a result: the coordinate is called otherwise, as in sweeps."""
        system = wb.paper.system(eta=-10.0, F0=0.036)
        data = wb.branches(system, angle=(0.45, 0.4), switch=0, opposite=False)
        assert data.attrs["parameter"] == "brake_angle"
        assert data["brake_angle"].values[[0, -1]] == pytest.approx([0.45, 0.4])
        assert data["angle"].dims == ("point", "return")
        assert wb.plot(data).axes

    def test_two_rests_of_a_symmetric_orbit_end_together(self) -> None:
        """From either side, where both vanish and where both are put in."""
        system = wb.paper.system(eta=-10.0, F0=0.036, brake="conventional")
        found = []
        for ends in ((0.3, 0.45), (0.45, 0.3)):
            data = wb.branches(system, f=ends, switch=0, opposite=False, step=0.05)
            assert str(data["branch_end"][0].item()).startswith("left the range")
            found.append(sorted(data["bifurcation_value"].values))
        np.testing.assert_allclose(found[0], found[1], rtol=1e-8)

    def test_smooth_branch_goes_through_a_symmetry_breaking(self) -> None:
        """There its equations are singular; the branch that leaves links both points."""
        system = wb.paper.system(eta=-6.0, F0=0.05, brake="conventional", friction="smoothed")
        data = wb.branches(system, f=(0.53, 0.47), switch=1, opposite=False, step=0.05)
        assert list(data["bifurcation_kind"].values[:2]) == ["symmetry breaking"] * 2
        pair = data.isel(point=np.flatnonzero(data["branch"].values == 1))
        ends = sorted(data["bifurcation_value"].values[:2])
        assert float(pair["f"][0]) == pytest.approx(ends[1], rel=1e-6)
        assert float(pair["f"][-1]) == pytest.approx(ends[0], rel=1e-4)

    @pytest.mark.parametrize("friction", ["coulomb", "smoothed"])
    @pytest.mark.parametrize("of", ["driveline", "machine", "general machine"])
    def test_a_branch_and_its_mirror_image_are_one(self, friction, of) -> None:
        """From an orbit of a pair and from its mirror image, one of which settles at the end."""
        system = wb.paper.system(eta=-6.0, F0=0.05, brake="conventional", friction=friction)
        system = system.replace(f=0.5)
        frequency = system.excitation.frequency
        found = wb.orbit(system, 1)
        end = wb.simulate(system, 0.5 / frequency, initial=found.initial, times=()).attrs
        image = (-end["final_angle"], -end["final_velocity"])
        assert abs(image[1] - found.velocity) > 1e-3 * found.velocity_amplitude
        over = {"f": (0.5, 0.501)}
        for angle, velocity in (found.initial, image):
            whole, start = system, {"initial": (angle, velocity)}
            if of != "driveline":
                at = {"driveline.angle": angle, "driveline.speed": velocity}
                whole = system.machine if of == "machine" else general(system.machine)
                start = {"initial": wb.orbit(whole.replace(at), 1).initial}
                over = {"torque.frequency": (frequency, 1.002 * frequency)}
            data = wb.branches(whole, over, order=1, switch=0, step=0.2, **start)
            assert data.sizes["branch_number"] == 1

    def test_turning_shaft_that_comes_to_rest(self) -> None:
        """At the end the system is symmetric, and so is its orbit: no meeting of branches."""
        branch = follow(CONVENTIONAL.replace(drive_speed=2.0), drive_speed=(2.0, 0.0))
        assert branch.end == "left the range at drive_speed = 0"

    def test_motion_beyond_a_jump_is_found(self) -> None:
        """With a static peak the motion jumps, here by little; another branch begins there.

        It ends where its slip reaches zero speed with zero acceleration.
        """
        band = wb.load_study(Path(__file__).parents[2] / "examples" / "band.toml").system
        data = wb.branches(
            band.replace(amplitude=100.0), drive_speed=(7.0, 9.0), switch=1, opposite=False
        )
        assert data["bifurcation_scenario"].values[1] == "jump"
        assert list(data["bifurcation_kind"].values[1:]) == ["crossing-sliding", "grazing-sliding"]
        assert list(data["branch_begin"].values) == ["start of the range", "beyond a jump"]
        first, second = (
            data["velocity_amplitude"].values[data["branch"].values == one] for one in (0, 1)
        )
        assert second[0] == pytest.approx(first[-1], rel=1e-2)

    def test_parents_of_a_branch_are_followed(self) -> None:
        """From the 8T motion at the far end over 4T to 2T, each with its period doubling."""
        data = wb.branches(wb.paper.system(eta=-10.0, F0=0.036), eta=(-21.0, -22.0))
        kinds, values = data["bifurcation_kind"].values, data["bifurcation_value"].values
        doublings = values[kinds == "period doubling"]
        assert np.any(np.abs(doublings + 21.7898354) < 1e-6)
        assert {4, 8} <= set(data["order"].values.tolist())

    def test_pole_of_a_multiplier_is_no_bifurcation(self) -> None:
        """Where the end of a rest becomes tangent a multiplier goes through infinity."""
        branch = follow(wb.paper.system(eta=-10.0, F0=0.036), static=(0.3, 0.6), step=0.05)
        for point in branch.bifurcations:
            if not point.bifurcation.kind.of_friction:
                assert abs(point.multipliers[0]) < 1e3

    @pytest.mark.parametrize("step", [0.05, 0.5])
    def test_two_doublings_inside_one_step(self, step) -> None:
        """The multiplier is -1 twice within a hundredth of the range: at long steps too."""
        start = wb.orbit(ISLAND.replace(f=0.41))
        branch = wb.continuation(start, step=step, f=(0.41, 0.38))
        kinds = [point.bifurcation.kind.value for point in branch if point.bifurcation]
        assert kinds == ["period doubling"] * 2


class TestNothingTwice:
    """An orbit is followed once, whichever of its periods is the first."""

    @pytest.mark.parametrize(
        ("kind", "steps", "of", "count", "room"),
        [
            ("period doubling", (0.02, 0.1, 0.5), "the synchronous orbit", 2, 1e-7),
            ("symmetry breaking", (0.1, 0.5), "a symmetric orbit", 5, 1e-8),
        ],
    )
    def test_a_branch_between_two_bifurcations_is_gone_once(
        self, kind, steps, of, count, room
    ) -> None:
        """From the one to the other, where its halves become one, and not back over itself."""
        parent = known("wedge, all forces" if kind == "period doubling" else "mirrored")
        meetings = [p for p in parent.bifurcations if p.bifurcation.kind.value == kind]
        rising = kind == "symmetry breaking"
        met, begin = sorted(meetings, key=lambda point: point.value, reverse=rising)[:2]
        ((origin, start),) = leaving(begin)
        for step in steps:
            largest = parent.largest * step / 0.02
            branch = ended(
                Branch(start, parent.bounds, rising, largest, parent.most, points=[origin])
            )
            assert branch.end == f"{kind} of {of}"
            assert branch.points[-1].value == pytest.approx(met.value, abs=room)
            assert len(branch.bifurcations) == count

    @pytest.mark.parametrize("step", [0.02, 0.05, 0.1])
    def test_a_branch_that_ends_at_a_doubling_has_no_fold_there(self, step) -> None:
        """Next to where branches meet, their direction is lost in rounding."""
        branch = follow(WEDGE.replace(f=0.63), None, f=(0.63, 0.15), step=step)
        assert branch.points[0].order == 2
        assert branch.end == "period doubling of the synchronous orbit"
        kinds = [point.bifurcation.kind.value for point in branch.bifurcations]
        assert kinds == ["grazing-sliding", "switching-sliding"]
        # No point of it is there twice.
        assert np.all(np.diff([point.arclength for point in branch.points[-3:]]) > 0.0)

    def test_parents_that_are_sheets_of_a_known_branch(self) -> None:
        """The 2T stick-slip goes from the end of the range over folds back to it."""
        system = wb.paper.system(eta=-24.0, F0=0.036)
        data = wb.branches(system, switch=1, eta=(-15.0, -36.0), step=0.05)
        found = sorted(
            zip(
                data.bifurcation_kind.values,
                data.order.values[data.bifurcation_point.values],
                data.bifurcation_value.values,
                strict=True,
            )
        )
        for (kind, order, value), (next_kind, next_order, next_value) in pairwise(found):
            same = kind == next_kind and order == next_order
            assert not same or next_value - value > 1e-6, (kind, order, value)
        assert sum(order == 2 for order in data.branch_order.values) == 2
        for end in data.branch_end.values:
            if end.startswith("left the range"):
                assert end == "left the range at eta = -36"

    def test_a_branch_that_closes(self) -> None:
        """The 7T orbits of a window, between two folds; once round, from either side."""
        begin = wb.orbit(wb.paper.system(eta=-71.0 / 3.0, F0=0.05))
        assert begin.order == 7
        values = []
        for ends in ((-40.0, -15.0), (-15.0, -40.0)):
            branch = wb.continuation(begin, points=300, eta=ends)
            ended(branch)
            assert branch.end == "the branch has closed"
            first, last = branch.points[0], branch.points[-1]
            assert last.value == first.value
            np.testing.assert_allclose(last.points, first.points, atol=1e-10)
            assert last.arclength > branch.points[-2].arclength
            kinds = [point.bifurcation.kind.value for point in branch.bifurcations]
            assert kinds.count("fold") == 2
            values.append(sorted(point.value for point in branch.bifurcations))
        np.testing.assert_allclose(values[0], values[1], atol=1e-9)


@pytest.mark.parametrize("end", [-4.82, -4.9, -5.0])
def test_steps_are_no_longer_than_asked(end) -> None:
    """For any width of the range, although the scales round it to a power of two."""
    branch = follow(wb.paper.system(eta=-2.0, F0=0.036), eta=(-2.0, end), step=0.05)
    shares = np.diff([point.value for point in branch.points]) / (end + 2.0)
    assert np.max(shares) == pytest.approx(0.05, rel=0.01)

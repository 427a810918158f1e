"""Sweeps: every point as if simulated alone, in any number of threads, with any neighbours."""

from __future__ import annotations

import json
import threading
from functools import partial
from typing import ClassVar

import numpy as np
import pytest

import wedgebrake as wb
from machines import contact, single
from wedgebrake.dynamics.enums import MotionClass, StickClass
from wedgebrake.model.friction import SetValuedFriction
from wedgebrake.model.part import parameter
from wedgebrake.model.view import DRIVELINE
from wedgebrake.sweeps.results import PointStatus, variables
from wedgebrake.sweeps.sweep import make_plan

VARIABLES = {one.name: one for one in variables(DRIVELINE)}
SYSTEM = wb.paper.system(eta=-24.0, F0=0.036)
ETAS = np.linspace(-60.0, 12.0, 25)


@pytest.fixture(scope="module")
def diagram():
    return wb.sweep(SYSTEM, eta=ETAS, transient=200)


def test_dimensions_and_labels(diagram) -> None:
    assert dict(diagram.sizes) == {"eta": 25, "period": 51}
    assert diagram["angle"].dims == ("eta", "period")
    np.testing.assert_array_equal(diagram["eta"], ETAS)
    np.testing.assert_array_equal(diagram["period"], np.arange(200, 251))
    for name, variable in VARIABLES.items():
        assert diagram[name].attrs["units"] == variable.unit
        assert diagram[name].dtype == variable.dtype
    assert json.loads(diagram.attrs["system"]) == SYSTEM.as_dict()
    assert json.loads(diagram.attrs["protocol"])["transient"] == 200
    assert diagram.attrs["wedgebrake_version"] == wb.__version__


@pytest.mark.parametrize("index", [0, 7, 12, 20, 24])
def test_points_are_those_of_poincare(diagram, index) -> None:
    """Chaos apart, where rounding decides."""
    one = diagram.isel(eta=index)
    if one["motion"] == MotionClass.CHAOTIC:
        return
    alone = wb.poincare(SYSTEM.replace(eta=ETAS[index]), periods=250, transient=200)
    for name in ("angle", "velocity"):
        np.testing.assert_allclose(one[name], alone[name], rtol=0, atol=2e-9)


def test_measures_are_those_of_a_response(diagram) -> None:
    index = 3
    one = diagram.isel(eta=index)
    order = int(one["order"])
    system = SYSTEM.replace(eta=ETAS[index])
    response = wb.simulate(system, periods=250 + order, samples_per_period=400)
    start = 250 / system.excitation.frequency
    sticks = wb.sticks(response, start).attrs
    assert StickClass(int(one["stick_class"])).word == sticks["class"]
    assert one["stick_share"] == pytest.approx(sticks["share"], rel=1e-9)
    assert one["sticks_backward"] * order == pytest.approx(sticks["count_backward"])
    torque = response["brake_torque"].where(response["time"] >= start)
    assert float(abs(torque).max()) <= float(one["peak_torque"]) * (1 + 1e-12)
    assert float(abs(torque).max()) == pytest.approx(float(one["peak_torque"]), rel=2e-2)


def test_threads_change_nothing(diagram) -> None:
    for threads in (1, 3):
        found = wb.sweep(SYSTEM, eta=ETAS, transient=200, threads=threads)
        assert found.identical(diagram)


def test_order_and_neighbours_change_nothing(diagram) -> None:
    backwards = wb.sweep(SYSTEM, eta=ETAS[::-1], transient=200)
    few = wb.sweep(SYSTEM, eta=ETAS[[4, 11, 12]], transient=200)
    for name in VARIABLES:
        np.testing.assert_array_equal(backwards[name].values[::-1], diagram[name])
        np.testing.assert_array_equal(few[name], diagram[name].values[[4, 11, 12]])


def test_several_axes_in_the_order_given() -> None:
    grid = {"F0": [0.036, 0.067], "eta": [-24.0, -30.0, 0.0], "damping": [0.1, 0.2]}
    whole = wb.sweep(SYSTEM, transient=200, keep_points=False, **grid)
    assert whole["motion"].dims == ("F0", "eta", "damping")
    assert "angle" not in whole
    # Groups are set last, on the new SI values, as replace does.
    system = SYSTEM.replace(F0=0.067, eta=-30.0, damping=0.2)
    alone = wb.simulate(system, periods=250, times=())
    found = whole.sel(F0=0.067, eta=-30.0, damping=0.2)
    assert found["final_angle"] == pytest.approx(alone.attrs["final_angle"], abs=1e-9)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("inertia", [0.9, 1.1]),
        ("stiffness", [9e3, 1.1e4]),
        ("drive_speed", [0.0, 1.5]),
        ("angle", [0.3, 0.4]),
        ("radius", [0.15, 0.25]),
        ("kinetic", [0.2, 0.3]),
        ("static", [0.3, 0.4]),
        ("initial_force", [100.0, 400.0]),
        ("slope", [-30.0, 5.0]),
        ("amplitude", [100.0, 9000.0]),
        ("frequency", [8.0, 20.0]),
        ("f", [0.5, 1.2]),
        ("alpha", [1.1, 2.0]),
        ("initial_velocity", [-3.0, 4.0]),
        ("initial_angle", [-0.02, 0.05]),
    ],
)
def test_every_parameter_reaches_its_system(name, values) -> None:
    base = SYSTEM.replace(static=0.35)
    found = wb.sweep(base, periods=12, transient=2, **{name: values})
    for i, value in enumerate(values):
        state = [0.0, 0.0]
        system = base
        if name.startswith("initial_") and name != "initial_force":
            state[name == "initial_velocity"] = value
        else:
            system = base.replace(**{name: value})
        alone = wb.simulate(system, periods=12, initial=tuple(state), times=())
        assert found["final_angle"][i] == pytest.approx(alone.attrs["final_angle"], abs=1e-10)
        assert found["final_velocity"][i] == pytest.approx(alone.attrs["final_velocity"], abs=1e-8)


def test_static_left_out_follows_kinetic() -> None:
    base = SYSTEM.replace(friction=wb.CoulombFriction(kinetic=0.3))
    found = wb.sweep(base, periods=10, transient=2, kinetic=[0.25, 0.35])
    for i, kinetic in enumerate((0.25, 0.35)):
        alone = wb.simulate(base.replace(kinetic=kinetic), periods=10, times=())
        assert found["final_angle"][i] == pytest.approx(alone.attrs["final_angle"], abs=1e-12)


@pytest.mark.parametrize(
    "brake",
    [
        wb.ConventionalBrake(radius=0.2),
        wb.BandBrake(radius=0.2, wrap_angle=4.0),
        wb.LeadingShoeBrake(radius=0.2, actuation_arm=0.2, normal_arm=0.1, friction_arm=0.08),
    ],
)
def test_every_brake_and_table(brake) -> None:
    friction = wb.TabulatedFriction(speeds=[0.0, 0.2, 1.0], coefficients=[0.35, 0.3, 0.28])
    for changes in ({"brake": brake}, {"brake": brake, "friction": friction}):
        base = wb.paper.system(eta=-10.0, F0=0.05).replace(**changes)
        found = wb.sweep(base, periods=20, transient=5, frequency=[9.0, 12.0])
        for i, frequency in enumerate((9.0, 12.0)):
            alone = wb.simulate(base.replace(frequency=frequency), periods=20, times=())
            assert found["final_angle"][i] == pytest.approx(alone.attrs["final_angle"], abs=1e-10)


class WideningTable(SetValuedFriction):
    """A friction law that bends at speeds, and in as many places, as its parameters say."""

    width: float = parameter("speed of the first bend", symbol="-", unit="m/s", example=0.2, gt=0)
    drop: float = parameter("drop at each bend", symbol="-", unit="1", example=0.05, ge=0)
    steps: float = parameter("number of bends", symbol="-", unit="1", example=2.0, ge=0)

    def nodes(self):
        return tuple((self.width * i, 0.3 - self.drop * i) for i in range(int(self.steps) + 1))

    @property
    def breakaway(self):
        return 0.35

    @property
    def reference(self):
        return 0.3


@pytest.mark.parametrize("follow", [None, "width", "steps"])
def test_speeds_at_which_a_law_bends_may_depend_on_swept_parameters(follow) -> None:
    law = WideningTable(width=0.2, drop=0.05, steps=2.0)
    base = wb.paper.system(eta=-10.0, F0=0.05).replace(friction=law)
    axes = {"width": [0.05, 0.4, 0.0, 1.5], "steps": [0.0, 1.0, 3.0]}
    found = wb.sweep(base, periods=12, transient=5, follow=follow, **axes)
    if follow is not None:
        found = found.sel(branch="up")
    for i, width in enumerate(axes["width"]):
        for j, steps in enumerate(axes["steps"]):
            point = found.isel(width=i, steps=j)
            if width == 0.0:
                assert point["status"] == PointStatus.INVALID
                continue
            before = {"width": (i - 1, j), "steps": (i, j - 1)}.get(follow, (-1, -1))
            start = (0.0, 0.0)
            if min(before) >= 0 and axes["width"][before[0]] != 0.0:
                start = tuple(
                    float(found[name][before]) for name in ("final_angle", "final_velocity")
                )
            system = base.replace(width=width, steps=steps)
            alone = wb.simulate(system, periods=12, initial=start, times=())
            assert point["final_angle"] == pytest.approx(alone.attrs["final_angle"], abs=1e-10)


def test_bad_points_say_so_and_end_nothing() -> None:
    """Diverging, self-locking, impossible and event-ridden points among good ones."""
    alphas = wb.sweep(
        wb.paper.system(eta=0.0, F0=0.02), alpha=[0.0, 0.5, 1.18], initial_velocity=[5.0, 0.0]
    )
    status = [[PointStatus(int(one)).name for one in row] for row in alphas["status"].values]
    assert status[0] == ["INVALID", "INVALID"]
    assert status[1][0] == "NO_FORWARD_SOLUTION"
    assert status[2] == ["COMPLETED", "COMPLETED"]
    assert np.isnan(alphas["angle"].values[0]).all()
    assert alphas["motion"].values[1, 0] == MotionClass.SELF_LOCKED
    printed = wb.paper.system(damping=1.0, release=False)
    grown = wb.sweep(printed, eta=[-24.0, 0.0])
    assert grown["status"].values.tolist() == [PointStatus.DIVERGED, PointStatus.COMPLETED]
    assert grown["motion"].values[0] == MotionClass.DIVERGED
    assert np.isnan(grown["velocity"].values[0]).all()
    few = wb.sweep(SYSTEM, eta=[-24.0], max_events=100)
    assert few["status"].values[0] == PointStatus.EVENT_LIMIT
    assert few["motion"].values[0] == MotionClass.UNDECIDED


def test_follow_goes_up_and_down() -> None:
    etas = np.linspace(-40.0, -10.0, 13)
    found = wb.sweep(SYSTEM, eta=etas, follow="eta", transient=60, periods=80)
    assert found["velocity"].dims == ("branch", "eta", "period")
    for branch, order in (("up", etas), ("down", etas[::-1])):
        state = (0.0, 0.0)
        for eta in order[:4]:
            alone = wb.simulate(SYSTEM.replace(eta=eta), periods=80, initial=state, times=())
            state = (alone.attrs["final_angle"], alone.attrs["final_velocity"])
            here = found.sel(branch=branch, eta=eta)
            assert here["final_angle"] == pytest.approx(state[0], abs=1e-7)
            state = (float(here["final_angle"]), float(here["final_velocity"]))


def test_follow_in_a_map_is_cut_into_chunks_of_lines(tmp_path) -> None:
    grid = {"F0": np.linspace(0.03, 0.05, 9), "eta": np.linspace(-30.0, -10.0, 5)}
    options = {"follow": "eta", "periods": 40, "transient": 20}
    whole = wb.sweep(SYSTEM, **grid, **options)
    stored = wb.sweep(SYSTEM, **grid, **options, store=tmp_path / "a.zarr", progress=False)
    assert stored.load().identical(whole)
    line = wb.sweep(SYSTEM.replace(F0=grid["F0"][3]), eta=grid["eta"], **options)
    np.testing.assert_array_equal(whole["velocity"][:, 3], line["velocity"])


def test_smooth_sweep_is_that_of_simulate() -> None:
    base = wb.paper.system(eta=0.0, F0=0.09, friction="smoothed")
    found = wb.sweep(base, eta=[0.0, -3.0], periods=40, transient=30)
    for i, eta in enumerate((0.0, -3.0)):
        alone = wb.poincare(base.replace(eta=eta), periods=40, transient=30)
        np.testing.assert_allclose(found["velocity"][i], alone["velocity"], atol=1e-5)
    assert set(found["status"].values.tolist()) == {PointStatus.COMPLETED}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({}, "nothing to sweep"),
        ({"release": [1.0]}, "release: cannot be swept"),
        ({"eta": ["1", "2"]}, "eta = "),
        ({"eta": [True, False]}, "eta = "),
        ({"eta": np.ma.array([1.0, 2.0], mask=[0, 1])}, "eta: has masked values"),
        ({"eta": [1.0], "slope": [2.0]}, "eta and slope"),
        ({"alpha": [-1.0, -2.0]}, "alpha: .*-1.0"),
        ({"initial_angle": [1e13]}, "initial_angle"),
        ({"eta": [1.0], "follow": "F0"}, "follow = 'F0'"),
        ({"eta": [1.0], "transient": 300}, "transient = 300"),
        ({"eta": [1.0], "resume": True}, "resume = True: needs store"),
        ({"eta": [1.0], "progress": 3}, "progress = 3"),
        ({"eta": [1.0], "client": "no such thing"}, "client = 'no such thing'"),
        ({"eta": [1.0], "keep_points": 1}, "keep_points = 1"),
        ({"eta": [1.0], "max_events": 0}, "max_events = 0"),
    ],
)
def test_wrong_arguments(arguments, words) -> None:
    with pytest.raises(wb.InputError, match=words):
        wb.sweep(SYSTEM, **arguments)


def test_too_large_for_memory() -> None:
    values = np.linspace(0.01, 0.1, 3000)
    axes = {"eta": values, "F0": values, "f": values, "initial_angle": values}
    with pytest.raises(wb.InputError, match="memory"):
        wb.sweep(SYSTEM, **axes)


def test_parameters_that_are_valid_only_together() -> None:
    """Alone each of them is refused by the system that is swept."""
    base = wb.paper.system().replace(kinetic=0.1, static=0.12)
    axes = {"kinetic": [0.1, 0.2], "static": [0.12, 0.25], "eta": [0.0, 5.0]}
    found = wb.sweep(base, periods=6, transient=1, **axes)
    expected = [[1, 1], [1, 1], [6, 6], [1, 1]]
    assert found["status"].values.reshape(4, 2).tolist() == expected
    alone = wb.simulate(base.replace(kinetic=0.2, static=0.25, eta=5.0), periods=6, times=())
    assert found["final_angle"][1, 1, 1] == pytest.approx(alone.attrs["final_angle"], abs=1e-12)
    still = wb.paper.system().replace(damping=0.0, initial_force=0.0, slope=0.0)
    for pair in (
        {"damping": [0.1, 0.2], "eta": [-3.0, 1.0]},
        {"initial_force": [100.0, 300.0], "F0": [0.03, 0.05]},
    ):
        assert (wb.sweep(still, periods=6, transient=1, **pair)["status"] == 1).all()


def test_basins_of_one_orbit_are_one() -> None:
    system = wb.paper.system(eta=-10.0, F0=0.036, brake="conventional")
    start = {
        "initial_angle": np.linspace(-0.3, 0.3, 5),
        "initial_velocity": np.linspace(-30.0, 30.0, 5),
    }
    found = wb.basins(system, limit=6000, **start)
    assert found["attractor_share"].values.tolist() == [1.0]
    assert found["attractor_order"].values.tolist() == [1]
    np.testing.assert_array_equal(found["attractor"], np.zeros((5, 5)))


def test_basins_of_one_chaotic_attractor_are_one() -> None:
    system = wb.paper.system(eta=-28.0, F0=0.036)
    start = {
        "initial_angle": np.linspace(-0.2, 0.2, 12),
        "initial_velocity": np.linspace(-9.0, 9.0, 12),
    }
    found = wb.basins(system, limit=1000, **start)
    chaotic = found["attractor_kind"] == MotionClass.CHAOTIC
    assert int(chaotic.sum()) == 1


def test_basins_of_an_orbit_longer_than_the_record() -> None:
    start = {"initial_angle": [-0.01, 0.0], "initial_velocity": [0.0, 0.1]}
    found = wb.basins(SYSTEM, periods=3, **start)
    assert found["attractor_order"].values.tolist() == [6]
    assert found.sizes["orbit_point"] == 4


def test_basins_tell_attractors_apart_in_any_company() -> None:
    """Two orbits of the same order; a point that is undecided has no say."""
    from wedgebrake.sweeps.basins import label

    system = wb.paper.system(eta=-30.0, f=0.6, F0=0.036)
    start = {
        "initial_angle": np.linspace(-0.2, 0.2, 6),
        "initial_velocity": np.linspace(-20.0, 20.0, 6),
    }
    found = wb.basins(system, **start)
    assert found.sizes["attractor_id"] >= 2
    assert found["attractor_share"].sum() == pytest.approx(1.0)
    wild = found.drop_dims("attractor_id").drop_vars("attractor").copy(deep=True)
    wild["motion"][0, 0], wild["angle"][0, 0, :3] = MotionClass.DIVERGED, [1.0, 100.0, 3000.0]
    again = label(wild)
    same = np.ones((6, 6), dtype=bool)
    same[0, 0] = False
    np.testing.assert_array_equal(again["attractor"].values[same], found["attractor"].values[same])
    flipped = wb.basins(system, **{name: values[::-1] for name, values in start.items()})
    np.testing.assert_allclose(flipped["attractor_share"], found["attractor_share"])


def test_points_without_an_attractor_say_why() -> None:
    """By codes that the docstring of ``basins`` states."""
    from wedgebrake.sweeps.basins import label

    start = {"initial_angle": [0.0, 0.1], "initial_velocity": [0.0, 1.0, 2.0]}
    found = wb.basins(SYSTEM, periods=20, transient=10, **start)
    points = found.drop_dims("attractor_id").drop_vars("attractor").copy(deep=True)
    others = (MotionClass.UNDECIDED, MotionClass.DIVERGED, MotionClass.SELF_LOCKED)
    points["motion"].values[:] = [[*others], [MotionClass.NONE, MotionClass.AT_REST, others[0]]]
    points["status"].values[1, 2] = PointStatus.NOT_COMPUTED
    again = label(points)
    assert again["attractor"].values.tolist() == [[-1, -2, -3], [-4, 0, -4]]
    assert again["attractor"].attrs["flag_values"] == [-1, -2, -3, -4, -5, -6]
    assert again["attractor_share"].values.tolist() == [1 / 6]


def test_after_an_interrupt_no_batch_begins(monkeypatch) -> None:
    """The one that runs ends; the others would keep the threads of a notebook busy."""
    from wedgebrake.sweeps import executor
    from wedgebrake.sweeps.grid import Chunks

    go_on, begun = threading.Event(), []

    class Blocked:
        """A chunk of four batches, each of which waits, except in the first chunk."""

        def __init__(self, where) -> None:
            first = where["eta"].start == 0
            self.work = [partial(self.batch, first)] * 4

        def batch(self, first) -> None:
            begun.append(first)
            assert first or go_on.wait(60.0)

        def results(self) -> dict:
            return {}

    plan = make_plan("sweep", SYSTEM, {"eta": ETAS})
    monkeypatch.setattr(type(plan), "chunk_maker", lambda _plan: Blocked)
    chunks = Chunks({"eta": 4}, {"eta": 1})
    before = set(threading.enumerate())
    running = executor.by_threads(plan, 1, chunks, chunks.indices())
    next(running)
    running.close()
    go_on.set()
    for thread in set(threading.enumerate()) - before:
        thread.join(60.0)
    assert begun.count(True) == 4
    assert begun.count(False) <= 1


def test_maps_ask_for_their_axes() -> None:
    with pytest.raises(wb.InputError, match="bifurcation: 2 parameters"):
        wb.bifurcation(SYSTEM, eta=[1.0], F0=[0.1])
    with pytest.raises(wb.InputError, match="regime_map: 1 parameters"):
        wb.regime_map(SYSTEM, eta=[1.0])
    with pytest.raises(wb.InputError, match="basins: swept eta"):
        wb.basins(SYSTEM, eta=[1.0])
    with pytest.raises(wb.InputError, match="follow: only bifurcation and sweep"):
        wb.regime_map(SYSTEM, eta=[1.0], F0=[0.1], follow="eta")


def test_time_left_leaves_out_what_came_before_the_first_points(monkeypatch) -> None:
    """Compilation: 20 s until the first ten of a hundred points, a second for the next ten."""
    from wedgebrake.sweeps import progress

    clock = iter([0.0, 20.0, 21.0])
    monkeypatch.setattr(progress.time, "perf_counter", lambda: next(clock))
    seen: list[progress.Progress] = []
    meter = progress.Meter(100, 0, seen.append)
    meter.add(10)
    assert seen[-1].left == np.inf
    meter.add(10)
    assert seen[-1].left == pytest.approx(8.0)
    assert seen[-1].rate == pytest.approx(20 / 21)


def test_an_interrupt_leaves_a_store_to_go_on_with(tmp_path) -> None:
    path = tmp_path / "run.zarr"
    options = {"eta": np.linspace(-60.0, 12.0, 200), "periods": 40, "transient": 30}

    def stop(progress) -> None:
        if progress.done >= 12:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        wb.sweep(SYSTEM, store=path, progress=stop, **options)
    assert "resume=True" in caught.value.__notes__[0]
    with pytest.raises(wb.InputError, match="resume"):
        wb.sweep(SYSTEM, store=path, progress=False, **options)
    seen = []
    resumed = wb.sweep(SYSTEM, store=path, resume=True, progress=seen.append, **options)
    assert 12 <= seen[0].resumed < 200
    assert resumed.load().identical(wb.sweep(SYSTEM, **options))


def own_law(width: float) -> wb.Friction:
    return wb.CustomFriction(law=lambda v: 0.3 * v / (abs(v) + width), width=0.01)


def own_brake(cubic: float) -> wb.Brake:
    class Own(wb.Brake):
        kind: ClassVar[str] = "own"

        @staticmethod
        def law(m, shape):  # noqa: ARG004 - the law of all brakes
            return m + cubic * m**3

    return Own(radius=0.2)


@pytest.mark.parametrize(("part", "made"), [("friction", own_law), ("brake", own_brake)])
def test_a_store_knows_the_law_that_a_user_wrote(part, made, tmp_path, monkeypatch) -> None:
    """Also one whose class has a name in study files."""
    monkeypatch.setattr(wb.Brake, "kinds", {**wb.Brake.kinds})
    options = {"eta": [0.0, -1.0], "periods": 4, "transient": 1, "progress": False}
    options["store"] = tmp_path / "run.zarr"
    wb.sweep(SYSTEM.replace(**{part: made(0.01)}), **options)
    wb.sweep(SYSTEM.replace(**{part: made(0.01)}), resume=True, **options)
    with pytest.raises(wb.InputError, match=rf"laws\.{part}"):
        wb.sweep(SYSTEM.replace(**{part: made(0.02)}), resume=True, **options)


def test_the_identity_of_a_law_is_what_it_does() -> None:
    """Also what it calls, and the values outside it that it uses."""
    from wedgebrake.sweeps.plan import fingerprint

    text = "import math\nMU = {}\ndef helper(v):\n    return {} * math.tanh(v)\n"
    text += "def law(v):\n    return MU * helper(v)\n"

    def made(mu, factor):
        here: dict = {}
        exec(text.format(mu, factor), here)  # noqa: S102 - our own text
        return fingerprint(here["law"])

    assert made(0.3, 1.0) == made(0.3, 1.0)
    assert len({made(0.3, 1.0), made(0.2, 1.0), made(0.3, 2.0)}) == 3


def test_the_law_of_a_machine_is_part_of_its_sweep() -> None:
    """A store is not resumed with another function of the same name."""

    def machine(limit: float) -> wb.Machine:
        law = wb.CustomFriction(law=lambda v: limit * np.tanh(100.0 * v), width=0.05, kinetic=0.3)
        return single(contact(friction=law), stiffness=1.0, speed=5.0)

    one, same, other = (
        make_plan("sweep", machine(limit), {"brake.radius": [1.0]}).identity()["laws"]
        for limit in (0.3, 0.3, 0.4)
    )
    assert one == same != other


def own_signal(amplitude: float) -> wb.Signal:
    class Own(wb.Signal):
        frequency: float

        def primitive(self) -> wb.Signal:
            return wb.Harmonic(amplitude, self.frequency)

    return Own(2.0)


@pytest.mark.parametrize("as_machine", [False, True])
def test_the_signal_of_a_user_is_part_of_the_sweep(as_machine) -> None:
    """Also of a driveline that is solved as a machine."""

    def laws(amplitude: float) -> dict[str, str]:
        system = SYSTEM.replace(excitation=own_signal(amplitude))
        axis = {"driveline.inertia" if as_machine else "inertia": [1.0]}
        plan = make_plan("sweep", system.machine if as_machine else system, axis)
        return plan.identity()["laws"]

    assert laws(1.0) == laws(1.0) != laws(2.0)

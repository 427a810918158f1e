"""Pictures over parameters on the page: the numbers of wb.sweep, and all their inputs."""

import threading
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from states import new_state

import wedgebrake as wb
from wedgebrake.errors import InputError
from wedgebrake.explorer.core import plots
from wedgebrake.explorer.core.computation import evaluation_settings, linked_friction
from wedgebrake.explorer.core.fields import parameter_axis
from wedgebrake.explorer.core.plots import basins, curve, diagram, regimes, stability
from wedgebrake.explorer.core.progressive_sweep import ProgressiveSweep, refinement_order
from wedgebrake.explorer.core.scheduler import Scheduler
from wedgebrake.explorer.core.state import PLOTS, PageState, axes
from wedgebrake.explorer.core.studies import state_of as state_of_study
from wedgebrake.explorer.core.traces import read
from wedgebrake.figures.bokeh.bifurcation import BifurcationPlot
from wedgebrake.figures.bokeh.class_map import MapPlot
from wedgebrake.figures.bokeh.curve import CurvePlot
from wedgebrake.figures.bokeh.trace import TracePlot
from wedgebrake.figures.data.class_map import HELD, LOCKED, STABLE
from wedgebrake.figures.data.class_styles import CODES, PERIODIC, motion_codes, without_result
from wedgebrake.figures.data.partial import QUANTITIES, hover_boxes
from wedgebrake.figures.data.response_curve import ResponseCurves
from wedgebrake.figures.style import SECTION
from wedgebrake.model.groups import SETTERS

EXAMPLES = Path(__file__).parents[2] / "examples"
BRAKES = ("wedge", "conventional", "band", "leading-shoe")
# Three motions, of which two repeat themselves.
TWO_BASINS = {"eta": -47.86, "f": 0.63, "F0": 0.06135, "alpha": 1.0961}


def state_of(brake: str = "wedge", friction: str = "coulomb", **values: float) -> PageState:
    return new_state(wb.paper.system(**values)).edited(brake=brake, friction=friction)


@pytest.fixture
def few(monkeypatch):
    """Pictures of few points."""
    monkeypatch.setattr(plots, "COARSE_POINTS", 10)
    monkeypatch.setattr(plots, "FINE_POINTS", 20)
    monkeypatch.setattr(plots, "COARSE_MAP", (8, 4))
    monkeypatch.setattr(plots, "FINE_MAP", (16, 8))


# Progressive sweeps


@pytest.mark.parametrize(("count", "levels"), [(600, (150, 600)), (24, (6, 12, 24)), (150, (150,))])
def test_every_level_is_evenly_spaced_and_part_of_the_next(count, levels):
    places = refinement_order(count, levels)
    assert sorted(places) == list(range(count))
    for level in levels:
        assert np.all(np.diff(np.sort(places[:level])) == count // level)


@pytest.mark.parametrize(
    ("grid", "levels"),
    [
        ({"eta": np.linspace(-60.0, 12.0, 16)}, [(4,), (16,)]),
        ({"F0": np.linspace(0.02, 0.1, 8), "eta": np.linspace(-60.0, 12.0, 16)},
         [(2, 4), (4, 8), (8, 16)]),
    ],
)  # fmt: skip
def test_the_points_are_those_of_a_sweep_bit_for_bit(grid, levels):
    system = wb.paper.system()
    options = {"keep_points": len(grid) == 1}
    one = ProgressiveSweep(system, grid, levels, **options)
    found = {one.level for _ in one.steps()}
    assert found >= set(levels)
    assert one.dataset().identical(wb.sweep(system, **grid, **options, threads=1))
    assert [places.size for places in one.complete_places()] == list(levels[-1])


# Keys


def edits(state: PageState, name: str) -> list[PageState]:
    """The state with other values of a parameter, inside its range."""
    axis = parameter_axis(state, name)
    low, high = axis.ends
    return [state.edited(**{name: axis.rounded(low + part * (high - low))}) for part in (0.3, 0.6)]


def check_inputs(inputs, state: PageState, names) -> None:
    """Check that the inputs depend on all parameters but the named ones."""
    here = inputs(state)
    hash(here)
    assert all(inputs(other) == here for name in names for other in edits(state, name))
    taken = {SETTERS[name].target if name in SETTERS else name for name in names}
    for name in axes(state.system):
        if (SETTERS[name].target if name in SETTERS else name) not in taken:
            assert any(inputs(other) != here for other in edits(state, name)), (names, name)


@pytest.mark.parametrize(
    ("brake", "friction"),
    [*((brake, "coulomb") for brake in BRAKES), ("wedge", "smoothed"), ("wedge", "tabulated")],
)
def test_the_inputs_of_the_diagram(brake, friction):
    for name in axes(state_of(brake, friction).system):
        state = state_of(brake, friction).edited(axis=name)
        check_inputs(diagram.inputs, state, [name])
        inputs, axis = diagram.inputs(state), parameter_axis(state, name)
        narrower = {name: (axis.low, axis.rounded(0.5 * sum(axis.ends)))}
        for changed in (
            {"periods": 30}, {"initial_angle": 0.01}, {"axis": "eta" if name == "f" else "f"},
            {"release": False}, {"spans": narrower}, {"follow": True},
        ):  # fmt: skip
            assert diagram.inputs(state.edited(**changed)) != inputs, (name, changed)
        assert diagram.inputs(state.edited(quantity="angle", comparison=True, shown=30)) == inputs


# Numbers


def last(steps):
    *_, picture = steps
    return picture


@pytest.mark.parametrize("name", ["eta", "stiffness"])
def test_the_diagram_is_that_of_a_bifurcation(few, name):
    state = state_of().edited(axis=name)
    pictures = list(diagram.pictures(state))
    known = [one.known.size for one in pictures]
    assert (known[0], known[-1]) == (10, 20)
    assert all(a < b for a, b in pairwise(known))
    assert pictures[0].band.size == 20
    assert pictures[0].progress
    picture = pictures[-1]
    assert not picture.progress
    values = picture.axes[0].values(20)
    truth = wb.bifurcation(
        linked_friction(state, [name]), **{name: values}, **evaluation_settings(state)
    )
    codes = motion_codes(truth).to_numpy()
    np.testing.assert_array_equal(picture.codes, codes)
    np.testing.assert_array_equal(picture.band, codes)
    for quantity in SECTION:
        cloud = picture.clouds[quantity]
        for index, (code, row) in enumerate(zip(codes, truth[quantity].values, strict=True)):
            drawn = cloud.points[cloud.index == index]
            if code in PERIODIC:
                gap = np.abs(row[:, None] - drawn).min(axis=1).max()
                assert gap < 1e-3 * max(np.ptp(truth[quantity].values), 1e-9)
                assert drawn.size < row.size
            elif not without_result(code) and drawn.size > 1:
                np.testing.assert_array_equal(drawn, row)


def test_the_diagram_shows_amplitudes_up_and_down(few):
    state = state_of().edited(axis="eta", follow=True)
    *before, picture = diagram.pictures(state)
    assert all(one.progress for one in before)
    assert picture.progress == ""
    truth = wb.bifurcation(
        linked_friction(state, ["eta"]), eta=picture.axes[0].values(20), follow=True,
        **evaluation_settings(state),
    )  # fmt: skip
    # The branches differ, in chaotic motions at least, and cannot be mistaken for each other.
    assert np.abs(truth["rms_torque"].diff("branch")).max() > 1e-3
    kept = ~without_result(motion_codes(truth).to_numpy())
    half = 0.5 * (truth["highest_velocity"] - truth["lowest_velocity"])
    truth = truth.assign(speed_amplitude=half)
    for quantity in QUANTITIES.keys() - SECTION.keys():
        cloud, row = picture.clouds[quantity], truth[quantity].transpose("branch", "eta").values
        np.testing.assert_array_equal(cloud.points, row[kept])
        np.testing.assert_array_equal(cloud.index, np.nonzero(kept)[1])


@pytest.mark.parametrize(("across", "up"), [("eta", "F0"), ("stiffness", "damping")])
def test_the_regimes_are_those_of_a_map(few, across, up):
    state = state_of().edited(across=across, up=up)
    picture = last(regimes.pictures(state))
    x, y = picture.axes
    assert x.log == y.log == (across == "stiffness")
    truth = wb.regime_map(
        linked_friction(state, [up, across]),
        **{up: y.values(8), across: x.values(16)},
        **evaluation_settings(state),
    )
    np.testing.assert_array_equal(picture.data.codes, motion_codes(truth).to_numpy())
    assert picture.progress == ""
    if across == "eta":
        (line,) = picture.data.limit
        # Forwards: -D = -(alpha - 1) mu_k, at the paper's alpha.
        assert line[:, 0] == pytest.approx(-0.054, abs=1e-6)
        assert np.ptp(line[:, 1]) > 0.0


@pytest.mark.parametrize("brake", BRAKES)
def test_the_stability_is_that_of_a_stability_map(brake):
    state = state_of(brake)
    (picture,) = stability.pictures(state)
    (x, y), (rows, columns) = picture.axes, picture.data.codes.shape
    truth = wb.stability_map(state.system, **{y.name: y.values(rows), x.name: x.values(columns)})
    codes = picture.data.codes
    np.testing.assert_array_equal(picture.data.margin, truth["margin"].to_numpy())
    np.testing.assert_array_equal(codes == LOCKED, truth["locked"].to_numpy())
    slides = codes < HELD
    np.testing.assert_array_equal((codes == STABLE)[slides], truth["stable"].to_numpy()[slides])


def test_the_basins_are_those_of_wb_basins(few):
    state = state_of(**TWO_BASINS)
    picture = last(basins.pictures(state))
    x, y = picture.axes
    truth = wb.basins(
        state.system,
        initial_velocity=y.values(8),
        initial_angle=x.values(16),
        **evaluation_settings(state),
    )
    assert truth.sizes["attractor_id"] > 1
    given, codes = truth["attractor"].to_numpy(), picture.data.codes
    # The same partition; the numbers of equally large basins may differ.
    pairs = set(zip(given.ravel().tolist(), codes.ravel().tolist(), strict=True))
    assert len(pairs) == len(np.unique(given)) == len(np.unique(codes))
    boxes = hover_boxes(picture.axes, picture.data)
    area = (boxes.right - boxes.left) * (boxes.top - boxes.bottom)
    assert area.sum() == pytest.approx((x.high - x.low) * (y.high - y.low))


def test_the_diagram_contains_the_resonance(few):
    """Of one value among twenty; it is many times as high as the other points."""
    state = state_of("conventional", eta=0.0).edited(
        damping=5.0, initial_force=100.0, axis="frequency", spans={"frequency": (2.0, 50.0)}
    )
    picture = last(diagram.pictures(state))
    for name in ("speed_amplitude", "velocity", "peak_torque"):
        cloud = picture.clouds[name]
        low, high = cloud.span
        assert low <= cloud.points.min()
        assert cloud.points.max() <= high
    amplitude = picture.clouds["speed_amplitude"].points
    assert amplitude.max() > 5.0 * np.median(amplitude)


@pytest.mark.parametrize(
    ("name", "span", "limits"),
    [
        # Forwards sliding is stable above tan(angle) = mu - eta, and locks at tan(angle) = mu.
        ("alpha", (0.9, 1.6), {1.0: "self-locking, forwards", 4 / 3: "Hopf bifurcation, forwards"}),
        ("eta", (-1.0, 0.2), {-0.054: "Hopf bifurcation, forwards"}),
    ],
)
def test_limits_are_named_where_they_are(few, name, span, limits):
    state = state_of(eta=-0.1 if name == "alpha" else -24.0, alpha=1.18)
    picture = last(diagram.pictures(state.edited(axis=name, spans={name: span})))
    cell = (span[1] - span[0]) / 20.0
    assert picture.limits == pytest.approx(list(limits), abs=cell)
    assert picture.limit_words == tuple(limits.values())


@pytest.mark.parametrize("own", [False, True])
def test_a_diagram_over_kinetic_friction_is_that_of_edits(few, own):
    """Static friction follows, or keeps its own value, also where kinetic friction exceeds it."""
    state = state_of().edited(kinetic=0.25, static=0.33 if own else 0.25, axis="kinetic")
    raised = state.edited(kinetic=0.4)
    assert diagram.inputs(raised) == diagram.inputs(state)
    assert linked_friction(raised, ["kinetic"]).friction.static == (0.33 if own else 0.4)
    for kinetic in (0.2, 0.3):
        system = linked_friction(raised, ["kinetic"]).replace(kinetic=kinetic)
        assert system.friction == raised.edited(kinetic=kinetic).system.friction


def test_the_wedge_angle_can_be_swept(few):
    """Its dimension has another name than the parameter, since results contain an angle."""
    state = state_of().edited(axis="angle", across="angle", up="eta")
    assert last(diagram.pictures(state)).band.size == 20
    assert last(regimes.pictures(state)).progress == ""


# Machines and ranges that are hard


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"release": False, "spans": {"eta": (-60.0, -40.0)}}, "diverged"),
        ({"alpha": 0.9, "initial_velocity": 20.0}, "self_locked"),
        ({"alpha": 0.9}, "at_rest"),
        ({"static": 0.33, "axis": "kinetic"}, "invalid"),
    ],
)
def test_diagrams_of_machines_that_do_not_move_on(few, changes, name):
    picture = last(diagram.pictures(state_of().edited(**changes)))
    cloud, these = picture.clouds["velocity"], picture.codes == CODES[name]
    assert these.any()
    if name == "diverged":
        assert these.all()
        assert cloud.points.size == 0
        assert picture.gaps == pytest.approx(np.array([picture.axes[0].ends]))
    if name == "invalid":
        assert np.all(picture.positions[these] > 0.33)
        assert picture.gaps.size
    assert np.all(np.isfinite(cloud.span))
    assert np.all(np.isfinite(cloud.points))


def test_amplitudes_of_a_rest_are_zero_at_the_bottom(few):
    state = state_of("conventional", eta=0.0).edited(axis="F0", spans={"F0": (3.0, 5.0)})
    picture = last(diagram.pictures(state))
    assert np.all(picture.codes == CODES["at_rest"])
    for name in ("speed_amplitude", "rms_velocity", "rms_torque"):
        low, high = picture.clouds[name].span
        lowest = picture.clouds[name].points.min()
        assert low < high
        assert lowest > 0.0 or low == lowest == 0.0, name


# Amplitude curves

NARROW = {"levels": [480.0, 500.0], "spans": {"frequency": (8.6, 9.0)}}


def test_the_curves_are_those_of_response_curve():
    state = state_of().edited(**NARROW)
    first, *_, picture = curve.pictures(state)
    assert first.done == ()
    assert first.progress
    truth = wb.response_curve(state.system, frequency=(8.6, 9.0), levels=[480.0, 500.0])
    whole = ResponseCurves.of(truth, "angle_amplitude")
    assert picture.progress == ""
    own = [one["angle_amplitude"] for one in picture.done]
    for level, found in enumerate(own):
        (panel,), (every,) = found.panels, whole.panels
        wanted = [one for one in every.curves if whole.of_branches[one.branch] == level]
        assert len(panel.curves) == len(wanted)
        for one, other in zip(panel.curves, wanted, strict=True):
            assert one.stable == other.stable
            assert np.array_equal(one.x, other.x)
            assert np.array_equal(one.y, other.y)
    assert sum(len(one.panels[0].folds) for one in own) == len(whole.panels[0].folds) > 0
    assert any(one.panels[0].sticks for one in own)
    words = [entry.css[1] for entry in picture.legend]
    assert {"stable", "unstable", "sticks", "fold"} < set(words)
    assert sum("480" in one or "500" in one for one in words) == 2


def test_the_inputs_of_the_curves():
    state = state_of().edited(**NARROW)
    inputs = curve.inputs(state)
    for same in ({"frequency": 8.7}, {"amplitude": 300.0}, {"initial_angle": 0.01}, {"axis": "f"},
                 {"measure": "angle_phase"}):  # fmt: skip
        assert curve.inputs(state.edited(**same)) == inputs, same
    for other in ({"slope": -30.0}, {"levels": [500.0]}, {"spans": {"frequency": (8.6, 8.9)}},
                  {"level": "initial_force"}, {"over": "slope"}):  # fmt: skip
        assert curve.inputs(state.edited(**other)) != inputs, other
    # Levels of another parameter are others; by default they are about the present value.
    assert curve.levels(state.edited(level="initial_force")) == (150.0, 300.0, 450.0)


def test_sample_times_can_follow_the_frequency():
    sampled = wb.paper.system(eta=-5.0, F0=0.036).replace(sample_time=0.001, delay=1)
    state = new_state(sampled)  # of the equivalent machine
    state = state.edited(levels=[400.0], spans={"torque.frequency": (10.0, 12.5)})
    with pytest.raises(InputError, match="samplings"):
        last(curve.pictures(state))
    followed = state.edited(samplings=100)
    assert curve.inputs(followed) != curve.inputs(state)
    truth = wb.response_curve(
        state.system, {"torque.frequency": (10.0, 12.5)}, levels={"torque.amplitude": [400.0]},
        samplings=100,
    )  # fmt: skip
    whole = ResponseCurves.of(truth, "angle_amplitude")
    (found,) = last(curve.pictures(followed)).done
    for one, other in zip(
        found["angle_amplitude"].panels[0].curves, whole.panels[0].curves, strict=True
    ):
        assert np.array_equal(one.x, other.x)
        assert np.array_equal(one.y, other.y)
    assert curve.call(followed, {}).options["samplings"] == 100
    for wrong in (0, 2.5, True, "a"):
        with pytest.raises(InputError, match="samplings"):
            state.edited(samplings=wrong)


def test_levels_without_an_orbit_are_named():
    state = state_of().edited(levels=[0.0, 500.0], spans={"frequency": (8.8, 9.0)})
    picture = last(curve.pictures(state))
    assert [bool(one) for one in picture.done] == [False, True]
    assert "no orbit at 0" in picture.progress
    assert picture.reason
    with pytest.raises(InputError, match="amplitude = 0"):
        last(curve.pictures(state.edited(levels=[0.0])))


@pytest.mark.parametrize("given", [[], ["a"], [1.0, 1.0], [float(k) for k in range(9)], "5"])
def test_levels_are_a_few_different_numbers(given):
    with pytest.raises(InputError, match="levels"):
        state_of().edited(levels=given)


def test_what_is_no_longer_wanted_ends():
    """A slot that is stopped frees its thread within a step of the curve."""
    scheduler = Scheduler(threads=1)
    slot = scheduler.slot(lambda call: call())
    begun, ended = threading.Event(), threading.Event()
    slot.start(
        iter(curve.pictures(state_of().edited(levels=[500.0]))),
        lambda _: begun.set(), lambda _: None,
    )  # fmt: skip
    assert begun.wait(30)
    time.sleep(0.5)
    slot.stop()
    after = scheduler.slot(lambda call: call())
    after.start(iter([1]), lambda _: ended.set(), lambda _: None)
    assert ended.wait(1.9)  # before another thread takes the place of this one
    scheduler.close()


def test_a_time_limit_keeps_the_levels_computed(monkeypatch):
    monkeypatch.setattr(plots, "LONGEST_CURVE", 0)
    picture = last(curve.pictures(state_of().edited(**NARROW)))
    assert picture.done == ()
    assert "stopped after 0 s" in picture.progress


def test_no_curve_of_a_signal_that_does_not_repeat():
    state = state_of_study(wb.load_study(EXAMPLES / "tip_in.toml"))
    with pytest.raises(InputError, match="pedal"):
        last(curve.pictures(state))


# Axes and figures, without a browser


@pytest.mark.parametrize("brake", ["wedge", "leading-shoe"])
def test_plots_show_mark_and_pick(few, brake):
    state = state_of(brake)
    trace = (EXAMPLES / "trace.csv").read_bytes()
    state = state.edited(**NARROW, trace=read("trace.csv", trace))
    for name in PLOTS:
        computed = plots.PARAMETER_PLOTS[name]
        plot = {"diagram": BifurcationPlot, "curve": CurvePlot, "trace": TracePlot}.get(
            name, MapPlot
        )()
        picture = next(one for one in computed.pictures(state) if name != "curve" or any(one.done))
        assert "Computing" in plot._middle.html
        plot.show(picture)
        assert plot._middle.html == ""
        axes = computed.axes(state)
        plot.mark(axes, [state.value(axis.name) for axis in axes])
        drawn = plot.figure
        sources = [one.data_source for one in drawn.renderers if hasattr(one, "data_source")]
        assert sum(any(map(len, one.data.values())) for one in sources) >= 2 + (name != "curve")
        inside = [0.5 * (one.start + one.end) for one in (drawn.x_range, drawn.y_range)]
        changes = computed.pick(state, *inside)
        assert len(changes) == len(axes)
        assert state.edited(**changes) is not None
        assert computed.pick(state, drawn.x_range.start - 1.0, inside[1]) == {}
        assert all("$" not in label for _, label in (one.css for one in picture.legend))
        plot.show_message("Nothing to see.")
        assert not any(len(one.data["image"]) for one in sources if "image" in one.data)
        plot.show(picture)

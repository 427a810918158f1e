"""Pictures over parameters on the page: the numbers of wb.sweep, and keys with all their inputs."""

from itertools import pairwise

import numpy as np
import pytest

import wedgebrake as wb
from wedgebrake.errors import InputError
from wedgebrake.explorer.core import plots, progressive_sweep
from wedgebrake.explorer.core.computation import evaluation_settings, following
from wedgebrake.explorer.core.fields import parameter_axis
from wedgebrake.explorer.core.plots import basins, diagram, regimes, stability
from wedgebrake.explorer.core.progressive_sweep import ProgressiveSweep, order
from wedgebrake.explorer.core.state import PLOTS, PageState, axes, new_state
from wedgebrake.explorer.ui.parameter_plots import DrawnPlot
from wedgebrake.figures.data.axes import ParameterAxis
from wedgebrake.figures.data.class_map import HELD, LOCKED, STABLE
from wedgebrake.figures.data.class_styles import CODES, PERIODIC, motion_codes, without_result
from wedgebrake.figures.data.partial import hover_boxes, nearest_known
from wedgebrake.model.groups import SETTERS

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
    places = order(count, levels)
    assert sorted(places) == list(range(count))
    for level in levels:
        assert np.all(np.diff(np.sort(places[:level])) == count // level)


def test_a_level_spreads_from_the_beginning():
    places = order(150, (150,))
    for known in (9, 20, 40):
        assert np.diff([0, *np.sort(places[:known]), 150]).max() <= 2.1 * 150 / known


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


@pytest.mark.parametrize(("seconds", "levels"), [(0.0007, [(150,), (600,)]), (0.3, [(20,)])])
def test_a_step_takes_all_coarse_points_or_one_slow_point(monkeypatch, seconds, levels):
    """The time passes with the points alone."""
    now, computed = 0.0, []
    monkeypatch.setattr(progressive_sweep.time, "perf_counter", lambda: now)

    def compute(one, where):
        nonlocal now
        computed.append(where[-1].stop - where[-1].start)
        now += computed[-1] * seconds
        one.known[np.ix_(*(o[w] for o, w in zip(one._orders, where, strict=True)))] = True

    monkeypatch.setattr(ProgressiveSweep, "_compute", compute)
    values = np.linspace(-60, 12, *levels[-1])
    one = ProgressiveSweep(wb.paper.system(), {"eta": values}, levels)
    times, known = zip(*((now, int(one.known.sum())) for _ in one.steps(0.25)), strict=True)
    assert known[-1] == values.size
    if len(levels) > 1:
        assert known[0] == 150
        assert len(known) < 9
    else:
        assert max(computed) <= 4  # before it is known how slow they are
        assert np.all(np.diff(times) <= 0.31)


# Keys


def edits(state: PageState, name: str) -> list[PageState]:
    """The state with other values of a parameter, inside its range."""
    axis = parameter_axis(state, name)
    low, high = axis.ends
    return [state.edited(**{name: axis.rounded(low + part * (high - low))}) for part in (0.3, 0.6)]


def check_key(key, state: PageState, names) -> None:
    """It is that of any value of some parameters, and another one of any other parameter."""
    here = key(state)
    hash(here)
    assert all(key(other) == here for name in names for other in edits(state, name))
    taken = {SETTERS[name].target if name in SETTERS else name for name in names}
    for name in axes(state.system):
        if (SETTERS[name].target if name in SETTERS else name) not in taken:
            assert any(key(other) != here for other in edits(state, name)), (names, name)


@pytest.mark.parametrize(
    ("brake", "friction"),
    [*((brake, "coulomb") for brake in BRAKES), ("wedge", "smoothed"), ("wedge", "tabulated")],
)
def test_the_key_of_the_diagram(brake, friction):
    for name in axes(state_of(brake, friction).system):
        state = state_of(brake, friction).edited(axis=name)
        check_key(diagram.key, state, [name])
        key, axis = diagram.key(state), parameter_axis(state, name)
        narrower = {name: (axis.low, axis.rounded(0.5 * sum(axis.ends)))}
        for changed in (
            {"periods": 30}, {"initial_angle": 0.01}, {"axis": "eta" if name == "f" else "f"},
            {"release": False}, {"spans": narrower},
        ):  # fmt: skip
            assert diagram.key(state.edited(**changed)) != key, (name, changed)
        assert diagram.key(state.edited(quantity="angle", comparison=True, shown=30)) == key


def test_the_keys_of_maps():
    state = state_of()
    for pair in (("eta", "F0"), ("alpha", "kinetic"), ("f", "slope")):
        # Ranges reach to the present value, which another parameter may move; not if they are set.
        found = [parameter_axis(state, name) for name in pair]
        spans = {one.name: (one.low, one.high) for one in found}
        check_key(regimes.key, state.edited(across=pair[0], up=pair[1], spans=spans), pair)
    # That of the basins is not the start.
    check_key(basins.key, state, [])
    start = state.edited(initial_angle=0.05, initial_velocity=1.0)
    assert basins.key(start) == basins.key(state)


def test_the_key_of_the_stability_is_what_it_shows():
    state, other = state_of(), state_of("leading-shoe")
    key = stability.key(state)
    assert stability.key(state.edited(eta=-3.0, alpha=1.4, F0=0.05)) == key
    assert stability.key(state.edited(kinetic=0.2)) != key
    assert stability.key(state.edited(static=0.35)) != key
    assert stability.key(other.edited(kinetic=0.2)) == stability.key(other)
    assert stability.key(other.edited(friction_arm=0.05)) != stability.key(other)
    with pytest.raises(InputError, match="eta"):
        stability.key(state.edited(damping=0.0))


def test_static_friction_follows_as_on_the_page():
    system = wb.paper.system()  # states static = 0.3
    assert following(system) == system
    assert following(system).replace(kinetic=0.5).friction.static == 0.5
    apart = wb.paper.system(static=0.33)
    assert following(apart) is apart


# Numbers


def last(steps):
    *_, picture = steps
    return picture


@pytest.mark.parametrize("name", ["eta", "stiffness"])
def test_the_diagram_is_that_of_a_bifurcation(few, name):
    state = state_of().edited(axis=name)
    pictures = list(diagram.work(state))
    known = [one.known.size for one in pictures]
    assert (known[0], known[-1]) == (10, 20)
    assert all(a < b for a, b in pairwise(known))
    assert pictures[0].band.size == 20
    assert pictures[0].progress
    picture = pictures[-1]
    assert not picture.progress
    values = picture.axes[0].values(20)
    truth = wb.bifurcation(following(state.system), **{name: values}, **evaluation_settings(state))
    codes = motion_codes(truth).to_numpy()
    np.testing.assert_array_equal(picture.codes, codes)
    np.testing.assert_array_equal(picture.band, codes)
    for quantity, cloud in picture.clouds.items():
        for index, (code, row) in enumerate(zip(codes, truth[quantity].values, strict=True)):
            drawn = cloud.points[cloud.index == index]
            if code in PERIODIC:
                gap = np.abs(row[:, None] - drawn).min(axis=1).max()
                assert gap < 1e-3 * max(np.ptp(truth[quantity].values), 1e-9)
                assert drawn.size < row.size
            elif not without_result(code) and drawn.size > 1:
                np.testing.assert_array_equal(drawn, row)


@pytest.mark.parametrize(("across", "up"), [("eta", "F0"), ("stiffness", "damping")])
def test_the_regimes_are_those_of_a_map(few, across, up):
    state = state_of().edited(across=across, up=up)
    picture = last(regimes.work(state))
    x, y = picture.axes
    assert x.log == y.log == (across == "stiffness")
    truth = wb.regime_map(
        following(state.system),
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


def test_the_limit_of_the_regimes_ends_where_the_brake_locks(few):
    spans = {"kinetic": (0.25, 0.345), "slope": (-0.5, 0.12)}
    state = state_of(eta=-0.05).edited(angle=0.3, across="kinetic", up="slope", spans=spans)
    (line,) = last(regimes.work(state)).data.limit
    assert 0.29 < line[:, 0].max() < np.tan(0.3)


def test_cells_not_known_yet_are_as_the_nearest():
    known = np.zeros((8, 16), dtype=bool)
    values = np.zeros((8, 16), dtype=np.int64)
    known[2, 3], known[6, 12] = True, True
    values[2, 3], values[6, 12] = 5, 7
    shown = nearest_known(values, known)
    assert (shown[0, 0], shown[7, 15]) == (5, 7)
    assert set(shown.ravel()) == {5, 7}


@pytest.mark.parametrize("brake", BRAKES)
def test_the_stability_is_that_of_a_stability_map(brake):
    state = state_of(brake)
    (picture,) = stability.work(state)
    (x, y), (rows, columns) = picture.axes, picture.data.codes.shape
    truth = wb.stability_map(state.system, **{y.name: y.values(rows), x.name: x.values(columns)})
    codes = picture.data.codes
    np.testing.assert_array_equal(picture.data.margin, truth["margin"].to_numpy())
    np.testing.assert_array_equal(codes == LOCKED, truth["locked"].to_numpy())
    slides = codes < HELD
    np.testing.assert_array_equal((codes == STABLE)[slides], truth["stable"].to_numpy()[slides])


def test_a_wedge_that_holds_itself_at_rest_alone():
    (picture,) = stability.work(state_of(static=0.33))
    alpha = picture.axes[1].values(picture.data.codes.shape[0])
    held = (picture.data.codes == HELD).all(axis=1)
    np.testing.assert_array_equal(held, (alpha > 1.0) & (alpha <= 1.1))


def test_the_basins_are_those_of_wb_basins(few):
    state = state_of(**TWO_BASINS)
    picture = last(basins.work(state))
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
    picture = last(diagram.work(state_of().edited(**changes)))
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


def test_a_parameter_beside_the_one_that_it_sets_is_refused():
    state = state_of().edited(across="eta", up="slope")
    with pytest.raises(InputError, match="both swept"):
        next(regimes.work(state))


@pytest.mark.parametrize(
    ("friction", "method"), [("tabulated", "exact"), ("smoothed", "smooth"), ("smoothed", "ode14x")]
)
def test_other_friction_laws_and_methods(few, monkeypatch, friction, method):
    """The first picture of each; of slow methods with as few periods as possible."""
    monkeypatch.setattr(plots, "COARSE_POINTS", 2)
    monkeypatch.setattr(plots, "COARSE_MAP", (4, 4))
    monkeypatch.setitem(evaluation_settings.__globals__["_LONGEST"], method, 20)
    state = state_of(friction=friction, eta=-6.0).edited(periods=20, method=method)
    assert next(diagram.work(state)).known.size > 0
    assert method == "ode14x" or next(regimes.work(state)).known > 0


# Axes and figures, without a browser


def test_values_are_rounded_to_four_digits_of_the_range():
    axis = ParameterAxis("eta", -60.0, 12.0)
    assert axis.rounded(-31.23456) == -31.23
    assert str(axis.rounded(-1e-9)) == "0.0"
    assert axis.rounded(99.0) == 12.0
    assert ParameterAxis("F0", 0.01, 0.12).rounded(0.0360449) == 0.036
    assert ParameterAxis("stiffness", 1e3, 1e5, log=True).rounded(3.87654321) == 7526.0


def test_ticks_are_round_and_inside():
    assert list(ParameterAxis("eta", -60.0, 12.0).ticks(8)) == [*range(-60, 20, 10)]
    log = ParameterAxis("k", 1e3, 1e5, log=True)
    assert list(log.ticks(8).values()) == ["1000", "2000", "5000", "10⁴", "2·10⁴", "5·10⁴", "10⁵"]
    for low, high in ((1010.0, 1090.0), (1e-6, 1e12)):
        assert 2 <= len(ParameterAxis("k", low, high, log=True).ticks(8)) <= 9


@pytest.mark.parametrize("brake", ["wedge", "leading-shoe"])
def test_plots_show_mark_and_pick(few, brake):
    state = state_of(brake)
    for plot in map(DrawnPlot, PLOTS):
        picture = next(iter(plot.computed.work(state)))
        plot.show(picture)
        plot.mark(state)
        drawn = plot.figure
        sources = [one.data_source for one in drawn.renderers if hasattr(one, "data_source")]
        assert sum(any(map(len, one.data.values())) for one in sources) >= 3
        inside = [0.5 * (one.start + one.end) for one in (drawn.x_range, drawn.y_range)]
        changes = plot.pick(state, *inside)
        assert len(changes) == (1 if plot.name == "diagram" else 2)
        assert state.edited(**changes)
        assert plot.pick(state, drawn.x_range.start - 1.0, inside[1]) == {}
        assert all("$" not in label for _, label in (one.css for one in picture.legend))
        plot.say("Nothing to see.")
        assert not any(len(one.data["image"]) for one in sources if "image" in one.data)
        plot.show(picture)

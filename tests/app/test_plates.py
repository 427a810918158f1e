"""Pictures over parameters: their numbers are those of wb.sweep, their keys say what they need."""

import json
from itertools import pairwise, product

import numpy as np
import pytest

import wedgebrake as wb
from wedgebrake.errors import InputError
from wedgebrake.explorer.core import (
    basins,
    cells,
    diagram,
    legend,
    progressive_sweep,
    regimes,
    stability,
)
from wedgebrake.explorer.core.axis import Axis
from wedgebrake.explorer.core.evaluation import judging
from wedgebrake.explorer.core.machine import following
from wedgebrake.explorer.core.progressive_sweep import Filling, order
from wedgebrake.explorer.core.state import PLATES, Desk, axes, new_desk
from wedgebrake.explorer.ui.plots import new_plate
from wedgebrake.figures.matplotlib import class_styles
from wedgebrake.model.groups import SETTERS

BRAKES = ("wedge", "conventional", "band", "leading-shoe")
FRICTIONS = ("coulomb", "smoothed", "tabulated")
# Three motions, of which two repeat themselves.
TWO_BASINS = {"eta": -47.86, "f": 0.63, "F0": 0.06135, "alpha": 1.0961}


def desk_of(brake: str = "wedge", friction: str = "coulomb", **values: float) -> Desk:
    return new_desk(wb.paper.system(**values)).edited(brake=brake, friction=friction)


@pytest.fixture
def few(monkeypatch):
    """Pictures of few points."""
    monkeypatch.setattr(diagram, "COARSE_POINTS", 10)
    monkeypatch.setattr(diagram, "FINE_POINTS", 20)
    monkeypatch.setattr(cells, "COARSE_MAP", (8, 4))
    monkeypatch.setattr(cells, "FINE_MAP", (16, 8))


# The order of points


@pytest.mark.parametrize(("count", "levels"), [(600, (150, 600)), (24, (6, 12, 24)), (150, (150,))])
def test_every_level_is_evenly_spaced_and_part_of_the_next(count, levels):
    places = order(count, levels)
    assert sorted(places) == list(range(count))
    for level in levels:
        steps = np.diff(np.sort(places[:level]))
        assert np.all(steps == count // level)


def test_a_level_spreads_from_the_beginning():
    places = order(150, (150,))
    for known in (9, 20, 40):
        gaps = np.diff([0, *np.sort(places[:known]), 150])
        assert gaps.max() <= 2.1 * 150 / known


# Filling


def test_the_points_are_those_of_a_sweep_bit_for_bit():
    system, values = wb.paper.system(), np.linspace(-60.0, 12.0, 16)
    one = Filling(system, {"eta": values}, [(4,), (16,)])
    for _ in one.steps():
        pass
    assert one.dataset().identical(wb.sweep(system, eta=values, threads=1))


def test_a_map_fills_with_the_points_of_a_sweep():
    system = wb.paper.system()
    grid = {"F0": np.linspace(0.02, 0.1, 8), "eta": np.linspace(-60.0, 12.0, 16)}
    one = Filling(system, grid, [(2, 4), (4, 8), (8, 16)], keep_points=False)
    levels = set()
    for _ in one.steps():
        levels.add(one.level)
    assert {(2, 4), (4, 8), (8, 16)} <= levels
    whole = wb.sweep(system, **grid, keep_points=False, threads=1)
    assert one.dataset().identical(whole)
    places, motion = one.complete("motion")
    assert motion.shape == (8, 16)
    assert [len(one) for one in places] == [8, 16]


class _Clock:
    """Time that passes with the points alone."""

    def __init__(self, monkeypatch, seconds):
        self.now, self.computed = 0.0, []
        monkeypatch.setattr(progressive_sweep.time, "perf_counter", lambda: self.now)

        def compute(one, where):
            count = where[-1].stop - where[-1].start
            self.now += count * seconds
            self.computed.append(count)
            one.known[np.ix_(*(o[w] for o, w in zip(one._orders, where, strict=True)))] = True

        monkeypatch.setattr(Filling, "_compute", compute)


def test_a_step_of_fast_points_takes_all_coarse_ones(monkeypatch):
    _Clock(monkeypatch, 0.0007)
    one = Filling(wb.paper.system(), {"eta": np.linspace(-60, 12, 600)}, [(150,), (600,)])
    known = [int(one.known.sum()) for _ in one.steps(0.25)]
    assert known[0] == 150
    assert known[-1] == 600
    assert len(known) < 9


def test_a_step_of_slow_points_is_one_of_them(monkeypatch):
    clock = _Clock(monkeypatch, 0.3)
    one = Filling(wb.paper.system(), {"eta": np.linspace(-60, 12, 20)}, [(20,)])
    times = [clock.now for _ in one.steps(0.25)]
    assert max(clock.computed) == progressive_sweep._PROBE  # before it is known how slow they are
    assert np.all(np.diff(times) <= 0.31)
    assert int(one.known.sum()) == 20


# Keys


def edits(desk: Desk, name: str) -> list[Desk]:
    """The desk with other values of a parameter, inside its span."""
    axis = Axis.of(desk, name)
    low, high = axis.ends
    return [desk.edited(**{name: axis.chosen(low + part * (high - low))}) for part in (0.3, 0.6)]


def others(desk: Desk, names) -> list[str]:
    """Parameters that none of the names sets."""
    taken = {SETTERS[name].target if name in SETTERS else name for name in names}
    return [
        name
        for name in axes(desk.system)
        if (SETTERS[name].target if name in SETTERS else name) not in taken
    ]


@pytest.mark.parametrize(("brake", "friction"), list(product(BRAKES, FRICTIONS)))
def test_the_key_of_the_diagram(brake, friction):
    for name in axes(desk_of(brake, friction).system):
        desk = desk_of(brake, friction).edited(axis=name)
        key = diagram.key(desk)
        hash(key)
        for other in edits(desk, name):
            assert diagram.key(other) == key, name
        for one in others(desk, [name]):
            assert any(diagram.key(other) != key for other in edits(desk, one)), (name, one)
        low, high = Axis.of(desk, name).ends
        narrower = {name: (Axis.of(desk, name).low, Axis.of(desk, name).chosen(0.5 * (low + high)))}
        for changed in (
            {"periods": 30}, {"initial_angle": 0.01}, {"axis": "eta" if name == "f" else "f"},
            {"release": False}, {"spans": narrower},
        ):  # fmt: skip
            assert diagram.key(desk.edited(**changed)) != key, (name, changed)
        assert diagram.key(desk.edited(quantity="angle", ghost=True, shown=30)) == key


def test_the_keys_of_the_maps():
    desk = desk_of()
    for pair in (("eta", "F0"), ("alpha", "kinetic"), ("f", "slope")):
        # Spans reach to the present value, which another parameter may move; not if they are set.
        spans = {name: (Axis.of(desk, name).low, Axis.of(desk, name).high) for name in pair}
        one = desk.edited(across=pair[0], up=pair[1], spans=spans)
        key = regimes.key(one)
        for name in pair:
            assert all(regimes.key(other) == key for other in edits(one, name)), (pair, name)
        for name in others(one, pair):
            assert any(regimes.key(other) != key for other in edits(one, name)), (pair, name)


def test_the_key_of_the_basins_is_not_the_start():
    desk = desk_of()
    key = basins.key(desk)
    assert basins.key(desk.edited(initial_angle=0.05, initial_velocity=1.0)) == key
    assert all(
        any(basins.key(other) != key for other in edits(desk, name)) for name in axes(desk.system)
    )


def test_the_key_of_the_stability_is_what_it_shows():
    desk = desk_of()
    key = stability.key(desk)
    assert stability.key(desk.edited(eta=-3.0, alpha=1.4, F0=0.05)) == key
    assert stability.key(desk.edited(kinetic=0.2)) != key
    assert stability.key(desk.edited(static=0.35)) != key
    other = desk_of("leading-shoe")
    assert stability.key(other.edited(kinetic=0.2)) == stability.key(other)
    assert stability.key(other.edited(friction_arm=0.05)) != stability.key(other)


def test_static_friction_follows_as_on_the_desk():
    system = wb.paper.system()  # states static = 0.3
    assert following(system) == system
    assert following(system).replace(kinetic=0.5).friction.static == 0.5
    apart = wb.paper.system(static=0.33)
    assert following(apart) is apart


# Numbers


def last(steps):
    pictures = list(steps)
    assert pictures
    return pictures[-1]


@pytest.mark.parametrize("name", ["eta", "f", "F0", "alpha", "kinetic", "stiffness"])
def test_the_diagram_is_that_of_a_bifurcation(few, name):
    desk = desk_of().edited(axis=name)
    picture = last(diagram.work(desk))
    values = picture.axis.values(20)
    truth = wb.bifurcation(following(desk.system), **{name: values}, **judging(desk))
    codes = class_styles.classes(truth).to_numpy()
    assert picture.known == picture.whole == 20
    np.testing.assert_array_equal(picture.codes, codes)
    np.testing.assert_array_equal(picture.strip, codes)
    for quantity in ("angle", "velocity"):
        for place, code, row in zip(picture.middles, codes, truth[quantity].values, strict=True):
            drawn = picture.points[quantity][picture.place == place]
            if code in class_styles.PERIODIC:
                gap = np.abs(row[:, None] - drawn).min(axis=1).max()
                assert gap < 1e-3 * max(np.ptp(truth[quantity].values), 1e-9)
                assert drawn.size < row.size
            elif not class_styles.without(codes[codes == code][:1])[0] and drawn.size > 1:
                np.testing.assert_array_equal(drawn, row)


def test_the_diagram_gives_whole_pictures_from_coarse_to_fine(few):
    known = [one.known for one in diagram.work(desk_of())]
    assert known[0] == 10
    assert known[-1] == 20
    assert all(a < b for a, b in pairwise(known))
    first = next(diagram.work(desk_of()))
    assert first.strip.size == 20
    assert first.progress == "10 of 20 values"


def test_many_points_are_thinned():
    codes = np.full(600, class_styles.UNDECIDED)
    points = np.random.default_rng(0).normal(size=(600, 51))
    kept = diagram._kept(codes, np.zeros(600, dtype=np.int32), points)
    assert 0.5 * diagram.MOST_DRAWN < kept.sum() <= diagram.MOST_DRAWN


def test_a_resonance_does_not_flatten_the_rest(few):
    picture = last(diagram.work(desk_of().edited(axis="f", spans={"f": (0.99, 1.3)})))
    outside = picture.outside["velocity"]
    low, high = picture.spans["velocity"]
    assert low < 0.0 < high
    assert outside == 0.0 or outside > max(-low, high)


def test_the_regimes_are_those_of_a_map(few):
    desk = desk_of()
    picture = last(regimes.work(desk))
    truth = wb.regime_map(
        following(desk.system), F0=picture.y.values(8), eta=picture.x.values(16), **judging(desk)
    )
    np.testing.assert_array_equal(picture.codes, class_styles.classes(truth).to_numpy())
    ((across, up),) = picture.limit
    # Forwards: -D = -(alpha - 1) mu_k, at the paper's alpha.
    assert across == pytest.approx([-0.054] * len(across), abs=0.02)
    assert np.ptp(up) > 0.0
    assert picture.progress == ""


def test_the_limit_of_the_regimes_ends_where_the_brake_locks(few):
    spans = {"kinetic": (0.25, 0.345), "slope": (-0.5, 0.12)}
    desk = desk_of(eta=-0.05).edited(angle=0.3, across="kinetic", up="slope", spans=spans)
    ((across, _),) = last(regimes.work(desk)).limit
    assert 0.29 < max(across) < np.tan(0.3)


def test_regimes_on_logarithmic_axes(few):
    desk = desk_of().edited(across="stiffness", up="damping")
    picture = last(regimes.work(desk))
    assert picture.x.log
    assert picture.y.log
    truth = wb.regime_map(
        desk.system, damping=picture.y.values(8), stiffness=picture.x.values(16), **judging(desk)
    )
    np.testing.assert_array_equal(picture.codes, class_styles.classes(truth).to_numpy())


def test_cells_not_known_yet_are_as_the_nearest():
    known = np.zeros((8, 16), dtype=bool)
    known[2, 3], known[6, 12] = True, True
    values = np.zeros((8, 16), dtype=np.int64)
    values[2, 3], values[6, 12] = 5, 7
    shown = cells.stand_in(values, known)
    assert shown[0, 0] == 5
    assert shown[7, 15] == 7
    assert set(shown.ravel()) == {5, 7}


@pytest.mark.parametrize("brake", BRAKES)
def test_the_stability_is_that_of_a_stability_map(brake):
    desk = desk_of(brake)
    (picture,) = stability.work(desk)
    rows, columns = picture.codes.shape
    truth = wb.stability_map(
        desk.system,
        **{picture.y.name: picture.y.values(rows), picture.x.name: picture.x.values(columns)},
    )
    np.testing.assert_array_equal(picture.margin, truth["margin"].to_numpy())
    np.testing.assert_array_equal(picture.codes == stability.LOCKED, truth["locked"].to_numpy())
    slides = picture.codes < stability.HELD
    np.testing.assert_array_equal(
        (picture.codes == stability.STABLE)[slides], truth["stable"].to_numpy()[slides]
    )


def test_a_wedge_that_holds_itself_at_rest_alone():
    (picture,) = stability.work(desk_of(static=0.33))
    alpha = picture.y.values(picture.codes.shape[0])
    held = (picture.codes == stability.HELD).all(axis=1)
    np.testing.assert_array_equal(held, (alpha > 1.0) & (alpha <= 1.1))


def test_the_basins_are_those_of_wb_basins(few):
    desk = desk_of(**TWO_BASINS)
    picture = last(basins.work(desk))
    truth = wb.basins(
        desk.system, initial_velocity=picture.y.values(8), initial_angle=picture.x.values(16),
        **judging(desk),
    )  # fmt: skip
    assert truth.sizes["attractor_id"] > 1
    given = truth["attractor"].to_numpy()
    # The same partition; the numbers of equally large basins may differ.
    pairs = set(zip(given.ravel().tolist(), picture.codes.ravel().tolist(), strict=True))
    assert len(pairs) == len(np.unique(given)) == len(np.unique(picture.codes))
    assert picture.codes.max() <= len(basins.TABLE)
    colour, orbit = picture.orbits[0]
    assert colour == class_styles.ATTRACTORS[0]
    assert orbit.shape[1] == 2


# Machines and spans that are hard


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"release": False, "spans": {"eta": (-60.0, -40.0)}}, "diverged"),
        ({"alpha": 0.9, "initial_velocity": 20.0}, "self_locked"),
        ({"alpha": 0.9}, "at_rest"),
    ],
)
def test_pictures_of_machines_that_do_not_move_on(few, changes, name):
    picture = last(diagram.work(desk_of().edited(**changes)))
    code = list(class_styles.MOTIONS).index(name)
    assert code in picture.codes
    if name == "diverged":
        assert set(picture.codes) == {code}
        assert picture.place.size == 0
        assert picture.gaps == [pytest.approx(picture.axis.ends)] * len(picture.gaps)
    assert all(np.isfinite(one) for one in picture.spans["velocity"])
    assert np.all(np.isfinite(picture.points["velocity"]))


def test_values_that_are_no_machine_are_shown_as_such(few):
    picture = last(diagram.work(desk_of(static=0.33).edited(axis="kinetic")))
    invalid = list(class_styles.MOTIONS).index("invalid")
    assert invalid in picture.codes
    assert np.all(picture.middles[picture.codes == invalid] > 0.33)
    assert picture.gaps


def test_without_damping_there_is_no_eta(few):
    desk = desk_of().edited(damping=0.0)
    assert diagram.parameter(desk) in axes(desk.system)
    assert set(regimes.parameters(desk)) <= set(axes(desk.system))
    assert next(diagram.work(desk)).known
    with pytest.raises(InputError, match="eta: not defined"):
        stability.key(desk)


def test_a_parameter_beside_the_one_that_it_sets_is_refused():
    desk = desk_of().edited(across="eta", up="slope")
    with pytest.raises(InputError, match="both swept"):
        next(regimes.work(desk))


@pytest.mark.parametrize("friction", ["smoothed", "tabulated"])
def test_other_friction_laws(few, friction):
    desk = desk_of(friction=friction, eta=-6.0).edited(periods=40)
    assert next(diagram.work(desk)).known > 0
    assert next(regimes.work(desk)).known > 0


def test_a_slow_method_begins_with_few_points(few):
    desk = desk_of(friction="smoothed", eta=-6.0).edited(periods=20, method="ode14x")
    assert next(diagram.work(desk)).known >= 1


# Axes


def test_values_are_chosen_to_four_digits_of_the_span():
    axis = Axis("eta", -60.0, 12.0)
    assert axis.chosen(-31.23456) == -31.23
    assert axis.chosen(-1e-9) == 0.0
    assert str(axis.chosen(-1e-9)) == "0.0"
    assert axis.chosen(99.0) == 12.0
    assert Axis("F0", 0.01, 0.12).chosen(0.0360449) == 0.036
    assert Axis("stiffness", 1e3, 1e5, log=True).chosen(3.87654321) == 7526.0


def test_ticks_are_round_and_inside():
    assert list(Axis("eta", -60.0, 12.0).ticks(8)) == [-60, -50, -40, -30, -20, -10, 0, 10]
    log = Axis("k", 1e3, 1e5, log=True)
    assert list(log.ticks(8).values()) == ["1000", "2000", "5000", "10⁴", "2·10⁴", "5·10⁴", "10⁵"]
    narrow = Axis("k", 1010.0, 1090.0, log=True)
    assert 2 <= len(narrow.ticks(8)) <= 9
    wide = Axis("k", 1e-6, 1e12, log=True)
    assert 2 <= len(wide.ticks(8)) <= 9


def test_words_of_axes_are_plain():
    desk = desk_of()
    for name in (*axes(desk.system), "initial_angle", "initial_velocity"):
        title = Axis.of(desk, name).title
        assert title
        assert not set("<>&$;") & set(title), title


def test_chips_are_plain_and_dark_enough_on_white():
    for look in class_styles.MOTION_LOOKS:
        assert "$" not in legend.words(look)
        assert legend.ink(look).startswith("#")
    assert legend.ink(class_styles.MOTIONS["chaotic"]) == class_styles.MOTIONS["chaotic"].colour
    assert (
        legend.ink(class_styles.MOTIONS["quasi_periodic"])
        != class_styles.MOTIONS["quasi_periodic"].colour
    )


# Figures, without a browser


@pytest.mark.parametrize("brake", ["wedge", "leading-shoe"])
def test_plates_show_mark_and_pick(few, brake):
    desk = desk_of(brake)
    for plate in map(new_plate, PLATES):
        hash(plate.key(desk))
        picture = next(iter(plate.work(desk)))
        plate.show(picture)
        plate.mark(desk)
        drawn = plate.figure
        inside = [0.5 * (one.start + one.end) for one in (drawn.x_range, drawn.y_range)]
        changes = plate.pick(desk, *inside)
        assert len(changes) == (1 if plate.name == "diagram" else 2)
        assert desk.edited(**changes)
        assert plate.pick(desk, drawn.x_range.start - 1.0, inside[1]) == {}
        assert all(len(chip) == 2 for chip in plate.legend(picture))
        assert isinstance(plate.progress(picture), str)
        plate.say("Nothing to see.")
        plate.show(picture)


def test_the_atlas_tells_its_controls():
    from wedgebrake.explorer.ui.widgets.tabs import Atlas

    atlas = Atlas(lambda _: None)
    desk = desk_of()
    for plate, roles in (
        ("diagram", ["axis"]), ("regimes", ["across", "up"]), ("stability", ["across", "up"]),
        ("basins", ["across", "up"]),
    ):  # fmt: skip
        atlas.legend([("#FFFFFF", "one")])
        atlas.show(desk.edited(plate=plate))
        assert atlas.tab == plate
        assert atlas._foot.state["chips"] == [] or plate == "diagram"
        controls = json.loads(atlas._head.state)["controls"]
        assert [one["role"] for one in controls] == roles
        assert all(one["low"] < one["high"] for one in controls)
        named = {name for one in controls for name, *_ in one["choices"]}
        assert named == (set(axes(desk.system)) if plate in ("diagram", "regimes") else set())
    atlas.show(desk.edited(damping=0.0, plate="stability"))

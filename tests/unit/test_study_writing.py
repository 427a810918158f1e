"""Studies as text: read from what was uploaded, written and read back to the last bit."""

from __future__ import annotations

import math
import os
import tomllib
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import wedgebrake as wb
from wedgebrake.model.study import Run, parse_study, schema
from wedgebrake.model.sweep_settings import Sweep, swept_values

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))
PAPER = next(path for path in EXAMPLES if path.name == "paper.toml").read_text(encoding="utf-8")


def bits(value: Any) -> Any:
    """A value that equals another one only bit for bit: 0.0 is not -0.0."""
    if isinstance(value, list | tuple):
        return [bits(one) for one in value]
    return value.hex() if isinstance(value, float) else value


def anatomy(study: wb.Study) -> dict[str, Any]:
    """All of a study: values to the last bit, and the one default that depends on others."""
    parts = {name: getattr(study.system, name) for name in study.system.as_dict()}
    found: dict[str, Any] = {
        name: (type(part), {key: bits(value) for key, value in dict(part).items()})
        for name, part in {**parts, "run": study.run}.items()
    }
    found["static follows"] = "static" not in study.system.friction.model_fields_set
    found["axes"] = [
        (name, bits(values) if isinstance(values, tuple) else bits(list(dict(values).items())))
        for name, values in study.sweep.axes
    ]
    found["sweep"] = study.sweep.arguments()
    return found


def positive(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers of all sizes between two powers of ten."""
    spread = st.floats(math.log10(low), math.log10(high)).map(lambda x: 10.0**x)
    return spread.map(lambda x: min(max(x, low), high))


def not_tiny(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers of the machine: those below 1e-50 in magnitude, other than 0, are refused."""
    return st.floats(low, high).filter(lambda x: x == 0.0 or abs(x) >= 1e-50)


coefficients = not_tiny(0.0, 5.0)
signed = not_tiny(-1e6, 1e6)


@st.composite
def frictions(draw: st.DrawFn) -> wb.CoulombFriction | wb.TabulatedFriction | wb.SmoothedFriction:
    kinetic = draw(coefficients)
    given = {"kinetic": kinetic}
    if draw(st.booleans()):
        given["static"] = draw(not_tiny(kinetic, 5.0))
    kind = draw(st.sampled_from(("coulomb", "tabulated", "smoothed")))
    if kind == "coulomb":
        return wb.CoulombFriction(**given)
    if kind == "smoothed":
        return wb.SmoothedFriction(
            **given,
            **draw(st.just({}) | st.fixed_dictionaries({"decay": positive(1e-9, 1e9)})),
            **draw(st.just({}) | st.fixed_dictionaries({"steepness": positive(1e-9, 1e9)})),
        )
    ascending = st.lists(positive(1e-6, 1e6), max_size=6, unique=True).map(sorted)
    speeds = (0.0, *draw(ascending.filter(lambda x: all(a + 1e-6 < b for a, b in pairwise(x)))))
    others = draw(st.lists(coefficients, min_size=len(speeds) - 1, max_size=len(speeds) - 1))
    table = {"speeds": speeds, "coefficients": (kinetic, *others)}
    static = {"static": given["static"]} if "static" in given else {}
    return wb.TabulatedFriction(**table, **static)


@st.composite
def brakes(draw: st.DrawFn) -> wb.Brake:
    length = positive(1e-9, 1e3)
    kinds = {
        wb.ConventionalBrake: {},
        wb.WedgeBrake: {"angle": st.floats(1e-6, 1.57)},
        wb.BandBrake: {"wrap_angle": positive(1e-3, 100.0)},
        wb.LeadingShoeBrake: {
            "actuation_arm": length,
            "normal_arm": length,
            "friction_arm": st.just(0.0) | length,
        },
    }
    assert set(kinds) == {kind for kind in wb.Brake.kinds.values() if is_ours(kind)}
    kind = draw(st.sampled_from(list(kinds)))
    return kind(radius=draw(length), **{key: draw(value) for key, value in kinds[kind].items()})


def is_ours(kind: type) -> bool:
    """Other tests make brakes of their own."""
    return kind.__module__.startswith("wedgebrake.")


@st.composite
def systems(draw: st.DrawFn) -> wb.BrakedDriveline:
    optional = {
        "drive_speed": draw(st.none() | signed),
        "slope": draw(st.none() | signed),
        "release": draw(st.none() | st.booleans()),
    }
    chosen = {name: value for name, value in optional.items() if value is not None}
    drive = {name: chosen.pop(name) for name in ("drive_speed",) if name in chosen}
    system = wb.BrakedDriveline(
        driveline=wb.Driveline(
            inertia=draw(positive(1e-12, 1e12)),
            damping=draw(st.just(0.0) | positive(1e-12, 1e12)),
            stiffness=draw(st.just(0.0) | positive(1e-12, 1e15)),
            **drive,
        ),
        brake=draw(brakes()),
        friction=draw(frictions()),
        actuation=wb.Actuation(initial_force=draw(st.just(0.0) | positive(1e-12, 1e12)), **chosen),
        excitation=wb.HarmonicTorque(
            amplitude=draw(st.just(0.0) | positive(1e-6, 1e15)), frequency=draw(positive(1e-9, 1e9))
        ),
    )
    for name, values in (
        ("eta", signed),
        ("f", positive(1e-3, 1e3)),
        ("F0", positive(1e-6, 1e6)),
        ("alpha", positive(1e-3, 1e3)),
        ("slope", signed),
        ("damping", positive(1e-3, 1e3)),
    ):
        if draw(st.booleans()):
            try:
                system = system.replace(**{name: draw(values)})
            except wb.InputError:
                continue  # not defined, or out of range
    return system


runs = st.fixed_dictionaries(
    {},
    optional={
        "initial": st.tuples(signed, signed),
        "start_time": st.floats(0.0, 1e12),
        "method": st.sampled_from((None, "exact", "smooth", "ode14x")),
        "samples_per_period": st.integers(1, 50_000_000),
        "rtol": positive(1e-13, 1e-2),
        "step": positive(1e-9, 1.0),
        "max_events": st.integers(1, 1_000_000_000_000),
        "max_steps": st.integers(1, 1_000_000_000_000),
    },
)
lengths = st.sampled_from(({}, {"duration": 0.0}, {"duration": 1 / 3}, {"periods": 7}))


@st.composite
def spans(draw: st.DrawFn) -> dict[str, Any]:
    low, high = draw(st.lists(positive(1e-6, 1e6), min_size=2, max_size=2, unique=True))
    scale = draw(st.sampled_from(({}, {"scale": "linear"}, {"scale": "log"})))
    return {"from": low, "to": high, "points": draw(st.integers(2, 10_000_000)), **scale}


@st.composite
def sweeps(draw: st.DrawFn) -> Sweep:
    names = draw(st.lists(st.sampled_from(("damping", "radius", "eta", "f")), unique=True))
    listed = st.lists(signed, min_size=1, max_size=4)
    axes = tuple((name, swept_values(draw(spans() | listed), name)) for name in names)
    options = {
        "periods": st.integers(1, 5_000_000),
        "transient": st.just("auto") | st.integers(0, 4_999_999),
        "limit": st.integers(1, 5_000_000),
        "keep_points": st.booleans(),
        "follow": st.sampled_from(names or [None]),
    }
    return Sweep(axes=axes, **draw(st.fixed_dictionaries({}, optional=options)))


@st.composite
def studies(draw: st.DrawFn) -> wb.Study:
    run = Run(**draw(runs), **draw(lengths))
    return wb.Study(draw(systems()), run, draw(sweeps()))


class TestRoundTrip:
    @given(studies())
    @settings(max_examples=60, deadline=None)
    def test_of_any_study(self, study):
        text = study.to_toml()
        read = wb.read_study(text)
        assert read == study
        assert anatomy(read) == anatomy(study)
        # Groups stand there only where they are exact; those that do come back as they were.
        stated = tomllib.loads(text).get("groups", {})
        assert bits(list(read.system.stated.items())) == bits(list(stated.items()))
        assert stated.items() <= study.system.stated.items()
        # Once in the form of a file, it stays as it is.
        assert read.to_toml() == text
        jsonschema.validate(tomllib.loads(text), schema())

    @pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
    def test_of_the_examples(self, path, tmp_path):
        study = wb.load_study(path)
        assert wb.save_study(study, tmp_path / "study.toml") == tmp_path / "study.toml"
        read = wb.load_study(tmp_path / "study.toml")
        assert read == study
        assert anatomy(read) == anatomy(study)
        assert read.system.stated == study.system.stated
        assert read.system.groups == study.system.groups
        written, given = (tomllib.loads(text) for text in (study.to_toml(), path.read_text()))
        assert written == given

    def test_a_default_stays_one(self):
        """Static friction that followed the kinetic one still does."""
        read = wb.read_study(wb.read_study(PAPER).to_toml())
        assert read.changed(kinetic=0.4).system.friction.static == 0.4

    def test_a_group_that_would_give_another_value_is_left_out(self):
        """The slope moves by a bit, and eta, as computed from it, does not."""
        found = None
        for i in range(200):
            system = wb.paper.system(eta=-0.3 - i)
            slope = math.nextafter(system.actuation.slope, 0.0)
            moved = system.replace(slope=slope)
            if "eta" in moved.stated:
                found = wb.Study(moved, Run())
                break
        assert found is not None
        text = found.to_toml()
        tables = tomllib.loads(text)
        assert set(tables["groups"]) == {"f", "F0", "alpha"}
        assert tables["actuation"]["slope"] == slope
        assert wb.read_study(text) == found

    def test_the_sign_of_zero(self):
        system = wb.paper.system(eta=0.0)
        for study in (
            wb.Study(system.replace(slope=-0.0), Run()),
            wb.Study(system.replace(eta=-0.0), Run(initial=(-0.0, 0.0))),
        ):
            assert anatomy(wb.read_study(study.to_toml())) == anatomy(study)


class TestText:
    def test_units_stand_beside_values(self):
        lines = wb.read_study(PAPER).changed(friction=TABLE).to_toml().splitlines()
        assert "inertia = 1.0        # kg m^2" in lines
        assert "speeds = [0.0, 0.1]        # m/s" in lines

    def test_a_kind_is_any_text(self):
        kind = 'a "quoted" \\ kind\n\x7fµ\U0001f600'

        class Odd(wb.Brake):
            """A brake that a plug-in brings."""

            kind: ClassVar[str] = 'a "quoted" \\ kind\n\x7fµ\U0001f600'
            words: str = "none"
            on: bool = True
            law = staticmethod(wb.ConventionalBrake.law)

        try:
            study = wb.Study(wb.paper.system().replace(brake=Odd(radius=0.1, words="1\t2")), Run())
            read = wb.read_study(study.to_toml())
            assert read.system.brake == study.system.brake
            assert tomllib.loads(study.to_toml())["brake"]["kind"] == kind
        finally:
            del wb.Brake.kinds[kind]


TABLE = wb.TabulatedFriction(speeds=(0.0, 0.1), coefficients=(0.3, 0.2))


class TestRefusals:
    def test_parts_without_a_kind(self):
        class Mine(wb.Brake):
            """A brake of one's own."""

            law = staticmethod(wb.ConventionalBrake.law)

        study = wb.Study(wb.paper.system().replace(brake=Mine(radius=0.1)), Run())
        with pytest.raises(wb.InputError, match=r"^brake = Mine: has no kind"):
            study.to_toml()
        custom = wb.CustomFriction(law=lambda v: 0.3 * v / (1.0 + abs(v)), width=0.1)
        study = wb.Study(wb.paper.system().replace(friction=custom), Run())
        with pytest.raises(wb.InputError, match=r"^friction = CustomFriction: has no kind"):
            study.to_toml()

    def test_values_that_are_no_text(self):
        class Odd(wb.Brake):
            """A brake with what no file holds."""

            kind: ClassVar[str] = "odd"
            given: Any = None
            law = staticmethod(wb.ConventionalBrake.law)

        try:
            for value, why in (
                (object(), r"^brake.given = <object.*: cannot stand in a study file"),
                (math.inf, r"^brake.given = inf: cannot stand"),
                ({"a": [1, {"b": b""}]}, r"^brake.given.a.b = b'': cannot stand"),
                (("a", "b"), "would differ"),  # a list is read
            ):
                system = wb.paper.system().replace(brake=Odd(radius=0.1, given=value))
                with pytest.raises(wb.InputError, match=why):
                    wb.Study(system, Run()).to_toml()
        finally:
            del wb.Brake.kinds["odd"]

    def test_a_sweep_that_no_file_can_hold(self):
        system = wb.paper.system()
        study = wb.Study(system, Run(), Sweep(axes=(("zeta", (1.0,)),)))
        with pytest.raises(wb.InputError, match=r"cannot hold it. sweep.zeta: neither"):
            study.to_toml()
        many = tuple(float(i) for i in range(200_000))
        study = wb.Study(system, Run(), Sweep(axes=(("eta", many),)))
        with pytest.raises(wb.InputError, match=r"cannot hold it\. is larger than 1000000 bytes"):
            study.to_toml()


class TestSaving:
    STUDY: ClassVar[wb.Study] = wb.Study(wb.paper.system(), Run(periods=9))

    def test_replaces_what_was_there(self, tmp_path):
        path = tmp_path / "mine.toml"
        path.write_text("something else")
        wb.save_study(self.STUDY, str(path))
        assert path.read_text(encoding="utf-8") == self.STUDY.to_toml()
        assert os.listdir(tmp_path) == ["mine.toml"]  # noqa: PTH208 - names alone

    def test_whole_or_not_at_all(self, tmp_path, monkeypatch):
        path = tmp_path / "mine.toml"
        path.write_text("as it was")

        def refuse(*_: object) -> None:
            raise OSError(28, "No space left on device")

        monkeypatch.setattr(Path, "replace", refuse)
        with pytest.raises(wb.OutputError, match="no space left on device"):
            wb.save_study(self.STUDY, path)
        assert path.read_text() == "as it was"
        assert [one.name for one in tmp_path.iterdir()] == ["mine.toml"]

    @pytest.mark.parametrize("name", ["there/mine.toml", "a\0b.toml", "x" * 300])
    def test_that_cannot_be_written(self, name, tmp_path):
        with pytest.raises(wb.OutputError, match="cannot be written"):
            wb.save_study(self.STUDY, tmp_path / name)

    def test_a_folder_is_no_file(self, tmp_path):
        with pytest.raises(wb.OutputError, match="is a directory"):
            wb.save_study(self.STUDY, tmp_path)
        assert list(tmp_path.iterdir()) == []

    @pytest.mark.parametrize("path", [3, None, "", "."])
    def test_a_path_names_a_file(self, path):
        with pytest.raises(wb.InputError, match=r"^path = "):
            wb.save_study(self.STUDY, path)


class TestReading:
    @pytest.mark.parametrize("content", [PAPER, PAPER.encode(), "\ufeff" + PAPER])
    def test_is_the_same_as_of_a_file(self, content):
        assert wb.read_study(content) == parse_study(tomllib.loads(PAPER))

    @pytest.mark.parametrize(
        ("content", "why"),
        [
            ("", "study: is empty."),
            (b" \n", "study: is empty."),
            (b"\xff\xfe", "study: is not text"),
            ("\ud800", "study: is not text"),
            ("a" * 1_000_001, "study: is larger than 1000000 bytes"),
            ("µ" * 600_000, "study: is larger than 1000000 bytes"),
            ("x = ", "study: is not TOML"),
            ("a" + ".a" * 200 + " = 1", "study: is nested too deeply"),
            ("x = " + "[" * 100_000, "study: is nested too deeply"),
            ("x = 1", "study: x = 1: stands outside the tables"),
            (PAPER.replace("inertia = 1.0", "inertia = -1.0"), "study: driveline.inertia = -1.0:"),
        ],
    )
    def test_says_what_is_wrong(self, content, why):
        with pytest.raises(wb.InputError) as caught:
            wb.read_study(content)
        assert str(caught.value).startswith(why)
        assert len(str(caught.value)) < 500

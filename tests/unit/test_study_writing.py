"""Studies as text: read from what was uploaded, written and read back to the last bit."""

from __future__ import annotations

import math
import os
import tomllib
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic.fields import FieldInfo

import wedgebrake as wb
from schemas import DRIVELINES, VALIDATOR
from wedgebrake.model.friction import Friction
from wedgebrake.model.part import Part
from wedgebrake.model.studies.study import RunSettings, parse_study
from wedgebrake.model.studies.sweep_settings import Sweep, swept_values

PAPER = next(path for path in DRIVELINES if path.name == "paper.toml").read_text(encoding="utf-8")


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


# Numbers of the machine: those below 1e-50 in magnitude, other than 0, are refused.
signed = st.floats(-1e6, 1e6).filter(lambda x: x == 0.0 or abs(x) >= 1e-50)


def values(field: FieldInfo) -> st.SearchStrategy[Any]:
    """What a parameter may be, by its type and range."""
    if field.annotation is bool:
        return st.booleans()
    keys = ("ge", "gt", "le")
    bounds = {k: getattr(one, k) for one in field.metadata for k in keys if hasattr(one, k)}
    low, high = bounds.get("ge", bounds.get("gt")), bounds.get("le", 1.57)
    if field.annotation is int:
        return st.integers(1, high)
    if low < 0.0:
        return signed
    above = positive(max(low, 1e-12), high)
    return st.just(0.0) | above if "ge" in bounds and low == 0.0 else above


def given_values(model: type[Part], **special: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    """All that a part needs, and some of its other parameters."""
    required, optional = {}, {}
    for name, field in model.model_fields.items():
        if name in model.later:
            continue  # they exclude each other
        where = required if field.is_required() else optional
        where[name] = special[name] if name in special else values(field)
    return st.fixed_dictionaries(required, optional=optional)


def kinds_of(base: type[Part]) -> st.SearchStrategy[type[Part]]:
    """The kinds of the package; other tests make brakes of their own."""
    return st.sampled_from(
        [one for one in base.kinds.values() if one.__module__.startswith("wedgebrake.")]
    )


@st.composite
def frictions(draw: st.DrawFn) -> Friction:
    kind = draw(kinds_of(Friction))
    ascending = st.lists(positive(1e-6, 1e6), max_size=6, unique=True).map(sorted)
    speeds = (0.0, *draw(ascending.filter(lambda x: all(a + 1e-6 < b for a, b in pairwise(x)))))
    coefficients = st.lists(positive(1e-12, 5.0), min_size=len(speeds), max_size=len(speeds))
    chosen = draw(given_values(kind, speeds=st.just(speeds), coefficients=coefficients))
    if "static" in chosen:
        least = chosen["coefficients"][0] if "coefficients" in chosen else chosen["kinetic"]
        chosen["static"] = max(chosen["static"], least)
    return kind(**chosen)


@st.composite
def systems(draw: st.DrawFn) -> wb.BrakedDriveline:
    brake = draw(kinds_of(wb.Brake))
    models = {"driveline": wb.Driveline, "brake": brake, "actuation": wb.Actuation,
              "excitation": wb.HarmonicTorque}  # fmt: skip
    parts = {name: model(**draw(given_values(model))) for name, model in models.items()}
    system = wb.BrakedDriveline(friction=draw(frictions()), **parts)
    for name, changes in (
        ("eta", signed),
        ("f", positive(1e-3, 1e3)),
        ("F0", positive(1e-6, 1e6)),
        ("alpha", positive(1e-3, 1e3)),
        ("slope", signed),
        ("damping", positive(1e-3, 1e3)),
    ):
        if draw(st.booleans()):
            try:
                system = system.replace(**{name: draw(changes)})
            except wb.InputError:
                continue  # not defined, or out of range
    return system


nothing = st.none()
runs = given_values(
    RunSettings,
    duration=nothing,
    periods=nothing,
    until=st.sampled_from((None, "rest")),
    samples=nothing,
    samples_per_period=nothing | st.integers(1, 10**6),
    initial=st.tuples(signed, signed),
    method=st.sampled_from((None, "exact", "smooth")),
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
    run = RunSettings(**{**draw(runs), **draw(lengths)})
    return wb.Study(draw(systems()), run, draw(sweeps()))


class TestRoundTrip:
    @given(studies())
    @settings(max_examples=20, deadline=None)
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
        VALIDATOR.validate(tomllib.loads(text))

    @pytest.mark.parametrize("path", DRIVELINES, ids=lambda path: path.stem)
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
                found = wb.Study(moved, RunSettings())
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
            wb.Study(system.replace(slope=-0.0), RunSettings()),
            wb.Study(system.replace(eta=-0.0), RunSettings(initial=(-0.0, 0.0))),
        ):
            assert anatomy(wb.read_study(study.to_toml())) == anatomy(study)


class TestText:
    def test_a_kind_is_any_text(self):
        kind = 'a "quoted" \\ kind\n\x7fµ\U0001f600'

        class Odd(wb.Brake):
            """A brake that a plug-in brings."""

            kind: ClassVar[str] = 'a "quoted" \\ kind\n\x7fµ\U0001f600'
            words: str = "none"
            on: bool = True
            law = staticmethod(wb.ConventionalBrake.law)

        try:
            study = wb.Study(
                wb.paper.system().replace(brake=Odd(radius=0.1, words="1\t2")), RunSettings()
            )
            read = wb.read_study(study.to_toml())
            assert read.system.brake == study.system.brake
            assert tomllib.loads(study.to_toml())["brake"]["kind"] == kind
        finally:
            del wb.Brake.kinds[kind]


class TestRefusals:
    def test_parts_without_a_kind(self):
        class Mine(wb.Brake):
            """A brake of one's own."""

            law = staticmethod(wb.ConventionalBrake.law)

        study = wb.Study(wb.paper.system().replace(brake=Mine(radius=0.1)), RunSettings())
        with pytest.raises(wb.InputError, match=r"^brake = Mine: has no kind"):
            study.to_toml()
        custom = wb.CustomFriction(law=lambda v: 0.3 * v / (1.0 + abs(v)), width=0.1)
        study = wb.Study(wb.paper.system().replace(friction=custom), RunSettings())
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
                    wb.Study(system, RunSettings()).to_toml()
        finally:
            del wb.Brake.kinds["odd"]

    def test_a_sweep_that_no_file_can_hold(self):
        system = wb.paper.system()
        study = wb.Study(system, RunSettings(), Sweep(axes=(("zeta", (1.0,)),)))
        with pytest.raises(wb.InputError, match=r"cannot hold it. sweep.zeta: neither"):
            study.to_toml()
        many = tuple(float(i) for i in range(200_000))
        study = wb.Study(system, RunSettings(), Sweep(axes=(("eta", many),)))
        with pytest.raises(wb.InputError, match=r"cannot hold it\. is larger than 1000000 bytes"):
            study.to_toml()


class TestSaving:
    STUDY: ClassVar[wb.Study] = wb.Study(wb.paper.system(), RunSettings(periods=9))

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

    @pytest.mark.parametrize("name", ["there/mine.toml", "a\0b.toml", "x" * 300, "."])
    def test_that_cannot_be_written(self, name, tmp_path):
        with pytest.raises(wb.OutputError, match="cannot be written"):
            wb.save_study(self.STUDY, tmp_path / name)
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
            ("a" + ".a" * 200 + " = 1", "study: is nested too deeply"),
            (PAPER.replace("inertia = 1.0", "inertia = -1.0"), "study: driveline.inertia = -1.0:"),
        ],
    )
    def test_says_what_is_wrong(self, content, why):
        with pytest.raises(wb.InputError) as caught:
            wb.read_study(content)
        assert str(caught.value).startswith(why)
        assert len(str(caught.value)) < 500

"""Study files: the same machine as in Python, changed copies, and the schema."""

from __future__ import annotations

import inspect
import json
import math
import tomllib
from pathlib import Path
from typing import Any, ClassVar

import jsonschema
import numpy as np
import pytest

import wedgebrake as wb
from schemas import VALIDATOR
from wedgebrake.errors import nearest
from wedgebrake.model.studies.study import RunSettings, parse_study, schema
from wedgebrake.model.studies.sweep_settings import Sweep, sweepable
from wedgebrake.model.studies.tables import CHOSEN, FIXED
from wedgebrake.model.system import PARTS
from wedgebrake.model.validation import labels

PAPER = Path(__file__).parents[2] / "examples" / "paper.toml"
LINE = wb.Driveline(inertia=1.5, damping=0.1, stiffness=1e4, drive_speed=-0.7)
PULL = wb.Actuation(initial_force=1 / 3, slope=-40.0, release=False)
TORQUE = wb.HarmonicTorque(amplitude=1e-3, frequency=10.03)
BRAKES = {
    "wedge": wb.WedgeBrake(angle=0.34, radius=0.2),
    "conventional": wb.ConventionalBrake(radius=0.2),
    "band": wb.BandBrake(radius=0.2, wrap_angle=4.0),
    "leading-shoe": wb.LeadingShoeBrake(
        radius=0.2, actuation_arm=0.2, normal_arm=0.1, friction_arm=0.08
    ),
}
FRICTIONS = {
    "coulomb": wb.CoulombFriction(kinetic=0.3, static=0.33),
    "tabulated": wb.TabulatedFriction(speeds=(0.0, 0.1, 1.0), coefficients=(0.4, 0.35, 0.3)),
    "smoothed": wb.SmoothedFriction(kinetic=0.3, static=0.33, decay=5.0, steepness=1e3),
}
# Each kind once.
MACHINES = [("wedge", "coulomb"), ("conventional", "tabulated"), ("band", "smoothed"),
            ("leading-shoe", "coulomb")]  # fmt: skip


def system(brake: str = "wedge", friction: str = "coulomb") -> wb.BrakedDriveline:
    return wb.BrakedDriveline(
        driveline=LINE,
        brake=BRAKES[brake],
        friction=FRICTIONS[friction],
        actuation=PULL,
        excitation=TORQUE,
    )


@pytest.fixture
def study() -> wb.Study:
    return wb.load_study(PAPER)


class TestRoundTrip:
    @pytest.mark.parametrize(("brake", "friction"), MACHINES)
    def test_of_a_system(self, brake, friction):
        """As plain tables and back: equal in every bit; test_study_writing has the files."""
        given = system(brake, friction)
        tables = given.as_dict()
        assert (tables["brake"]["kind"], tables["friction"]["kind"]) == (brake, friction)
        read = parse_study(tables)
        assert (read.system, read.run) == (given, RunSettings())
        assert read.system.as_dict() == tables
        VALIDATOR.validate(tables)

    def test_of_a_run(self):
        run = {
            "duration": 2.5, "initial": [0.1, -0.2], "start_time": 0.3, "method": "exact",
            "samples_per_period": 50, "rtol": 1e-7, "max_events": 1000, "max_steps": 2000,
        }  # fmt: skip
        read = parse_study({**system().as_dict(), "run": run})
        assert read.arguments() == {**run, "initial": (0.1, -0.2)}

    def test_is_the_same_as_in_python(self, study):
        assert wb.load_study(str(PAPER)) == study
        assert study.system == wb.paper.system()
        assert study.system.groups == wb.paper.system().groups


class TestDefaults:
    def test_of_a_run(self):
        """Those of ``simulate``, and 250 periods."""
        assert parse_study(system().as_dict()).arguments() == {"periods": 250}
        assert wb.Study(system().machine).arguments() == {"duration": 10.0}
        defaults = {**wb.simulate.__kwdefaults__, "initial": (0.0, 0.0), "duration": None}
        assert dict(RunSettings()) == {name: defaults[name] for name in RunSettings.model_fields}
        assert set(defaults) - set(RunSettings.model_fields) == {"times"}

    def test_limits_are_those_of_simulate(self):
        """What a file may say, ``simulate`` takes."""
        right = {"rtol": (1e-13, 1e-2), "max_events": (1, 10**12)}
        wrong = {"rtol": (0.99e-13, 1.01e-2), "max_events": (0, 10**13)}
        for name, values in right.items():
            for value in values:
                wb.simulate(system(), duration=0.0, **{name: value})
                RunSettings(**{name: value})
        for name, values in wrong.items():
            for value in values:
                with pytest.raises(wb.InputError, match=name):
                    wb.simulate(system(), duration=0.0, **{name: value})
                with pytest.raises(wb.InputError, match=f"run.{name}"):
                    RunSettings(**{name: value})

    def test_of_a_system(self):
        tables = system().as_dict()
        del tables["driveline"]["drive_speed"], tables["friction"]["static"]
        del tables["actuation"]["slope"], tables["actuation"]["release"]
        read = parse_study(tables).system
        assert read.driveline.drive_speed == 0.0
        assert read.friction.static == 0.3
        assert (read.actuation.slope, read.actuation.release) == (0.0, True)


class TestGroups:
    SI = (("eta", "actuation", "slope"), ("f", "excitation", "frequency"),
          ("F0", "excitation", "amplitude"), ("alpha", "brake", "angle"))  # fmt: skip

    SETS: ClassVar[set[str]] = {name for _, _, name in SI}

    @pytest.mark.parametrize(("group", "table", "name"), SI)
    def test_each_stands_for_its_si_value(self, group, table, name):
        plain = system().replace(amplitude=500.0)
        tables = plain.as_dict()
        del tables[table][name]
        wanted = 0.7 * getattr(plain.groups, group)
        read = parse_study({**tables, "groups": {group: wanted}}).system
        assert getattr(read.groups, group) == wanted  # to the last bit
        assert read == plain.replace(**{group: wanted})
        assert read.as_dict()[table][name] != plain.as_dict()[table][name]

    def test_whole_numbers_and_none(self):
        tables = system().as_dict()
        assert parse_study({**tables, "groups": {}}).system == system()
        del tables["actuation"]["slope"]
        assert parse_study({**tables, "groups": {"eta": -24}}).system.groups.eta == -24.0

    @pytest.mark.parametrize(("group", "table", "name"), SI)
    def test_beside_the_si_value_is_refused(self, group, table, name):
        tables = {**system().as_dict(), "groups": {group: 1.0}}
        with pytest.raises(wb.InputError, match=rf"^groups.{group} and {table}.{name}: "):
            parse_study(tables)

    def test_the_tables_are_not_changed(self):
        tables = system().as_dict()
        del tables["actuation"]["slope"]
        tables["groups"] = {"eta": -24}
        before = json.dumps(tables)
        parse_study(tables)
        assert json.dumps(tables) == before


def swept(table: Any) -> Sweep:
    """The [sweep] table of the paper's study."""
    return parse_study({**tomllib.loads(PAPER.read_text()), "sweep": table}).sweep


class TestSweep:
    @pytest.mark.parametrize(
        ("given", "expected"),
        [
            ({"from": -60, "to": 12, "points": 400}, np.linspace(-60, 12, 400)),
            ({"from": 0.2, "to": 0.01, "points": 7, "scale": "log"}, np.geomspace(0.2, 0.01, 7)),
            ([0.3, 1, 0.2], np.array([0.3, 1.0, 0.2])),
        ],
    )
    def test_values(self, given, expected):
        sweep = swept({"initial_velocity": [1], "F0": given, "radius": [0.2]})
        assert np.array_equal(sweep.parameters()["F0"], expected)
        assert list(sweep.parameters()) == ["initial_velocity", "F0", "radius"]
        assert sweep.arguments() == swept({}).parameters() == {}

    def test_settings_are_arguments_of_sweep(self):
        settings = {
            "periods": 60, "transient": "auto", "limit": 500, "follow": "eta", "keep_points": False,
        }  # fmt: skip
        assert swept({**settings, "eta": [1.0, 2.0]}).arguments() == settings
        assert set(settings) <= set(inspect.signature(wb.sweep).parameters)
        assert swept({"transient": 0}).arguments() == {"transient": 0}

    @pytest.mark.parametrize(("brake", "friction"), MACHINES)
    def test_takes_the_names_that_sweep_takes(self, brake, friction):
        given = system(brake, friction)
        allowed = sweepable(given)
        tables = given.as_dict()
        table = {name: [0.5] for name in allowed if name not in TestGroups.SETS}
        assert list(parse_study({**tables, "sweep": table}).sweep.parameters()) == list(table)
        VALIDATOR.validate({**tables, "sweep": {name: [0.5] for name in allowed}})
        with pytest.raises(wb.InputError, match="Allowed: ") as caught:
            parse_study({**tables, "sweep": {"zzz": [1.0]}})
        told = set(str(caught.value).partition("Allowed: ")[2].rstrip(".").split(", "))
        assert told == set(allowed) | set(Sweep.model_fields) - {"axes"}

    @pytest.mark.parametrize(
        ("table", "named"),
        [
            ([{}], ["sweep = [{}]"]),
            ({"etta": [1]}, ["sweep.etta: ", "Did you mean 'eta'?"]),
            ({"transiant": 3}, ["sweep.transiant: ", "Did you mean 'transient'?"]),
            ({"release": [1]}, ["sweep.release: "]),
            ({"axes": [1]}, ["sweep.axes: "]),
            ({"self": [1]}, ["sweep.self: "]),
            ({"\x1b[1m": [1]}, ["sweep.'\\x1b[1m': "]),
            ({"wrap_angle": [1]}, ["sweep.wrap_angle: ", "'band'"]),
            ({"eta": "-60:12"}, ["sweep.eta = '-60:12': "]),
            ({"eta": []}, ["sweep.eta = []: "]),
            *(
                ({"eta": [1, one]}, [f"sweep.eta[1] = {str(one)[:9]}"])
                for one in (True, [1, 2], math.nan, 10**400)
            ),
            ({"eta": {}}, ["sweep.eta.from: missing", "eta.to: missing", "eta.points: missing"]),
            ({"eta": {"form": 1, "to": 2, "points": 3}}, ["sweep.eta.form: ", "'from'?"]),
            ({"eta": {"from": 1, "to": 1.0, "points": 3}}, ["sweep.eta.from = 1.0 and to = 1.0"]),
            (
                {"eta": {"from": 0, "to": 1, "points": 3, "scale": "log"}},
                ["sweep.eta.from = 0.0 and to = 1.0: "],
            ),
            (
                {"eta": {"from": "a", "to": math.inf, "points": 10**9, "scale": "lin"}},
                ["eta.from = 'a': ", "eta.to = inf: ", "points = 1000000000: ", "scale = 'lin': "],
            ),
            ({"eta": [1], "slope": [2], "periods": 0}, ["eta and sweep.slope: ", "periods = 0: "]),
            ({"eta": [1], "F0": [2], "follow": "F"}, ["sweep.follow = 'F': ", "'F0'?"]),
            *(
                ({"transient": one}, [f"sweep.transient = {one!r}: "])
                for one in (True, "Auto", -1, 1.5, [1])
            ),
            ({"limit": 2.5, "keep_points": 1, "follow": 3}, ["limit = ", "points = ", "follow = "]),
        ],
    )
    def test_wrongly(self, table, named):
        with pytest.raises(wb.InputError) as caught:
            swept(table)
        for name in named:
            assert name in str(caught.value)
        assert max(map(len, str(caught.value).split("\n"))) <= 400

    def test_of_a_thousand_mistakes_the_first_are_told(self):
        with pytest.raises(wb.InputError) as caught:
            swept({f"x{number}": number for number in range(1000)})
        assert 1 < len(str(caught.value).split("\n")) <= 10

    def test_extreme_ends_overflow_nowhere(self):
        for scale in ("linear", "log"):
            ends = {"from": 1e-300 if scale == "log" else -1e300, "to": 1e300}
            values = swept({"eta": {**ends, "points": 5, "scale": scale}}).parameters()["eta"]
            assert np.all(np.isfinite(values))
            assert np.all(np.diff(values) > 0.0)

    def test_changed(self, study):
        given = Sweep(axes=(("eta", (1.0, 2.0)),), periods=30)
        other = study.changed(sweep=given, limit=7, eta=-3)
        assert other.sweep == Sweep(axes=given.axes, periods=30, limit=7)
        assert other.system.groups.eta == -3.0
        # The periods are the run's, and the sweep survives other changes.
        assert other.changed(periods=5).sweep == other.sweep
        assert other.changed(periods=5).run.periods == 5
        assert study.sweep == Sweep()
        assert hash(other) != hash(study)


class TestChanged:
    def test_parameters_and_groups(self, study):
        other = study.changed(inertia=2.0, eta=-30, static=0.4)
        assert other.system == study.system.replace(inertia=2.0, eta=-30, static=0.4)
        assert other.run == study.run
        assert study.system.groups.eta == -24.0

    def test_whole_parts(self, study):
        brake = wb.ConventionalBrake(radius=0.3)
        assert study.changed(brake=brake).system.brake == brake

    def test_an_si_value_takes_the_place_of_a_group(self, study):
        other = study.changed(slope=-10.0).system
        assert other.actuation.slope == -10.0
        assert other.groups.eta == pytest.approx(-6.0)
        assert other.groups.f == 0.63

    def test_duration_and_periods_replace_each_other(self, study):
        assert study.run.duration == 25.0
        other = study.changed(periods=7)
        assert (other.run.duration, other.run.periods) == (None, 7)
        back = other.changed(duration=2)
        assert (back.run.duration, back.run.periods) == (2.0, None)
        with pytest.raises(wb.InputError, match=r"run.duration = 1.0 and run.periods = 2: "):
            study.changed(duration=1, periods=2)

    def test_other_settings_stay(self, study):
        other = study.changed(initial=(0.1, 0.2), rtol=1e-6).changed(periods=3)
        assert (other.run.initial, other.run.rtol) == ((0.1, 0.2), 1e-6)

    @pytest.mark.parametrize(
        ("changes", "named"),
        [
            ({"sweep": {"eta": [1]}}, "sweep = {'eta': "),
            ({"limit": 0}, "sweep.limit = 0: "),
            ({"transeint": 3}, "transeint: no such .*'transient'"),
            ({"self": 3}, "self: "),
            ({"inertai": 1.0}, "inertai: .*'inertia'"),
            ({"period": 3}, "period: .*'periods'"),
            ({"times": [1.0]}, "times: no such"),
            ({"wrap_angle": 3.0}, "wrap_angle: .* of a brake of kind 'band'"),
            ({"decay": 3.0}, "decay: .* of a friction of kind 'smoothed'"),
            ({"inertia": -1}, "driveline.inertia = -1: "),
            ({"periods": 2.0}, "run.periods = 2.0: "),
            ({"method": "exakt"}, "run.method = 'exakt': "),
            ({"eta": math.nan}, "groups.eta = nan: "),
            ({"eta": 10**400}, r"groups.eta = 1000+\.\.\.: "),
            ({"eta": "-3"}, "groups.eta = '-3': "),
            ({"eta": 1.0, "slope": 2.0}, "eta and slope: "),
            ({"brake": "band"}, "brake = 'band': "),
        ],
    )
    def test_wrongly(self, changes, named, study):
        with pytest.raises(wb.InputError, match=f"^{named}"):
            study.changed(**changes)

    def test_of_a_part_without_a_kind(self, study):
        class Pad(wb.Brake):
            @staticmethod
            def law(m, shape):  # noqa: ARG004 - the common signature
                return 2.0 * m

        other = study.changed(brake=Pad(radius=0.1))
        with pytest.raises(wb.InputError, match=r"angle: .* of kind 'wedge', .* of kind 'Pad'"):
            other.changed(angle=0.3)


class TestErrorsNameTheFile:
    def test_before_one_mistake_and_several(self, tmp_path):
        path = tmp_path / "mine.toml"
        text = PAPER.read_text().replace("inertia = 1.0", "inertia = -1.0")
        path.write_text(text)
        with pytest.raises(wb.InputError) as caught:
            wb.load_study(path)
        assert str(caught.value).startswith(f"{path}: driveline.inertia = -1.0: ")
        assert caught.value.__suppress_context__
        path.write_text(text.replace("duration = 25.0", "duration = -1"))
        with pytest.raises(wb.InputError) as caught:
            wb.load_study(path)
        first, *others = str(caught.value).split("\n")
        assert first == f"{path}:"
        named = [one.partition(": ")[0] for one in others]
        assert named == ["  driveline.inertia = -1.0", "  run.duration = -1"]


class TestSchema:
    def test_is_json_and_valid(self):
        assert json.loads(json.dumps(schema())) == schema()
        jsonschema.Draft202012Validator.check_schema(schema())

    def test_its_examples_are_right(self):
        """The example of each parameter is within its range."""
        shared = {"$defs": schema()["$defs"]}
        for table, node in schema()["properties"].items():
            node = node.get("items", node)
            for choice in node.get("oneOf", node.get("anyOf", [node])):
                for name, field in choice["properties"].items():
                    of_contact = table == "contact" and name in PARTS
                    if name != "kind" and table != "groups" and not of_contact:
                        assert {"description", "unit", "symbol", "example"} <= set(field), name
                        validator = jsonschema.Draft202012Validator(field | shared)
                        validator.validate(field["example"])
                        if field.get("default") is not None:
                            validator.validate(field["default"])


def test_every_symbol_leads_to_its_parameter():
    """Of each part, in Python and in a study file: what theory calls it is suggested by name."""
    kinds = [one for kinds in CHOSEN.values() for one in kinds.values()]
    found = {}
    for model in [*FIXED.values(), *kinds]:
        for name, field in model.model_fields.items():
            symbol = str(labels(field).get("symbol", "-"))
            if symbol != "-":
                found[symbol] = nearest(symbol, model.model_fields)
                assert f"Did you mean {name!r}" in found[symbol]
    assert {"J", "Omega", "mu_k", "F_a0", "T_e", "alpha_w"} <= set(found)


class TestBothKinds:
    """A brake on a driveline and a machine answer the same questions."""

    DRIVELINE = wb.paper.system()

    @pytest.mark.parametrize("system", [DRIVELINE, DRIVELINE.machine], ids=["driveline", "machine"])
    def test_hints_lead_to_names_that_can_be_changed(self, system):
        names = system.names()
        for wrong, right in (("brake.radius", "radius"), ("radius", "brake.radius")):
            if wrong not in names:
                assert right in system.hint(wrong, names)
                assert right in names
        assert "'slope'" in self.DRIVELINE.hint("slop", self.DRIVELINE.names())

    def test_a_parameter_of_another_kind_names_that_kind(self):
        assert "'band'" in self.DRIVELINE.hint("wrap_angle", self.DRIVELINE.names())

    def test_quantities_have_the_units_of_their_fields(self):
        driveline, machine = self.DRIVELINE.quantities(), self.DRIVELINE.machine.quantities()
        for one, other in (("radius", "brake.radius"), ("stiffness", "shaft.stiffness")):
            assert driveline[one] == machine[other]
        assert driveline["eta"].unit == "1"
        assert self.DRIVELINE.coords == {}
        assert self.DRIVELINE.machine.coords["contact"] == ("brake",)

    def test_groups_are_those_of_the_machine(self):
        """To the last bit, unless they were given; there are none of another machine."""
        machine = self.DRIVELINE.machine
        system = wb.BrakedDriveline(**self.DRIVELINE.parts())
        assert system.groups == machine.groups
        assert not machine.replace(torques=[]).groups.defined

    def test_values_and_signals(self):
        signals = self.DRIVELINE.replace(drive_speed=wb.Harmonic(1.0, 5.0))
        assert not signals.autonomous
        assert self.DRIVELINE.replace(amplitude=0.0).autonomous
        assert self.DRIVELINE.parameters()["slope"] == self.DRIVELINE.value("slope")
        assert {"kinetic", "stiffness"} <= self.DRIVELINE.parameters().keys()
        assert self.DRIVELINE.replace({"slope": -3.0}) == self.DRIVELINE.replace(slope=-3.0)

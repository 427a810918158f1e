"""Numbers with units in texts: parts, study files, sweeps and the command line."""

from __future__ import annotations

import itertools
import math
import re
import tomllib

import jsonschema
import numpy as np
import pytest

import wedgebrake as wb
from schemas import VALIDATOR
from wedgebrake.cli.assignments import parse_axes, parse_changes, parse_range
from wedgebrake.model.part import text_unit
from wedgebrake.model.studies.study import Study, parse_study
from wedgebrake.model.studies.study_run import RunSettings
from wedgebrake.model.units import ANY, UNITS, is_quantity, pattern, with_unit

DEGREE = math.pi / 180.0
# SI value of one unit, by other knowledge than the table's.
KNOWN = {
    ("rad", "deg"): DEGREE, ("rad", "turn"): 2.0 * math.pi,
    ("rad/s", "rpm"): 2.0 * math.pi / 60.0, ("Hz", "rpm"): 1.0 / 60.0,
    ("m/s", "km/h"): 1000.0 / 3600.0, ("s", "h"): 3600.0,
    ("N m/rad", "N m/deg"): 180.0 / math.pi, ("kg m^2", "g cm^2"): 1e-3 * 1e-2**2,
    ("kg/m^3", "g/cm^3"): 1e-3 / 1e-6, ("1", "%"): 0.01,
}  # fmt: skip


class TestTable:
    @pytest.mark.parametrize("si", UNITS)
    def test_every_unit_is_read_and_in_the_schema(self, si):
        words = pattern(si)
        for unit, factor in UNITS[si].items():
            for text in (f"2.5 {unit}", f" 25e-1 {unit} ", f"2.5{unit}"):
                if text[3] == "1":
                    continue  # 2.51/s is no 2.5 1/s
                assert is_quantity(text)
                assert with_unit("x", text, si) == 2.5 * factor
                assert re.search(words, text)
                assert re.search(ANY, text)

    @pytest.mark.parametrize(("si", "unit"), KNOWN)
    def test_known_values(self, si, unit):
        assert UNITS[si][unit] == pytest.approx(KNOWN[si, unit], rel=1e-15)

    @pytest.mark.parametrize("text", ["2 N m", "2 Nm", "2 N·m", "2 N*m", "2Nm"])
    def test_spellings(self, text):
        assert with_unit("x", text, "N m") == 2.0

    @pytest.mark.parametrize(
        ("text", "si", "value"),
        [("20°", "rad", 20.0 * DEGREE), ("20 °/s", "rad/s", 20.0 * DEGREE), ("3 µm", "m", 3e-6),
         ("3μs", "s", 3e-6)],
    )  # fmt: skip
    def test_signs(self, text, si, value):
        assert with_unit("x", text, si) == pytest.approx(value, rel=1e-15)
        assert re.search(pattern(si), text)
        assert re.search(ANY, text)

    @pytest.mark.parametrize("text", ["3 kg m²", "3 kg m^2", "3 kgm2", "3 kg·m²"])
    def test_powers(self, text):
        assert with_unit("x", text, "kg m^2") == 3.0

    @pytest.mark.parametrize(
        "given", ["hold", "2", "4e-2", "-.5E+3", "12", "rad", "", "two deg", 2.0, None, True, "-"]
    )
    def test_other_values_are_left_alone(self, given):
        assert with_unit("x", given, "rad") is given

    @pytest.mark.parametrize(
        ("text", "si"),
        [("5 Hz", "rad/s"), ("5 mm", "rad"), ("5 kN", "N m"), ("5 min", "Hz"), ("5 parsec", "m"),
         ("5 ms", "m"), ("5 %", "N")],
    )  # fmt: skip
    def test_other_quantities_are_refused(self, text, si):
        with pytest.raises(wb.InputError) as error:
            with_unit("part.field", text, si)
        assert (error.value.name, error.value.value) == ("part.field", text)
        assert all(unit in error.value.allowed for unit in UNITS[si])
        own = any(text.split()[1] in units for units in UNITS.values())
        assert ("not a unit" in str(error.value)) == (not own)


def brake(**values):
    return wb.WedgeBrake(**{"angle": "22 deg", "radius": "200 mm", **values})


class TestParts:
    def test_numbers(self):
        assert brake().angle == pytest.approx(math.radians(22.0), rel=1e-15)
        assert brake().radius == pytest.approx(0.2, rel=1e-15)
        assert wb.Inertia("a", "2 kg m^2", "90 deg", "600 rpm").speed == pytest.approx(
            20.0 * math.pi, rel=1e-15
        )
        assert wb.CoulombFriction(kinetic="30 %").kinetic == pytest.approx(0.3, rel=1e-15)
        assert wb.HarmonicTorque("0.5 kN m", "600 rpm").frequency == pytest.approx(10.0)

    def test_lists(self):
        friction = wb.TabulatedFriction(speeds=["0 m/s", "36 km/h"], coefficients=["40 %", 0.3])
        np.testing.assert_allclose(friction.speeds, [0.0, 10.0])
        np.testing.assert_allclose(friction.coefficients, [0.4, 0.3])
        limits = wb.Actuation(initial_force="2 kN", limits=["0 N", "3 kN"]).limits
        assert limits == (0.0, 3000.0)

    def test_signals_take_the_units_of_their_quantities(self):
        assert wb.Torque("disc", "2 kN m").signal == wb.Constant(2000.0)
        assert wb.Harmonic("2 kN m", "5 Hz", "90 deg").phase == pytest.approx(0.5 * math.pi)
        ramp = wb.Ramp("600 rpm", 0.0, "500 ms")
        assert (ramp.start, ramp.duration) == (pytest.approx(20.0 * math.pi), 0.5)
        assert wb.Table(["0 s", "1 min"], [0.0, "2 kN"]).times == (0.0, 60.0)
        assert wb.Orders("60 rpm", [[1, 1, 0]]).speed.value == pytest.approx(2.0 * math.pi)
        contact = wb.Contact(
            "disc", name="brake", brake=brake(), friction=wb.CoulombFriction(kinetic=0.3),
            actuation=wb.Actuation(initial_force="3 kN"), base_speed="60 rpm",
        )  # fmt: skip
        assert contact.base_speed == pytest.approx(2.0 * math.pi)

    def test_rows_have_a_unit_in_each_column(self):
        torque = wb.HarmonicTorque("0.5 kN m", 10.0, [[2, "30 %", "40 deg"], [3, 0.1, 0.2]])
        assert torque.orders[0] == (2.0, pytest.approx(0.3), pytest.approx(40.0 * DEGREE))
        assert torque.orders[1] == (3.0, 0.1, 0.2)
        orders = wb.Orders("60 rpm", [[1, "2 kN m", "90°"]]).orders
        assert orders == ((1.0, 2000.0, pytest.approx(0.5 * math.pi)),)
        run = RunSettings(initial=["1 deg", "60 rpm"])
        assert run.initial == (pytest.approx(DEGREE), pytest.approx(2.0 * math.pi))

    def test_damping_ratios_and_groups_take_percent(self):
        given = {"inertia": 1.0, "stiffness": 1e4}
        found = wb.Driveline(**given, damping_ratio="1 %")
        assert found == wb.Driveline(**given, damping_ratio=0.01)
        assert wb.paper.system(F0="5 %").groups.F0 == pytest.approx(0.05)

    @pytest.mark.parametrize(
        ("make", "unit"),
        [
            (lambda: brake(angle="20"), "deg"),
            (lambda: wb.CoulombFriction(kinetic="low"), "%"),
            (lambda: wb.Inertia("a", "heavy"), "kg m^2"),
            (lambda: wb.HarmonicTorque(1.0, 1.0, [[2, 0.3, "late"]]), "deg"),
            (lambda: wb.HarmonicTorque(1.0, 1.0, [[2, "small", 0.0]]), "%"),
        ],
    )
    def test_refusals_name_the_units_of_the_field(self, make, unit):
        with pytest.raises(wb.InputError) as error:
            make()
        assert unit in error.value.allowed
        assert unit in str(error.value)

    def test_changes(self):
        system = wb.paper.system().replace(angle="20 deg", frequency="300 rpm")
        assert system.brake.angle == pytest.approx(20.0 * DEGREE)
        assert system.excitation.frequency == pytest.approx(5.0)
        machine = system.machine.replace({"brake.angle": "10 deg", "driveline.speed": "30 rpm"})
        assert machine.contacts[0].brake.angle == pytest.approx(10.0 * DEGREE)
        assert machine.inertias[0].speed == pytest.approx(math.pi)

    @pytest.mark.parametrize(
        ("make", "name"),
        [
            (lambda: brake(angle="22 mm"), "brake.angle"),
            (lambda: wb.Inertia("a", "3 kg"), "a.inertia"),
            (lambda: wb.Harmonic(1.0, "5 s"), "signal.frequency"),
            (lambda: wb.Harmonic("5 s", 1.0), "signal.amplitude"),
            (lambda: wb.Actuation(initial_force=1.0, frequency="5 Hz"), "actuation.frequency"),
            (lambda: wb.Actuation(initial_force=1.0, limits=["0 N", "2 s"]), "actuation.limits[1]"),
            (lambda: brake(angle="22"), "brake.angle"),
            (lambda: brake(angle="100 deg"), "brake.angle"),
        ],
    )
    def test_errors_name_the_argument(self, make, name):
        with pytest.raises(wb.InputError) as error:
            make()
        assert error.value.name == name
        assert error.value.allowed

    def test_names_are_no_quantities(self):
        """Texts stay texts where a text is wanted."""
        assert text_unit(wb.Shaft, "name") is None
        assert text_unit(wb.Shaft, "stiffness") == "N m/rad"


STUDY = """
[driveline]
inertia = "1 kg m^2"
damping = "0.1 N m s/rad"
stiffness = "10 kN m/rad"
[brake]
kind = "wedge"
angle = "20 deg"
radius = "200 mm"
[friction]
kind = "coulomb"
kinetic = "30 %"
[actuation]
initial_force = "0.3 kN"
slope = -40.0
[excitation]
amplitude = "500 N m"
frequency = "600 rpm"
[run]
duration = "500 ms"
[sweep]
angle = { from = "10 deg", to = "20 deg", points = 3 }
slope = [-60.0, "-0.02 kN s/rad"]
"""


class TestStudies:
    def test_study_file(self):
        study = wb.read_study(STUDY)
        assert study.system.driveline.stiffness == 10_000.0
        assert study.run.duration == 0.5
        swept = study.sweep.parameters()
        np.testing.assert_allclose(swept["angle"], np.radians([10.0, 15.0, 20.0]), rtol=1e-15)
        np.testing.assert_allclose(swept["slope"], [-60.0, -20.0])

    def test_schema_accepts_it(self):
        VALIDATOR.validate(tomllib.loads(STUDY))

    @pytest.mark.parametrize(
        "line", ['angle = "20 mm"', 'angle = "20"', 'angle = "deg"', "angle = true"]
    )
    def test_schema_and_reader_refuse_the_same(self, line):
        text = STUDY.replace('angle = "20 deg"', line, 1)
        with pytest.raises(wb.InputError):
            wb.read_study(text)
        with pytest.raises(jsonschema.ValidationError):
            VALIDATOR.validate(tomllib.loads(text))

    def test_saved_in_si(self, tmp_path):
        study = wb.read_study(STUDY)
        path = wb.save_study(study, tmp_path / "study.toml")
        tables = tomllib.loads(path.read_text())
        flat = itertools.chain.from_iterable(table.values() for table in tables.values())
        assert not any(is_quantity(one) for one in flat)
        assert wb.load_study(path) == study

    def test_machine(self):
        study = parse_study(
            tomllib.loads('[[inertia]]\nname = "a"\ninertia = "1 kg m^2"\nspeed = "60 rpm"\n')
        )
        assert study.system.inertias[0].speed == pytest.approx(2.0 * math.pi)


class TestCommandLine:
    def test_set(self):
        system = wb.paper.system()
        changes = parse_changes(["angle=20 deg", "amplitude=0.3 kN m"], system)
        study = Study(system, RunSettings()).changed(**changes)
        assert study.system.brake.angle == pytest.approx(20.0 * DEGREE)
        assert study.system.excitation.amplitude == 300.0

    def test_over(self):
        system = wb.paper.system()
        (_, span), (_, listed) = parse_axes(
            ["angle=10 deg:20 deg:5", "frequency=5 Hz,600 rpm"], system
        )
        assert dict(span)["to"] == pytest.approx(20.0 * DEGREE)
        np.testing.assert_allclose(listed, [5.0, 10.0])

    def test_range(self):
        found = parse_range("--over", "angle=10 deg:20 deg", wb.paper.system())
        assert found.first == pytest.approx(10.0 * DEGREE)

    @pytest.mark.parametrize("text", ["angle=10 mm:20 mm:5", "angle=1 N,2 N", "eta=1 deg,2 deg"])
    def test_other_quantities_are_refused(self, text):
        with pytest.raises(wb.InputError):
            parse_axes([text], wb.paper.system())

    def test_sweep_in_python(self):
        found = wb.sweep(
            wb.paper.system(), frequency=["540 rpm", "10 Hz"], periods=4, transient=2
        )  # fmt: skip
        np.testing.assert_allclose(found.frequency, [9.0, 10.0])


class TestDampingRatio:
    def test_gives_the_damping(self):
        line = wb.Driveline(inertia=2.0, stiffness="8 kN m/rad", damping_ratio=0.05)
        assert line.damping == pytest.approx(2.0 * 0.05 * math.sqrt(2.0 * 8000.0), rel=1e-15)

    def test_is_the_ratio_of_the_eigenvalues(self):
        line = wb.Driveline(inertia=2.0, stiffness=8e3, damping_ratio=0.05)
        released = wb.BrakedDriveline(
            **{**wb.paper.system().parts(), "driveline": line,
               "actuation": wb.Actuation(initial_force=0.0)}
        )  # fmt: skip
        mode = wb.stability(released.machine).modes[0]
        assert mode.damping_ratio == pytest.approx(0.05, rel=1e-9)

    def test_in_a_study(self):
        text = STUDY.replace('damping = "0.1 N m s/rad"', "damping_ratio = 0.01")
        VALIDATOR.validate(tomllib.loads(text))
        assert wb.read_study(text).system.driveline.damping == pytest.approx(2.0)

    def test_is_changed_by_the_damping(self):
        """Elsewhere the name is that of a lag of second order."""
        system = wb.paper.system()
        lagged = {"initial_force": 300.0, "frequency": 200.0, "damping_ratio": 0.7}
        with_lag = system.replace(actuation=wb.Actuation(**lagged), damping_ratio=0.5)
        assert with_lag.actuation.damping_ratio == 0.5
        assert with_lag.driveline == system.driveline
        with pytest.raises(wb.InputError) as error:
            system.replace(damping_ratio=0.02)
        assert error.value.name == "damping_ratio"
        assert "damping" in str(error.value).split()
        for wrong in ("damping_ratio", "driveline.damping_ratio"):
            assert "damping" in system.hint(wrong, system.names()).split()

    @pytest.mark.parametrize(
        ("values", "name"),
        [
            ({"damping_ratio": -0.1}, "driveline.damping_ratio"),
            ({"damping_ratio": "much"}, "driveline.damping_ratio"),
            ({"damping_ratio": 0.1, "damping": 1.0}, "driveline.damping_ratio"),
            ({"damping_ratio": 0.1, "inertia": -1.0}, "driveline.inertia"),
            ({"damping_ratio": 0.1, "stiffness": "hard"}, "driveline.stiffness"),
            ({}, "driveline.damping"),
        ],
    )
    def test_bad_input(self, values, name):
        with pytest.raises(wb.InputError) as error:
            wb.Driveline(**{"inertia": 2.0, "stiffness": 8e3, **values})
        assert error.value.name == name

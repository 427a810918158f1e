"""Tables of friction: their factor, and points from CSV files."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

import wedgebrake as wb
from schemas import VALIDATOR

SPEEDS, COEFFICIENTS, STATIC = (0.0, 0.4, 2.0), (0.4, 0.33, 0.3), 0.45


def table(scale=1.0, factor=1.0):
    """A table with a factor, or with coefficients that have been multiplied by one."""
    return wb.TabulatedFriction(
        speeds=SPEEDS, coefficients=[factor * one for one in COEFFICIENTS],
        static=factor * STATIC, scale=scale,
    )  # fmt: skip


def system(friction):
    return wb.paper.system(eta=-24, f=0.63).replace(friction=friction)


class TestScale:
    def test_is_that_of_another_table(self):
        scaled, other = table(scale=0.8), table(factor=0.8)
        np.testing.assert_allclose(scaled.nodes(), other.nodes(), rtol=1e-15)
        assert scaled.breakaway == pytest.approx(other.breakaway, rel=1e-15)
        assert scaled.reference == pytest.approx(other.reference, rel=1e-15)
        groups = [system(one).groups.as_dict() for one in (scaled, other)]
        assert groups[0] == pytest.approx(groups[1], rel=1e-14)

    def test_response(self):
        """Of the closed forms of one inertia, and of the solver for machines."""
        first, second = (system(one) for one in (table(scale=0.8), table(factor=0.8)))
        for one, other in ((first, second), (first.machine, second.machine)):
            found, expected = (wb.simulate(each, 1.0) for each in (one, other))
            np.testing.assert_allclose(
                found.brake_torque, expected.brake_torque, rtol=1e-7, atol=1e-6
            )

    def test_stability(self):
        found, expected = (
            wb.stability(system(one)) for one in (table(scale=0.8), table(factor=0.8))
        )
        assert found.margin_slope == pytest.approx(expected.margin_slope, rel=1e-12)
        assert found.self_locking == expected.self_locking

    def test_sweep_is_that_of_rebuilt_systems(self):
        scales = [0.5, 0.8, 1.0, 1.3]
        short = {"periods": 40, "transient": 30}
        found = wb.sweep(system(table()), scale=scales, **short)
        assert found.scale.dims == ("scale",)
        for i, scale in enumerate(scales):
            one = wb.sweep(system(table(factor=scale)), slope=[system(table()).actuation.slope],
                           **short)  # fmt: skip
            for name in ("motion", "stick_class"):
                assert int(found[name][i]) == int(one[name][0])
            for name in ("peak_torque",):
                assert float(found[name][i]) == pytest.approx(float(one[name][0]), rel=1e-6)
        assert len(set(found.peak_torque.to_numpy())) == len(scales)

    def test_dotted_name(self):
        machine = system(table()).machine
        assert machine.parameters()["brake.scale"] == 1.0
        changed = machine.replace({"brake.scale": 0.7})
        assert changed.contacts[0].friction.nodes()[0][1] == pytest.approx(0.7 * 0.4)

    @pytest.mark.parametrize("scale", [-0.1, float("nan"), "more", 1e3])
    def test_bad_input(self, scale):
        with pytest.raises(wb.InputError) as error:
            table(scale=scale)
        assert error.value.name == "friction.scale"


STUDY = """
[driveline]
inertia = 1.0
damping = 0.1
stiffness = 10000.0
[brake]
kind = "wedge"
angle = 0.34
radius = 0.2
[friction]
kind = "tabulated"
file = "pad.csv"
columns = ["v", "mu"]
{more}
[actuation]
initial_force = 300.0
[excitation]
amplitude = 500.0
frequency = 10.0
"""
MACHINE = """
[[inertia]]
name = "disc"
inertia = 1.0
[[contact]]
a = "disc"
name = "brake"
[contact.brake]
kind = "conventional"
radius = 0.2
[contact.friction]
kind = "tabulated"
file = "pad.csv"
columns = ["v", "mu"]
{more}
[contact.actuation]
initial_force = 300.0
"""


@pytest.fixture
def load(tmp_path):
    def load(text, more="", content="v,mu\n0,0.4\n0.4,0.33\n2,0.3\n"):
        (tmp_path / "pad.csv").write_text(content)
        path = tmp_path / "study.toml"
        path.write_text(text.replace("{more}", more))
        VALIDATOR.validate(tomllib.loads(path.read_text()))
        return wb.load_study(path).system

    return load


class TestRecord:
    @pytest.mark.parametrize("text", [STUDY, MACHINE])
    def test_is_the_table(self, load, text):
        found = load(text, "static = 0.45\nscale = 1.1")
        friction = found.friction if text is STUDY else found.contacts[0].friction
        assert friction == table(scale=1.1)

    def test_units(self, load):
        content = "mu;v\n40;0\n33;1.44\n30;7.2\n"
        found = load(STUDY, 'units = ["km/h", "%"]', content).friction
        np.testing.assert_allclose(found.speeds, SPEEDS, rtol=1e-14)
        np.testing.assert_allclose(found.coefficients, COEFFICIENTS, rtol=1e-14)

    @pytest.mark.parametrize(
        ("more", "content"),
        [
            ("", "v,nu\n0,0.4\n"), ("", ""), ("", "v,mu\n0,\n"), ("", "v,mu\n1,0.4\n"),
        ],
    )  # fmt: skip
    def test_bad_input(self, load, more, content):
        with pytest.raises(wb.InputError) as error:
            load(STUDY, more, content)
        assert "friction" in str(error.value)

    def test_unknown_field_and_missing_file(self, tmp_path):
        path = tmp_path / "study.toml"
        for more in ("speeds = [0.0]", ""):
            path.write_text(STUDY.replace("{more}", more))
            with pytest.raises(wb.InputError):
                wb.load_study(path)

    def test_text_without_a_folder(self):
        with pytest.raises(wb.InputError):
            wb.read_study(STUDY.replace("{more}", ""))

    @pytest.mark.parametrize("of_machine", [False, True])
    def test_long_tables_are_saved_beside_the_study(self, tmp_path, of_machine):
        speeds = np.linspace(0.0, 10.0, 300)
        friction = wb.TabulatedFriction(
            speeds=speeds, coefficients=0.3 + 0.1 * np.exp(-speeds), scale=0.9
        )
        one = system(friction)
        study = wb.Study(one.machine, wb.read_study(MACHINE_RUN).run) if of_machine else wb.Study(
            one, wb.read_study(DRIVELINE_RUN).run
        )  # fmt: skip
        path = wb.save_study(study, tmp_path / "study.toml")
        assert len(list(tmp_path.glob("*.csv"))) == 1
        assert wb.load_study(path) == study


MACHINE_RUN = '[[inertia]]\nname = "a"\ninertia = 1.0\n'
DRIVELINE_RUN = STUDY.replace('file = "pad.csv"\ncolumns = ["v", "mu"]\n{more}',
                              "speeds = [0.0]\ncoefficients = [0.3]")  # fmt: skip

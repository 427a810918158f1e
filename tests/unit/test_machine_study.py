"""Study files of machines: read, written bit for bit, with records in CSV files."""

from __future__ import annotations

import json
import os
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wedgebrake as wb
from schemas import VALIDATOR
from wedgebrake.cli import examples
from wedgebrake.model.studies.study import Study, parse_study
from wedgebrake.model.studies.study_run import RunSettings
from wedgebrake.model.studies.sweep_settings import Sweep

FOLDER = Path(__file__).parents[2] / "examples"
NAMES = ["clutch", "driveline", "electronic_wedge", "recorded"]
DISC = """
[[inertia]]
name = "disc"
inertia = 1.0

[[contact]]
a = "disc"
name = "brake"
[contact.brake]
kind = "wedge"
angle = 0.34
radius = 0.2
[contact.friction]
kind = "coulomb"
kinetic = 0.3
[contact.actuation]
initial_force = 300.0

[[torque]]
on = "disc"
name = "engine"
[torque.signal]
kind = "table"
file = "torque.csv"
columns = ["t", "M"]
"""


def rich(**changes: Any) -> wb.Machine:
    """A machine with all kinds of parts and signals."""
    sine = wb.Harmonic(0.1 + 0.2, 3.0, 1.0 / 3.0)
    jump = wb.Table([0.0, 0.5, 0.5, 1.0], [0.1, 0.2, -0.0, 1e-7], periodic=True)
    common = {"brake": wb.BandBrake(radius=0.2, wrap_angle=2.0), "a": "disc"}
    return wb.Machine(
        inertias=[wb.Inertia("motor", 0.2, 0.1, -3.0), wb.Inertia("disc", 1.0 / 3.0)],
        shafts=[
            wb.Shaft("motor", "disc", 2e4, ratio=1.7, name="gear"),
            wb.Shaft("disc", "ground", 1e4, 0.3),
        ],
        contacts=[
            wb.Contact(
                name="brake", **common, friction=wb.CoulombFriction(kinetic=0.3),
                base_speed=wb.Ramp(80.0, 0.0, 4.0),
                actuation=wb.Actuation(
                    initial_force=300.0 * (1.0 + sine), slope=-4.0, sample_time=1e-3, delay=2,
                    resolution=0.5, frequency=200.0, damping_ratio=0.7, limits=(0.0, 900.0),
                ),
            ),
            wb.Contact(
                name="clutch", b="motor", **common,
                friction=wb.StribeckFriction(kinetic=0.2, static=0.3, speed=0.1),
                actuation=wb.Actuation(initial_force=wb.Constant(200.0), lag=0.02),
            ),
        ],
        torques=[
            wb.Torque("disc", wb.Orders(10.0 + sine, [(2.0, 50.0, 0.1)]), name="engine"),
            wb.Torque("motor", wb.HarmonicTorque(5.0, 2.0, orders=[(0.5, 0.2, 0.0)]) + jump),
            wb.Torque("motor", 3.0, name="load"),
        ],
    ).replace(changes)  # fmt: skip


def test_every_machine_is_read_back_bit_for_bit() -> None:
    sweep = Sweep(axes=(("brake.slope", (-3.0, 0.1)), ("gear.stiffness", (1e4, 2e4))))
    study = Study(rich(), RunSettings(duration=1.5, until="rest"), sweep)  # type: ignore[arg-type]
    text = study.to_toml()
    read = wb.read_study(text)
    assert read == study
    assert repr(read.system) == repr(study.system)  # tells 0.0 from -0.0
    assert read.to_toml() == text
    assert read.arguments() == {"duration": 1.5, "until": "rest"}
    VALIDATOR.validate(tomllib.loads(text))


def test_plain_tables_are_a_study() -> None:
    """As the attributes of a response hold them."""
    tables = json.loads(json.dumps(rich().as_dict()))
    assert parse_study(tables).system == rich()


def test_long_tables_become_records_beside_the_study(tmp_path: Path) -> None:
    times = np.linspace(0.0, 1.0, 1001)
    record = wb.Table(times, np.sin(7.0 * times) / 3.0, after="hold")
    system = rich(**{"load.signal": 2.0 * record, "brake.base_speed": record})
    study = Study(system, RunSettings())  # type: ignore[arg-type]
    path = wb.save_study(study, tmp_path / "mine.toml")
    assert sorted(one.name for one in tmp_path.iterdir()) == [
        "mine-brake.csv", "mine-load.csv", "mine.toml",
    ]  # fmt: skip
    assert wb.load_study(path) == study


@pytest.mark.parametrize("name", NAMES)
def test_examples(name: str, tmp_path: Path) -> None:
    study = wb.load_study(FOLDER / f"{name}.toml")
    assert isinstance(study.system, wb.Machine)
    VALIDATOR.validate(tomllib.loads((FOLDER / f"{name}.toml").read_text()))
    assert wb.read_study(study.to_toml()) == study
    assert wb.load_study(wb.save_study(study, tmp_path / "again.toml")) == study


def test_an_example_is_written_with_its_record(tmp_path: Path) -> None:
    path = examples.written("recorded", tmp_path / "mine.toml")
    assert wb.load_study(path) == wb.load_study(FOLDER / "recorded.toml")
    assert (tmp_path / "torque.csv").is_file()
    (tmp_path / "torque.csv").write_text("earlier work")
    with pytest.raises(wb.InputError):
        examples.written("recorded", tmp_path / "other.toml")
    assert (tmp_path / "torque.csv").read_text() == "earlier work"


def test_changed_by_dotted_names() -> None:
    study = wb.load_study(FOLDER / "clutch.toml")
    other = study.changed(**{"brake.slope": -4.0, "duration": 5.0, "drive.signals.0.amplitude": 7})
    assert other.system == study.system.replace(
        {"brake.slope": -4.0, "drive.signals.0.amplitude": 7.0}
    )
    assert other.run.duration == 5.0
    with pytest.raises(wb.InputError) as raised:
        study.changed(**{"brake.slop": 1.0})
    assert raised.value.name == "brake.slop"


def test_dotted_names_in_a_sweep_need_no_quotation_marks() -> None:
    text = wb.load_study(FOLDER / "clutch.toml").to_toml()
    plain = text + "\n[sweep]\nbrake.kinetic = [0.1, 0.2]\nload.inertia = [1, 2]\n"
    quoted = text + '\n[sweep]\n"brake.kinetic" = [0.1, 0.2]\n"load.inertia" = [1, 2]\n'
    spans = text + "\n[sweep]\nbrake.kinetic = { from = 1, to = 3, points = 3 }\n"
    assert wb.read_study(plain) == wb.read_study(quoted)
    assert wb.read_study(plain).sweep.parameters().keys() == {"brake.kinetic", "load.inertia"}
    assert wb.read_study(spans).sweep.parameters()["brake.kinetic"].tolist() == [1.0, 2.0, 3.0]


def test_a_braked_driveline_with_signals() -> None:
    study = wb.load_study(FOLDER / "paper.toml")
    system = study.system.replace(
        excitation=wb.Orders(wb.Ramp(1.0, 2.0, 3.0), [(2.0, 50.0, 0.0)]),
        drive_speed=wb.Ramp(8.0, 0.0, 4.0), initial_force=300.0 * (1.0 + wb.Harmonic(0.1, 3.0)),
        lag=0.01,
    )  # fmt: skip
    other = Study(system, study.run)
    text = other.to_toml()
    assert wb.read_study(text) == other
    VALIDATOR.validate(tomllib.loads(text))
    orders = study.system.replace(orders=[(2.0, 0.5, 0.0)])
    assert "kind" not in tomllib.loads(Study(orders, study.run).to_toml())["excitation"]
    assert wb.read_study(Study(orders, study.run).to_toml()).system == orders


@pytest.mark.parametrize(
    ("csv", "more", "times", "values"),
    [
        ("t,M\n0,1\n1,2.5\n", "", (0.0, 1.0), (1.0, 2.5)),
        ("M;x;t\n1;9;0\n\n2.5;9;1\n", "", (0.0, 1.0), (1.0, 2.5)),
        ("t , M\n0,1\n500,-2\n", 'units = ["ms", "kN m"]', (0.0, 0.5), (1e3, -2e3)),
        ("t,M\n0,1\n1,2\n", "scale = -2.0", (0.0, 1.0), (-2.0, -4.0)),
        ("\ufefft,M\n0,1\n0,2\n1,3\n", 'after = "zero"', (0.0, 0.0, 1.0), (1.0, 2.0, 3.0)),
    ],
)
def test_records(tmp_path: Path, csv: str, more: str, times: Any, values: Any) -> None:
    (tmp_path / "torque.csv").write_text(csv, encoding="utf-8")
    (tmp_path / "study.toml").write_text(DISC + more)
    signal = wb.load_study(tmp_path / "study.toml").system.torques[0].signal
    assert (signal.times, signal.values) == (times, values)
    assert signal.after == ("zero" if "zero" in more else "error")


@pytest.mark.parametrize(
    ("csv", "old", "new", "name", "value"),
    [
        ("t,M\n0,1\n1,nan\n", "", "", "engine.signal.file", "nan"),
        ("t,M\n0,1\n1,\n", "", "", "engine.signal.file", ""),
        ("t,M\n0,1\n1\n", "", "", "engine.signal.file", ""),
        ("t,M\n0,1\n1,inf\n", "", "", "engine.signal.file", "inf"),
        ("t,M\n0,one\n1,2\n", "", "", "engine.signal.file", "one"),
        ("t,M\n0,1_000\n1,2\n", "", "", "engine.signal.file", "1_000"),
        ("t,M\n0,\uff11\n1,2\n", "", "", "engine.signal.file", "\uff11"),
        ("t,M\n0,\u0663\n1,2\n", "", "", "engine.signal.file", "\u0663"),
        ("t,M\n0,1\n1,2\n", '["t", "M"]', '["t", "t"]', "engine.signal.columns", ...),
        ("", "", "", "engine.signal.file", ...),
        ("t,M\n0,1\n1,2\n", "torque.csv", "torqe.csv", "engine.signal.file", ...),
        ("t,M\n0,1\n1,2\n", '"M"', '"N"', "engine.signal.columns[1]", "N"),
        ("t,M\n1,1\n0,2\n", "", "", "engine.signal.times[1]", 0.0),
        ("t,M\n0,1\n0,2\n0,3\n1,4\n", "", "", "engine.signal.times[2]", 0.0),
        ("t,M\n0,1\n", "", "", "engine.signal.times", ...),
        ("t,M\n0,1\n1,2\n", "columns", 'units = ["s", "kNm"]\ncolumns', "engine.signal.units[1]",
         "kNm"),
        ("t,M\n0,1\n1,2\n", "columns", 'unit = "s"\ncolumns', "engine.signal.unit", "s"),
        ("t,M\n0,1\n1,2\n", "inertia = 1.0", "inertia = -1.0", "disc.inertia", -1.0),
        ("t,M\n0,1\n1,2\n", 'on = "disc"', 'on = "dics"', "engine.on", "dics"),
        ("t,M\n0,1\n1,2\n", "kinetic = 0.3", "kinetic = -1.0", "brake.kinetic", -1.0),
        ("t,M\n0,1\n1,2\n", '"wedge"', '"wege"', "brake.brake.kind", "wege"),
        ("t,M\n0,1\n1,2\n", "[contact.friction]", "[contact.frction]", "brake.friction", None),
        ("t,M\n0,1\n1,2\n", "[[torque]]", "[[torques]]", "torques", ...),
        ("t,M\n0,1\n1,2\n", "[[torque]]", "[brake]\n[[torque]]", "brake", {}),
        ("t,M\n0,1\n1,2\n", "[[torque]]", "[run]\nduration = -1\n[[torque]]", "run.duration", -1),
    ],
)  # fmt: skip
def test_wrong_studies(tmp_path: Path, csv: str, old: str, new: str, name: str, value: Any) -> None:
    (tmp_path / "torque.csv").write_text(csv, encoding="utf-8")
    (tmp_path / "study.toml").write_text(DISC.replace(old, new, 1) if old else DISC)
    with pytest.raises(wb.InputError) as raised:
        wb.load_study(tmp_path / "study.toml")
    assert raised.value.name == name
    assert value is ... or raised.value.value == value
    assert raised.value.allowed
    assert str(tmp_path / "study.toml") in str(raised.value)


def test_a_wrong_column_does_not_tell_what_another_file_contains(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(DISC.replace('"M"', '"torques"'))
    (tmp_path / "torque.csv").write_text("t,secret of another user\n0,1\n1,2\n")
    with pytest.raises(wb.InputError) as raised:
        wb.load_study(tmp_path / "study.toml")
    assert "secret" not in f"{raised.value} {raised.value.allowed} {raised.value.value}"
    (tmp_path / "torque.csv").write_text("t,torque\n0,1\n1,2\n")  # a slip is helped
    with pytest.raises(wb.InputError, match="Did you mean 'torque'"):
        wb.load_study(tmp_path / "study.toml")


def _pipe(path: Path) -> None:
    os.mkfifo(path)


def _device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def _large(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(500_000_001)  # a hole, which takes no room


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes on this system")
@pytest.mark.parametrize("make", [_pipe, _device, _large, Path.mkdir])
def test_records_are_regular_files_of_a_stated_size(tmp_path: Path, make: Any) -> None:
    """Others are refused before any of them is read: a pipe without a writer would block."""
    make(tmp_path / "torque.csv")
    (tmp_path / "study.toml").write_text(DISC)
    with pytest.raises(wb.InputError) as raised:
        wb.load_study(tmp_path / "study.toml")
    assert raised.value.name == "engine.signal.file"
    assert raised.value.allowed


def test_of_many_wrong_parts_the_first_few_are_reported() -> None:
    with pytest.raises(wb.InputError) as raised:
        wb.read_study("[[inertia]]\n" * 10_000)
    assert raised.value.name.startswith("inertia.")
    assert len(str(raised.value)) < 5_000


def test_the_text_of_a_study_has_no_folder_for_records() -> None:
    with pytest.raises(wb.InputError) as raised:
        wb.read_study(DISC)
    assert (raised.value.name, raised.value.value) == ("engine.signal.file", "torque.csv")


class TestOneRunTable:
    """The [run] table has the same settings for a machine and for a driveline."""

    def test_periods_of_a_machine(self) -> None:
        machine = wb.paper.system(eta=-6.0).machine
        read = wb.read_study(
            wb.Study(machine, RunSettings(periods=3, samples_per_period=20)).to_toml()
        )
        found = wb.simulate(machine, **read.arguments())
        assert float(found["time"][-1]) == pytest.approx(3.0 * machine.period, rel=1e-12)
        assert read.changed(duration=1.0).arguments() == {"duration": 1.0, "samples_per_period": 20}

    def test_a_driveline_until_rest(self) -> None:
        held = wb.paper.system(eta=-6.0).replace(amplitude=0.0)
        study = wb.Study(held, RunSettings(duration=50.0, until="rest", initial=(0.0, 1.0)))
        found = wb.simulate(held, **wb.read_study(study.to_toml()).arguments())
        assert found.attrs["at_rest"] == 1
        assert float(found["time"][-1]) < 50.0

    def test_settings_that_a_machine_does_not_have(self) -> None:
        text = wb.Study(wb.paper.system().machine).to_toml()
        with pytest.raises(wb.InputError, match=r"run\.initial = .*speed of an inertia"):
            wb.read_study(f"{text}\n[run]\ninitial = [0.0, 1.0]\n")
        with pytest.raises(wb.InputError, match=r"^eta: groups belong to"):
            wb.Study(wb.paper.system().machine).changed(eta=-3.0)

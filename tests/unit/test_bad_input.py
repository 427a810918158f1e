"""Wrong study files and arguments: what the user is told, and that nothing is left behind."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import wedgebrake as wb
from wedgebrake.cli.main import main
from wedgebrake.model.part import Part, parameter

PROGRAM = Path(sys.executable).parent / "wedgebrake"
PLAIN = """\
[driveline]
inertia = 1.0
damping = 0.1
stiffness = 10000.0

[brake]
kind = "conventional"
radius = 0.2

[friction]
kind = "coulomb"
kinetic = 0.30

[actuation]
initial_force = 300.0
slope = -40.0

[excitation]
amplitude = 500.0
frequency = 10.0

[run]
periods = 5
"""
GROUPED = """\
driveline = { inertia = 1.0, damping = 0.1, stiffness = 10000.0 }
brake = { kind = "wedge", radius = 0.2 }
friction = { kind = "coulomb", kinetic = 0.30 }
actuation = { initial_force = 300.0 }
[excitation]
[groups]
eta = -24.0
f = 0.63
F0 = 0.036
alpha = 1.18
"""

Result = tuple[int, str, str]
Run = Callable[..., Result]


@pytest.fixture
def run(monkeypatch, capsys, tmp_path) -> Run:
    """The command line in this process, in an empty folder: (status, output, messages)."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments: str) -> Result:
        monkeypatch.setattr(sys, "argv", ["wedgebrake", *arguments])
        with pytest.raises(SystemExit) as stop:
            main()
        return (stop.value.code or 0, *capsys.readouterr())

    return call


def changed(old: str, new: str, text: str = PLAIN) -> str:
    assert text.count(old) == 1, old
    return text.replace(old, new)


def in_run(line: str) -> str:
    return changed("periods = 5", line)


def in_groups(line: str) -> str:
    """The study with its line of the same group replaced."""
    name = line.split("=")[0].strip()
    kept = [one for one in GROUPED.splitlines() if one.split("=")[0].strip() != name]
    return "\n".join([*kept, line])


def table(speeds: str, coefficients: str) -> str:
    law = f'kind = "tabulated"\nspeeds = {speeds}\ncoefficients = {coefficients}'
    return changed('kind = "coulomb"\nkinetic = 0.30', law)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def check(result: Result, *words: str) -> None:
    status, output, message = result
    assert status == 2
    assert output == ""
    assert "Traceback" not in message
    assert "internal" not in message
    assert message.startswith(("error: ", "Usage: ", "Error: "))
    assert message.endswith("\n")
    lines = message.splitlines()
    assert 1 <= len(lines) <= 11
    assert max(map(len, lines)) <= 600
    assert all(line.isprintable() for line in lines)
    for word in words:
        assert word in message


HUGE = "1" + "0" * 400
ENDLESS = "1" + "0" * 5000

# What is wrong: (the study file, what the message must say).
FILES: dict[str, tuple[str | bytes, list[str]]] = {
    # Numbers.
    "text for a number": (
        changed("inertia = 1.0", 'inertia = "1.0 kg"'),
        ["driveline.inertia = '1.0 kg'", "a number", "without quotation marks or units", "kg m^2"],
    ),
    "negative": (
        changed("inertia = 1.0", "inertia = -1.0"),
        ["driveline.inertia = -1.0", "greater than 0", "moment of inertia", "for example 1.0"],
    ),
    "zero": (changed("inertia = 1.0", "inertia = 0"), ["driveline.inertia = 0:", "greater than 0"]),
    "bool for a number": (
        changed("inertia = 1.0", "inertia = true"),
        ["driveline.inertia = True", "must be a number"],
    ),
    "list for a number": (
        changed("inertia = 1.0", "inertia = [1.0]"),
        ["driveline.inertia = [1.0]", "must be a number"],
    ),
    "table for a number": (
        changed("inertia = 1.0", "inertia.value = 1.0"),
        ["driveline.inertia = {'value': 1.0}", "must be a number"],
    ),
    "date for a number": (
        changed("inertia = 1.0", "inertia = 2014-01-01"),
        ["driveline.inertia = ", "2014", "must be a number"],
    ),
    "nan": (changed("damping = 0.1", "damping = nan"), ["driveline.damping = nan", "finite"]),
    "infinite": (
        changed("stiffness = 10000.0", "stiffness = inf"),
        ["driveline.stiffness = inf", "finite"],
    ),
    "minus infinite": (
        changed("slope = -40.0", "slope = -inf"),
        ["actuation.slope = -inf", "finite"],
    ),
    "too large for a float": (
        changed("inertia = 1.0", f"inertia = {HUGE}"),
        ["driveline.inertia = 1000", "finite number", "1.8e308"],
    ),
    "too large for an integer": (
        changed("inertia = 1.0", f"inertia = {ENDLESS}"),
        ["is not TOML", "digits"],
    ),
    "absurdly large": (
        changed("stiffness = 10000.0", "stiffness = 1e300"),
        ["driveline.stiffness = 1e+300", "at most 1e+15"],
    ),
    "negative force": (
        changed("initial_force = 300.0", "initial_force = -300.0"),
        ["actuation.initial_force = -300.0", "at least 0", "in N"],
    ),
    "negative torque": (
        changed("amplitude = 500.0", "amplitude = -500.0"),
        ["excitation.amplitude = -500.0", "at least 0", "in N m"],
    ),
    "frequency zero": (
        changed("frequency = 10.0", "frequency = 0"),
        ["excitation.frequency = 0:", "at least 1e-09", "in Hz"],
    ),
    "number for a bool": (
        changed("slope = -40.0", "slope = -40.0\nrelease = 1"),
        ["actuation.release = 1:", "true or false"],
    ),
    "text for a bool": (
        changed("slope = -40.0", 'slope = -40.0\nrelease = "yes"'),
        ["actuation.release = 'yes'", "true or false", "without quotation marks"],
    ),
    # Units.
    "angle in degrees": (
        changed('"conventional"', '"wedge"\nangle = 19.5'),
        ["brake.angle = 19.5", "below 1.5708", "looks like degrees: write 0.340339", "in rad"],
    ),
    "wrap angle in degrees": (
        changed('"conventional"', '"band"\nwrap_angle = 230'),
        ["brake.wrap_angle = 230", "at most 100", "looks like degrees: write 4.01426"],
    ),
    "negative angle": (
        changed('"conventional"', '"wedge"\nangle = -0.3'),
        ["brake.angle = -0.3", "greater than 0"],
    ),
    "friction in percent": (
        changed("kinetic = 0.30", "kinetic = 30"),
        ["friction.kinetic = 30", "at most 5", "looks like percent: write 0.3"],
    ),
    "static below kinetic": (
        changed("kinetic = 0.30", "kinetic = 0.30\nstatic = 0.2"),
        ["friction.static = 0.2", "at least friction.kinetic = 0.3", "leave static out"],
    ),
    # Names.
    "unknown parameter": (
        changed("inertia = 1.0", "inertia = 1.0\ncolour = 2.0"),
        [
            "driveline.colour: no such parameter",
            "Allowed: damping, drive_speed, inertia, stiffness",
        ],
    ),
    "misspelt parameter": (
        changed("inertia = 1.0", "inertai = 1.0"),
        ["driveline.inertai: no such parameter", "Did you mean 'inertia'?", "inertia: missing"],
    ),
    "capital parameter": (
        changed("inertia = 1.0", "Inertia = 1.0"),
        ["driveline.Inertia", "Did you mean 'inertia'?"],
    ),
    "missing parameter": (
        changed("inertia = 1.0", ""),
        ["driveline.inertia: missing", "moment of inertia J in kg m^2, for example 1.0"],
    ),
    "unprintable name": (
        changed("inertia = 1.0", '"inertia\\u001b[31m" = 1.0'),
        ["driveline.'inertia\\x1b[31m': no such parameter", "'inertia'"],
    ),
    "empty name": (changed("inertia = 1.0", '"" = 1.0'), ["driveline.'': no such parameter"]),
    "thousands of unknown names": (
        changed("inertia = 1.0", "".join(f"k{i} = 1\n" for i in range(5000))),
        ["driveline.k0: no such parameter", "more."],
    ),
    "misspelt table": (
        changed("[driveline]", "[drivelin]"),
        ["[drivelin]: no such table", "'driveline'"],
    ),
    "capital table": (
        changed("[driveline]", "[Driveline]"),
        ["[Driveline]: no such table", "'driveline'"],
    ),
    "array of tables": (
        changed("[driveline]", "[[driveline]]"),
        ["driveline = [{'inertia'", "one table", "Write [driveline] on a line of its own"],
    ),
    "number for a table": (
        "driveline = 3\n" + changed("[driveline]", "[run.x]"),
        ["driveline = 3", "one table", "Write [driveline]"],
    ),
    "table inside a table": (
        changed("[driveline]", "[driveline]\n[driveline.sub]"),
        ["driveline.sub: no such parameter", "driveline.inertia: missing"],
    ),
    "parameter outside the tables": (
        "inertia = 1.0\n" + PLAIN,
        ["inertia = 1.0", "outside the tables", "[driveline]"],
    ),
    "missing table": (
        changed("[friction]", ""),
        ["is not TOML", "line 11", "'kind = \"coulomb\"'", "each name once"],
    ),
    "missing tables": (
        "[driveline]\ninertia = 1.0\n",
        ["missing: [brake], [friction], [actuation], [excitation]", "`wedgebrake example paper`"],
    ),
    # Kinds.
    "unknown brake": (
        changed('"conventional"', '"konventional"'),
        ["brake.kind = 'konventional'", "not known", "Did you mean 'conventional'?"],
    ),
    "brake by number": (
        changed('"conventional"', "3"),
        ["brake.kind = 3", "text", "'band', 'conventional', 'leading-shoe', 'wedge'"],
    ),
    "no kind of brake": (
        changed('kind = "conventional"', ""),
        ["brake.kind: missing", "'band', 'conventional', 'leading-shoe', 'wedge'"],
    ),
    "capital friction": (
        changed('"coulomb"', '"Coulomb"'),
        ["friction.kind = 'Coulomb'", "Did you mean 'coulomb'?"],
    ),
    "parameter of another kind": (
        changed('"conventional"', '"conventional"\nangle = 0.3'),
        ["brake.angle: no such parameter", "Allowed: radius"],
    ),
    "wedge without its angle": (
        changed('"conventional"', '"wedge"'),
        ["brake.angle: missing", "wedge angle in rad, for example 0.34"],
    ),
    "kind in a table without kinds": (
        changed("inertia = 1.0", 'inertia = 1.0\nkind = "rigid"'),
        ["driveline.kind: no such parameter"],
    ),
    # Tables of friction.
    "lists of different length": (
        table("[0, 1]", "[0.3]"),
        ["friction.coefficients", "1 values", "has 2", "one coefficient for each speed"],
    ),
    "empty lists": (
        table("[]", "[]"),
        ["friction.speeds = []", "at least 1", "for example [0.0, 0.1, 1.0]"],
    ),
    "speeds that descend": (
        table("[0, 2, 1]", "[0.3, 0.3, 0.3]"),
        ["friction.speeds", "ascend", "Sort"],
    ),
    "nan in a list": (
        table("[0, 1]", "[0.3, nan]"),
        ["friction.coefficients[1] = nan", "finite"],
    ),
    "bool in a list": (
        table("[0, true]", "[0.3, 0.3]"),
        ["friction.speeds[1] = True", "must be a number"],
    ),
    "negative friction": (
        table("[0, 1]", "[0.3, -0.3]"),
        ["friction.coefficients", "[0, 5]", "magnitudes"],
    ),
    "number for a list": (table("0", "[0.3]"), ["friction.speeds = 0", "a list of numbers"]),
    "list too long": (
        table(str(list(range(10_001))), str([0.3] * 10_001)),
        ["friction.speeds = [0, 1, 2", "at most 10000"],
    ),
    # Groups.
    "eta and slope": (
        changed("[run]", "[groups]\neta = -24.0\n[run]"),
        ["groups.eta and actuation.slope: both given", "eta sets slope", "Remove one"],
    ),
    "alpha and angle": (
        changed("radius = 0.2", "radius = 0.2, angle = 0.3", GROUPED),
        ["groups.alpha and brake.angle: both given", "Remove one"],
    ),
    "nan group": (in_groups("eta = nan"), ["groups.eta = nan", "finite"]),
    "infinite group": (in_groups("f = inf"), ["groups.f = inf", "finite"]),
    "group too large for a float": (in_groups(f"eta = {HUGE}"), ["groups.eta = 1000", "finite"]),
    "text for a group": (in_groups('eta = "-24"'), ["groups.eta = '-24'", "must be a number"]),
    "bool for a group": (in_groups("eta = true"), ["groups.eta = True", "must be a number"]),
    "list for a group": (in_groups("eta = [1]"), ["groups.eta = [1]", "must be a number"]),
    "unknown group": (
        in_groups("loss_factor = 0.1"),
        ["groups.loss_factor: no such group", "Allowed: F0, alpha, eta, f"],
    ),
    "capital group": (in_groups("Eta = -24"), ["groups.Eta: no such group", "'eta'"]),
    "negative frequency ratio": (in_groups("f = -1"), ["groups.f = -1.0", "greater than 0"]),
    "no force ratio": (in_groups("F0 = 0"), ["groups.F0 = 0.0", "greater than 0", "amplitude = 0"]),
    "no angle ratio": (in_groups("alpha = 0"), ["groups.alpha = 0.0", "greater than 0"]),
    "slope out of range": (in_groups("eta = 1e300"), ["slope = ", "at most 1e+12"]),
    "alpha of another brake": (
        changed('"wedge"', '"conventional"', GROUPED),
        ["groups.alpha: not defined", "ConventionalBrake", "Give SI values"],
    ),
    "eta without damping": (
        changed("damping = 0.1", "damping = 0", GROUPED),
        ["groups.eta: not defined", "driveline.damping is 0", "Give SI values"],
    ),
    "f without stiffness": (
        changed("stiffness = 10000.0", "stiffness = 0", GROUPED),
        ["groups.f: not defined", "driveline.stiffness is 0", "Give SI values"],
    ),
    "groups as a list": (
        changed("[groups]", "[[groups]]", GROUPED),
        ["groups = [{", "one table", "Write [groups]"],
    ),
    # Run.
    "no time": (in_run("periods = 0"), ["run.periods = 0:", "greater than 0", "250"]),
    "negative periods": (in_run("periods = -5"), ["run.periods = -5", "greater than 0"]),
    "broken periods": (in_run("periods = 2.5"), ["run.periods = 2.5", "a whole number"]),
    "periods as float": (in_run("periods = 250.0"), ["run.periods = 250.0", "a whole number"]),
    "periods as bool": (in_run("periods = true"), ["run.periods = True", "a whole number"]),
    "periods as text": (in_run('periods = "5"'), ["run.periods = '5'", "a whole number"]),
    "too many periods": (in_run(f"periods = {HUGE}"), ["run.periods = 1000", "at most 1e+09"]),
    "negative duration": (
        in_run("duration = -1"),
        ["run.duration = -1", "at least 0", "in s, for example 25.0"],
    ),
    "nan duration": (in_run("duration = nan"), ["run.duration = nan", "finite"]),
    "endless duration": (in_run("duration = inf"), ["run.duration = inf", "finite"]),
    "duration with its unit": (
        in_run('duration = "25 s"'),
        ["run.duration = '25 s'", "a number", "without quotation marks or units"],
    ),
    "duration and periods": (
        in_run("duration = 1.0\nperiods = 5"),
        ["run.duration = 1.0 and run.periods = 5", "both given", "Remove one"],
    ),
    "samples beyond memory": (in_run("duration = 1e12"), ["at most"]),
    "more samples beyond memory": (
        in_run("periods = 1000\nsamples_per_period = 1_000_000"),
        ["samples_per_period = 1000000", "50000000", "Lower"],
    ),
    "one initial value": (in_run("initial = [0.0]"), ["run.initial = [0.0]", "a list of 2 values"]),
    "three initial values": (
        in_run("initial = [0, 0, 0]"),
        ["run.initial = [0, 0, 0]", "a list of 2 values", "angle [rad] and velocity [rad/s]"],
    ),
    "initial number": (in_run("initial = 0"), ["run.initial = 0:", "a list of numbers"]),
    "nan at the start": (in_run("initial = [nan, 0]"), ["run.initial[0] = nan", "finite"]),
    "infinite at the start": (in_run("initial = [0, inf]"), ["run.initial[1] = inf", "finite"]),
    "bool at the start": (in_run("initial = [0, true]"), ["run.initial[1] = True", "a number"]),
    "far away at the start": (in_run("initial = [1e13, 0]"), ["run.initial[0]", "at most 1e+12"]),
    "start before time": (in_run("start_time = -1"), ["run.start_time = -1", "at least 0"]),
    "nan start": (in_run("start_time = nan"), ["run.start_time = nan", "finite"]),
    "unknown method": (
        in_run('method = "exakt"'),
        ["run.method = 'exakt'", "'exact', 'smooth' or 'ode14x'"],
    ),
    "method by number": (in_run("method = 3"), ["run.method = 3", "'exact', 'smooth' or 'ode14x'"]),
    "smooth method for Coulomb friction": (
        in_run('method = "smooth"'),
        ["method = 'smooth'", "not CoulombFriction", "method='exact'"],
    ),
    "exact method for smooth friction": (
        changed('"coulomb"', '"smoothed"', in_run('method = "exact"')),
        ["method = 'exact'", "not SmoothedFriction", "method='smooth'"],
    ),
    "no samples": (
        in_run("samples_per_period = 0"),
        ["run.samples_per_period = 0", "greater than 0"],
    ),
    "tolerance beyond rounding": (in_run("rtol = 1e-16"), ["run.rtol = 1e-16", "at least 1e-13"]),
    "nan tolerance": (in_run("rtol = nan"), ["run.rtol = nan", "finite"]),
    "no step": (in_run("step = 0"), ["run.step = 0:", "at least 1e-09", "in s"]),
    "no events": (in_run("max_events = 0"), ["run.max_events = 0", "greater than 0"]),
    "events as float": (in_run("max_events = 1e7"), ["run.max_events = 10000000.0", "whole"]),
    "endless steps": (in_run(f"max_steps = {HUGE}"), ["run.max_steps = 1000", "at most 1e+12"]),
    "unknown setting": (in_run("periodes = 5"), ["run.periodes", "Did you mean 'periods'?"]),
    # Not TOML.
    "empty": (b"", ["is empty", "`wedgebrake example paper`"]),
    "blank": (b" \n\n", ["is empty"]),
    "comment only": (b"# later\n", ["missing: [driveline], [brake]"]),
    "decimal comma": (
        changed("inertia = 1.0", "inertia = 1,0"),
        ["is not TOML", "line 2", "'inertia = 1,0'", "a number reads 0.5"],
    ),
    "unit after the number": (
        changed("inertia = 1.0", "inertia = 1.0 kg"),
        ["is not TOML", "line 2", "'inertia = 1.0 kg'"],
    ),
    "no value": (changed("inertia = 1.0", "inertia ="), ["is not TOML", "line 2", "'inertia ='"]),
    "doubled name": (
        changed("inertia = 1.0", "inertia = 1.0\ninertia = 2.0"),
        ["is not TOML", "line 3", "'inertia = 2.0'", "each name once"],
    ),
    "doubled table": (
        PLAIN + "[driveline]\n",
        ["is not TOML", "driveline", "twice", "'[driveline]'"],
    ),
    "JSON": ('{"driveline": {"inertia": 1.0}}', ["is not TOML", "under a [table]"]),
    "YAML": ("driveline:\n  inertia: 1.0\n", ["is not TOML", "'driveline:'"]),
    "cut off": (PLAIN[:100], ["is not TOML"]),
    "binary": (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), ["is not text", "TOML, in UTF-8"]),
    "UTF-16": (PLAIN.encode("utf-16"), ["is not text", "TOML, in UTF-8"]),
    "NUL bytes": (b"\x00" * 100, ["is not TOML", "\\x00"]),
    "NUL in a number": (changed("inertia = 1.0", "inertia = 1\x00"), ["is not TOML", "line 2"]),
    "two megabytes": (PLAIN + "# more\n" * 300_000, ["larger than 1000000 bytes", "study file"]),
    "deep list": (changed("inertia = 1.0", "inertia = " + "[" * 50_000), ["nested"]),
    "deep table": ("[" + "a." * 20_000 + "b]", ["nested"]),
    "deep name": ("driveline" + ".inertia" * 40_000 + " = 1", ["nested"]),
    "brackets only": ("[" * 50_000, ["is not TOML"]),
    "long list of tables": ("[[driveline]]\n" * 20_000, ["driveline = [{}, {}", "one table"]),
}


@pytest.mark.parametrize("case", FILES)
def test_wrong_study_file(case, run, tmp_path):
    text, words = FILES[case]
    study = tmp_path / "study.toml"
    content = text.encode() if isinstance(text, str) else text
    study.write_bytes(content)
    result = run("simulate", "study.toml", "--out", "run.nc", "--plot", "run.png")
    if "method" not in case and "samples beyond" not in case:
        words = ["error: study.toml:", *words]
        check(run("stability", "study.toml"), *words)
    check(result, *words)
    assert names(tmp_path) == ["study.toml"]
    assert study.read_bytes() == content


# What is wrong: (the arguments, what the message must say). `ok.toml` is a right study.
ARGUMENTS: dict[str, tuple[list[str], list[str]]] = {
    "no command": ([], ["Usage: wedgebrake", "stability", "simulate", "schema"]),
    "unknown command": (["simulat", "ok.toml"], ["'simulat'", "Did you mean 'simulate'?"]),
    "unknown option": (["simulate", "ok.toml", "--jsn"], ["--jsn", "--json", "--help"]),
    "option of another command": (["stability", "ok.toml", "--out", "r.nc"], ["--out", "--help"]),
    "no study": (["simulate"], ["Missing argument", "STUDY.toml", "--help"]),
    "two studies": (["simulate", "ok.toml", "b.toml"], ["b.toml", "--help"]),
    "study for the schema": (["schema", "ok.toml"], ["ok.toml", "--help"]),
    "value for a switch": (["simulate", "ok.toml", "--json=yes"], ["--json"]),
    # The study.
    "missing study": (
        ["simulate", "no.toml"],
        ["no.toml: no such file", "`wedgebrake example paper`"],
    ),
    "folder for a study": (["simulate", "."], [".: is a directory", "a study file in it"]),
    "nothing for a study": (["simulate", ""], ["is a directory"]),
    "file for a folder": (["stability", "ok.toml/a.toml"], ["ok.toml/a.toml: cannot be read"]),
    "study name too long": (["stability", "x" * 300], ["cannot be read", "too long"]),
    "endless device": (["stability", "/dev/zero"], ["/dev/zero: is larger than"]),
    "empty device": (["stability", os.devnull], ["is empty"]),
    # --set.
    "set without a value": (["stability", "ok.toml", "--set", "eta"], ["--set eta:", "NAME=VALUE"]),
    "set to nothing": (["stability", "ok.toml", "--set", "eta="], ["--set eta=:", "NAME=VALUE"]),
    "set nothing": (["stability", "ok.toml", "--set", "=3"], ["--set =3:", "--set eta=-30"]),
    "set at the end": (["stability", "ok.toml", "--set"], ["--set", "requires an argument"]),
    "set in two words": (["stability", "ok.toml", "--set", "eta", "-30"], ["No such option"]),
    "set twice": (
        ["stability", "ok.toml", "--set", "eta=1", "--set", "eta=2"],
        ["--set eta: given twice", "once"],
    ),
    "set unknown": (
        ["stability", "ok.toml", "--set", "inertai=1"],
        ["--set: inertai: no such parameter", "Did you mean 'inertia'"],
    ),
    "set the start": (
        ["stability", "ok.toml", "--set", "initial_velocity=5"],
        ["initial_velocity: no such", "Did you mean 'initial'?", "example initial=[0.0, 5.0]"],
    ),
    "set friction by its symbol": (
        ["stability", "ok.toml", "--set", "mu=0.2"],
        ["mu: no such parameter", "Did you mean 'kinetic'?"],
    ),
    "set a force": (
        ["stability", "ok.toml", "--set", "force=200"],
        ["force: no such parameter", "Did you mean 'initial_force' or 'F0'?"],
    ),
    "set a torque": (
        ["stability", "ok.toml", "--set", "torque=200"],
        ["torque: no such parameter", "Did you mean 'amplitude' or 'F0'?"],
    ),
    "set omega": (
        ["stability", "ok.toml", "--set", "omega=20"],
        ["omega: no such parameter", "Did you mean 'drive_speed' or 'frequency'?"],
    ),
    "set a table by one value": (
        ["stability", "ok.toml", "--set", "friction=0.2"],
        ["friction is a table", "--set kinetic=0.25"],
    ),
    "set the start of a sweep": (
        ["sweep", "ok.toml", "--over", "velocity=1:2:3"],
        ["velocity cannot be swept", "Did you mean 'initial_velocity'?"],
    ),
    "set unknown setting": (["stability", "ok.toml", "--set", "period=9"], ["'periods'"]),
    "set of another kind": (
        ["stability", "ok.toml", "--set", "angle=0.3"],
        ["angle: no parameter of the brake", "'conventional'", "'wedge'", "Change the kind"],
    ),
    "set negative": (
        ["stability", "ok.toml", "--set", "inertia=-1"],
        ["--set: driveline.inertia = -1", "greater than 0", "for example 1.0"],
    ),
    "set nan": (["stability", "ok.toml", "--set", "eta=nan"], ["groups.eta = nan", "finite"]),
    "set infinite": (["stability", "ok.toml", "--set", "f=inf"], ["groups.f = inf", "finite"]),
    "set beyond floats": (["stability", "ok.toml", "--set", "eta=1e400"], ["groups.eta = inf"]),
    "set huge": (["stability", "ok.toml", "--set", f"eta={HUGE}"], ["groups.eta = 1000", "finite"]),
    "set endless": (["stability", "ok.toml", "--set", f"damping={ENDLESS}"], ["damping = inf"]),
    "set text": (["stability", "ok.toml", "--set", "eta=low"], ["groups.eta = 'low'", "a number"]),
    "set comma": (["stability", "ok.toml", "--set", "eta=1,5"], ["--set eta=1,5", "not a value"]),
    "set open list": (
        ["stability", "ok.toml", "--set", "initial=["],
        ["--set initial=[", "[a, b]"],
    ),
    "set deep list": (
        ["stability", "ok.toml", "--set", "initial=" + "[" * 20_000],
        ["--set 'initial=[[", "not a value"],
    ),
    "set two lines": (
        ["stability", "ok.toml", "--set", "eta=1\nf=2"],
        ["--set 'eta=1\\nf=2'", "one NAME=VALUE"],
    ),
    "set bool": (["stability", "ok.toml", "--set", "release=True"], ["'True'", "true or false"]),
    "set a table": (
        ["stability", "ok.toml", "--set", "brake=band"],
        ["brake is a table", "one by"],
    ),
    "set a kind": (
        ["stability", "ok.toml", "--set", "kind=band"],
        ["--set kind=band", "Edit a copy of the study file", "[brake] 'band'", "[friction] 'coul"],
    ),
    "set a kind with its table": (
        ["stability", "ok.toml", "--set", "brake.kind=leading-shoe"],
        [
            "--set brake.kind=leading-shoe: another kind",
            "Edit a copy of the study file",
            "[brake] 'band', 'conventional', 'leading-shoe', 'wedge'.\n",
        ],
    ),
    "set with table": (
        ["stability", "ok.toml", "--set", "driveline.inertia=2"],
        ["--set driveline.inertia=2", "without its table: --set inertia=VALUE"],
    ),
    "set unprintable": (["stability", "ok.toml", "--set", "\x1b[1m=2"], ["'\\x1b[1m'"]),
    "set eta and slope": (
        ["stability", "ok.toml", "--set", "eta=1", "--set", "slope=2"],
        ["eta and slope: both given", "eta sets slope"],
    ),
    "set duration and periods": (
        ["stability", "ok.toml", "--set", "duration=1", "--set", "periods=2"],
        ["run.duration = 1.0 and run.periods = 2", "both given"],
    ),
    "set method": (["stability", "ok.toml", "--set", "method=exakt"], ["run.method = 'exakt'"]),
    "set eta without damping": (
        ["stability", "ok.toml", "--set", "eta=1", "--set", "damping=0"],
        ["groups.eta: not defined", "driveline.damping is 0"],
    ),
    # --method.
    "unknown method": (
        ["simulate", "ok.toml", "--method", "exakt"],
        ["--method exakt", "not known", "Did you mean 'exact'?"],
    ),
    "empty method": (["simulate", "ok.toml", "--method", ""], ["Allowed: exact, ode14x, smooth"]),
    "method that does not fit": (
        ["simulate", "ok.toml", "--method", "smooth"],
        ["method = 'smooth'", "CoulombFriction", "method='exact'"],
    ),
    "method twice": (
        ["simulate", "ok.toml", "--method", "exact", "--set", "method=smooth"],
        ["--method and --set method: both given"],
    ),
    # --out and --plot.
    "data as text": (["simulate", "ok.toml", "--out", "r.txt"], ["--out r.txt", ".nc", "run.nc"]),
    "data without suffix": (["simulate", "ok.toml", "--out", "r"], ["--out r:", "end in .nc"]),
    "picture as data": (
        ["simulate", "ok.toml", "--plot", "r.nc"],
        ["--plot r.nc", ".png, .svg, .pdf", "--plot run.png"],
    ),
    "picture without a name": (["simulate", "ok.toml", "--plot", ".png"], ["--plot .png"]),
    "data to a folder": (
        ["simulate", "ok.toml", "--out", "folder.nc"],
        ["--out folder.nc: is a directory", "name of a file"],
    ),
    "picture to a folder": (
        ["simulate", "ok.toml", "--plot", "folder.png"],
        ["--plot folder.png: is a directory"],
    ),
    "data into nowhere": (
        ["simulate", "ok.toml", "--out", "no/r.nc"],
        ["--out no/r.nc", "folder no does not exist", "Create it"],
    ),
    "picture into nowhere": (["simulate", "ok.toml", "--plot", "no/r.png"], ["folder no does not"]),
    "data under a file": (
        ["simulate", "ok.toml", "--out", "ok.toml/r.nc"],
        ["--out ok.toml/r.nc", "cannot be written", "another"],
    ),
    "picture under a device": (
        ["simulate", "ok.toml", "--plot", "/dev/null/r.png"],
        ["--plot /dev/null/r.png", "cannot be written"],
    ),
    "data into /proc": (["simulate", "ok.toml", "--out", "/proc/r.nc"], ["cannot be written"]),
    "data name too long": (["simulate", "ok.toml", "--out", "x" * 300 + ".nc"], ["too long"]),
    "data name nearly too long": (
        ["simulate", "ok.toml", "--out", "x" * 250 + ".nc"],
        ["too long"],
    ),
    "data to /dev/full": (["simulate", "ok.toml", "--out", "/dev/full"], ["must end in .nc"]),
    "good data, wrong picture": (
        ["simulate", "ok.toml", "--out", "r.nc", "--plot", "r.bmp"],
        ["--plot r.bmp", ".png"],
    ),
}


@pytest.mark.parametrize("case", ARGUMENTS)
def test_wrong_arguments(case, run, tmp_path):
    arguments, words = ARGUMENTS[case]
    (tmp_path / "ok.toml").write_text(PLAIN)
    (tmp_path / "folder.nc").mkdir()
    (tmp_path / "folder.png").mkdir()
    status, output, message = run(*arguments)
    if case == "no command":  # is answered by the help
        assert (status, output) == (2, "")
        assert all(word in message for word in words)
    else:
        check((status, output, message), *words)
    assert names(tmp_path) == ["folder.nc", "folder.png", "ok.toml"]
    assert names(tmp_path / "folder.nc") == []
    assert (tmp_path / "ok.toml").read_text() == PLAIN


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["stability", "bad.toml"], ["error: bad.toml: driveline.inertia = -1.0"]),
        (["simulate", "bad.toml", "--out", "r.nc"], ["error: bad.toml: driveline.inertia = -1.0"]),
        (["simulate", "ok.toml", "--set", "eta=nan"], ["error: --set: groups.eta = nan"]),
        (["simulate", "ok.toml", "--plot", "no/r.png"], ["error: --plot no/r.png"]),
        (["simulate", "ok.toml", "--seed", "3"], ["No such option", "--seed"]),
    ],
)
def test_in_a_process_of_its_own(arguments, words, tmp_path):
    (tmp_path / "ok.toml").write_text(PLAIN)
    (tmp_path / "bad.toml").write_text(changed("inertia = 1.0", "inertia = -1.0"))
    done = subprocess.run(
        [PROGRAM, *arguments], cwd=tmp_path, capture_output=True, text=True, timeout=60
    )
    check((done.returncode, done.stdout, done.stderr), *words)
    assert names(tmp_path) == ["bad.toml", "ok.toml"]


def test_there_are_enough_of_them():
    assert len(FILES) >= 60
    assert len(ARGUMENTS) >= 40


def test_all_mistakes_of_a_file_are_told_at_once(run, tmp_path):
    text = changed("inertia = 1.0", "inertia = -1.0")
    text = changed("kinetic = 0.30", "kinetic = 30", changed("periods = 5", "periods = 0", text))
    (tmp_path / "study.toml").write_text(text)
    result = run("stability", "study.toml")
    check(result, "driveline.inertia = -1.0", "friction.kinetic = 30", "run.periods = 0")
    assert len(result[2].splitlines()) == 4


def test_what_cannot_be_read_is_told(run, tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise PermissionError(13, "Permission denied")

    (tmp_path / "study.toml").write_text(PLAIN)
    monkeypatch.setattr(Path, "open", refuse)
    check(run("stability", "study.toml"), "study.toml: cannot be read (Permission denied)")


def test_a_folder_that_refuses_files(run, tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise PermissionError(13, "Permission denied")

    (tmp_path / "ok.toml").write_text(PLAIN)
    monkeypatch.setattr(Path, "touch", refuse)
    for option, name in (("--out", "r.nc"), ("--plot", "r.png")):
        message = f"{option} {name}: cannot be written (Permission denied). Choose another"
        check(run("simulate", "ok.toml", option, name), message)


def test_netcdf_without_its_libraries_is_told_before_the_work(run, tmp_path, monkeypatch):
    (tmp_path / "ok.toml").write_text(PLAIN)
    monkeypatch.setattr("wedgebrake.cli.output.find_spec", lambda _: None)
    check(
        run("simulate", "ok.toml", "--out", "r.nc", "--set", "periods=1000000"),
        "--out r.nc: netCDF needs h5netcdf and h5py",
        "pip install 'wedgebrake[netcdf]'",
    )


@pytest.mark.parametrize("option", ["--out", "--plot"])
def test_a_file_that_is_there_survives_a_mistake(option, run, tmp_path):
    name = "r.nc" if option == "--out" else "r.png"
    (tmp_path / name).write_text("earlier work")
    (tmp_path / "ok.toml").write_text(PLAIN)
    check(run("simulate", "ok.toml", option, name, "--set", "eta=nan"), "groups.eta = nan")
    assert (tmp_path / name).read_text() == "earlier work"


@pytest.mark.parametrize(
    "text",
    [
        changed("inertia = 1.0", "inertia = 1"),
        changed("[driveline]\ninertia = 1.0", "driveline.inertia = 1.0\n[x]").replace(
            "[x]\ndamping = 0.1\nstiffness = 10000.0",
            "driveline.damping = 0.1\ndriveline.stiffness = 10000.0",
        ),
        changed("inertia = 1.0", "inertia = 0x1"),
        changed("stiffness = 10000.0", "stiffness = 10_000"),
        changed("\nperiods = 5", ""),
        changed("[run]\nperiods = 5\n", ""),
        PLAIN.replace("\n", "\r\n"),
        "\ufeff" + PLAIN,
        "# a.b.c " + "." * 500 + "\n" + PLAIN,
        GROUPED,
    ],
)
def test_right_input_is_not_refused(text, run, tmp_path):
    (tmp_path / "study.toml").write_bytes(text.encode())
    status, output, message = run("stability", "study.toml")
    assert (status, message) == (0, "")
    assert "Linear stability" in output


# The same messages reach Python.
PYTHON: dict[str, tuple[Callable[[], object], str]] = {
    "negative": (
        lambda: wb.Driveline(inertia=-1, damping=0.1, stiffness=1e4),
        (
            "driveline.inertia = -1: must be greater than 0. Meaning: moment of inertia J in"
            " kg m^2, for example 1.0."
        ),
    ),
    "text": (
        lambda: wb.Driveline(inertia="1", damping=0.1, stiffness=1e4),
        (
            "driveline.inertia = '1': must be a number. Write the number without quotation marks or"
            " units. Meaning: moment of inertia J in kg m^2, for example 1.0."
        ),
    ),
    "none": (
        lambda: wb.Driveline(inertia=None, damping=0.1, stiffness=1e4),
        "driveline.inertia = None: must be a number.",
    ),
    "missing": (
        lambda: wb.Driveline(inertia=1.0, damping=0.1),
        (
            "driveline.stiffness: missing. Meaning: torsional stiffness k in N m/rad, for example"
            " 10000.0."
        ),
    ),
    "misspelt": (
        lambda: wb.Driveline(inertai=1.0, damping=0.1, stiffness=1e4),
        (
            "driveline.inertai: no such parameter. Did you mean 'inertia'?\n"
            "driveline.inertia: missing."
        ),
    ),
    "endless integer": (
        lambda: wb.Driveline(inertia=10**5000, damping=0.1, stiffness=1e4),
        "driveline.inertia = (int too long to show): must be a finite number",
    ),
    "degrees": (
        lambda: wb.WedgeBrake(angle=19.5, radius=0.2),
        "brake.angle = 19.5: must be below 1.5708. 19.5 looks like degrees: write 0.340339.",
    ),
    "half a part": (
        lambda: wb.BrakedDriveline(),
        "driveline: missing. Give one of class Driveline",
    ),
    "matrix": (
        lambda: wb.Driveline(inertia=np.eye(2), damping=0.1, stiffness=1e4),
        "driveline.inertia = [[1.0, 0.0], [0.0, 1.0]]: must be a number.",
    ),
    "truth from NumPy": (
        lambda: wb.Driveline(inertia=np.True_, damping=0.1, stiffness=1e4),
        "driveline.inertia = True: must be a number.",
    ),
    "no path": (lambda: wb.load_study(3), "path = 3: must be the path of a study file (TOML)."),
}


@pytest.mark.parametrize("case", PYTHON)
def test_python_says_the_same(case):
    make, message = PYTHON[case]
    with pytest.raises(wb.InputError) as caught:
        make()
    assert str(caught.value).startswith(message)


SUBNORMAL = (5e-324, -5e-324, 1e-320, 1e-308, 1e-60)
TINY = {
    "driveline": ("inertia", "damping", "stiffness", "drive_speed"),
    "brake": ("radius", "angle"),
    "friction": ("kinetic", "static"),
    "actuation": ("initial_force", "slope"),
    "excitation": ("amplitude",),
}


@pytest.mark.parametrize(("part", "name"), [(part, name) for part in TINY for name in TINY[part]])
def test_numbers_whose_powers_vanish_are_refused(part, name):
    """They would end in a division by zero somewhere, or in a solver that makes no headway."""
    system = wb.paper.system()
    signed = name in ("drive_speed", "slope")
    for value in SUBNORMAL:
        if value < 0.0 and not signed:
            continue
        with pytest.raises(wb.InputError, match=f"{part}.{name} = {value!r}: must be") as caught:
            system.replace(**{name: value})
        assert "1e-50" in str(caught.value)
    # The least that is allowed is one that can be computed with.
    both = {"kinetic": 1e-50, "static": 1e-50}
    least = system.replace(**both if part == "friction" else {name: 1e-50})
    wb.stability(least)
    response = wb.simulate(least, periods=2, max_events=5_000, times=[])
    assert response.attrs["status"] in {"completed", "diverged", "event_limit"} | {
        "no_forward_solution"
    }


@pytest.mark.parametrize("command", ["stability", "simulate"])
@pytest.mark.parametrize("change", ["inertia=5e-324", "drive_speed=5e-324", "amplitude=1e-308"])
def test_tiny_numbers_from_the_command_line(command, change, run, tmp_path):
    (tmp_path / "ok.toml").write_text(PLAIN)
    check(run(command, "ok.toml", "--set", change), change.split("=")[0], "1e-50")


def test_numpy_numbers_and_arrays_are_numbers_and_lists():
    line = wb.Driveline(inertia=np.float32(1.5), damping=np.array(0.5), stiffness=np.int64(10))
    assert (line.inertia, line.damping, line.stiffness) == (1.5, 0.5, 10.0)
    law = wb.TabulatedFriction(speeds=np.array([0.0, 1.0]), coefficients=np.array([0.4, 0.3]))
    assert law.nodes() == ((0.0, 0.4), (1.0, 0.3))


def test_a_part_of_ones_own_explains_itself_too():
    class Spring(Part):
        table = "spring"
        pair: tuple[float, float] = parameter(
            "two rates", symbol="k", unit="N/m", example=[1.0, 2.0], strict=False
        )
        few: tuple[float, ...] = parameter(
            "some rates", symbol="k", unit="1", example=None, default=(1.0,), strict=False,
            min_length=1, max_length=2,
        )  # fmt: skip

    for given, words in (
        ({"pair": [1.0]}, "spring.pair = [1.0]: must be a list of 2 values. Meaning: two rates in"),
        ({"pair": [1.0, 2.0], "few": [1.0, 2.0, 3.0]}, "must be a list of values, at most 2"),
        ({"pair": [1.0, "2"]}, "spring.pair[1] = '2': must be a number."),
    ):
        with pytest.raises(wb.InputError) as caught:
            Spring(**given)
        assert words in str(caught.value)

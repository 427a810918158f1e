"""Wrong input: the message names the argument and its value, exit status 2, nothing is written."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import wedgebrake as wb
from printed import names

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
HUGE, ENDLESS = "1" + "0" * 400, "1" + "0" * 5000


def check(result: tuple[int, str, str], *words: str) -> None:
    """Exit status 2, nothing on standard output, a few printable lines that hold the words."""
    status, output, message = result
    assert (status, output) == (2, ""), message
    assert message.startswith(("error: ", "Usage: ", "Error: "))
    assert "internal" not in message
    lines = message.splitlines()
    assert len(lines) <= 11
    assert max(map(len, lines)) <= 600
    assert all(line.isprintable() for line in lines)
    for word in words:
        assert word in message


def changed(old: str, new: str, text: str = PLAIN) -> str:
    assert text.count(old) == 1, old
    return text.replace(old, new)


def line(new: str, text: str = PLAIN) -> str:
    """The study with one line replaced, that of the same parameter."""
    name = new.split("=")[0].strip()
    [old] = [one for one in text.splitlines() if one.split("=")[0].strip() == name]
    return changed(f"\n{old}\n", f"\n{new}\n", text)


def run_of(text: str) -> str:
    return changed("periods = 5", text)


def wedge(text: str) -> str:
    return changed('"conventional"', f'"wedge"\n{text}')


def table(speeds: str, coefficients: str) -> str:
    law = f'kind = "tabulated"\nspeeds = {speeds}\ncoefficients = {coefficients}'
    return changed('kind = "coulomb"\nkinetic = 0.30', law)


# Study files, and what the message must name.
FILES: list[tuple[str | bytes, str]] = [
    # Numbers and units.
    (line('inertia = "1.0 kg"'), "driveline.inertia = '1.0 kg'"),
    (line("inertia = -1.0"), "driveline.inertia = -1.0"),
    (line("inertia = 0"), "driveline.inertia = 0"),
    (line("inertia = true"), "driveline.inertia = True"),
    (line("inertia = [1.0]"), "driveline.inertia = [1.0]"),
    (changed("inertia =", "inertia.value ="), "driveline.inertia = {'value': 1.0}"),
    (line("inertia = 2014-01-01"), "driveline.inertia = "),
    (line(f"inertia = {HUGE}"), "driveline.inertia = 1000"),
    (line(f"inertia = {ENDLESS}"), "is not TOML"),
    (line("damping = nan"), "driveline.damping = nan"),
    (line("stiffness = inf"), "driveline.stiffness = inf"),
    (line("stiffness = 1e300"), "driveline.stiffness = 1e+300"),
    (line("slope = -inf"), "actuation.slope = -inf"),
    (line("initial_force = -300.0"), "actuation.initial_force = -300.0"),
    (line("amplitude = -500.0"), "excitation.amplitude = -500.0"),
    (line("frequency = 0"), "excitation.frequency = 0"),
    (line("slope = -40.0\nrelease = 1"), "actuation.release = 1"),
    (line('slope = -40.0\nrelease = "yes"'), "actuation.release = 'yes'"),
    (wedge("angle = 19.5"), "19.5 looks like degrees: write 0.340339"),
    (changed('"conventional"', '"band"\nwrap_angle = 230'), "degrees: write 4.01426"),
    (wedge("angle = -0.3"), "brake.angle = -0.3"),
    (line("kinetic = 30"), "30 looks like percent: write 0.3"),
    (line("kinetic = 0.30\nstatic = 0.2"), "friction.static = 0.2"),
    # Names.
    (line("inertia = 1.0\ncolour = 2.0"), "driveline.colour"),
    (changed("inertia =", "inertai ="), "driveline.inertai: no such parameter. Did you mean 'ine"),
    (changed("inertia =", "Inertia ="), "Did you mean 'inertia'?"),
    (changed("inertia = 1.0", ""), "driveline.inertia: missing"),
    (changed("inertia =", '"inertia\\u001b[31m" ='), "driveline.'inertia\\x1b[31m'"),
    (changed("inertia =", '"" ='), "driveline.''"),
    (line("inertia = 1.0\n" + "".join(f"k{i} = 1\n" for i in range(5000))), "driveline.k0"),
    (changed("[driveline]", "[drivelin]"), "[drivelin]: no such table. Did you mean 'driveline'"),
    (changed("[driveline]", "[[driveline]]"), "driveline = [{'inertia'"),
    ("driveline = 3\n" + changed("[driveline]", "[run.x]"), "driveline = 3"),
    (changed("[driveline]", "[driveline]\n[driveline.sub]"), "driveline.sub"),
    ("inertia = 1.0\n" + PLAIN, "inertia = 1.0: stands outside"),
    (changed("[friction]", ""), "'kind = \"coulomb\"'"),
    ("[driveline]\ninertia = 1.0\n", "missing: [brake], [friction], [actuation], [excitation]"),
    # Kinds.
    (changed('"conventional"', '"konventional"'), "brake.kind = 'konventional'"),
    (changed('"conventional"', "3"), "brake.kind = 3"),
    (changed('kind = "conventional"', ""), "brake.kind: missing"),
    (changed('"coulomb"', '"Coulomb"'), "Did you mean 'coulomb'?"),
    (line("radius = 0.2\nangle = 0.3"), "brake.angle: no such parameter"),
    (wedge(""), "brake.angle: missing"),
    (line('inertia = 1.0\nkind = "rigid"'), "driveline.kind"),
    # Lists.
    (table("[0, 1]", "[0.3]"), "friction.coefficients: has 1 values"),
    (table("[]", "[]"), "friction.speeds = []"),
    (table("[0, 2, 1]", "[0.3, 0.3, 0.3]"), "friction.speeds: 1.0 follows 2.0"),
    (table("[1, 2]", "[0.3, 0.3]"), "friction.speeds[0] = 1.0"),
    (table("[0, 1]", "[0.3, nan]"), "friction.coefficients[1] = nan"),
    (table("[0, true]", "[0.3, 0.3]"), "friction.speeds[1] = True"),
    (table("[0, 1]", "[0.3, -0.3]"), "friction.coefficients[1] = -0.3"),
    (table("0", "[0.3]"), "friction.speeds = 0"),
    (table(str(list(range(10_001))), str([0.3] * 10_001)), "friction.speeds = [0, 1, 2"),
    # Groups.
    (changed("[run]", "[groups]\neta = -24.0\n[run]"), "groups.eta and actuation.slope"),
    (changed("radius = 0.2", "radius = 0.2, angle = 0.3", GROUPED), "groups.alpha and brake.angle"),
    (line("eta = nan", GROUPED), "groups.eta = nan"),
    (line("f = inf", GROUPED), "groups.f = inf"),
    (line(f"eta = {HUGE}", GROUPED), "groups.eta = 1000"),
    (line('eta = "-24"', GROUPED), "groups.eta = '-24'"),
    (line("eta = true", GROUPED), "groups.eta = True"),
    (line("eta = [1]", GROUPED), "groups.eta = [1]"),
    (GROUPED + "loss_factor = 0.1", "groups.loss_factor"),
    (line("f = -1", GROUPED), "groups.f = -1.0"),
    (line("F0 = 0", GROUPED), "groups.F0 = 0.0"),
    (line("alpha = 0", GROUPED), "groups.alpha = 0.0"),
    (line("eta = 1e300", GROUPED), "slope = "),
    (changed('"wedge"', '"conventional"', GROUPED), "groups.alpha: not defined"),
    (changed("damping = 0.1", "damping = 0", GROUPED), "groups.eta: not defined"),
    (changed("stiffness = 10000.0", "stiffness = 0", GROUPED), "groups.f: not defined"),
    (changed("[groups]", "[[groups]]", GROUPED), "groups = [{"),
    # Run.
    *((run_of(f"periods = {one}"), "run.periods = ") for one in ("0", "2.5", "250.0", "true")),
    *((run_of(f"periods = {one}"), "run.periods = ") for one in ('"5"', HUGE)),
    *((run_of(f"duration = {one}"), "run.duration = ") for one in ("-1", "nan", "inf", '"25 s"')),
    (run_of("duration = 1.0\nperiods = 5"), "run.duration = 1.0 and run.periods = 5"),
    *((run_of(f"initial = {one}"), "run.initial = ") for one in ("[0.0]", "[0, 0, 0]", "0")),
    (run_of("initial = [nan, 0]"), "run.initial[0] = nan"),
    (run_of("initial = [0, true]"), "run.initial[1] = True"),
    (run_of("initial = [1e13, 0]"), "run.initial[0] = "),
    *((run_of(f"start_time = {one}"), "run.start_time = ") for one in ("-1", "nan")),
    *((run_of(f"method = {one}"), "run.method = ") for one in ('"exakt"', "3")),
    (run_of("samples_per_period = 0"), "run.samples_per_period = 0"),
    *((run_of(f"rtol = {one}"), f"run.rtol = {one}") for one in ("1e-16", "nan")),
    (run_of("step = 0"), "run.step = 0"),
    *((run_of(f"max_events = {one}"), "run.max_events = ") for one in ("0", "1e7")),
    (run_of(f"max_steps = {HUGE}"), "run.max_steps = 1000"),
    (run_of("periodes = 5"), "run.periodes: no such parameter. Did you mean 'periods'?"),
    # Not TOML; too much.
    (b"", "is empty"),
    (b" \n\n", "is empty"),
    (b"# later\n", "missing: [driveline]"),
    (line("inertia = 1,0"), "in 'inertia = 1,0'"),
    (line("inertia ="), "in 'inertia ='"),
    (line("inertia = 1.0\ninertia = 2.0"), "in 'inertia = 2.0'"),
    (PLAIN + "[driveline]\n", "in '[driveline]'"),
    ('{"driveline": {"inertia": 1.0}}', "is not TOML"),
    (PLAIN[:100], "is not TOML"),
    (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), "is not text"),
    (PLAIN.encode("utf-16"), "is not text"),
    (b"\x00" * 100, "is not TOML"),
    (PLAIN + "# more\n" * 300_000, "is larger than 1000000 bytes"),
    (line("inertia = " + "[" * 50_000), "nested"),
    ("[" + "a." * 20_000 + "b]", "nested"),
    ("driveline" + ".inertia" * 40_000 + " = 1", "nested"),
    ("[" * 50_000, "is not TOML"),
    ("[[driveline]]\n" * 20_000, "driveline = [{}, {}"),
]


@pytest.mark.parametrize("case", range(len(FILES)), ids=lambda i: FILES[i][1][:40])
def test_wrong_study_file(case, run, tmp_path):
    text, named = FILES[case]
    content = text.encode() if isinstance(text, str) else text
    (tmp_path / "study.toml").write_bytes(content)
    check(run("stability", "study.toml"), "error: study.toml:", named)
    assert (tmp_path / "study.toml").read_bytes() == content


@pytest.mark.parametrize(
    ("text", "named"),
    [
        (run_of('method = "smooth"'), "method = 'smooth'"),
        (changed('"coulomb"', '"smoothed"', run_of('method = "exact"')), "method = 'exact'"),
        (run_of("duration = 1e12"), "duration = 1"),
        (run_of("periods = 1000\nsamples_per_period = 1_000_000"), "samples_per_period = 1000000"),
    ],
)
def test_a_study_that_no_solver_takes(text, named, run, tmp_path):
    (tmp_path / "study.toml").write_text(text)
    check(run("simulate", "study.toml", "--out", "run.nc", "--plot", "run.png"), named)
    assert names() == ["study.toml"]


# Command lines, and what the message must name. `ok.toml` is a right study.
SET, SIMULATE = ["stability", "ok.toml", "--set"], ["simulate", "ok.toml"]
ARGUMENTS: list[tuple[list[str], str]] = [
    (["simulat", "ok.toml"], "'simulat'"),
    ([*SIMULATE, "--jsn"], "--jsn"),
    ([*SIMULATE, "--seed", "3"], "--seed"),
    (["stability", "ok.toml", "--out", "r.nc"], "--out"),
    (["simulate"], "STUDY.toml"),
    ([*SIMULATE, "b.toml"], "b.toml"),
    (["schema", "ok.toml"], "ok.toml"),
    ([*SIMULATE, "--json=yes"], "--json"),
    # The study.
    (["simulate", "no.toml"], "no.toml: no such file"),
    (["simulate", "."], ".: is a directory"),
    (["stability", "ok.toml/a.toml"], "ok.toml/a.toml: cannot be read"),
    (["stability", "x" * 300], "too long"),
    (["stability", "/dev/zero"], "/dev/zero: is larger than"),
    (["stability", os.devnull], "is empty"),
    # --set.
    ([*SET, "eta"], "--set eta:"),
    ([*SET, "eta="], "--set eta=:"),
    ([*SET, "=3"], "--set =3:"),
    (SET, "--set"),
    ([*SET, "eta=1", "--set", "eta=2"], "--set eta: given twice"),
    ([*SET, "inertai=1"], "inertai: no such parameter, group or run setting. Did you mean 'inert"),
    ([*SET, "initial_velocity=5"], "Did you mean 'initial'?"),
    ([*SET, "mu=0.2"], "Did you mean 'kinetic'?"),
    ([*SET, "force=200"], "Did you mean 'initial_force' or 'F0'?"),
    ([*SET, "omega=20"], "Did you mean 'drive_speed' or 'frequency'?"),
    ([*SET, "period=9"], "'periods'"),
    ([*SET, "angle=0.3"], "'wedge'"),
    ([*SET, "inertia=-1"], "--set: driveline.inertia = -1"),
    ([*SET, "inertia=5e-324"], "driveline.inertia = 5e-324"),
    ([*SET, "eta=nan"], "groups.eta = nan"),
    ([*SET, "eta=1e400"], "groups.eta = inf"),
    ([*SET, f"eta={HUGE}"], "groups.eta = 1000"),
    ([*SET, f"damping={ENDLESS}"], "damping = inf"),
    ([*SET, "eta=low"], "groups.eta = 'low'"),
    ([*SET, "eta=1,5"], "--set eta=1,5"),
    ([*SET, "initial=["], "--set initial=["),
    ([*SET, "initial=" + "[" * 20_000], "--set 'initial=[["),
    ([*SET, "eta=1\nf=2"], "--set 'eta=1\\nf=2'"),
    ([*SET, "release=True"], "actuation.release = 'True'"),
    ([*SET, "brake=band"], "--set brake=band"),
    ([*SET, "kind=band"], "--set kind=band"),
    ([*SET, "brake.kind=leading-shoe"], "'band', 'conventional', 'leading-shoe', 'wedge'.\n"),
    ([*SET, "driveline.inertia=2"], "--set inertia=VALUE"),
    ([*SET, "\x1b[1m=2"], "'\\x1b[1m'"),
    ([*SET, "eta=1", "--set", "slope=2"], "eta and slope"),
    ([*SET, "duration=1", "--set", "periods=2"], "run.duration = 1.0 and run.periods = 2"),
    ([*SET, "eta=1", "--set", "damping=0"], "groups.eta: not defined"),
    # Other options.
    ([*SIMULATE, "--method", "exakt"], "--method exakt: not known. Did you mean 'exact'?"),
    ([*SIMULATE, "--method", "smooth"], "method = 'smooth'"),
    ([*SIMULATE, "--method", "exact", "--set", "method=smooth"], "--method and --set method"),
    ([*SIMULATE, "--out", "r.txt"], "--out r.txt"),
    ([*SIMULATE, "--plot", "r.nc"], "--plot r.nc"),
    ([*SIMULATE, "--plot", ".png"], "--plot .png"),
    ([*SIMULATE, "--out", "folder.nc"], "--out folder.nc: is a directory"),
    ([*SIMULATE, "--out", "no/r.nc"], "--out no/r.nc"),
    ([*SIMULATE, "--out", "ok.toml/r.nc"], "--out ok.toml/r.nc: cannot be written"),
    ([*SIMULATE, "--plot", "/dev/null/r.png"], "--plot /dev/null/r.png: cannot be written"),
    ([*SIMULATE, "--out", "/proc/r.nc"], "--out /proc/r.nc: cannot be written"),
    ([*SIMULATE, "--out", "x" * 250 + ".nc"], "too long"),
    ([*SIMULATE, "--out", "r.nc", "--plot", "r.bmp"], "--plot r.bmp"),
    (["sweep", "ok.toml", "--over", "velocity=1:2:3"], "Did you mean 'initial_velocity'?"),
]


@pytest.mark.parametrize("case", range(len(ARGUMENTS)), ids=lambda i: ARGUMENTS[i][1][:40])
def test_wrong_arguments(case, run, tmp_path):
    arguments, named = ARGUMENTS[case]
    (tmp_path / "ok.toml").write_text(PLAIN)
    (tmp_path / "folder.nc").mkdir()
    check(run(*arguments), named)
    assert names() == ["folder.nc", "ok.toml"]
    assert names("folder.nc") == []
    assert (tmp_path / "ok.toml").read_text() == PLAIN


def test_in_a_process_of_its_own(tmp_path):
    (tmp_path / "bad.toml").write_text(line("inertia = -1.0"))
    command = [sys.executable, "-m", "wedgebrake", "simulate", "bad.toml", "--out", "r.nc"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    result = (done.returncode, done.stdout, done.stderr)
    check(result, "error: bad.toml: driveline.inertia = -1.0")
    assert names(tmp_path) == ["bad.toml"]


def test_all_mistakes_of_a_file_are_told_at_once(run, tmp_path):
    text = line("inertia = -1.0", line("kinetic = 30", line("periods = 0")))
    (tmp_path / "study.toml").write_text(text)
    result = run("stability", "study.toml")
    check(result, "driveline.inertia = -1.0", "friction.kinetic = 30", "run.periods = 0")
    assert len(result[2].splitlines()) == 4


@pytest.mark.parametrize(
    ("where", "arguments"),
    [("open", ["stability"]), ("touch", ["simulate", "--out", "r.nc"])],
)
def test_a_file_or_folder_without_permission(where, arguments, run, tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise PermissionError(13, "Permission denied")

    (tmp_path / "ok.toml").write_text(PLAIN)
    monkeypatch.setattr(Path, where, refuse)
    command, *options = arguments
    check(run(command, "ok.toml", *options), "Permission denied")


def test_netcdf_without_its_libraries_is_told_before_the_work(run, tmp_path, monkeypatch):
    (tmp_path / "ok.toml").write_text(PLAIN)
    monkeypatch.setattr("wedgebrake.cli.output.find_spec", lambda _: None)
    endless = ["--set", "periods=1000000"]
    check(run(*SIMULATE, "--out", "r.nc", *endless), "--out r.nc", "'wedgebrake[netcdf]'")


def test_a_file_that_is_there_survives_a_mistake(run, tmp_path):
    (tmp_path / "r.nc").write_text("earlier work")
    (tmp_path / "ok.toml").write_text(PLAIN)
    check(run(*SIMULATE, "--out", "r.nc", "--set", "eta=nan"), "groups.eta = nan")
    assert (tmp_path / "r.nc").read_text() == "earlier work"


@pytest.mark.parametrize(
    "text",
    [
        line("inertia = 0x1"),
        line("stiffness = 10_000"),
        changed("[run]\nperiods = 5\n", ""),
        PLAIN.replace("\n", "\r\n"),
        "\ufeff" + PLAIN,
        "# a.b.c " + "." * 500 + "\n" + PLAIN,
        GROUPED,
    ],
)
def test_right_input_is_not_refused(text):
    assert wb.read_study(text).system.driveline.inertia == 1.0


class Odd:
    """Something that nothing takes."""

    def __repr__(self) -> str:
        return "Odd()"


LINE = {"inertia": 1.0, "damping": 0.1, "stiffness": 1e4}
SYSTEM = wb.paper.system()
# Calls of Python, and how the message begins.
PYTHON: list[tuple[Callable[[], object], str]] = [
    (lambda: wb.Driveline(**LINE | {"inertia": -1}), "driveline.inertia = -1: "),
    (lambda: wb.Driveline(**LINE | {"inertia": "1"}), "driveline.inertia = '1': "),
    (lambda: wb.Driveline(**LINE | {"inertia": None}), "driveline.inertia = None: "),
    (lambda: wb.Driveline(**LINE | {"inertia": 10**5000}), "driveline.inertia = (int too long"),
    (lambda: wb.Driveline(**LINE | {"inertia": np.eye(2)}), "driveline.inertia = [[1.0, 0.0], "),
    (lambda: wb.Driveline(**LINE | {"inertia": np.True_}), "driveline.inertia = True: "),
    (lambda: wb.Driveline(inertia=1.0, damping=0.1), "driveline.stiffness: missing"),
    (lambda: wb.Driveline(inertai=1.0, **LINE), "driveline.inertai: no such parameter"),
    (lambda: wb.WedgeBrake(angle=19.5, radius=0.2), "brake.angle = 19.5: "),
    (wb.BrakedDriveline, "driveline: missing"),
    (lambda: wb.load_study(3), "path = 3: "),
    (lambda: wb.read_study(3), "content = 3: "),
    (lambda: wb.save_study(SYSTEM, "a.toml"), "study = "),
    *(
        (lambda call=call: call(Odd()), "system = Odd(): ")
        for call in (wb.simulate, wb.stability, wb.motion, wb.poincare, wb.orbit, wb.sweep)
    ),
]


@pytest.mark.parametrize("case", range(len(PYTHON)), ids=lambda i: PYTHON[i][1][:30])
def test_python_says_the_same(case):
    make, begin = PYTHON[case]
    with pytest.raises(wb.InputError, match=f"^{re.escape(begin)}"):
        make()


# Arguments with which a function does its work at once, and bad values for some of them.
GOOD = {
    wb.simulate: {"periods": 2},
    wb.poincare: {"periods": 3, "transient": 1},
    wb.motion: {"periods": 30, "transient": 10},
    wb.orbit: {"order": 1, "initial": (0.01, 0.0)},
    wb.sweep: {"eta": [-6.0], "periods": 3, "transient": 1},
}
OF_A_RESPONSE = (wb.sticks, wb.energy, wb.brake_torque)
NUMBERS = {
    wb.simulate: ("periods", "samples_per_period", "start_time", "rtol", "step", "max_events"),
    wb.poincare: ("periods", "transient", "section_time", "max_steps"),
    wb.motion: ("periods", "transient", "limit", "rtol", "step", "max_steps"),
    wb.orbit: ("order", "rtol"),
    wb.sweep: ("eta", "periods", "transient", "limit", "threads"),
    **dict.fromkeys(OF_A_RESPONSE, ("start",)),
}


@pytest.fixture(scope="module")
def response():
    return wb.simulate(SYSTEM, periods=4)


@pytest.mark.parametrize("bad", [Odd(), "nonsense", np.nan, -1.5, 10**400, True], ids=str)
@pytest.mark.parametrize(
    ("function", "name"),
    [(function, name) for function, found in NUMBERS.items() for name in found],
    ids=lambda one: getattr(one, "__name__", one),
)
def test_a_bad_number_is_refused_by_its_name(function, name, bad, response):
    subject = response if function in OF_A_RESPONSE else SYSTEM
    with pytest.raises(wb.InputError, match=rf"^{name}\b"):
        function(subject, **{**GOOD.get(function, {}), name: bad})


@pytest.mark.parametrize("function", [wb.simulate, wb.motion, wb.orbit, wb.sweep])
@pytest.mark.parametrize("bad", [Odd(), "ab", (0.0,), (0.0, np.nan), (True, 0.0)], ids=str)
def test_a_bad_state_is_refused(function, bad):
    with pytest.raises(wb.InputError, match=r"^initial(\[\d\])? = "):
        function(SYSTEM, **{**GOOD[function], "initial": bad})


def test_axes_of_sweeps_and_maps_say_the_same():
    for function in (wb.sweep, wb.bifurcation, wb.stability_map):
        for value in (Odd(), "nonsense", [np.nan], [], [[1.0], [2.0, 3.0]], np.eye(2)):
            with pytest.raises(wb.InputError, match=r"^(?:\w+ \()?eta\b.*\."):
                function(SYSTEM, eta=value)
        with pytest.raises(wb.InputError, match=r"^etta: .*(?:Did you mean 'eta'|Allowed)"):
            function(SYSTEM, etta=[1.0])


TINY = {
    "driveline": ("inertia", "damping", "stiffness", "drive_speed"),
    "brake": ("radius", "angle"),
    "friction": ("kinetic", "static"),
    "actuation": ("initial_force", "slope"),
    "excitation": ("amplitude",),
}


@pytest.mark.parametrize(("part", "name"), [(part, name) for part in TINY for name in TINY[part]])
def test_numbers_whose_powers_vanish_are_refused(part, name):
    """They would end in a division by zero, or in a solver that does not advance."""
    signed = name in ("drive_speed", "slope")
    for value in (5e-324, 1e-308, 1e-60, *([-5e-324] if signed else [])):
        with pytest.raises(wb.InputError, match=f"{part}.{name} = {value!r}: must be"):
            SYSTEM.replace(**{name: value})
    # The least that is allowed can be computed with.
    both = {"kinetic": 1e-50, "static": 1e-50}
    least = SYSTEM.replace(**both if part == "friction" else {name: 1e-50})
    wb.stability(least)
    response = wb.simulate(least, periods=2, max_events=500, times=[])
    ends = {"completed", "diverged", "event_limit", "no_forward_solution"}
    assert response.attrs["status"] in ends


def test_numpy_numbers_and_arrays_are_numbers_and_lists():
    line = wb.Driveline(inertia=np.float32(1.5), damping=np.array(0.5), stiffness=np.int64(10))
    assert (line.inertia, line.damping, line.stiffness) == (1.5, 0.5, 10.0)
    law = wb.TabulatedFriction(speeds=np.array([0.0, 1.0]), coefficients=np.array([0.4, 0.3]))
    assert law.nodes() == ((0.0, 0.4), (1.0, 0.3))
    assert wb.simulate(SYSTEM, periods=np.int32(2), times=[]).attrs["status"] == "completed"

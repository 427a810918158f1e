"""Wrong input: the message names the argument and its value, exit status 2, nothing is written."""

from __future__ import annotations

import copy
import pickle
import re
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import wedgebrake as wb
from printed import names
from wedgebrake.model.studies.study import RunSettings, parse_study
from wedgebrake.model.validation import wrong

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


# Values of TOML that a parameter of the plain study cannot have, and of the groups of the other
# one: the message begins with the parameter.
VALUES = {
    "driveline.inertia": ['"1.0 kg"', "-1.0", "0", "true", "[1.0]", "2014-01-01", HUGE],
    "driveline.damping": ["nan"],
    "driveline.stiffness": ["inf", "1e300"],
    "actuation.slope": ["-inf"],
    "actuation.initial_force": ["-300.0"],
    "actuation.release": ["1", '"yes"'],
    "excitation.amplitude": ["-500.0"],
    "excitation.frequency": ["0"],
    "friction.static": ["0.2"],
    "run.periods": ["0", "2.5", "250.0", "true", '"5"', HUGE],
    "run.duration": ["-1", "nan", "inf", '"25 kg"'],
    "run.initial": ["[0.0]", "[0, 0, 0]", "0"],
    "run.initial[0]": ["[nan, 0]", "[1e13, 0]"],
    "run.initial[1]": ["[0, true]"],
    "run.start_time": ["-1", "nan"],
    "run.method": ['"exakt"', "3"],
    "run.samples_per_period": ["0"],
    "run.rtol": ["1e-16", "nan"],
    "run.max_events": ["0", "1e7"],
    "run.max_steps": [HUGE],
    "groups.eta": ["nan", HUGE, '"-24"', "true", "[1]"],
    "groups.f": ["inf", "-1"],
    "groups.F0": ["0"],
    "groups.alpha": ["0"],
}


@pytest.mark.parametrize(("name", "value"), [(n, v) for n, found in VALUES.items() for v in found])
def test_wrong_value(name, value):
    where, key = name.partition("[")[0].split(".")
    tables = tomllib.loads(GROUPED if where == "groups" else PLAIN)
    if name == "run.duration":
        del tables["run"]["periods"]
    tables[where][key] = tomllib.loads(f"x = {value}")["x"]
    with pytest.raises(wb.InputError, match=f"^{re.escape(name)} = ") as caught:
        parse_study(tables)
    assert len(str(caught.value)) < 600


# Study files, and what the message must name.
FILES: list[tuple[str | bytes, str]] = [
    (line("inertia = -1.0"), "driveline.inertia = -1.0"),
    (changed("inertia =", "inertia.value ="), "driveline.inertia = {'value': 1.0}"),
    (line(f"inertia = {ENDLESS}"), "is not TOML"),
    (wedge("angle = 19.5"), "19.5 looks like degrees: write 0.340339"),
    (changed('"conventional"', '"band"\nwrap_angle = 230'), "degrees: write 4.01426"),
    (line("kinetic = 30"), "30 looks like percent: write 0.3"),
    # Names.
    (changed("inertia =", "inertai ="), "driveline.inertai: no such parameter. Did you mean 'ine"),
    (changed("inertia = 1.0", ""), "driveline.inertia: missing"),
    (changed("inertia =", '"inertia\\u001b[31m" ='), "driveline.'inertia\\x1b[31m'"),
    (line("inertia = 1.0\n" + "".join(f"k{i} = 1\n" for i in range(5000))), "driveline.k0"),
    (changed("[driveline]", "[drivelin]"), "[drivelin]: no such table. Did you mean 'driveline'"),
    (changed("[driveline]", "[[driveline]]"), "driveline = [{'inertia'"),
    ("driveline = 3\n" + changed("[driveline]", "[run.x]"), "driveline = 3"),
    ("inertia = 1.0\n" + PLAIN, "inertia = 1.0: stands outside"),
    (changed("[friction]", ""), "'kind = \"coulomb\"'"),
    ("[driveline]\ninertia = 1.0\n", "missing: [brake], [friction], [actuation], [excitation]"),
    # Kinds.
    (changed('"conventional"', '"konventional"'), "brake.kind = 'konventional'"),
    (changed('kind = "conventional"', ""), "brake.kind: missing"),
    (line("radius = 0.2\nangle = 0.3"), "brake.angle: no such parameter"),
    (wedge(""), "brake.angle: missing"),
    # Lists.
    (table("[0, 1]", "[0.3]"), "friction.coefficients: has 1 values"),
    (table("[]", "[]"), "friction.speeds = []"),
    (table("[0, 2, 1]", "[0.3, 0.3, 0.3]"), "friction.speeds: 1.0 follows 2.0"),
    (table("[1, 2]", "[0.3, 0.3]"), "friction.speeds[0] = 1.0"),
    (table("[0, 1]", "[0.3, nan]"), "friction.coefficients[1] = nan"),
    (table("[0, true]", "[0.3, 0.3]"), "friction.speeds[1] = True"),
    (table("[0, 1]", "[0.3, -0.3]"), "friction.coefficients[1] = -0.3"),
    (table(str(list(range(10_001))), str([0.3] * 10_001)), "friction.speeds = [0, 1, 2"),
    # Groups.
    (GROUPED + "loss_factor = 0.1", "groups.loss_factor"),
    (line("eta = 1e300", GROUPED), "slope = "),
    (changed('"wedge"', '"conventional"', GROUPED), "groups.alpha: not defined"),
    (changed("[groups]", "[[groups]]", GROUPED), "groups = [{"),
    # Run.
    (run_of("duration = 1.0\nperiods = 5"), "run.duration = 1.0 and run.periods = 5"),
    (run_of("periodes = 5"), "run.periodes: no such parameter. Did you mean 'periods'?"),
    # Not TOML; too much.
    (b"# later\n", "missing: [driveline]"),
    (line("inertia = 1,0"), "in 'inertia = 1,0'"),
    (line("inertia = 1.0\ninertia = 2.0"), "in 'inertia = 2.0'"),
    (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), "is not text"),
    (PLAIN.encode("utf-16"), "is not text"),
    (PLAIN + "# more\n" * 300_000, "is larger than 1000000 bytes"),
    (line("inertia = " + "[" * 50_000), "nested"),
    ("[" + "a." * 20_000 + "b]", "nested"),
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
        (changed('"coulomb"', '"smoothed"', run_of('method = "exact"')), "method 'exact'"),
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
    (["stability", "ok.toml", "--out", "r.nc"], "--out"),
    (["simulate"], "STUDY.toml"),
    # The study.
    (["simulate", "no.toml"], "no.toml: no such file"),
    (["simulate", "."], ".: is a directory"),
    (["stability", "ok.toml/a.toml"], "ok.toml/a.toml: cannot be read"),
    (["stability", "x" * 300], "too long"),
    (["stability", "/dev/zero"], "/dev/zero: is larger than"),
    # --set.
    ([*SET, "eta"], "--set eta:"),
    (SET, "--set"),
    ([*SET, "eta=1", "--set", "eta=2"], "--set eta: given twice"),
    ([*SET, "inertai=1"], "inertai: no such parameter or group. Did you mean 'inert"),
    ([*SIMULATE, "--set", "initial_velocity=5"], "Did you mean 'initial'?"),
    ([*SET, "omega=20"], "Did you mean 'drive_speed' or 'frequency'?"),
    ([*SET, "angle=0.3"], "'wedge'"),
    ([*SET, "eta=nan"], "groups.eta = nan"),
    ([*SET, f"damping={ENDLESS}"], "damping = inf"),
    ([*SET, "eta=low"], "groups.eta = 'low'"),
    ([*SET, "eta=1,5"], "--set eta=1,5"),
    ([*SET, "initial=" + "[" * 20_000], "--set 'initial=[["),
    ([*SET, "release=True"], "actuation.release = 'True'"),
    ([*SET, "brake=band"], "--set brake=band"),
    ([*SET, "brake.kind=leading-shoe"], "'band', 'conventional', 'leading-shoe', 'wedge'"),
    ([*SET, "driveline.inertia=2"], "without its table: inertia"),
    ([*SET, "\x1b[1m=2"], "'\\x1b[1m'"),
    # Other options.
    ([*SIMULATE, "--method", "exakt"], "--method exakt: not known. Did you mean 'exact'?"),
    ([*SIMULATE, "--method", "exact", "--set", "method=smooth"], "--method and --set method"),
    ([*SIMULATE, "--out", "r.txt"], "--out r.txt"),
    ([*SIMULATE, "--out", "folder.nc"], "--out folder.nc: is a directory"),
    ([*SIMULATE, "--out", "ok.toml/r.nc"], "--out ok.toml/r.nc: cannot be written"),
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


def test_all_mistakes_of_a_file_are_told_at_once(run, tmp_path):
    text = line("inertia = -1.0", line("kinetic = 30", line("periods = 0")))
    (tmp_path / "study.toml").write_text(text)
    result = run("stability", "study.toml")
    check(result, "driveline.inertia = -1.0", "friction.kinetic = 30", "run.periods = 0")


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
    monkeypatch.setattr("wedgebrake.model.validation.find_spec", lambda _: None)
    endless = ["--set", "periods=1000000"]
    check(run(*SIMULATE, "--out", "r.nc", *endless), "--out r.nc", "'wedgebrake[netcdf]'")


@pytest.mark.parametrize(
    "text",
    [
        changed("[run]\nperiods = 5\n", ""),
        PLAIN.replace("\n", "\r\n"),
        "\ufeff" + PLAIN,
        "# a.b.c " + "." * 500 + "\n" + PLAIN,
        GROUPED,
    ],
)
def test_right_input_is_not_refused(text):
    assert wb.read_study(text).system.driveline.inertia == 1.0


ODD = type("Odd", (), {"__repr__": lambda _: "Odd()"})()
LINE = {"inertia": 1.0, "damping": 0.1, "stiffness": 1e4}
SYSTEM = wb.paper.system()
# Calls of Python, and how the message begins.
PYTHON: list[tuple[Callable[[], object], str]] = [
    (lambda: wb.Driveline(**LINE | {"inertia": -1}), "driveline.inertia = -1: "),
    (lambda: wb.Driveline(**LINE | {"inertia": 10**5000}), "driveline.inertia = (int too long"),
    (lambda: wb.Driveline(**LINE | {"inertia": np.eye(2)}), "driveline.inertia = [[1.0, 0.0], "),
    (lambda: wb.Driveline(**LINE | {"inertia": np.True_}), "driveline.inertia = True: "),
    (lambda: wb.Driveline(inertia=1.0, damping=0.1), "driveline.stiffness: missing"),
    (wb.BrakedDriveline, "driveline: missing"),
    (lambda: wb.load_study(3), "path = 3: "),
    (lambda: wb.load_study("a\0b"), "a\0b: cannot be read"),
    (lambda: wb.read_study(3), "content = 3: "),
    (lambda: wb.save_study(SYSTEM, "a.toml"), "study = "),
    *(
        (lambda call=call: call(ODD), "system = Odd(): ")
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
    wb.paper.ode14x: {"periods": 2},
    wb.poincare: {"periods": 3, "transient": 1},
    wb.motion: {"periods": 30, "transient": 10},
    wb.orbit: {"order": 1, "initial": (0.01, 0.0)},
    wb.sweep: {"eta": [-6.0], "periods": 3, "transient": 1},
}
OF_A_RESPONSE = (wb.sticks, wb.energy, wb.brake_torque)
NUMBERS = {
    wb.simulate: ("periods", "samples_per_period", "rtol", "max_events"),
    wb.paper.ode14x: ("periods", "samples_per_period", "step", "max_steps"),
    wb.poincare: ("periods", "transient", "section_time", "max_steps"),
    wb.motion: ("periods", "transient", "limit", "rtol", "max_steps", "method"),
    wb.orbit: ("order", "rtol", "limit", "method"),  # also where a guess makes the limit unused
    wb.sweep: ("eta", "periods", "transient", "limit", "threads", "method"),
    **dict.fromkeys(OF_A_RESPONSE, ("start",)),
}


@pytest.fixture(scope="module")
def response():
    return wb.simulate(SYSTEM, periods=4)


@pytest.mark.parametrize("bad", [ODD, "nonsense", np.nan, 0.5 - 1.5e15, 10**400, True], ids=str)
@pytest.mark.parametrize(
    ("function", "name"),
    [(function, name) for function, found in NUMBERS.items() for name in found],
    ids=lambda one: getattr(one, "__name__", one),
)
def test_a_bad_number_is_refused_by_its_name(function, name, bad, response):
    subject = response if function in OF_A_RESPONSE else SYSTEM
    with pytest.raises(wb.InputError, match=rf"^{name}\b"):
        function(subject, **{**GOOD.get(function, {}), name: bad})


@pytest.mark.parametrize("function", [wb.simulate, wb.paper.ode14x, wb.motion, wb.orbit, wb.sweep])
@pytest.mark.parametrize("bad", [ODD, "ab", (0.0,), (0.0, np.nan), (True, 0.0)], ids=str)
def test_a_bad_state_is_refused(function, bad):
    with pytest.raises(wb.InputError, match=r"^initial(\[\d\])? = "):
        function(SYSTEM, **{**GOOD[function], "initial": bad})


@pytest.mark.parametrize("function", [wb.sweep, wb.bifurcation, wb.stability_map])
def test_a_bad_axis_is_refused(function):
    for value in (ODD, "nonsense", [np.nan], [], [[1.0], [2.0, 3.0]], np.eye(2)):
        with pytest.raises(wb.InputError, match=r"^(?:\w+ \()?eta\b"):
            function(SYSTEM, eta=value)
    with pytest.raises(wb.InputError, match=r"^etta: "):
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
    given = {"step": float(np.float32(1e-3)), "samples": 50, "max_steps": 10_000}
    numbers = {"step": np.float32(1e-3), "samples": np.int16(50), "max_steps": np.uint64(10_000)}
    found, expected = (wb.paper.ode14x(SYSTEM, periods=2, **one) for one in (numbers, given))
    assert found.identical(expected)


PAPER = wb.paper.system()
MACHINE = PAPER.replace(amplitude=0.0).machine
ANY = np.array(["eta"])


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("system", lambda _: wb.Study(5, wb.load_study("examples/paper.toml").run)),
        ("run", lambda _: wb.Study(PAPER, run=5)),
        ("run.initial", lambda _: wb.Study(MACHINE, RunSettings(initial=(0.0, 1.0)))),
        ("sweep", lambda _: wb.Study(PAPER, wb.load_study("examples/paper.toml").run, 5)),
        ("system", lambda _: wb.basins(5, {"a.angle": [0.0], "a.speed": [0.0]})),
        ("system", lambda _: wb.basins(None, initial_angle=[0.0], initial_velocity=[0.0])),
        ("over", lambda _: wb.sweep(MACHINE, {5: [1]})),
        ("over", lambda _: wb.sweep(PAPER, {5: [1]})),
        ("over", lambda _: wb.stability_map(PAPER, {5: [1]})),
        ("over", lambda _: wb.stability_map(MACHINE, {5: [1]})),
        ("changes", lambda _: MACHINE.replace({5: 1.0})),
        ("response", lambda _: wb.stopping(wb.poincare(PAPER, periods=4, transient=2))),
        ("response", lambda _: wb.energy(wb.poincare(PAPER, periods=4, transient=2))),
        ("response", lambda given: wb.stopping(wb.spectrum(given))),
        ("window", lambda given: wb.spectrum(given, window=True)),
        ("window", lambda given: wb.spectrum(given, window=8)),
        ("window", lambda given: wb.spectrum(given, window=given)),
        ("follow", lambda given: wb.sweep(PAPER, eta=[-6.0, -5.0], follow=given)),
        ("follow", lambda _: wb.sweep(PAPER, eta=[-6.0, -5.0], follow=ANY)),
    ],
)
def test_an_argument_of_another_kind_is_refused_by_its_name(name, call, response):
    with pytest.raises(wb.InputError) as raised:
        call(response)
    assert raised.value.name == name
    assert raised.value.allowed


class TestStructure:
    """Errors are reworded from their attributes; ``str`` of an error is never taken apart."""

    def test_a_new_name_and_sign(self):
        error = wrong("order", 0, "a whole number", "Try 1.")
        new = error.renamed(lambda name: f"--{name}", " ")
        assert str(new) == "--order 0: must be a whole number. Try 1."
        assert (new.name, new.value, new.allowed) == ("--order", 0, "a whole number")

    def test_a_name_elsewhere_in_the_message_stays(self):
        error = wrong("a", "a = 1: a", "another a")
        assert str(error.renamed(lambda _: "b")) == "b = 'a = 1: a': must be another a."

    def test_several_errors(self):
        parts = wrong("a", 1, "0"), wrong("b", 2, "0")
        both = wb.InputError.joined(parts, "... and more.")
        assert both.errors == parts
        assert (both.name, both.value) == ("a", 1)
        new = both.renamed(lambda name: f"x.{name}")
        assert [one.name for one in new.errors] == ["x.a", "x.b"]
        assert str(new) == "x.a = 1: must be 0.\nx.b = 2: must be 0.\n... and more."
        assert wb.InputError.joined([both, wrong("c", 3, "0")]).errors[-1].name == "c"

    def test_of_a_study_file(self):
        text = wb.Study(wb.paper.system(), RunSettings()).to_toml()
        wrong_text = text.replace("inertia = 1.0", "inertia = -1.0") + "\n[run]\nduration = -1.0\n"
        with pytest.raises(wb.InputError) as raised:
            wb.read_study(wrong_text)
        assert [one.name for one in raised.value.errors] == ["driveline.inertia", "run.duration"]

    @pytest.mark.parametrize("error", [wb.InputError, wb.OutputError])
    def test_copies_keep_the_attributes(self, error):
        one = error("path = 'x': gone.", name="path", value="x", allowed="a file")
        for other in (copy.copy(one), pickle.loads(pickle.dumps(one))):  # noqa: S301 - our own
            assert (str(other), other.name, other.value) == (str(one), "path", "x")
            assert other.errors == (other,)
            assert str(other.renamed(lambda _: "--out", " ", "x")) == "--out x: gone."

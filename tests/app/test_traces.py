"""Measured traces on the page: files, the motion beside them, fits, and their limits."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import wedgebrake as wb
from wedgebrake.errors import InputError
from wedgebrake.explorer.core import fits, traces
from wedgebrake.explorer.core.plots import measured
from wedgebrake.explorer.core.presets import preset
from wedgebrake.explorer.core.scheduler import Scheduler
from wedgebrake.explorer.core.studies import state_of

EXAMPLES = Path(__file__).parents[2] / "examples"
CONTENT = (EXAMPLES / "trace.csv").read_bytes()
TRACE = traces.read("trace.csv", CONTENT)
STATE = preset("start").state().edited(plot="trace", trace=TRACE)
FREE = {"kinetic": (0.1, 0.5), "slope": (-100.0, 0.0)}


@pytest.mark.parametrize(
    "content",
    [
        b"", b"a,b\n1,x\n", b"time,velocity\n0,1\n0,2\n1,2\n3,2\n", b"\xff\xfe\x00",
        b"time,velocity\n0,1\n1,2\n2,3\n", b"time,word\n0,a\n1,b\n2,c\n3,d\n4,e\n",
    ],
)  # fmt: skip
def test_a_bad_file_has_the_errors_of_the_command_line(content, tmp_path):
    path = tmp_path / "bad.csv"
    path.write_bytes(content)
    with pytest.raises(InputError) as wanted:
        wb.fit(wb.paper.system(), path, {"kinetic": (0.1, 0.5)})
    with pytest.raises(InputError) as found:
        traces.read(str(path), content)
    assert str(found.value) == str(wanted.value)


@pytest.mark.parametrize(
    "content",
    [
        b"time,velocity\n" + b"0,1\n" * 600_000,
        b"time" + b",c" * 20_000 + b"\n",
        b"time,velocity\n" + b"".join(b"%d,1\n" % k for k in range(500_001)),
        b"time,velocity\n" + b"0," + b"1" * 70_000_000,
    ],
)
def test_a_large_file_is_refused(content):
    with pytest.raises(InputError, match=r"big\.csv"):
        traces.read("big.csv", content)


def test_the_motion_beside_the_trace_is_that_of_simulate():
    picture = next(measured.pictures(STATE))
    ((quantity, unit, values, model),) = picture.columns.values()
    assert (quantity, unit, picture.progress) == ("velocity", "rad/s", "")
    assert np.array_equal(values, TRACE.trace.columns["velocity"])
    time = TRACE.trace.time
    found = wb.simulate(STATE.system, float(np.ptp(time)), times=time, initial=(0.0, 0.0))
    assert np.array_equal(model, found["velocity"].to_numpy())


def test_the_inputs_are_the_machine_and_the_trace():
    inputs = measured.inputs(STATE)
    assert measured.inputs(STATE.edited(free=FREE, shown=30)) == inputs
    for other in (
        {"slope": -30.0}, {"initial_angle": 0.01}, {"observe": {"velocity": "angle"}},
        {"trace": traces.read("trace.csv", CONTENT)},
    ):  # fmt: skip
        assert measured.inputs(STATE.edited(**other)) != inputs, other


def test_a_run_that_ends_early_says_so():
    state = STATE.edited(brake="wedge", kinetic=0.5, alpha=0.7, initial_velocity=5.0)
    picture = next(measured.pictures(state))
    ((*_, model),) = picture.columns.values()
    assert np.isnan(model).any() == bool(picture.progress)


def test_the_fit_is_that_of_the_library_and_can_be_taken_over():
    (found,) = fits.fits(STATE.edited(free=FREE))
    system = wb.load_study(EXAMPLES / "paper.toml").system
    wanted = wb.fit(system, EXAMPLES / "trace.csv", FREE)
    for name in FREE:
        assert found.values[name] == pytest.approx(wanted.values[name], rel=1e-9)
        assert found.stderr[name] == pytest.approx(wanted.stderr[name], rel=1e-6)
    state = STATE.edited(**fits.of_machine(STATE, found.values))
    ((_, _, values, model),) = next(measured.pictures(state)).columns.values()
    residual = float(np.sqrt(np.mean((values - model) ** 2)))
    assert residual == pytest.approx(found.rms["velocity"], rel=1e-6)


def test_units_in_names_are_read_once():
    columns = {"time [ms]": 1e3 * TRACE.trace.time}
    columns["velocity [rpm]"] = TRACE.trace.columns["velocity"] * 30.0 / np.pi
    content = pd.DataFrame(columns).to_csv(index=False).encode()
    state = STATE.edited(trace=traces.read("units.csv", content), free=FREE)
    assert state.view.observe == {"velocity [rpm]": "velocity"}
    (found,), (wanted,) = fits.fits(state), fits.fits(STATE.edited(free=FREE))
    assert found.values == pytest.approx(wanted.values, rel=1e-9)
    assert found.rms["velocity [rpm]"] == pytest.approx(wanted.rms["velocity"], rel=1e-9)


def test_what_is_not_of_the_machine_is_not_taken_over():
    values = {"kinetic": 0.3, "initial_velocity": 1.0, "time_shift": 0.1, "velocity.scale": 2.0}
    assert set(fits.of_machine(STATE, values)) == {"kinetic", "initial_velocity"}


def test_columns_of_another_machine_keep_their_names_where_they_can():
    machine = state_of(wb.load_study(EXAMPLES / "belt.toml"), STATE.view)
    assert machine.view.trace is TRACE
    assert machine.view.observe == {"velocity": "velocity"}
    assert STATE.edited(observe={}).view.observe == {}
    with pytest.raises(InputError, match="observe"):
        next(measured.pictures(STATE.edited(observe={})))


@pytest.mark.parametrize(
    ("free", "word"),
    [({}, "free"), ({"kinetik": (0.1, 0.5)}, "kinetik"), ({"kinetic": (0.4, 0.5)}, "kinetic")],
)
def test_a_fit_that_is_refused_says_why(free, word):
    with pytest.raises(InputError, match=word):
        next(fits.fits(STATE.edited(free=free)))


def test_a_trace_that_is_too_long_is_refused():
    time = np.arange(10) * 1e6
    long = traces.MeasuredTrace("long.csv", traces.Trace(time, {"velocity": np.zeros(10)}))
    with pytest.raises(InputError, match="seconds"):
        next(measured.pictures(STATE.edited(trace=long)))
    with pytest.raises(InputError, match="seconds"):
        next(fits.fits(STATE.edited(trace=long, free=FREE)))


def test_a_fit_has_a_time_limit(monkeypatch):
    monkeypatch.setattr(fits, "LONGEST_FIT", 0)
    with pytest.raises(InputError, match="time limit"):
        next(fits.fits(STATE.edited(free=FREE)))


def test_a_fit_that_is_stopped_frees_its_thread():
    scheduler = Scheduler(threads=1)
    slot, ended = scheduler.slot(lambda call: call()), threading.Event()
    shown: list[object] = []
    begun = threading.Event()

    def steps():
        begun.set()
        yield from fits.fits(STATE.edited(free=FREE))

    slot.start(steps(), shown.append, shown.append)
    assert begun.wait(10)
    slot.stop()
    after = scheduler.slot(lambda call: call())
    after.start(iter([1]), lambda _: ended.set(), lambda _: None)
    assert ended.wait(1.9)  # before another thread takes the place of this one
    assert shown == []
    scheduler.close()


@pytest.mark.parametrize(
    ("text", "free"),
    [
        ("", {}),
        ("kinetic=0.1:0.5, slope=-100:0", FREE),
        (" kinetic = 0.1 : 0.5 ", {"kinetic": (0.1, 0.5)}),
    ],
)
def test_ranges_as_text(text, free):
    assert traces.parsed_ranges(text) == free
    assert traces.parsed_ranges(traces.ranges_text(free)) == free


@pytest.mark.parametrize("text", ["kinetic", "kinetic=0.1", "=0.1:0.5", "kinetic=a:b", "k=1:2:3"])
def test_wrong_ranges(text):
    with pytest.raises(InputError, match="NAME=LOW:HIGH"):
        traces.parsed_ranges(text)

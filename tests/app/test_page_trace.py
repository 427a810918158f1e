"""A measured trace on the page: loaded, seen beside the motion, fitted, taken over."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import expect
from screen import near

import wedgebrake as wb
from wedgebrake.explorer.core.limits import MOST_MESSAGE
from wedgebrake.figures.data.trace import MEASURED, MODEL

EXAMPLES = Path(__file__).parents[2] / "examples"


def load(screen, name, content):
    given = {"name": name, "mimeType": "text/csv", "buffer": content.encode()}
    screen("load-trace").set_input_files(given)


def test_a_trace_is_fitted_and_its_values_taken_over(screen):
    screen("tab-trace").click()
    expect(screen("plot-trace")).to_contain_text("Load a measured trace")
    expect(screen("fit")).to_be_hidden()
    # Files that are no traces are refused in words.
    load(screen, "bad.csv", "time,velocity\n0,1\n0,2\n1,2\n3,2\n")
    screen.refused("must be greater than the time before it")
    load(screen, "<img src=x onerror=alert(1)>.csv", "")
    screen.refused("<img")
    load(screen, "trace.csv", (EXAMPLES / "trace.csv").read_text())
    expect(screen("column")).to_have_value("velocity")
    expect(screen("observes")).to_have_value("velocity")
    expect(screen("legend").locator("li")).to_have_count(2)
    assert screen.check_layout(1440) <= 900
    drawn = screen.pixels(screen("plot-trace"))
    for colour in (MEASURED, MODEL):
        assert near(drawn, colour).sum() > 100
    # Without a free parameter there is nothing to fit.
    screen("fit").click()
    expect(screen("trace-result")).to_contain_text("no parameter is free")
    screen.type("free", "kinetic")
    screen.refused("NAME=LOW:HIGH")
    screen("add-free").select_option("μₖ  kinetic")
    expect(screen("free")).to_have_value("kinetic=0.05:0.6")
    screen.type("free", "kinetic=0.1:0.5, slope=-100:0")
    screen("fit").click()
    system = wb.load_study(EXAMPLES / "paper.toml").system
    free = {"kinetic": (0.1, 0.5), "slope": (-100.0, 0.0)}
    found = wb.fit(system, EXAMPLES / "trace.csv", free)
    result = screen("fitted")
    half = found.interval()["slope"][1] - found.values["slope"]
    expect(result).to_contain_text(f"{found.values['slope']:.3f} ± {half:.2g}".replace("-", "−"))
    expect(result).to_contain_text(f"{found.rms['velocity']:.3g}")
    assert screen.check_layout(1440) <= 900
    # Of what the trace does not determine, too, it says so.
    screen.type("free", "kinetic=0.1:0.5, initial_force=100:500, radius=0.1:0.3, slope=-100:0")
    screen("fit").click()
    expect(result).to_contain_text("not determined")
    expect(result).to_contain_text("determines only")
    screen.type("free", "kinetic=0.1:0.5, slope=-100:0")
    screen("fit").click()
    expect(result).to_contain_text(f"{found.rms['velocity']:.3g}")
    expect(result).not_to_contain_text("radius")
    before = screen.shown()
    screen("take").click()
    screen.after(before)
    for name, value in found.values.items():
        assert screen.number(name) == pytest.approx(value, rel=1e-4)


def test_a_large_file_is_read_and_a_larger_one_is_refused(screen, tmp_path):
    """25 s at 5 kHz; then more than the server accepts in a message, as a trace and as a study."""
    screen("tab-trace").click()
    trace = np.loadtxt(EXAMPLES / "trace.csv", delimiter=",", skiprows=2)
    time = np.linspace(trace[0, 0], trace[-1, 0], 125_000)
    columns = [time, *[np.interp(time, *trace.T)] * 3]
    path = tmp_path / "large.csv"
    np.savetxt(
        path, np.transpose(columns), "%.9f", ",", header="time,velocity,a,b", comments=""
    )  # fmt: skip
    assert path.stat().st_size > 5_000_000
    screen("load-trace").set_input_files(path)
    expect(screen("legend").locator("li")).to_have_count(2)
    expect(screen("column")).to_have_value("velocity")
    for name, chooser in (("larger.csv", "load-trace"), ("larger.toml", "load")):
        path = tmp_path / name
        with path.open("wb") as file:
            file.truncate(2 * MOST_MESSAGE)
        screen(chooser).set_input_files(path)
        screen.refused(name)
    before = screen.shown()  # the connection is not lost
    screen.type("eta", -20)
    screen.after(before)


def test_a_column_that_measures_nothing(screen):
    """Of another name, it is told what it measures; then it is drawn."""
    screen("tab-trace").click()
    text = (EXAMPLES / "trace.csv").read_text().replace("time,velocity", "time,sensor 1")
    load(screen, "trace.csv", text)
    expect(screen("plot-trace")).to_contain_text("Select the quantity")
    expect(screen("column")).to_have_value("sensor 1")
    screen("observes").select_option("velocity")
    expect(screen("legend").locator("li")).to_have_count(2)
    screen("observes").select_option("not used")
    expect(screen("plot-trace")).to_contain_text("Select the quantity")

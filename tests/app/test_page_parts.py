"""Machines on the page: every number edited by part, and the results of the library."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from browsing import Server
from playwright.sync_api import expect
from screen import _FLAWS

import wedgebrake as wb
from wedgebrake.analysis.linear_stability import linearisation_of
from wedgebrake.explorer.core.export import export
from wedgebrake.explorer.core.fields import sections
from wedgebrake.explorer.core.plots import PARAMETER_PLOTS
from wedgebrake.explorer.core.snapshot import take_snapshot
from wedgebrake.explorer.core.state import PageState
from wedgebrake.explorer.core.studies import study_of
from wedgebrake.explorer.core.verdict import verdict
from wedgebrake.figures.data.class_styles import motion_codes

EXAMPLES = Path(__file__).parents[2] / "examples"
NAMES = (
    "belt", "clutch", "driveline", "electronic_wedge", "ratchet", "rattle", "recorded", "shift",
    "squeal", "tip_in", "torque_control",
)  # fmt: skip


def _state(name: str) -> PageState:
    return PageState.of(wb.load_study(EXAMPLES / f"{name}.toml"))


@pytest.mark.parametrize("name", NAMES)
def test_every_number_has_one_row_by_its_part_and_can_be_edited(name):
    state = _state(name)
    rows = [row for group in sections(state).values() for row in group]
    names = [row.name for row in rows]
    assert len(names) == len(set(names))
    assert len(sections(state)) == len(state.system.parts()) + 1  # and the run
    for row in (row for row in rows if row.kind == "number" and "." in row.name):
        assert row.value == state.system.value(row.name)
        assert row.low < row.high
        if not row.enabled:  # it follows from others by a joint
            continue
        for end in (row.low, row.high):
            value = round(end) if row.whole else end
            edited = state.edited(**{row.name: value})
            assert edited.system.value(row.name) == value, row.name


def test_kinds_of_a_contact_are_chosen_and_restored():
    state = _state("clutch")
    there = state.edited(**{"brake.brake": "wedge", "clutch.friction": "stribeck"})
    kinds = [type(one.brake) for one in there.system.contacts]
    assert kinds == [wb.ConventionalBrake, wb.WedgeBrake]
    assert isinstance(there.system.contacts[0].friction, wb.StribeckFriction)
    back = there.edited(**{"brake.brake": "conventional", "clutch.friction": "coulomb"})
    assert back.system == state.system
    # Static friction follows the kinetic one of its own contact.
    raised = state.edited(**{"clutch.kinetic": 0.5}).system
    assert [one.friction.static for one in raised.contacts] == [0.5, 0.4]


def test_a_driveline_with_a_signal_is_edited_as_its_machine():
    system = wb.paper.system().replace(initial_force=wb.Harmonic(30.0, 3.0) + 300.0)
    state = PageState.of(wb.Study(system, wb.load_study(EXAMPLES / "paper.toml").run))
    assert state.system == system.machine
    name = next(
        one for one in state.system.parameters() if one.endswith("force.signals.0.amplitude")
    )
    assert state.edited(**{name: 50.0}).system.value(name) == 50.0


@pytest.mark.parametrize("name", NAMES)
def test_the_snapshot_is_what_the_library_says(name):
    state = _state(name)
    snapshot = take_snapshot(state, settle=True)
    inertia, history = state.inertia, snapshot.figures.history
    response = wb.simulate(state.system, **{**state.study.arguments(), "samples": 2000})
    expected = response["velocity"].sel(inertia=inertia).to_numpy()
    scale = np.abs(expected).max()
    inside = response["time"].to_numpy() >= history.begin
    found = np.interp(response["time"], history.time, history.velocity)
    np.testing.assert_allclose(found[inside], expected[inside], atol=0.02 * scale)
    said = verdict(state, snapshot)
    assert said["headline"]
    assert all(tile["value"] and tile["hint"] for tile in said["tiles"])
    linear = next(tile for tile in said["tiles"] if tile["name"] == "linear")
    method = linearisation_of(response.attrs["method"])
    try:
        words = wb.stability(state.system, method=method).verdict
    except wb.InputError as refused:
        words = str(refused)
    assert words in linear["hint"]
    assert (words in said["headline"]) == (linear["value"] == "–")
    if state.system.period is None:
        assert snapshot.motion is None
    else:
        final = wb.final_state(wb.simulate(state.system, **state.study.arguments()))
        returns = "crossings" if state.system.autonomous else "periods"
        settled = wb.motion(state.system, initial=final, limit=1000, **{returns: state.recorded})
        assert snapshot.motion.kind == settled.kind
    if state.system.inertia_names[1:]:
        assert list(snapshot.discs.angles) == list(state.system.inertia_names)


def test_the_contact_that_is_shown_is_chosen():
    state = _state("clutch")
    clutch, brake = (
        take_snapshot(state.edited(of_contact=name)).figures for name in ("clutch", "brake")
    )
    assert np.abs(clutch.history.brake_torque).max() == pytest.approx(80.0)
    assert np.abs(brake.history.brake_torque).max() == pytest.approx(800.0)


def test_diagrams_have_the_numbers_of_the_library():
    state = _state("belt").edited(method="exact", spans={"belt.base_speed": (0.4, 1.9)})
    (*_, last) = PARAMETER_PLOTS["diagram"].pictures(state)
    axis = last.axes[0]
    swept = wb.sweep(
        state.system, {axis.name: axis.values(last.whole)}, crossings=state.recorded, limit=1000
    )
    np.testing.assert_array_equal(last.codes, motion_codes(swept))
    np.testing.assert_array_equal(last.data["rms_velocity"].points[0, :, 0],
                                  swept["rms_velocity"].squeeze())  # fmt: skip
    state = state.edited(plot="stability", across="belt.base_speed", up="mass-ground.damping")
    (*_, last) = PARAMETER_PLOTS["stability"].pictures(state)
    assert last.known == last.whole


@pytest.mark.parametrize("name", [one for one in NAMES if one not in ("belt", "recorded")])
def test_files_and_the_program_give_the_machine_back(name, tmp_path):
    state = _state(name).edited(duration=0.5)
    assert wb.read_study(export(state, "study").content) == study_of(state)
    assert export(state, "png").content.startswith(b"\x89PNG")
    assert b"velocity" in export(state, "csv").content
    program = export(state, "python").content.decode()
    names: dict = {}
    exec(program.partition("response = ")[0], names)  # noqa: S102 - our own text
    assert names["system"] == state.system
    compile(program, "study.py", "exec")


def test_the_page_edits_and_draws_a_machine_with_a_controller(visit):
    server = Server(str(EXAMPLES / "torque_control.toml"))
    try:
        screen = visit(server.url)
        state = _state("torque_control")
        screen.says(state)
        for name in state.system.parts():
            assert name in screen("stage-svg").text_content()
        drawn = screen.pixels(screen("stage-svg"))
        screen.drag("brake-kinetic", 0.5)
        screen.still()
        kinetic = screen.number("brake-kinetic")
        assert 0.25 < kinetic < 0.35  # above, the brake locks itself
        screen.tile("linear", "warn")
        screen.says(state.edited(**{"brake.kinetic": kinetic}))
        assert (screen.pixels(screen("stage-svg")) != drawn).any()
        # A stability map over the numbers of the controller.
        screen("tab-stability").click()
        screen("plot-stability").wait_for()
        assert screen.page.evaluate(_FLAWS) == []
        screen.page.set_viewport_size({"width": 420, "height": 900})
        screen.still()
        assert screen.page.evaluate(_FLAWS) == []
    finally:
        server.stop()
    assert "Traceback" not in server.said, server.said


def test_the_page_edits_a_machine(visit):
    server = Server(str(EXAMPLES / "clutch.toml"))
    try:
        screen = visit(server.url)
        state = _state("clutch")
        screen.says(state)
        screen.type("clutch-initial_force", 1000)
        screen.says(state.edited(**{"clutch.initial_force": 1000.0}))
        screen("of-contact").locator("select").select_option("brake")
        screen.page.get_by_text("Torque of brake").wait_for()
        screen.page.get_by_text("clutch s").first.wait_for()  # sticks or slides, in the drawing
        screen.type("load-inertia", -1)
        screen.refused("load.inertia")
        assert screen.page.evaluate(_FLAWS) == []
    finally:
        server.stop()
    assert "Traceback" not in server.said, server.said


def test_amplitude_curves_of_a_sampled_machine(visit, tmp_path):
    """Over the frequency they need the number of samplings in a period, which has an input."""
    text = (EXAMPLES / "electronic_wedge.toml").read_text()
    study = tmp_path / "sampled.toml"
    study.write_text(re.sub("(?m)^resolution.*$", "", text))
    server = Server(str(study))
    try:
        screen = visit(server.url)
        expect(screen("samplings")).to_be_hidden()
        screen("tab-curve").click()
        expect(screen("plot-curve")).to_contain_text("samplings")
        screen.type("levels", "100")
        screen.type("from", "10")
        screen.type("to", "10.2")
        screen.type("samplings", "many")
        screen.refused("samplings")
        expect(screen("samplings")).to_have_value("")
        assert screen.check_layout(1440) <= 900
        # The last input of the row is inside the card.
        last, card = (one.bounding_box() for one in (screen("measure"), screen.card("plots")))
        assert last["x"] + last["width"] < card["x"] + card["width"]
        screen.type("samplings", "100")
        expect(screen("legend").locator("li").get_by_text("unstable", exact=True)).to_be_visible()
        screen("tab-diagram").click()
        expect(screen("samplings")).to_be_hidden()
    finally:
        server.stop()
    assert "Traceback" not in server.said, server.said

"""Sweeps of machines in the explorer: the numbers of the library, and the page."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from browsing import PATIENCE, Server
from playwright.sync_api import expect

import wedgebrake as wb
from wedgebrake.explorer.core.machine_sweep import (
    DIAGRAMS,
    LIMITS,
    MAPS,
    SweepRequest,
    sweep_datasets,
    sweep_pictures,
)
from wedgebrake.explorer.core.machine_view import take_machine_view

EXAMPLES = Path(__file__).parents[2] / "examples"
# With straight lines of friction, which are fast.
BELT = wb.load_study(EXAMPLES / "belt.toml").changed(method="exact")
SPEED = "belt.base_speed"


def test_a_sweep_has_the_numbers_of_the_library():
    request = SweepRequest("response", ((SPEED, 0.4, 1.9),), follow=True)
    found = list(sweep_datasets(BELT, request))
    (*coarse, last), words = zip(*found, strict=True)
    assert [words[-1], len(coarse) >= 2] == ["", True]
    assert last.sizes["branch"] == 2
    own = wb.bifurcation(
        BELT.system, {SPEED: np.linspace(0.4, 1.9, last.sizes[SPEED])}, follow=True, limit=1000
    )
    for name in ("rms_velocity", "motion", "peak_jerk"):
        np.testing.assert_array_equal(last[name], own[name])
    fixed = wb.sweep(BELT.system, {SPEED: coarse[0][SPEED].to_numpy()}, limit=1000)
    np.testing.assert_array_equal(coarse[0]["rms_velocity"], fixed["rms_velocity"])


def test_a_map_over_two_parameters():
    damping = "mass-ground.damping"
    request = SweepRequest("motion", ((SPEED, 0.8, 1.8), (damping, 0.05, 0.3)))
    dataset, _ = next(sweep_datasets(BELT, request))
    own = wb.regime_map(
        BELT.system, {one: dataset[one].to_numpy() for one in (SPEED, damping)}, limit=1000
    )
    np.testing.assert_array_equal(dataset["motion"], own["motion"])


@pytest.mark.parametrize("picture", [*DIAGRAMS, *MAPS])
def test_every_picture_is_drawn(picture):
    ranges = ((SPEED, 0.4, 1.9), ("mass-ground.damping", 0.05, 0.3))
    first = next(sweep_pictures(BELT, SweepRequest(picture, ranges[: 1 + (picture in MAPS)])))
    assert first.picture.startswith(b"\x89PNG")


def test_the_page_shows_the_machine_and_computes_a_sweep(chromium):
    path = EXAMPLES / "belt.toml"
    server = Server(str(path))
    page = chromium.new_page()
    page.set_default_timeout(PATIENCE)
    try:
        page.goto(server.url)
        page.get_by_text(take_machine_view(wb.load_study(path)).sentences[-1]).wait_for()
        page.locator("img").first.wait_for()
        assert page.locator("img").first.bounding_box()["height"] > 300
        for end in ("from", "to"):
            field = page.locator(f".first-{end} input")
            before = field.input_value()
            for text in ("", "fast"):
                field.fill(text)
                field.press("Enter")
                page.locator(".notyf__message").get_by_text(f"{SPEED}, {end}").first.wait_for()
                expect(field).to_have_value(before)
        page.locator(".first-from input").fill("1.0")
        page.locator(".first-to input").fill("0.5")
        page.locator(".first-to input").press("Enter")
        page.get_by_role("button", name="Compute").click()
        page.locator(".said").get_by_text(SPEED).wait_for()
        page.locator(".first-to input").fill("1.9")
        page.locator(".first-to input").press("Enter")
        page.get_by_role("button", name="Compute").click()
        page.locator(".sweep-picture img").wait_for()
        page.locator(".picture select").select_option(DIAGRAMS[LIMITS])
        page.get_by_role("button", name="Compute").click()
        assert page.locator(".sweep-picture img").bounding_box()["height"] > 200
        # A second parameter offers maps.
        page.locator(".second select").select_option(label="mass-ground.damping [N m s/rad]")
        page.locator(".picture option", has_text="Class of motion").wait_for(state="attached")
    finally:
        page.close()
        server.stop()
    assert "Traceback" not in server.said, server.said

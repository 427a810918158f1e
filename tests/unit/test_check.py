"""``check``: right responses obey all laws, and each falsified number violates the law it is of."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wedgebrake as wb
from machine_round import FAMILIES, round_case
from machines import contact, single
from wedgebrake.analysis.responses.check import examine
from wedgebrake.solvers import simulate as front_door

EXAMPLES = Path(__file__).parents[2] / "examples"
CLUTCH = EXAMPLES / "clutch.toml"
STRIBECK = wb.StribeckFriction(kinetic=0.25, static=0.4, speed=0.1)


def of_study(path: Path) -> Any:
    study = wb.load_study(path)
    return wb.simulate(study.system, **study.arguments())


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.toml")), ids=lambda path: path.stem)
def test_examples_obey_all_laws(path):
    response = of_study(path)
    found = examine(response)
    assert found.violations == []
    assert (found.events, found.samples) == (response.sizes["event"], response.sizes["time"])
    assert found.residual <= 1e-9 * found.exchanged


@pytest.mark.parametrize("family", FAMILIES)
def test_machines_with_round_numbers_obey_all_laws(family):
    for seed in range(6):
        case = round_case(family, seed)
        response = wb.simulate(case.machine(), case.duration, samples=101, max_events=5000)
        assert wb.check(response) == [], seed


def test_a_contact_without_force_shares_no_torque_of_a_loop():
    """Its limit is 0, whatever the limits of the contacts beside it."""
    case = round_case("unequal", 21)
    response = wb.simulate(case.machine(), case.duration, samples=101)
    assert np.all(response.actuation_force.sel(contact="contact-2") == 0.0)
    assert np.all(response.brake_torque.sel(contact="contact-2") == 0.0)


def line(drive_speed: Any) -> wb.Driveline:
    return wb.Driveline(inertia=1.0, damping=0.5, stiffness=1e4, drive_speed=drive_speed)


def braked(**changes: Any) -> wb.BrakedDriveline:
    """Stick-slip of a brake under a sine."""
    parts = {
        "driveline": line(0.0),
        "brake": wb.ConventionalBrake(radius=0.2),
        "friction": wb.CoulombFriction(kinetic=0.3, static=0.35),
        "actuation": wb.Actuation(initial_force=600.0),
        "excitation": wb.HarmonicTorque(amplitude=100.0, frequency=10.0),
    }
    return wb.BrakedDriveline(**parts | changes)


@pytest.mark.parametrize(
    ("changes", "method"),
    [
        ({}, "exact"),
        ({"actuation": wb.Actuation(initial_force=600.0, slope=-40.0)}, "exact"),
        ({"actuation": wb.Actuation(initial_force=600.0, slope=-700.0, release=False)}, "exact"),
        ({"actuation": wb.Actuation(initial_force=600.0, slope=-40.0, lag=0.01)}, "exact"),
        ({"actuation": wb.Actuation(initial_force=600.0 + wb.Harmonic(200.0, 3.0))}, "exact"),
        ({"friction": STRIBECK}, "exact"),
        ({"friction": STRIBECK}, "smooth"),
        ({"friction": wb.SmoothedFriction(kinetic=0.3, static=0.35)}, "smooth"),
        ({"brake": wb.WedgeBrake(radius=0.2, angle=0.28)}, "exact"),
        ({"driveline": line(1.0), "friction": STRIBECK}, "smooth"),
        ({"driveline": line(wb.Harmonic(0.5, 1.0))}, "exact"),
    ],
)  # fmt: skip
def test_drivelines_of_all_kinds_obey_all_laws(changes, method):
    response = wb.simulate(braked(**changes), duration=1.0, method=method)
    found = examine(response)
    assert found.violations == []
    assert found.samples == response.sizes["time"]
    assert found.residual < 1e-2 * found.exchanged
    # With a smooth law the events are those of its stick band, and in the last case there are some.
    assert found.events == response.sizes["event"]


def changed(response: Any, name: str, at: Any, value: Any) -> Any:
    """A copy of a response with another value at one place."""
    copy = response.copy(deep=True)
    copy[name][at] = value
    return copy


def laws(response: Any) -> set[tuple[float, str, str]]:
    return {(one.time, one.contact, one.law) for one in wb.check(response)}


@pytest.fixture(scope="module")
def clutch():
    """Engine and plate slide, then stick; the brake, then the whole line comes to rest."""
    return of_study(CLUTCH)


def sample(response: Any, name: str, sticking: bool) -> tuple[int, float]:
    """Number and time of the middle one of the samples at which a contact sticks or slides."""
    own = response.sel(contact=name)
    held = (own.sticking.to_numpy() == sticking) & (own.actuation_force.to_numpy() > 0.0)
    k = np.flatnonzero(held)[np.count_nonzero(held) // 2]
    return int(k), float(response.time[k])


def test_a_torque_of_the_wrong_sign_does_not_oppose_the_sliding(clutch):
    k, time = sample(clutch, "brake", False)
    torque = clutch.brake_torque[k, 1].item()
    wrong = changed(clutch, "brake_torque", (k, 1), -torque)
    assert laws(wrong) == {(time, "brake", "opposes")}
    (found,) = wb.check(wrong)
    assert found.found == abs(torque) == pytest.approx(800.0, rel=1e-14)
    assert found.allowed < 1e-6


@pytest.mark.parametrize(
    ("name", "value", "law", "found"),
    [
        ("brake_torque", 801.0, "friction", 1.0),
        ("actuation_force", 10010.0, "friction", 0.8),
        ("sliding_velocity", 1e-3, "sliding velocity", 1e-3),
        ("brake_torque", np.nan, "finite", None),
        ("actuation_force", np.inf, "finite", None),
    ],
)
def test_false_numbers_of_a_sliding_contact(clutch, name, value, law, found):
    """80 kN m per 1 m N: a brake of 0.2 m, 0.4 and 10 kN slides at 800 N m."""
    k, time = sample(clutch, "brake", False)
    right = clutch[name][k, 1].item()
    given = value if law == "finite" else np.copysign(value, right)
    given = right + value if law == "sliding velocity" else given
    (fault,) = wb.check(changed(clutch, name, (k, 1), given))
    assert fault[:3] == (time, "brake", law)
    if found is not None:
        assert fault.found == pytest.approx(found, rel=1e-9)


def test_a_stick_with_a_speed_slides(clutch):
    k, time = sample(clutch, "brake", True)
    assert clutch.velocity[k, 0].item() == 0.0
    (fault,) = wb.check(changed(clutch, "sliding_velocity", (k, 1), 1e-9))
    assert fault == (time, "brake", "stick", 1e-9, 0.0)
    (fault,) = wb.check(changed(clutch, "velocity", (k, 0), 1e-9))
    assert fault == (time, "brake", "stick", 1e-9, 0.0)


def test_bodies_that_stick_together_have_one_speed(clutch):
    k, time = sample(clutch, "clutch", True)
    engine = clutch.velocity[k, 2].item()
    assert (time, "clutch", "stick") in laws(changed(clutch, "velocity", (k, 2), engine + 1e-9))


def test_a_stick_beyond_its_limit_and_without_balance(clutch):
    k, time = sample(clutch, "brake", True)
    wrong = changed(clutch, "brake_torque", (k, 1), 900.0)
    assert laws(wrong) == {(time, "brake", "limit"), (time, "brake", "balance")}
    limit = next(one for one in wb.check(wrong) if one.law == "limit")
    assert (limit.found, limit.allowed) == pytest.approx((900.0, 800.0), rel=1e-6)
    held = clutch.brake_torque[k, 1].item()
    assert laws(changed(clutch, "brake_torque", (k, 1), held + 1e-4)) == {
        (time, "brake", "balance")
    }


def test_samples_sticks_and_events_agree(clutch):
    for stuck in (False, True):
        k, time = sample(clutch, "brake", stuck)
        assert (time, "brake", "events") in laws(changed(clutch, "sticking", (k, 1), not stuck))
    stick = clutch.stick_start.to_numpy().argmax()
    name = clutch.contact.to_numpy()[clutch.stick_contact[stick].item()]
    start = clutch.stick_start[stick].item()
    found = laws(changed(clutch, "stick_start", stick, start + 1e-3))
    assert {(start + 1e-3, name, "events"), (start, name, "events")} <= found


def test_a_shaft_has_the_torque_of_its_twist(clutch):
    k = 100
    wrong = changed(clutch, "shaft_torque", (k, 0), clutch.shaft_torque[k, 0].item() + 1e-3)
    assert laws(wrong) == {(clutch.time[k].item(), clutch.shaft[0].item(), "shaft")}


def test_false_numbers_of_a_driveline():
    response = wb.simulate(braked(), periods=10)
    moving = np.flatnonzero((response.sticking == 0) & (np.abs(response.velocity) > 0.1))[50]
    held = np.flatnonzero(response.sticking == 1)[5]
    for at, name, value, law in (
        (moving, "brake_torque", -response.brake_torque[moving].item(), "opposes"),
        (moving, "brake_torque", 1.001 * response.brake_torque[moving].item(), "friction"),
        (held, "velocity", 1e-9, "stick"),
        (held, "brake_torque", response.brake_torque[held].item() + 1e-4, "balance"),
    ):
        time = response.time[at].item()
        assert (time, "brake", law) in laws(changed(response, name, at, value)), law
    velocity = response.poincare_velocity[4].item()
    wrong = changed(response, "poincare_velocity", 4, velocity + 1.0)
    assert "energy" in {one.law for one in wb.check(wrong)}


def test_the_law_is_that_of_the_system():
    """A response that claims to be of another friction disagrees with its samples."""
    disc = single(contact(force=1.0), speed=1.0)
    response = wb.simulate(disc, 1.0, samples=11)
    assert wb.check(response) == []
    other = wb.simulate(single(contact(force=1.0, friction=0.4), speed=1.0), 1.0, samples=11)
    response.attrs["system"] = other.attrs["system"]
    found = wb.check(response)
    assert [one.time for one in found if one.law == "friction"] == response.time.to_numpy().tolist()
    assert [one.found for one in found if one.law == "friction"] == pytest.approx([0.1] * 11)


def test_short_runs_and_few_samples_have_no_energy_balance():
    response = wb.simulate(braked(), duration=0.02)
    assert np.isnan(examine(response).residual)
    assert wb.check(response) == []
    assert wb.check(wb.simulate(braked(), duration=0.0)) == []
    assert wb.check(wb.simulate(single(contact()), 1.0, times=[])) == []


def test_it_takes_responses_of_exact_and_smooth():
    with pytest.raises(wb.InputError, match=r"response.*wb\.simulate"):
        wb.check(wb.poincare(braked(), periods=4, transient=2))


@pytest.mark.parametrize("path", [CLUTCH, EXAMPLES / "paper.toml"], ids=lambda path: path.stem)
def test_the_command_prints_a_sentence(run, answer, path):
    found = examine(of_study(path))
    told = answer("simulate", path, "--check")["check"]
    assert (told["events"], told["samples"]) == (found.events, found.samples)
    assert (told["residual"], told["exchanged"]) == (found.residual, found.exchanged)
    assert told["violations"] == []
    status, output, _ = run("simulate", path, "--check")
    sentence = f"all laws hold at {found.events} events and {found.samples} samples"
    assert status == 0
    assert f"{sentence}; energy residual {found.residual:.2g} J" in output
    assert "check" not in answer("simulate", path)


def test_the_command_lists_violations(run, clutch, monkeypatch):
    k, time = sample(clutch, "brake", False)
    wrong = clutch.copy(deep=True)
    wrong["brake_torque"][k - 10 : k + 15, 1] *= -1.0
    monkeypatch.setattr(front_door, "simulate", lambda *_, **__: wrong)
    status, output, _ = run("simulate", CLUTCH, "--check")
    assert status == 1
    assert "check: 25 violations of the laws" in output
    first = float(clutch.time[k - 10])
    assert f"t = {first:.9g} s: brake, opposes: found 800, allowed" in output
    assert "and 5 more" in output
    assert run("simulate", CLUTCH)[0] == 0
    assert time > first

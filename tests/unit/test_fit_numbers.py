"""Fits to measured numbers: periods, stick times, harmonics, orders and measures of a run."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import brentq
from test_fit import TIMES, machine, trace_of

import wedgebrake as wb

Kernel = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def belt(**more: float) -> wb.Machine:
    """A block on a moving belt, held by a spring: stick-slip."""
    made = wb.Machine(
        inertias=[wb.Inertia("block", 1.0, speed=0.1)],
        shafts=[wb.Shaft("block", "ground", name="spring", stiffness=100.0)],
        contacts=[
            wb.Contact(
                "block", name="pad", brake=wb.ConventionalBrake(radius=0.1),
                friction=wb.CoulombFriction(kinetic=0.3, static=0.5),
                actuation=wb.Actuation(initial_force=100.0), base_speed=0.1,
            )
        ],
    )  # fmt: skip
    return made.replace({name.replace("_", ".", 1): value for name, value in more.items()})


def of_belt(system: wb.Machine) -> tuple[float, float]:
    """Period and stick time in closed form.

    With k x = F_s at the beginning of slip, the block leaves the belt at x = F_k / k + D / k with
    the speed v and returns to it at F_k / k - D / k, D = F_s - F_k.
    """
    k, j, v = (system.value(one) for one in ("spring.stiffness", "block.inertia", "pad.base_speed"))
    force = system.value("pad.initial_force") * 0.1
    drop = force * (system.value("pad.static") - system.value("pad.kinetic"))
    stick = 2.0 * drop / (k * v)
    slip = 2.0 * math.sqrt(j / k) * (math.pi - math.atan(drop / (v * math.sqrt(k * j))))
    return stick + slip, stick


def turning() -> wb.Machine:
    """A disc and a hub that turn, with vibration in step with neither."""
    return wb.Machine(
        inertias=[wb.Inertia("disc", 1.0, speed=20.0), wb.Inertia("hub", 0.4, speed=20.0)],
        shafts=[wb.Shaft("disc", "hub", name="shaft", stiffness=300.0, damping=1.0)],
        torques=[wb.Torque("disc", wb.Harmonic(80.0, 4.0, 0.3), name="engine")],
        contacts=[
            wb.Contact(
                "hub", name="brake", brake=wb.ConventionalBrake(radius=0.1),
                friction=wb.CoulombFriction(kinetic=0.3),
                actuation=wb.Actuation(initial_force=20.0),
            )
        ],
    )  # fmt: skip


def integral(system: wb.Machine, part: str, span: tuple[float, float], of: Kernel) -> complex:
    """Integral of a function of time, angle and speed, by Gauss points between events."""
    events = wb.simulate(system, span[1])["event_time"].to_numpy()
    inside = events[(events > span[0]) & (events < span[1])]
    cuts = np.union1d(np.linspace(*span, 201), inside)
    nodes, weights = np.polynomial.legendre.leggauss(12)
    half = 0.5 * np.diff(cuts)[:, None]
    times = (cuts[:-1, None] + half * (1.0 + nodes)).ravel()
    found = wb.simulate(system, span[1], times=times).sel(inertia=part)
    values = of(times, found["angle"].to_numpy(), found["velocity"].to_numpy())
    return complex((half * weights).ravel() @ values)


def harmonic(system: wb.Machine, part: str, number: int, window: tuple[float, float]) -> float:
    """Amplitude at a multiple of the frequency of the engine, over the last whole periods."""
    frequency = system.value("engine.frequency")
    length = math.floor((window[1] - window[0]) * frequency) / frequency
    span = window[1] - length, window[1]
    turn = 2j * math.pi * frequency * number
    return abs(integral(system, part, span, lambda t, _, v: v * np.exp(-turn * t))) * 2.0 / length


def order(system: wb.Machine, part: str, number: int, window: tuple[float, float]) -> float:
    """Amplitude at cycles per turn, over the last whole turns."""

    def angle(time: float) -> float:
        return float(wb.simulate(system, window[1], times=[time])["angle"].sel(inertia=part)[0])

    first, last = map(angle, window)
    turns = math.floor((last - first) / (2.0 * math.pi))
    begin = brentq(lambda t: angle(t) - last + 2.0 * math.pi * turns, *window, xtol=1e-13)
    span = float(begin), window[1]
    found = integral(system, part, span, lambda _, q, v: v**2 * np.exp(-1j * number * q))
    return abs(found) / (math.pi * turns)


def test_period_and_stick_time_in_closed_form() -> None:
    """Both are recovered, from 30 % off, and so is the covariance of the closed form."""
    true = belt()
    period, stick = of_belt(true)
    measured = {"period": (period, 1e-4), "pad.stick_time": (stick, 2e-4)}
    names, window = ("pad.static", "block.inertia"), (1.0, 30.0)
    start = true.replace({"pad.static": 0.65, "block.inertia": 0.7})
    free = {"pad.static": (0.35, 0.9), "block.inertia": (0.3, 2.0)}
    found = wb.fit(start, None, free, measured=measured, window=window)
    assert found.converged
    for name in names:
        assert found.values[name] == pytest.approx(true.value(name), rel=1e-8)
    rows = []
    for name in names:
        at = true.value(name)
        near = [of_belt(true.replace({name: at * (1.0 + h)})) for h in (1e-5, -1e-5)]
        rows.append((np.array(near[0]) - near[1]) / (2e-5 * at) / np.array([1e-4, 2e-4]))
    matrix = np.array(rows).T
    np.testing.assert_allclose(
        found.covariance.to_numpy(), np.linalg.inv(matrix.T @ matrix), rtol=1e-6
    )
    assert found.undetermined == []
    for name, (value, sigma) in measured.items():
        told = found.numbers[name]
        assert told["fitted"] == pytest.approx(value, rel=1e-9)
        assert (told["measured"], told["sigma"], told["unit"]) == (value, sigma, "s")
        assert name in found.report()


def measures_of(system: wb.Machine, names: list[str], duration: float) -> dict[str, float]:
    """Measures of parts of a whole run."""
    words = [name.partition(".")[2] for name in names]
    any_name = next(one for one in system.quantities() if one.endswith(".inertia"))
    found = wb.sensitivity(system, [any_name], duration, of=words)
    dims = {"torque": "contact", "velocity": "inertia"}
    return {
        name: float(found[f"{word}_value"].sel({dims[word.split("_")[1]]: name.partition(".")[0]}))
        for name, word in zip(names, words, strict=True)
    }


def harmonics(system: wb.Machine) -> dict[str, float]:
    """Numbers of a driven machine in the first second."""
    window = 0.0, 1.0
    values = {
        f"{part}.harmonic_{number}": harmonic(system, part, number, window)
        for part, number in (("disc", 1), ("disc", 2), ("hub", 1))
    }
    names = ["brake.peak_torque", "brake.rms_torque", "hub.rms_velocity"]
    return values | measures_of(system, names, 1.0)


def orders(system: wb.Machine) -> dict[str, float]:
    """Numbers of a machine that turns, in the first second."""
    return {
        f"{part}.order_{number}": order(system, part, number, (0.0, 1.0))
        for part, number in (("disc", 1), ("hub", 1), ("disc", 2))
    }


CASES = [
    (machine(), harmonics, ["brake.kinetic", "engine.amplitude", "shaft.stiffness"]),
    (turning(), orders, ["shaft.stiffness", "engine.amplitude"]),
]


@pytest.mark.parametrize(("true", "of", "names"), CASES, ids=["harmonics", "orders"])
def test_amplitudes_and_measures(
    true: wb.Machine, of: Callable[[wb.Machine], dict[str, float]], names: list[str]
) -> None:
    """Without noise the parameters come back; the covariance is that of differences."""
    values = of(true)
    measured = {name: (value, 0.01 * value) for name, value in values.items()}
    start = true.replace(
        {name: (1.3, 0.7)[i % 2] * true.value(name) for i, name in enumerate(names)}
    )
    free = {name: (0.5 * true.value(name), 1.6 * true.value(name)) for name in names}
    found = wb.fit(start, None, free, measured=measured, window=(0.0, 1.0))
    for name in names:
        assert found.values[name] == pytest.approx(true.value(name), rel=1e-8)
    rows = []
    for name in names:
        at, step = true.value(name), 1e-4
        near = [of(true.replace({name: at * (1.0 + h)})) for h in (step, -step)]
        change = np.array([near[0][one] - near[1][one] for one in measured]) / (2.0 * step * at)
        rows.append(change / np.array([sigma for _, sigma in measured.values()]))
    matrix = np.array(rows).T
    expected = np.linalg.inv(matrix.T @ matrix)
    size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(found.covariance.to_numpy() / size, expected / size, atol=1e-5)


def test_a_trace_and_numbers_together() -> None:
    """The information of the number adds to that of the trace."""
    true, names = machine(brake_slope=0.0), ["brake.rms_torque"]
    (value,) = measures_of(true, names, 1.0).values()
    free = {"brake.kinetic": (0.1, 0.6), "shaft.damping": (0.3, 3.0)}
    start = true.replace({"brake.kinetic": 0.39, "shaft.damping": 1.3})
    given = {"observe": {"velocity": "disc.speed"}, "sigma": {"velocity": 0.01}}
    both = wb.fit(start, trace_of(true), free, measured={names[0]: (value, 0.1)}, **given)
    for name in free:
        assert both.values[name] == pytest.approx(true.value(name), rel=1e-8)
    alone = wb.fit(start, trace_of(true), free, **given)
    slopes = wb.sensitivity(true, list(free), 1.0, of=["rms_torque"])["rms_torque"].to_numpy()[:, 0]
    expected = np.linalg.inv(alone.covariance.to_numpy()) + np.outer(slopes, slopes) / 0.1**2
    information = np.linalg.inv(both.covariance.to_numpy())
    np.testing.assert_allclose(information, expected, rtol=1e-6)
    assert set(both.data["column"].to_numpy()) == {"velocity"}
    assert both.numbers[names[0]]["unit"] == "N m"


def test_fewer_numbers_than_parameters() -> None:
    """What is not determined has an infinite standard error, and is named."""
    period, _ = of_belt(belt())
    free = {"block.inertia": (0.3, 2.0), "spring.stiffness": (50.0, 200.0)}
    found = wb.fit(belt(), None, free, measured={"period": (period, 1e-4)}, window=(1.0, 10.0))
    assert all(np.isinf(one) for one in found.stderr.values())
    assert len(found.undetermined) == 1
    assert all(name in found.undetermined[0] for name in free)


def test_a_number_that_contradicts_others_is_named() -> None:
    """The stick time follows from the static friction, which the period determines too."""
    period, stick = of_belt(belt())
    measured = {"period": (period, 1e-4), "stick_time": (1.2 * stick, 1e-3)}
    found = wb.fit(belt(), None, {"pad.static": (0.4, 0.6)}, measured=measured, window=(1.0, 10.0))
    assert any(told.startswith("stick_time:") for told in found.remarks)


def test_a_profile_and_an_interval_of_numbers() -> None:
    """One standard deviation away the sum of squares is larger by 1; intervals are normal."""
    measured = dict(
        zip(("period", "stick_time"), ((one, 1e-4) for one in of_belt(belt())), strict=True)
    )
    free = {"pad.static": (0.4, 0.6), "block.inertia": (0.5, 2.0)}
    found = wb.fit(belt(), None, free, measured=measured, window=(1.0, 10.0))
    at, error = found.values["pad.static"], found.stderr["pad.static"]
    costs = found.profile("pad.static", [at - error, at, at + error])["cost"].to_numpy()
    np.testing.assert_allclose(costs, [1.0, 0.0, 1.0], atol=0.01)
    # With one parameter nothing is left to be fitted.
    single = wb.fit(belt(), None, {"pad.static": (0.4, 0.6)}, measured=measured, window=(1.0, 10.0))
    at, error = single.values["pad.static"], single.stderr["pad.static"]
    costs = single.profile("pad.static", [at - error, at])["cost"].to_numpy()
    np.testing.assert_allclose(costs, [1.0, 0.0], atol=0.01)
    low, high = found.interval()["pad.static"]
    assert (high - low) / found.stderr["pad.static"] == pytest.approx(2.0 * 1.959963984540054)


def test_numbers_of_a_driveline_have_no_parts() -> None:
    line = wb.paper.system(eta=-24.0).replace(friction=wb.CoulombFriction(kinetic=0.27))
    response = wb.simulate(line, periods=1)
    heat = float(wb.energy(response).attrs["total_friction_heat"])
    found = wb.fit(
        line.replace(kinetic=0.255), None, {"kinetic": (0.24, 0.285)},
        measured={"friction_heat": (heat, 0.01 * heat)},
        window=(0.0, response.attrs["final_time"]),
    )  # fmt: skip
    assert found.values["kinetic"] == pytest.approx(0.27, rel=1e-8)


def test_the_picture_shows_numbers() -> None:
    measured = {"period": (of_belt(belt())[0], 1e-4)}
    free = {"block.inertia": (0.5, 2.0)}
    figure = wb.plot(wb.fit(belt(), None, free, measured=measured, window=(1.0, 5.0)))
    (axes,) = figure.axes
    assert [one.get_text() for one in axes.get_yticklabels()] == ["period"]


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("measured['perod']", {"measured": {"perod": (0.3, 0.1)}}),
        ("measured['disc.period']", {"measured": {"disc.period": (0.3, 0.1)}}),
        ("measured['block.stick_time']", {"measured": {"block.stick_time": (0.3, 0.1)}}),
        ("measured['harmonic_0']", {"measured": {"harmonic_0": (0.3, 0.1)}}),
        ("measured['temperature']", {"measured": {"temperature": (300.0, 1.0)}}),
        ("measured['period']", {"measured": {"period": 0.3}}),
        ("measured['period']", {"measured": {"period": (0.3, 0.0)}}),
        ("measured", {"measured": {}}),
        ("measured", {"measured": ["period"]}),
        ("measured['period']", {"window": (1.0, 1.1)}),
        ("measured['order_1']", {"measured": {"order_1": (1.0, 0.1)}}),
        ("window", {"window": None}),
        ("window", {"window": (2.0, 1.0)}),
        ("window", {"window": (-1.0, 1.0)}),
        ("window", {"measured": None, "trace": {"time": TIMES, "velocity": TIMES}}),
        ("window", {"trace": {"time": TIMES, "velocity": TIMES}, "window": (0.5, 3.0)}),
        ("sigma", {"trace": {"time": TIMES, "velocity": TIMES}, "window": (0.1, 0.9)}),
        ("observe", {"observe": {"v": "velocity"}}),
        ("trace", {"measured": None, "window": None}),
        (
            "free['time_shift']",
            {"trace": {"time": TIMES, "velocity": TIMES}, "window": (0.1, 0.9),
             "free": {"time_shift": (-0.1, 0.1)}},
        ),
    ],
)  # fmt: skip
def test_what_is_refused_is_named(name: str, changes: dict[str, object]) -> None:
    arguments = {
        "trace": None, "free": {"block.inertia": (0.5, 2.0)}, "measured": {"period": (0.3, 0.1)},
        "window": (0.0, 5.0), **changes,
    }  # fmt: skip
    with pytest.raises(wb.InputError) as raised:
        wb.fit(belt(), **arguments)
    assert raised.value.name == name


def test_too_sensitive_number_is_named() -> None:
    """A stick time of chaotic motion determines no parameter; near the start of the run it does."""
    system = wb.paper.system(eta=-24, f=0.63, F0=0.036, alpha=1.18)
    free, measured = {"slope": (-80.0, -10.0)}, {"stick_time": (0.012, 0.001)}
    early = wb.fit(system, None, free, measured=measured, window=(0.0, 1.0))
    assert early.numbers["stick_time"]["fitted"] == pytest.approx(0.012, rel=1e-9)
    assert not early.remarks
    late = wb.fit(system, None, free, measured=measured, window=(5.0, 10.0))
    assert any("stick_time" in one and "slope" in one for one in late.remarks)

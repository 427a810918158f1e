"""Relations between the motions of related machines with all parts.

The machines are random, with joints and controllers. Their mirror image, their motion in other
units, with parts in another order, from a state in the middle, or with one more part that has no
effect, follows from the motion itself, without another solver.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest

import wedgebrake as wb
from machine_draw import joined_machine
from machine_units import KINDS, Units

MANY, PACK = 500, 25
FEW = (1, 2, 4, 16, 112, 198, 232)
# A curve bends at the speed of a contact at rest, or a force is 0 at a reversal: rounding decides
# whether this is a breakpoint. It does not change the motion.
BENT = (67, 107)
BREAKPOINT = 5
DURATION, SAMPLES = 6.0, 121
Array = np.ndarray


class Motion(NamedTuple):
    """A motion by the names of its parts.

    states : each quantity over time, by its name and that of the part
    events : times of each kind of event of each part, by the name of the part and the kind
    """

    states: dict[tuple[str, str], Array]
    events: dict[tuple[str, int], Array]


def simulated(machine: wb.Machine, start: float = 0.0, end: float = DURATION, **more: Any) -> Any:
    """The response, at times between the samples of controllers, where outputs jump."""
    times = (np.arange(SAMPLES) + 0.377) * (end / SAMPLES)
    times = times[times >= start]
    response = wb.simulate(machine, end - start, times=times, **more)
    assert response.attrs["status"] == "completed", response.attrs["message"]
    return response


@cache
def response_of(seed: int) -> Any:
    return simulated(joined_machine(seed))


def motion_of(response: Any) -> Motion:
    states = {
        (str(name), str(part)): one.sel({one.dims[1]: part}).to_numpy()
        for name, one in response.data_vars.items()
        if len(one.dims) == 2 and one.dims[0] == "time"
        for part in response[one.dims[1]].to_numpy()
    }
    events: dict[tuple[str, int], list[float]] = {}
    kinds, times = (response[f"event_{name}"].to_numpy() for name in ("kind", "time"))
    if "event_part" in response:
        parts = response["event_part"].to_numpy()
    else:  # contacts alone have events
        parts = response["contact"].to_numpy()[response["event_contact"].to_numpy().astype(int)]
    for part, kind, time in zip(parts, kinds, times, strict=True):
        events.setdefault((str(part), int(kind)), []).append(float(time))
    return Motion(states, {key: np.array(times) for key, times in events.items()})


def check_same(seed: int, one: Motion, other: Motion, tolerance: float = 1e-9) -> None:
    """The states and events of the first motion are those of the other one."""
    for key, values in one.states.items():
        room = tolerance * np.nanmax(np.abs(values), initial=1e-3)
        np.testing.assert_allclose(other.states[key], values, rtol=0, atol=room, err_msg=f"{key}")
    for name, times in one.events.items():
        if seed in BENT and name[1] == BREAKPOINT:
            continue
        pair = (times, other.events.get(name, np.zeros(0)))
        expected, found = (one[one < DURATION - tolerance] for one in pair)
        np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance, err_msg=f"{name}")


def check_units(seed: int, units: Units, tolerance: float = 1e-9) -> None:
    machine = joined_machine(seed)
    seen = motion_of(simulated(units.machine(machine), end=DURATION * units.time))
    states = {key: one / units.of_state(*key, machine) for key, one in seen.states.items()}
    events = {key: one / units.time for key, one in seen.events.items()}
    check_same(seed, motion_of(response_of(seed)), Motion(states, events), tolerance)


def mirror(seed: int) -> None:
    """All angles, speeds and torques with the other sign."""
    check_units(seed, Units(angle=-1.0, torque=-1.0))


def binary_units(seed: int) -> None:
    """Powers of two change no digit.

    The steps of the solver depend on the unit of time, on those of the states of controllers, and,
    where a torque over the state has a factor that varies, on those of all states by rounding.
    """
    machine = joined_machine(seed)
    throttled = any(
        isinstance(getattr(one.signal, "scale", 1.0), wb.Signal) for one in machine.torques
    )
    exact = not machine.controllers and not throttled
    check_units(seed, Units(2.0**-3, 1.0, 2.0**7, 2.0**7), 0.0 if exact else 1e-11)
    check_units(seed, Units(time=2.0**5), 1e-11)


def decimal_units(seed: int) -> None:
    check_units(seed, Units(10.0, 0.1, 1e3, 1e3))


def order(seed: int) -> None:
    """Parts in another order."""
    machine = joined_machine(seed)
    other = wb.Machine(**{kind: getattr(machine, kind)[::-1] for kind in KINDS})
    check_same(seed, motion_of(response_of(seed)), motion_of(simulated(other)))


def restart(seed: int) -> None:
    """A run that is broken off, and goes on from its state as a text, is the run itself."""
    machine, whole = joined_machine(seed), response_of(seed)
    stop = DURATION * (0.13, 0.5, 0.81)[seed % 3]
    first = wb.simulate(machine, stop)
    state = wb.FinalState.from_json(wb.final_state(first).to_json())
    later = simulated(machine, stop, initial=state)
    ends = motion_of(first).events, motion_of(later).events
    events = {
        key: np.concatenate([one.get(key, np.zeros(0)) for one in ends])
        for key in {**ends[0], **ends[1]}
    }
    expected = motion_of(whole.sel(time=later["time"]))
    check_same(seed, expected, Motion(motion_of(later).states, events))


def study_file(seed: int) -> None:
    machine = joined_machine(seed)
    assert wb.read_study(wb.Study(machine).to_toml()).system == machine


def energy_balance(seed: int) -> None:
    found = wb.energy(response_of(seed))
    parts = [one for name, one in found.data_vars.items() if name not in ("residual", "rounding")]
    exchanged = sum(float(np.abs(one).sum()) for one in parts)
    assert abs(float(found["residual"])) <= 1e-12 * exchanged
    assert np.all(found["viscous_loss"] >= -1e-14 * exchanged)
    assert np.all(found["friction_heat"] >= -1e-14 * exchanged)


def laws(seed: int) -> None:
    assert wb.check(response_of(seed)) == []


# Parts without effect. Each function gives machines of which the first has the same motion as the
# others.


def _with(machine: wb.Machine, kind: str, *parts: Any) -> wb.Machine:
    return machine.replace({kind: [*getattr(machine, kind), *parts]})


def _changed(part: Any, **changes: Any) -> Any:
    return type(part)(
        **{**{name: getattr(part, name) for name in part.model_fields_set}, **changes}
    )


def springs(machine: wb.Machine) -> list[wb.Machine]:
    """Linear springs as a gap of no length, and as stages of equal stiffness."""
    linear = [one for one in machine.shafts if one.law is None]
    others = [one for one in machine.shafts if one.law is not None]
    others += [_changed(one, stiffness=0.0, name=f"{one.name}-damper") for one in linear]
    alone = [_changed(one, damping=0.0, name=one.name) for one in linear]
    gaps = [_changed(one, gap=(0.0, 0.0)) for one in alone]
    stages = [_changed(one, stiffness=wb.Stages((-0.1, 0.2), [one.stiffness] * 3)) for one in alone]
    return [machine.replace(shafts=[*others, *each]) for each in (alone, gaps, stages)]


def loops(machine: wb.Machine) -> list[wb.Machine]:
    """Controllers whose gains are 0."""
    given = wb.Controller("idle", {"a.speed": 1.0}, 1.0, "a.torque")
    more = ({}, {"limits": (-1.0, 1.0)}, {"sample_time": 0.1, "delay": 1})
    return [machine, *(_with(machine, "controllers", _changed(given, **one)) for one in more)]


def joints(machine: wb.Machine) -> list[wb.Machine]:
    """Part of an inertia beyond a joint: r^2 J beyond a gear of ratio r."""
    (body, *others) = machine.inertias
    found = [machine]
    for joint, inertia in (
        (wb.Rigid("a", "x"), 0.25), (wb.Gear("a", "x", -2.0), 1.0), (wb.Gear("x", "a", 2.0), 0.0625)
    ):  # fmt: skip
        rest = _changed(body, inertia=body.inertia - 0.25)
        bodies = [rest, *others, wb.Inertia("x", inertia)]
        found.append(_with(machine.replace(inertias=bodies), "joints", joint))
    return found


def torques(machine: wb.Machine) -> list[wb.Machine]:
    """Curves that are 0, clutches without capacity, and forces per angle that are 0."""
    flat = wb.OverSpeed((-1.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    round_ = wb.OverAngle((0.0, 0.1), (0.0, 0.0), period=0.3)
    clutch = wb.OneWayClutch("a", "ground", "idle", capacity=0.0)
    zero = {"a.angle": 0.0}
    pressed = [
        _changed(one, normal={**one.normal, **zero})
        if isinstance(one, wb.Contact) and "a.angle" not in one.normal else one
        for one in machine.contacts
    ]  # fmt: skip
    return [
        machine, _with(machine, "torques", wb.Torque("a", flat, name="flat")),
        _with(machine, "torques", wb.Torque("a", round_, name="round")),
        _with(machine, "contacts", clutch), machine.replace(contacts=pressed),
    ]  # fmt: skip


def drag(machine: wb.Machine) -> list[wb.Machine]:
    return [machine, _with(machine, "contacts", wb.Drag("a", 0.0, 0.0, name="idle"))]


def ground(machine: wb.Machine) -> list[wb.Machine]:
    """A driven body that stands in place of the ground."""
    parts = {
        kind: [
            _changed(one, b="wall", name=one.name)
            if one.b == "ground" and getattr(one, "base_speed", 0.0) == 0.0 else one
            for one in getattr(machine, kind)
        ]
        for kind in ("shafts", "contacts")
    }  # fmt: skip
    return [machine, machine.replace(inertias=[*machine.inertias, wb.Driven("wall", 0.0)], **parts)]


def ratios(machine: wb.Machine) -> list[wb.Machine]:
    """Contacts between inertias with the ratio 1, which is not left out."""
    given = [
        _changed(one, ratio=1.0)
        if isinstance(one, wb.Contact) and one.b != "ground" and not one.geared
        else one
        for one in machine.contacts
    ]
    return [machine, machine.replace(contacts=given)]


def check_effect(machines: Callable[[wb.Machine], list[wb.Machine]], seed: int) -> None:
    first, *others = machines(joined_machine(seed))
    expected = motion_of(simulated(first))
    for other in others:
        check_same(seed, expected, motion_of(simulated(other)))


RELATIONS = (mirror, binary_units, decimal_units, order, restart, study_file, energy_balance, laws)
NOTHING = (springs, loops, joints, torques, drag, ground, ratios)


@pytest.mark.parametrize("seed", FEW)
@pytest.mark.parametrize("relation", RELATIONS)
def test_relations(relation: Callable[[int], None], seed: int) -> None:
    relation(seed)


@pytest.mark.parametrize("seed", FEW)
@pytest.mark.parametrize("parts", NOTHING)
def test_parts_without_effect(parts: Any, seed: int) -> None:
    check_effect(parts, seed)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, MANY, PACK))
def test_many_machines(first: int) -> None:
    for seed in range(first, first + PACK):
        for relation in RELATIONS:
            relation(seed)
        for parts in NOTHING:
            check_effect(parts, seed)
        response_of.cache_clear()

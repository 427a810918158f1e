"""Wrong input of joints, stages, gaps, driven bodies, freewheels, drag, curves and controllers.

Each message names the argument and its value, what is allowed, and the way out.
"""

from __future__ import annotations

import math
from typing import Any

import pytest
from test_bad_input import check

import wedgebrake as wb
from machines import contact
from printed import names

I = wb.Inertia  # noqa: E741
Curve = wb.OverSpeed([0.0, 1.0], [1.0, 0.0])
NOT_FINITE = (math.nan, math.inf, -math.inf)


def shaft(stiffness: Any = 100.0, **more: Any) -> wb.Shaft:
    return wb.Shaft("a", "b", stiffness, **more)


def freewheel(**more: Any) -> wb.OneWayClutch:
    return wb.OneWayClutch("a", "b", "free", **more)


def torque(signal: Any = Curve, **more: Any) -> wb.Torque:
    return wb.Torque("a", signal, **more)


def pad(*ends: str, **more: Any) -> wb.Contact:
    return wb.Contact(**{**dict(contact(*ends or ("a",), name="pad")), **more})


def loop(**more: Any) -> wb.Controller:
    given: dict[str, Any] = {
        "measured": {"a.speed": 1.0}, "setpoint": 10.0, "output": "a.torque", "proportional": 1.0,
    }  # fmt: skip
    return wb.Controller("loop", **{**given, **more})


def machine(**parts: Any) -> wb.Machine:
    return wb.Machine(**{"inertias": [I("a", 1.0), I("b", 1.0)], **parts})


def driven(*more: Any) -> wb.Machine:
    return wb.Machine(inertias=[I("a", 1.0), wb.Driven("d", 1.0), *more])


def swept() -> wb.Machine:
    """A machine without equilibrium: the spring of b yields at 1 N m, and its load is 5 N m."""
    held = wb.Shaft("a", "ground", 10.0, 1.0)
    yields = wb.Shaft("a", "b", wb.Stages([-0.1, 0.1], [0.0, 10.0, 0.0]))
    load = wb.Torque("b", 5.0)
    return machine(shafts=[held, yields], contacts=[pad()], torques=[load])


# What is called, the name of what is wrong, and words of the value, or of the way out.
Case = tuple[Any, str, tuple[str, ...]]
VALUES: dict[str, Case] = {
    # Stages, gaps and preload.
    "stages that descend": (lambda: wb.Stages([0.1, -0.1], [1, 2, 3]), "stiffness.angles[1]",
                            ("-0.1", "0.1", "Sort")),
    "equal stages": (lambda: wb.Stages([0.1, 0.1], [1, 2, 3]), "stiffness.angles[1]", ("above",)),
    "too few stiffnesses": (lambda: wb.Stages([-0.1, 0.1], [1, 2]), "stiffness.stiffnesses",
                            ("3 values",)),
    "a negative stage": (lambda: wb.Stages([0.1], [1, -2]), "stiffness.stiffnesses[1]", ("-2",)),
    "one angle": (lambda: wb.Stages(0.1, [1, 2]), "stiffness.angles", ("0.1", "list")),
    "no angle": (lambda: wb.Stages([], [1, 2]), "stiffness.angles", ("at least 1",)),
    "an angle of weight": (lambda: wb.Stages(["1 kg"], [1, 2]), "stiffness.angles[0]",
                           ("1 kg", "deg")),
    "a list as stiffness": (lambda: shaft([1.0, 2.0]), "a-b.stiffness", ("wb.Stages",)),
    "stages without stiffnesses": (lambda: shaft({"angles": [0.1]}), "a-b.stiffness.stiffnesses",
                                   ("missing",)),
    "a gap and stages": (lambda: shaft(wb.Stages([0.0], [1, 2]), gap=(-0.1, 0.1)), "a-b.gap",
                         ("stage of stiffness 0",)),
    "a gap turned round": (lambda: shaft(gap=(0.1, -0.1)), "a-b.gap", ("low <= high",)),
    "half a gap": (lambda: shaft(gap=0.1), "a-b.gap", ("0.1", "[-0.01, 0.01]")),
    "three limits": (lambda: shaft(gap=(-0.1, 0.0, 0.1)), "a-b.gap", ("2 values",)),
    "a gap of mass": (lambda: shaft(gap=("-1 kg", "1 kg")), "a-b.gap[0]", ("rad", "deg")),
    "a gap without end": (lambda: shaft(gap=(-math.inf, 0.1)), "a-b.gap[0]", ("finite",)),
    "a shaft with one end": (lambda: wb.Shaft("a", stiffness=1.0), "shaft.b", ("missing",)),
    # Driven bodies.
    "a list as speed": (lambda: wb.Driven("d", [1.0]), "d.speed", ("[1.0]", "signal")),
    "a function as speed": (lambda: wb.Driven("d", math.sin), "d.speed", ("wb.Harmonic",)),
    "a curve as speed": (lambda: wb.Driven("d", Curve), "d.speed", ("a signal",)),
    "a speed in words": (lambda: wb.Driven("d", "80 rpm x"), "d.speed", ("80 rpm x", "rpm")),
    "no speed": (lambda: wb.Driven("d"), "d.speed", ("missing",)),
    "a driven ground": (lambda: wb.Driven("ground", 1.0), "ground.name", ("another name",)),
    "a heavy driven body": (lambda: wb.Driven("d", 1.0, inertia=3.0), "d.inertia", ("speed",)),
    "a torque on it": (lambda: machine(inertias=[I("b", 1.0), wb.Driven("a", 1.0)],
                                       torques=[torque()]), "a-torque.on", ("'a'", "b")),
    "a brake on it": (lambda: machine(inertias=[I("b", 1.0), wb.Driven("a", 1.0)],
                                      contacts=[pad("a", "b")]), "pad.a", ("as b",)),
    "drag on it": (lambda: driven().replace(contacts=[wb.Drag("d", 0.1)]), "d-drag.on",
                   ("relative_to",)),
    "states of one body": (lambda: driven().started_at([0.0], [1.0]), "angles", ("[0.0]", "a, d")),
    # Joints.
    "a ratio in words": (lambda: wb.Gear("a", "b", "3:1"), "a-b.ratio", ("3:1", "a number")),
    "teeth": (lambda: wb.Planetary("a", "b", "c", (60, 20)), "a-b-c.ratio", ("(60, 20)", "over")),
    "no carrier": (lambda: wb.Planetary("a", "b", ratio=3.0), "planetary.carrier", ("missing",)),
    "a rigid joint with ratio": (lambda: wb.Rigid("a", "b", ratio=2.0), "a-b.ratio",
                                 ("no such parameter",)),
    "an unknown body": (lambda: machine(joints=[wb.Gear("a", "c", 2.0)]), "a-c.b", ("'c'", "a, b")),
    "a ratio of text": (lambda: pad("a", "b", ratio="2"), "pad.ratio", ("quotation marks",)),
    # Freewheels and drag.
    "no direction": (lambda: freewheel(direction=0), "free.direction", ("1 or -1",)),
    "a direction in words": (lambda: freewheel(direction="forward"), "free.direction", ("-1",)),
    "pulling drag": (lambda: freewheel(drag=-1.0), "free.drag", ("-1.0", "at least 0")),
    "drag without limit": (lambda: freewheel(drag=math.inf), "free.drag", ("finite",)),
    "negative capacity": (lambda: freewheel(capacity=-1.0), "free.capacity", ("at least 0",)),
    "capacity nan": (lambda: freewheel(capacity=math.nan), "free.capacity", ("nan",)),
    "capacity as a force": (lambda: freewheel(capacity="5 N"), "free.capacity", ("5 N", "N m")),
    "a freewheel without name": (lambda: wb.OneWayClutch("a", "b"), "one_way_clutch.name",
                                 ("missing",)),
    "the ground first": (lambda: wb.OneWayClutch("ground", "a", "free"), "free.a", ("as b",)),
    "negative drag": (lambda: wb.Drag("a", -0.1), "drag.linear", ("-0.1",)),
    "drag as a signal": (lambda: wb.Drag("a", wb.Harmonic(1.0, 1.0)), "drag.linear", ("number",)),
    "drag to itself": (lambda: wb.Drag("a", 0.1, relative_to="a"), "a-drag.relative_to",
                       ("another",)),
    # Torques over a state.
    "too few torques": (lambda: wb.OverSpeed([0, 1, 2], [1, 0]), "signal.torques", ("3 values",)),
    "speeds that descend": (lambda: wb.OverSpeed([0, 2, 1], [1, 0, 0]), "signal.speeds[2]",
                            ("above 2.0",)),
    "a mapping as speeds": (lambda: wb.OverSpeed({0: 1.0}, [1]), "signal.speeds", ("list",)),
    "speeds of mass": (lambda: wb.OverSpeed(["0 kg"], [1]), "signal.speeds[0]", ("rpm",)),
    "no torques": (lambda: wb.OverSpeed([0, 1]), "signal.torques", ("missing",)),
    "a function as torque": (lambda: torque(math.sin), "a-torque.signal", ("wb.OverSpeed",)),
    "a short period": (lambda: wb.OverAngle([0, 1, 2], [0, 1, 0], period=1.5), "signal.period",
                       ("at least 2.0",)),
    "a torque that jumps": (lambda: wb.OverAngle([0, 1, 2], [0, 1, 3], period=2.0),
                            "signal.torques", ("must not jump",)),
    "a negative period": (lambda: wb.OverAngle([0, 1], [0, 1], period=-1.0), "signal.period",
                          ("greater than 0",)),
    "a signal over a state": (lambda: torque(1.0, relative_to="b"), "a-torque.relative_to",
                              ("wb.OverSpeed",)),
    "relative to itself": (lambda: torque(relative_to="a"), "a-torque.relative_to", ("ground",)),
    "relative to nothing": (lambda: machine(torques=[torque(relative_to="c")]),
                            "a-torque.relative_to", ("'c'", "a, b")),
    "a curve as force": (lambda: wb.Actuation(initial_force=Curve), "actuation.initial_force",
                         ("a signal",)),
    # Chirps and ramps.
    "an unknown law": (lambda: wb.Chirp(1.0, 1.0, 10.0, 5.0, law="exp"), "signal.law",
                       ("'exp'", "'log'")),
    "a chirp from nothing": (lambda: wb.Chirp(1.0, 0.0, 10.0, 5.0, law="log"), "signal.start",
                             ("Hz",)),
    "a logarithm of zero": (lambda: wb.Ramp(0.0, 10.0, 5.0, law="log"), "signal.end",
                            ("linear", "sign")),
    "a logarithm of both signs": (lambda: wb.Ramp(-1.0, 10.0, 5.0, law="log"), "signal.end",
                                  ("same sign",)),
    # Normal forces.
    "a number as normal": (lambda: pad(normal=2e4), "pad.normal", ("20000.0", "disc.angle")),
    "a force per torque": (lambda: pad(normal={"a.torque": 1.0}), "pad.normal", ("disc.speed",)),
    "a force per body": (lambda: pad(normal={"a": 1.0}), "pad.normal", ("disc.angle",)),
    "a force of nothing": (lambda: machine(contacts=[pad(normal={"c.angle": 1.0})]),
                           "pad.normal.c.angle", ("a.angle",)),
    "a factor with unit": (lambda: pad(normal={"a.angle": "2e4 N/rad"}), "pad.normal.a.angle",
                           ("2e4 N/rad", "SI units")),
    # Controllers.
    "a list as measured": (lambda: loop(measured=["a.speed"]), "loop.measured", ("mapping",)),
    "a factor in words": (lambda: loop(measured={"a.speed": "1 rad"}), "loop.measured.a.speed",
                          ("without a unit",)),
    "a misspelt quantity": (lambda: loop(measured={"a.sped": 1.0}), "loop.measured",
                            ("disc.speed",)),
    "a torque measured": (lambda: machine(torques=[torque(name="t")],
                                          controllers=[loop(measured={"t.torque": 1.0})]),
                          "loop.measured", ("a.speed",)),
    "a setpoint with unit": (lambda: loop(setpoint="10 rpm"), "loop.setpoint",
                             ("10 rpm", "without a unit")),
    "a setpoint as list": (lambda: loop(setpoint=[1.0]), "loop.setpoint", ("a signal",)),
    "a setpoint as curve": (lambda: loop(setpoint=Curve), "loop.setpoint", ("a signal",)),
    "no setpoint": (lambda: loop(setpoint=None), "loop.setpoint", ("None", "a signal")),
    "half a limit": (lambda: loop(limits=(None, 10.0)), "loop.limits[0]", ("None",)),
    "limits without end": (lambda: loop(limits=(0.0, math.inf)), "loop.limits[1]", ("finite",)),
    "half a sample": (lambda: loop(sample_time=0.1, delay=0.5), "loop.delay", ("whole",)),
    "a sample ahead": (lambda: loop(sample_time=0.1, delay=-1), "loop.delay", ("-1",)),
    "a gain with unit": (lambda: loop(proportional="2 N m s"), "loop.proportional",
                         ("without a unit",)),
    "a gain by letters": (lambda: loop(kp=2.0), "loop.kp", ("proportional",)),
    "no output": (lambda: wb.Controller("loop", {"a.speed": 1.0}, 10.0), "loop.output",
                  ("missing",)),
    "a command of a freewheel": (lambda: machine(contacts=[freewheel()],
                                                 controllers=[loop(output="free.command")]),
                                 "loop.output", ("free.command", "There is none")),
    # Functions.
    "no equilibrium in a range": (lambda: wb.margin(swept(), "a.inertia", between=(1.0, 2.0)),
                            "a-b", ("a.inertia = 1",)),
    "drag by straight lines": (lambda: wb.simulate(machine(contacts=[wb.Drag("a", 0.1)]), 1.0,
                                                   method="exact"), "method", ("'smooth'",)),
    "no such number of a gap": (lambda: machine(shafts=[shaft(gap=(-0.1, 0.1))]).replace(
        {"a-b.gap.2": 1.0}), "a-b.gap.2", ("0 to 1",)),
    "a state without controllers": (lambda: wb.simulate(
        machine(controllers=[loop(integral=1.0)]), 1.0,
        initial=wb.final_state(wb.simulate(machine(), 1.0))), "initial", ("controllers",)),
}  # fmt: skip


@pytest.mark.parametrize("case", VALUES)
def test_wrong_value(case: str) -> None:
    make, name, words = VALUES[case]
    with pytest.raises(wb.InputError) as found:
        make()
    error, message = found.value, str(found.value)
    assert error.name == name
    assert message.startswith(name)
    assert message.endswith((".", "?"))
    assert len(message.splitlines()) == 1
    assert len(message) < 400
    for word in words:
        assert word in message


JOINT = wb.Gear("a", "b", 2.0)
# Parts, the lists that they are put in, and the lists to which they belong.
PLACES: list[tuple[Any, str, str]] = [
    (JOINT, "shafts", "joints"),
    (JOINT, "inertias", "joints"),
    (shaft(), "joints", "shafts"),
    (pad(), "shafts", "contacts"),
    (freewheel(), "joints", "contacts"),
    (freewheel(), "shafts", "contacts"),
    (wb.Drag("a", 0.1), "torques", "contacts"),
    (wb.Driven("d", 1.0), "torques", "inertias"),
    (I("c", 1.0), "joints", "inertias"),
    (loop(), "torques", "controllers"),
    (torque(), "controllers", "torques"),
    (torque(), "contacts", "torques"),
]


@pytest.mark.parametrize(("part", "place", "right"), PLACES)
def test_a_part_in_another_list(part: Any, place: str, right: str) -> None:
    with pytest.raises(wb.InputError, match=rf"^machine\.{place}\[0\] = ") as found:
        machine(**{place: [part]})
    assert f"{right}=[wb.{type(part).__name__}" in str(found.value)
    assert len(str(found.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("part", "right"), {right: (part, right) for part, _, right in PLACES}.values()
)
def test_a_part_without_a_list(part: Any, right: str) -> None:
    with pytest.raises(wb.InputError, match=rf"^machine\.{right} = ") as found:
        machine(**{right: part})
    assert f"{right}=[" in str(found.value)
    assert len(str(found.value).splitlines()) == 1


@pytest.mark.parametrize("wrong", [None, wb.Gear, {"a": "a"}, wb.Harmonic(1.0, 2.0), "a", 3.0])
@pytest.mark.parametrize("place", ["shafts", "contacts", "torques", "joints", "controllers"])
def test_what_is_no_part(place: str, wrong: Any) -> None:
    with pytest.raises(wb.InputError, match=rf"^machine\.{place}\[0\] = "):
        machine(**{place: [wrong]})


STUDY = """\
[[inertia]]
name = "a"
inertia = 1.0

[[inertia]]
name = "b"
inertia = 2.0

[[shaft]]
a = "a"
b = "b"
stiffness = 100.0
"""
PAD = """
[[contact]]
a = "a"
name = "pad"
brake = { kind = "conventional", radius = 0.2 }
friction = { kind = "coulomb", kinetic = 0.3 }
actuation = { initial_force = 100.0 }
"""
LOOP = """
[[controller]]
name = "loop"
measured = { "a.speed" = 1.0 }
setpoint = 10.0
output = "a.torque"
"""
# Tables that are added to a study file, and what the message names.
FILES = [
    ("gap = [0.1, -0.1]", "a-b.gap"),
    ('gap = ["1 kg", "2 kg"]', "1 kg"),
    ("gap = 0.1", "a-b.gap = 0.1"),
    ("rest = nan", "a-b.rest = nan"),
    ("[[gear]]\na = 'a'\nb = 'b'\nratio = 0.0", "a-b.ratio = 0.0"),
    ("[[gear]]\na = 'a'\nb = 'c'\nratio = 2.0", "'c'"),
    ("[[gear]]\na = 'a'\nratio = 2.0", "gear.b: missing"),
    ("[[gears]]\na = 'a'", "Did you mean 'gear'"),
    ("[[planetary]]\nsun = 'a'\nring = 'b'\nratio = 2.0", "planetary.carrier: missing"),
    ("[[rigid]]\na = 'a'\nb = 'ground'", "a-ground.b = 'ground'"),
    ("[[driven]]\nname = 'd'", "d.speed: missing"),
    ("[[driven]]\nname = 'd'\nspeed = [1.0]", "d.speed = [1.0]"),
    ("[[one_way_clutch]]\na = 'a'\nb = 'b'\nname = 'f'\ndirection = 0", "f.direction"),
    ("[[drag]]\non = 'a'\nlinear = -1.0", "linear = -1.0"),
    ("[[torque]]\non = 'a'\nsignal = { kind = 'over_speed', speeds = [0, 1], torques = [1] }",
     "2 values"),
    ("[[torque]]\non = 'a'\nsignal = { kind = 'over_sped', speeds = [0, 1] }", "over_speed"),
    (PAD + "normal = { c.angle = 1.0 }", "pad.normal.c.angle"),
    (PAD + "normal = 3", "pad.normal = 3"),
    (PAD + "ratio = 2.0", "pad.ratio = 2.0"),
    (LOOP + "limits = ['-1 N m', '1 N m']", "loop.limits[0]"),
    (LOOP + "limits = [1.0, -1.0]", "loop.limits"),
    (LOOP + "derivative = 1.0", "loop.filter_time"),
    (LOOP + "delay = 1", "sample_time"),
    (LOOP.replace("10.0", "'10 rpm'"), "loop.setpoint = '10 rpm'"),
    (LOOP.replace("a.speed", "c.speed"), "loop.measured"),
]  # fmt: skip


@pytest.mark.parametrize("case", range(len(FILES)), ids=lambda i: FILES[i][1])
def test_wrong_study_file(case: int, run: Any, tmp_path: Any) -> None:
    more, named = FILES[case]
    (tmp_path / "study.toml").write_text(STUDY + more + "\n")
    check(run("simulate", "study.toml", "--out", "run.nc"), "error: ", named)
    assert names() == ["study.toml"]

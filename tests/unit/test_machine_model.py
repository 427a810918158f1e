"""The model of machines: how parts join, what is refused, and changed copies."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import wedgebrake as wb


def contact(**changes: Any) -> wb.Contact:
    usual: dict[str, Any] = {
        "a": "disc",
        "name": "brake",
        "brake": wb.WedgeBrake(angle=0.34, radius=0.2),
        "friction": wb.CoulombFriction(kinetic=0.3),
        "actuation": wb.Actuation(initial_force=300.0, slope=-10.0),
    }
    return wb.Contact(**{**usual, **changes})


def actuation(**changes: Any) -> wb.Actuation:
    return wb.Actuation(**{"initial_force": 300.0, **changes})


def machine(**changes: Any) -> wb.Machine:
    usual: dict[str, Any] = {
        "inertias": [wb.Inertia("motor", 0.2), wb.Inertia("disc", 1.0, speed=10.0)],
        "shafts": [
            wb.Shaft("motor", "disc", stiffness=2e4, damping=1.0),
            wb.Shaft("disc", "ground", stiffness=1e4),
        ],
        "contacts": [contact()],
        "torques": [wb.Torque("disc", wb.Harmonic(500.0, 10.03), name="engine")],
    }
    return wb.Machine(**{**usual, **changes})


MACHINE = machine()
RAMP = wb.Ramp(80.0, 0.0, 4.0)
NAN, INF = math.nan, math.inf


def table(*times: float, **more: Any) -> wb.Table:
    return wb.Table(times, [1.0] * len(times), **more)


# What makes it; the name, the value and what is allowed, of which the words may be a part.
WRONG: dict[str, tuple[Callable[[], object], str, Any, str]] = {
    # inertias
    "no inertia": (lambda: wb.Inertia("disc", 0.0), "disc.inertia", 0.0, "greater than 0"),
    "negative": (lambda: wb.Inertia("disc", -1.0), "disc.inertia", -1.0, "greater than 0"),
    "nan": (lambda: wb.Inertia("disc", NAN), "disc.inertia", NAN, "a finite number"),
    "infinite": (lambda: wb.Inertia("disc", INF), "disc.inertia", INF, "a finite number"),
    "too large": (lambda: wb.Inertia("disc", 1e13), "disc.inertia", 1e13, "at most 1e+12"),
    "vanishing": (lambda: wb.Inertia("disc", 1e-60), "disc.inertia", 1e-60, "at least 1e-50"),
    "text": (lambda: wb.Inertia("disc", "1"), "disc.inertia", "1", "a number"),
    "true": (lambda: wb.Inertia("disc", True), "disc.inertia", True, "a number"),
    "missing": (lambda: wb.Inertia("disc"), "disc.inertia", None, "moment of inertia"),
    "angle": (lambda: wb.Inertia("disc", 1.0, angle=NAN), "disc.angle", NAN, "a finite number"),
    "speed": (lambda: wb.Inertia("disc", 1.0, 0.0, "x"), "disc.speed", "x", "a number"),
    "misspelt": (lambda: wb.Inertia("disc", 1.0, sped=3.0), "disc.sped", 3.0, "speed"),
    "no name": (lambda: wb.Inertia(name="", inertia=1.0), "inertia.name", "", "a name of"),
    "dot": (lambda: wb.Inertia("di.sc", 1.0), "inertia.name", "di.sc", "a name of"),
    "digit": (lambda: wb.Inertia("1", 1.0), "inertia.name", "1", "a name of"),
    "number": (lambda: wb.Inertia(3, 1.0), "inertia.name", 3, "a name of"),
    "long": (lambda: wb.Inertia("a" * 61, 1.0), "inertia.name", "a" * 61, "at most 60"),
    "ground": (lambda: wb.Inertia("ground", 1.0), "ground.name", "ground", "another name"),
    "twice": (lambda: wb.Inertia("disc", 1.0, name="x"), "name", "x", "inertia"),
    "too many": (lambda: wb.Inertia("d", 1.0, 0.0, 0.0, 5.0), "Inertia", ..., "inertia"),
    # shafts
    "stiffness": (lambda: wb.Shaft("a", "b", -1.0), "a-b.stiffness", -1.0, "at least 0"),
    "damping": (lambda: wb.Shaft("a", "b", 1.0, -1.0), "a-b.damping", -1.0, "at least 0"),
    "soft": (lambda: wb.Shaft("a", "b"), "a-b.stiffness", None, "torsional stiffness"),
    "ratio": (lambda: wb.Shaft("a", "b", 1.0, ratio=0.0), "a-b.ratio", 0.0, "than 0"),
    "nan ratio": (lambda: wb.Shaft("a", "b", 1.0, ratio=NAN), "a-b.ratio", NAN, "a finite"),
    "gear to ground": (
        lambda: wb.Shaft("a", "ground", 1.0, ratio=2.0), "a-ground.ratio", 2.0, "1 for a shaft",
    ),
    "shaft from ground": (
        lambda: wb.Shaft("ground", "a", 1.0), "ground-a.a", "ground", "the name of an inertia",
    ),
    "shaft to itself": (lambda: wb.Shaft("a", "a", 1.0), "a-a.b", "a", "another inertia"),
    "end": (lambda: wb.Shaft("a", 3, 1.0), "a-3.b", 3, "a name of"),
    # contacts
    "contact with itself": (lambda: contact(b="disc"), "brake.b", "disc", "another inertia"),
    "contact of the ground": (lambda: contact(a="ground"), "brake.a", "ground", "the name of"),
    "brake": (lambda: contact(brake="wedge"), "brake.brake", "wedge", "Brake"),
    "friction": (lambda: contact(friction=0.3), "brake.friction", 0.3, "Friction"),
    "actuation": (lambda: contact(actuation=300.0), "brake.actuation", 300.0, "Actuation"),
    "base": (lambda: contact(base_speed="x"), "brake.base_speed", "x", "a number"),
    "nan base": (lambda: contact(base_speed=NAN), "brake.base_speed", NAN, "a finite number"),
    "fast base": (lambda: contact(base_speed=1e7), "brake.base_speed", 1e7, "at most 1e"),
    "base of a clutch": (
        lambda: contact(b="motor", base_speed=2.0), "brake.base_speed", 2.0, "0 for a contact",
    ),
    "moving base of a clutch": (
        lambda: contact(b="motor", base_speed=RAMP), "brake.base_speed", RAMP, "0 for a contact",
    ),
    "nameless": (lambda: contact(name=None), "contact.name", None, "a name of"),
    # actuation
    "sample time": (
        lambda: actuation(sample_time=0.0), "actuation.sample_time", 0.0, "greater than 0",
    ),
    "delay": (lambda: actuation(delay=1), "actuation.delay", 1, "without a sample_time"),
    "half a delay": (
        lambda: actuation(sample_time=0.1, delay=0.5), "actuation.delay", 0.5, "a whole number",
    ),
    "resolution": (
        lambda: actuation(resolution=0.5), "actuation.resolution", 0.5, "without a sample_time",
    ),
    "lag": (lambda: actuation(lag=-0.1), "actuation.lag", -0.1, "at least 0"),
    "frequency": (
        lambda: actuation(frequency=9.0), "actuation.damping_ratio", None, "together",
    ),
    "damping ratio": (
        lambda: actuation(damping_ratio=0.7), "actuation.frequency", None, "together",
    ),
    "two lags": (
        lambda: actuation(lag=0.1, frequency=9.0, damping_ratio=0.7), "actuation.lag", 0.1, "0",
    ),
    "limits": (lambda: actuation(limits=(2, 1)), "actuation.limits", (2, 1), "a lowest and"),
    "one limit": (lambda: actuation(limits=5.0), "actuation.limits", 5.0, "a list"),
    "never pressed": (
        lambda: actuation(limits=(-2, 0)), "actuation.limits", (-2, 0), "highest force is above 0",
    ),
    "force": (
        lambda: actuation(initial_force=-1.0), "actuation.initial_force", -1.0, "at least 0",
    ),
    "release": (lambda: actuation(release=False, lag=0.1), "actuation.release", False, "True"),
    "pulled by a signal": (
        lambda: actuation(release=False, initial_force=RAMP), "actuation.release", False, "True",
    ),
    # signals
    "order of times": (lambda: table(0.0, 2.0, 1.0), "signal.times[2]", 1.0, "at least 2.0"),
    "thrice": (lambda: table(0.0, 1.0, 1.0, 1.0), "signal.times[3]", 1.0, "at most twice"),
    "nan in a table": (lambda: table(0.0, NAN), "signal.times[1]", NAN, "a finite number"),
    "gap in a table": (
        lambda: wb.Table([0.0, 1.0], [2.0, None]), "signal.values[1]", None, "a number",
    ),
    "one time": (lambda: table(1.0), "signal.times", (1.0,), "at least 2"),
    "equal times": (lambda: table(1.0, 1.0), "signal.times", (1.0, 1.0), "two different times"),
    "lengths": (
        lambda: wb.Table([0.0, 1.0], [1.0, 2.0, 3.0]), "signal.values", (1.0, 2.0, 3.0), "2 values",
    ),
    "after": (lambda: table(0.0, 1.0, after="stop"), "signal.after", "stop", "'hold'"),
    "endless": (
        lambda: table(0.0, 1.0, periodic=True, after="hold"), "signal.after", "hold", "left out",
    ),
    "beyond": (lambda: table(0.0, 1.0)(2.0), "time", 2.0, "in [0, 1]"),
    "hertz": (lambda: wb.Harmonic(1.0, 0.0), "signal.frequency", 0.0, "at least 1e-09"),
    "amplitude": (lambda: wb.Harmonic(NAN, 1.0), "signal.amplitude", NAN, "a finite number"),
    "duration": (lambda: wb.Ramp(1.0, 2.0, 0.0), "signal.duration", 0.0, "greater than 0"),
    "short": (lambda: wb.Ramp(1.0, 2.0, 1e-9, 1e9), "signal.duration", 1e-9, "longer"),
    "orders": (lambda: wb.Orders(1.0, [(1.0, 1.0)]), "signal.orders[0]", (1.0, 1.0), "3 values"),
    "no orders": (lambda: wb.Orders(1.0, []), "signal.orders", [], "at least 1"),
    "order speed": (lambda: wb.Orders("fast", [(1, 1, 0)]), "signal.speed", "fast", "a signal"),
    "torque": (lambda: wb.Torque("disc", "big"), "disc-torque.signal", "big", "a signal"),
    "quiet": (lambda: wb.Torque("disc"), "disc-torque.signal", None, "the torque"),
    "on the ground": (
        lambda: wb.Torque("ground", 1.0), "ground-torque.on", "ground", "the name of an inertia",
    ),
    "kind": (
        lambda: wb.Torque("disc", {"kind": "sine"}), "disc-torque.signal.kind", "sine", "harmonic",
    ),
    "stribeck": (
        lambda: wb.StribeckFriction(kinetic=0.3, static=0.2, speed=0.1), "friction.static", 0.2,
        "at least friction.kinetic",
    ),
    "stribeck speed": (
        lambda: wb.StribeckFriction(kinetic=0.3, speed=0.0), "friction.speed", 0.0, "at least",
    ),
    # machines
    "empty": (lambda: machine(inertias=[]), "machine.inertias", [], "at least 1"),
    "one for a list": (
        lambda: machine(shafts=wb.Shaft("disc", "ground", 1.0)), "machine.shafts", ..., "list",
    ),
    "another class": (
        lambda: machine(contacts=[wb.Inertia("x", 1.0)]), "machine.contacts[0]", ..., "inertias",
    ),
    "number in a list": (lambda: machine(torques=[3]), "machine.torques[0]", 3, "Torque"),
    "no such list": (lambda: machine(inertia=[]), "machine.inertia", [], "inertias"),
    "same inertias": (
        lambda: machine(inertias=[wb.Inertia("disc", 1.0)] * 2), "inertias[1].name", "disc",
        "no other part has",
    ),
    "same shafts": (
        lambda: machine(shafts=[wb.Shaft("motor", "disc", 1.0, name="spring")] * 2),
        "shafts[1].name", "spring", "no other part has",
    ),
    "same across kinds": (
        lambda: machine(contacts=[contact(name="disc")]), "contacts[0].name", "disc", "no other",
    ),
    "same torques": (
        lambda: machine(torques=[wb.Torque("disc", 1.0, name="load")] * 2), "torques[1].name",
        "load", "no other",
    ),
    "loose shaft": (
        lambda: machine(shafts=[wb.Shaft("motr", "disc", 1.0)]), "motr-disc.a", "motr", "motor",
    ),
    "loose end": (
        lambda: machine(shafts=[wb.Shaft("motor", "dics", 1.0)]), "motor-dics.b", "dics", "ground",
    ),
    "loose contact": (
        lambda: machine(contacts=[contact(a="wheel")]), "brake.a", "wheel", "disc",
    ),
    "loose clutch": (lambda: machine(contacts=[contact(b="wheel")]), "brake.b", "wheel", "motor"),
    "loose torque": (
        lambda: machine(torques=[wb.Torque("wheel", 1.0)]), "wheel-torque.on", "wheel", "disc",
    ),
    "number of a name": (lambda: MACHINE.index("dics"), "name", "dics", "disc"),
    # changed copies
    "no such part": (lambda: MACHINE.replace({"brke.slope": 1.0}), "brke.slope", 1.0, "brake"),
    "no such field": (lambda: MACHINE.replace({"brake.slop": 1.0}), "brake.slop", 1.0, "slope"),
    "field of an inertia": (lambda: MACHINE.replace({"disc.mass": 1.0}), "disc.mass", 1.0, "speed"),
    "no part": (lambda: MACHINE.replace(slope=1.0), "slope", 1.0, "brake"),
    "value": (lambda: MACHINE.replace({"brake.slope": "x"}), "brake.slope", "x", "a number"),
    "two values": (
        lambda: MACHINE.replace({"brake.static": 0.1, "brake.kinetic": 0.2}), "brake.static", 0.1,
        "at least friction.kinetic",
    ),
    "too deep": (lambda: MACHINE.replace({"brake.slope.x": 1.0}), "brake.slope.x", 1.0, "slope"),
    "of a signal": (
        lambda: MACHINE.replace({"engine.frequency": 0.0}), "engine.frequency", 0.0, "at least",
    ),
    "no number": (
        lambda: MACHINE.replace({"engine.signal": 1.0 + RAMP, "engine.signals.7": 1.0}),
        "engine.signals.7", 1.0, "1",
    ),
    "whole part": (
        lambda: MACHINE.replace({"brake.friction": 0.3}), "brake.friction", 0.3, "Friction",
    ),
    "another part": (lambda: MACHINE.replace(disc=3), "machine.inertias[1]", 3, "Inertia"),
    "two lengths": (
        lambda: wb.simulate(MACHINE, 1.0, periods=5), "periods", 5, "left out"
    ),
    "no mapping": (lambda: MACHINE.replace([1]), "changes", [1], "values by name"),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_wrong_machines_say_name_value_and_what_is_allowed(case: str) -> None:
    make, name, value, allowed = WRONG[case]
    with pytest.raises(wb.InputError) as raised:
        make()
    error = raised.value
    assert error.name == name
    if value is not ...:
        same = error.value == value or (error.value != error.value and value != value)
        assert same, error.value
    words = error.allowed if isinstance(error.allowed, str) else " ".join(error.allowed or ())
    assert allowed in words


def test_errors_of_other_functions_carry_the_same() -> None:
    with pytest.raises(wb.InputError) as raised:
        wb.Driveline(inertia=-1.0, damping=0.1, stiffness=1.0)
    error = raised.value
    assert (error.name, error.value, error.allowed) == ("driveline.inertia", -1.0, "greater than 0")
    again = pickle.loads(pickle.dumps(error))  # noqa: S301 - our own
    assert (str(again), again.name, again.value) == (str(error), error.name, error.value)
    with pytest.raises(wb.InputError) as raised:
        wb.simulate(wb.paper.system(), periods=0)
    assert (raised.value.name, raised.value.value) == ("periods", 0)


def test_parts_are_tuples_and_cannot_be_changed() -> None:
    assert [one.name for one in MACHINE.inertias] == ["motor", "disc"]
    assert isinstance(MACHINE.shafts, tuple)
    for part, field in ((MACHINE, "inertias"), (MACHINE.inertias[0], "inertia")):
        with pytest.raises(wb.InputError, match="cannot be changed"):
            setattr(part, field, 1.0)
        with pytest.raises(wb.InputError, match="cannot be changed"):
            delattr(part, field)


def test_parts_with_names_only_refuse_positions() -> None:
    with pytest.raises(wb.InputError, match="by name") as error:
        wb.WedgeBrake(0.34, 0.2)
    assert error.value.allowed == ("radius", "angle")


def test_default_names_of_parallel_shafts_and_of_torques_differ() -> None:
    torques = [wb.Torque("disc", 1.0), wb.Torque("disc", 2.0, name="disc-torque-2")]
    found = machine(
        shafts=[wb.Shaft("motor", "disc", 1.0), wb.Shaft("motor", "disc", 2.0)],
        torques=[*torques, wb.Torque("disc", 3.0)],
    )
    assert [one.name for one in found.shafts] == ["motor-disc", "motor-disc-2"]
    names = ["disc-torque", "disc-torque-2", "disc-torque-3"]
    assert [one.name for one in found.torques] == names
    assert found.value("disc-torque-3.value") == 3.0
    assert list(found.replace({"disc.inertia": 3.0}).parts()) == list(found.parts())


def test_default_names() -> None:
    assert [one.name for one in MACHINE.shafts] == ["motor-disc", "disc-ground"]
    assert wb.Torque("disc", 3.0).name == "disc-torque"
    assert list(MACHINE.parts()) == [
        "motor", "disc", "motor-disc", "disc-ground", "brake", "engine",
    ]  # fmt: skip


def test_numbers_of_inertias() -> None:
    assert [MACHINE.index(name) for name in ("motor", "disc", "ground")] == [0, 1, -1]


def test_equal_parts_make_equal_machines() -> None:
    assert machine() == MACHINE
    assert hash(machine()) == hash(MACHINE)
    assert machine(torques=[]) != MACHINE
    assert wb.Torque("disc", 3.0) == wb.Torque("disc", wb.Constant(3.0))
    assert contact(base_speed=3.0) != contact(base_speed=wb.Constant(3.0))


def test_numpy_numbers_are_numbers() -> None:
    part = wb.Inertia("disc", np.float64(2.0), speed=np.array(3.0))
    assert type(part.inertia) is type(part.speed) is float


def test_replace_by_dotted_names() -> None:
    new = MACHINE.replace(
        {
            "brake.slope": -40.0, "disc.inertia": 1.2, "motor-disc.stiffness": 3e4,
            "engine.amplitude": 400.0, "brake.angle": 0.4, "brake.static": 0.5,
        }
    )  # fmt: skip
    assert new.contacts[0].actuation == actuation(slope=-40.0)
    assert new.contacts[0].brake == wb.WedgeBrake(angle=0.4, radius=0.2)
    assert new.contacts[0].friction == wb.CoulombFriction(kinetic=0.3, static=0.5)
    assert new.inertias[1] == wb.Inertia("disc", 1.2, speed=10.0)
    assert new.shafts[0].stiffness == 3e4
    assert new.torques[0].signal == wb.Harmonic(400.0, 10.03)
    assert machine() == MACHINE


def test_replace_whole_parts_and_fields_of_them() -> None:
    law = wb.StribeckFriction(kinetic=0.2, static=0.3, speed=0.1)
    new = MACHINE.replace({"brake.speed": 0.2, "brake.friction": law, "brake.base_speed": RAMP})
    assert new.contacts[0].friction == wb.StribeckFriction(kinetic=0.2, static=0.3, speed=0.2)
    assert new.contacts[0].base_speed == RAMP
    assert new.replace({"brake.base_speed.end": 5.0}).contacts[0].base_speed.end == 5.0
    other = wb.Inertia("disc", 7.0)
    assert MACHINE.replace(disc=other).inertias[1] == other
    assert MACHINE.replace(torques=[]) == machine(torques=[])


@pytest.mark.parametrize("wrong", ["slop", "delta"])
def test_the_suggested_name_is_one_that_replace_takes(wrong: str) -> None:
    with pytest.raises(wb.InputError) as caught:
        MACHINE.replace({f"brake.{wrong}": 1.0})
    assert "'brake.slope'" in str(caught.value)


def test_a_default_follows_what_it_depends_on() -> None:
    """Static friction that followed the kinetic one still does."""
    assert MACHINE.replace({"brake.kinetic": 0.5}).contacts[0].friction.static == 0.5


def test_parameters_are_all_numbers_by_name() -> None:
    signal = 300.0 * (1.0 + 0.1 * wb.Harmonic(1.0, 3.0))
    full = MACHINE.replace({"brake.initial_force": signal})
    values = full.parameters()
    assert values["brake.slope"] == -10.0
    assert values["disc.speed"] == 10.0
    assert values["engine.frequency"] == 10.03
    assert values["brake.initial_force.signals.0.value"] == 300.0
    assert "brake.name" not in values
    for name, value in values.items():
        assert full.replace({name: value}) == full


def test_names_that_two_parts_have_are_told_apart() -> None:
    class Caliper(wb.Brake):
        """A brake with a slope of its own."""

        slope: float

        @staticmethod
        def law(m: float, shape: Any) -> float:  # noqa: ARG004 - the common signature
            return m

    both = machine(contacts=[contact(brake=Caliper(radius=0.1, slope=2.0))])
    values = both.parameters()
    assert values["brake.slope"] == 2.0
    assert values["brake.actuation.slope"] == -10.0
    assert both.replace({"brake.actuation.slope": 1.0}).contacts[0].actuation.slope == 1.0


def test_periods_of_machines() -> None:
    def driven(*signals: wb.Signal, **more: Any) -> wb.Machine:
        torques = [wb.Torque("disc", one, name=f"t{i}") for i, one in enumerate(signals)]
        return machine(torques=torques, **more)

    sine = wb.Harmonic(5.0, 4.0)
    assert driven().autonomous
    assert driven(wb.Constant(3.0), wb.HarmonicTorque(0.0, 4.0), 0.0 * RAMP).autonomous
    sampled = [contact(actuation=actuation(sample_time=0.01))]
    assert driven(contacts=sampled).autonomous
    assert driven(sine, wb.Harmonic(5.0, 6.0)).period == pytest.approx(0.5)
    assert driven(sine, wb.Harmonic(5.0, 4.0 * 2.0**0.5)).period is None
    assert driven(sine, wb.Harmonic(0.0, 2.0**0.5)).period == 0.25
    pressed = [contact(actuation=actuation(initial_force=300.0 + wb.Harmonic(5.0, 3.0)))]
    assert driven(sine, contacts=pressed).period == pytest.approx(1.0)
    assert driven(sine, contacts=[contact(base_speed=RAMP)]).period is None


def test_a_run_beyond_a_record_is_refused() -> None:
    recorded = machine(torques=[wb.Torque("disc", 2.0 * table(1.0, 3.0), name="engine")])
    recorded.check_times(1.0, 3.0)
    for first, last, wrong in ((0.0, 2.0, 0.0), (1.0, 3.5, 3.5)):
        with pytest.raises(wb.InputError) as raised:
            recorded.check_times(first, last)
        assert (raised.value.name, raised.value.value) == ("engine.signal", wrong)
    pressed = wb.Table([0.0, 1.0], [0.0, 300.0])
    held = machine(contacts=[contact(actuation=actuation(initial_force=pressed))])
    with pytest.raises(wb.InputError) as raised:
        held.check_times(0.0, 2.0)
    assert raised.value.name == "brake.initial_force"
    machine(torques=[wb.Torque("disc", table(1.0, 3.0, after="hold"))]).check_times(0.0, 9.0)


def test_plain_tables_hold_the_machine() -> None:
    tables = MACHINE.as_dict()
    assert tables["inertia"][0] == {"name": "motor", "inertia": 0.2, "angle": 0.0, "speed": 0.0}
    assert tables["contact"][0]["brake"] == {"kind": "wedge", "angle": 0.34, "radius": 0.2}
    assert tables["torque"][0]["signal"]["kind"] == "harmonic"
    assert "shaft" not in wb.Machine(inertias=[wb.Inertia("disc", 1.0)]).as_dict()


def test_notebooks_show_a_table() -> None:
    shown = MACHINE._repr_html_()
    for name, value in (("brake.slope", -10.0), ("disc.speed", 10.0)):
        assert name in shown
        assert f"{value:.6g}" in shown


def test_a_braked_driveline_is_a_machine() -> None:
    system = wb.paper.system(eta=-24.0).replace(drive_speed=3.0)
    found = system.machine
    assert found.parts().keys() == {"driveline", "shaft", "brake", "torque"}
    line = system.driveline
    assert found.inertias[0].inertia == line.inertia
    assert (found.shafts[0].stiffness, found.shafts[0].damping) == (line.stiffness, line.damping)
    assert found.contacts[0].base_speed == -3.0
    assert found.contacts[0].inner() == {
        "brake": system.brake, "friction": system.friction, "actuation": system.actuation,
    }  # fmt: skip
    assert found.torques[0].signal == system.excitation


SIGNALS = {
    "excitation": wb.Harmonic(500.0, 10.0) + 30.0,
    "drive_speed": RAMP,
    "initial_force": 300.0 * (1.0 + 0.1 * wb.Harmonic(1.0, 3.0)),
}


class TestBrakedDrivelineWithSignals:
    SYSTEM = wb.paper.system(eta=-24.0)

    @pytest.mark.parametrize("name", SIGNALS)
    def test_converts(self, name: str) -> None:
        system = self.SYSTEM.replace(**{name: SIGNALS[name]})
        found = system.machine
        times = np.linspace(0.0, 5.0, 11)
        if name == "excitation":
            assert found.torques[0].signal == SIGNALS[name]
        elif name == "drive_speed":
            speed = found.contacts[0].base_speed
            assert isinstance(speed, wb.Signal)
            assert speed(times).tolist() == (-RAMP(times)).tolist()
        else:
            assert found.contacts[0].actuation.initial_force == SIGNALS[name]
        assert system.one_inertia is None

    @pytest.mark.parametrize("name", SIGNALS)
    def test_stability_has_the_value_of_a_signal_at_the_start(self, name: str) -> None:
        system = self.SYSTEM.replace(**{name: SIGNALS[name]})
        start = {} if name == "excitation" else {name: float(SIGNALS[name](0.0))}
        number = self.SYSTEM.replace(**start)
        assert wb.stability(system) == wb.stability(number)
        axes = {"eta": [-24.0, 0.0, 3.0], "alpha": [0.9, 1.2]}
        found, expected = (wb.stability_map(one, axes) for one in (system, number))
        for variable in expected.data_vars:
            np.testing.assert_array_equal(found[variable], expected[variable])

    def test_groups_that_are_not_defined_are_none(self) -> None:
        groups = self.SYSTEM.replace(**SIGNALS).groups
        assert (groups.f, groups.F0, groups.drive) == (None, None, None)
        assert groups.eta == -24.0
        with pytest.raises(wb.InputError):
            self.SYSTEM.replace(excitation=RAMP).replace(f=0.5)

    def test_numbers_stay_numbers(self) -> None:
        assert type(self.SYSTEM.driveline.drive_speed) is float
        assert type(self.SYSTEM.actuation.initial_force) is float
        assert self.SYSTEM.one_inertia is self.SYSTEM
        assert set(self.SYSTEM.as_dict()["actuation"]) == {"initial_force", "slope", "release"}
        assert set(self.SYSTEM.as_dict()["excitation"]) == {"amplitude", "frequency"}

    @pytest.mark.parametrize(
        "changes",
        [
            {"lag": 0.1},
            {"limits": (0.0, 9.0)},
            {"sample_time": 0.01, "delay": 1},
            {"actuation": actuation(frequency=9.0, damping_ratio=0.7)},
            {"orders": [(2.0, 0.5, 0.0)]},
        ],
    )
    def test_maps_with_a_lag_or_orders(self, changes: dict[str, Any]) -> None:
        system = self.SYSTEM.replace(**changes)
        assert system.one_inertia is None
        found = wb.stability_map(system, eta=[-24.0, -0.04, 3.0])
        alone = [wb.stability(system.replace(eta=eta)) for eta in found.eta.values.tolist()]
        assert found.stable.values.tolist() == [one.stable for one in alone]
        rates = [one.growth_rate for one in alone]
        np.testing.assert_allclose(
            found.growth * system.driveline.natural_frequency, rates, rtol=1e-9
        )

    def test_an_orbit_names_what_does_not_repeat_as_the_driveline_does(self) -> None:
        for name, changes in {
            "actuation.sample_time": {"sample_time": 0.01},
            "excitation": {"initial_force": SIGNALS["initial_force"]},
        }.items():
            with pytest.raises(wb.InputError) as raised:
                wb.orbit(self.SYSTEM.replace(**changes))
            assert raised.value.name == name

    def test_linear_stability_depends_on_no_torque(self) -> None:
        torque = {"excitation": SIGNALS["excitation"]}
        assert wb.stability(self.SYSTEM.replace(**torque)) == wb.stability(self.SYSTEM)

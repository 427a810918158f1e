"""The sketch of a machine: every part is there, joined to its bodies, with its name."""

from __future__ import annotations

import itertools
import math
from typing import Any

import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Circle

import wedgebrake as wb
from wedgebrake.figures.data.sketch import RADIUS, Sketch
from wedgebrake.model.machine import FURTHER, KINDS


def _contact(a: str, b: str, name: str, **more: Any) -> wb.Contact:
    return wb.Contact(
        a, b=b, name=name, brake=wb.ConventionalBrake(radius=0.1),
        friction=wb.CoulombFriction(kinetic=0.3),
        actuation=wb.Actuation(initial_force=10.0, lag=0.01), **more,
    )  # fmt: skip


def _machine(**changes: Any) -> wb.Machine:
    """Parts of every class, of which several are on one body."""
    bodies = ("motor", "sun", "ring", "arm", "wheel")
    parts: dict[str, Any] = {
        "inertias": [*(wb.Inertia(one, 1.0) for one in bodies), wb.Driven("bench", 3.0)],
        "shafts": [
            wb.Shaft("wheel", "bench", wb.Stages([0.0], [1.0, 2.0]), name="stages"),
            wb.Shaft("motor", "ground", 5.0, name="stop", gap=(-1.0, 1.0)),
            wb.Shaft("motor", "ground", 0.0, damping=1.0, name="bearing"),
        ],
        "contacts": [
            _contact("motor", "arm", "clutch"),
            _contact("ring", "ground", "band", normal={"wheel.angle": 3.0}),
            _contact("wheel", "ground", "brake", base_speed=2.0),
            wb.OneWayClutch("ring", "wheel", "freewheel"),
            wb.Drag("wheel", linear=1.0, name="air"),
        ],
        "torques": [
            wb.Torque("motor", wb.Harmonic(1.0, 2.0), name="engine"),
            wb.Torque("motor", wb.OverSpeed([0.0, 1.0], [1.0, 0.0]), name="curve"),
            wb.Torque("sun", wb.OverAngle([0.0, 1.0], [1.0, 0.0]), "cam", relative_to="arm"),
        ],
        "joints": [
            wb.Gear("motor", "sun", -2.0, name="gear"),
            wb.Planetary("sun", "ring", "arm", 2.0, name="planets"),
            wb.Rigid("arm", "wheel", name="flange"),
        ],
        "controllers": [
            wb.Controller("speed", {"wheel.speed": 1.0}, 1.0, "motor.torque", 1.0),
            wb.Controller("force", {"brake.force": 1.0}, 1.0, "brake.command", 1.0),
            wb.Controller("twist", {"stop.torque": 1.0, "arm.speed": 1.0}, 1.0, "clutch.command",
                          1.0),
        ],
    }  # fmt: skip
    return wb.Machine(**{**parts, **changes})


MACHINE = _machine()


def test_the_machine_has_parts_of_every_class() -> None:
    classes = {*KINDS.values(), *(one for more in FURTHER.values() for one in more)}
    assert {type(one) for one in MACHINE.parts().values()} == classes


def test_every_part_has_a_symbol_and_its_name() -> None:
    sketch = Sketch.of(MACHINE)
    bodies = {one.name for one in sketch.discs}
    assert bodies == set(MACHINE.inertia_names)
    assert [one.name for one in sketch.discs if one.driven] == ["bench"]
    words = [one.words for one in sketch.texts]
    for name in MACHINE.parts().keys() - bodies:
        assert any(line.part == name for line in sketch.lines), name
        assert words.count(name) == 1


def test_a_name_made_of_those_of_the_bodies_is_left_out() -> None:
    bodies = [wb.Inertia("a", 1.0), wb.Inertia("b", 1.0)]
    shafts = [wb.Shaft("a", "b", 1.0), wb.Shaft("b", "ground", 1.0, name="spring")]
    sketch = Sketch.of(wb.Machine(inertias=bodies, shafts=shafts))
    assert [one.words for one in sketch.texts] == ["spring"]
    assert {one.part for one in sketch.lines} == {"a-b", "spring"}


def test_parts_touch_their_bodies_and_bodies_are_apart() -> None:
    sketch = Sketch.of(MACHINE)
    at = {one.name: one.at for one in sketch.discs}
    for name, part in MACHINE.parts().items():
        fields = getattr(part, "ends", ("a", "b", "on", "relative_to"))
        for body in {getattr(part, one, None) for one in fields} & set(at):
            ends = [
                point for line in sketch.lines if line.part == name and "signal" not in line.look
                for point in line.points
            ]  # fmt: skip
            nearest = min(math.dist(point, at[body]) for point in ends)
            assert nearest == pytest.approx(RADIUS), (name, body)
    places = list(at.values())
    for i, one in enumerate(places):
        assert all(math.dist(one, other) > 2.0 * RADIUS for other in places[i + 1 :])


def test_signals_lead_from_what_is_measured_to_what_is_acted_on() -> None:
    sketch = Sketch.of(MACHINE)
    heads = {one.part: one.points[0] for one in sketch.lines if one.look == "signal head"}
    # Controllers by name; a normal force belongs to its contact.
    assert heads.keys() == {"speed", "force", "twist", "band"}
    motor = next(one.at for one in sketch.discs if one.name == "motor")
    assert math.dist(heads["speed"], motor) == pytest.approx(RADIUS)
    for name, part in (("force", "brake"), ("twist", "clutch"), ("band", "band")):
        points = [
            point for one in sketch.lines if one.part == part and one.look == "bold"
            for point in one.points
        ]  # fmt: skip
        assert min(math.dist(heads[name], point) for point in points) < RADIUS


def test_everything_is_inside_the_box() -> None:
    sketch = Sketch.of(MACHINE)
    left, bottom, right, top = sketch.box
    points = [point for one in sketch.lines for point in one.points]
    points += [one.at for one in (*sketch.texts, *sketch.discs)]
    assert all(left <= x <= right and bottom <= y <= top for x, y in points)


def test_names_beside_each_other_do_not_overlap() -> None:
    """Words of nine characters, as wide as two thirds of a symbol and its surroundings."""
    texts = [(*one.at, one.words) for one in Sketch.of(MACHINE).texts if len(one.words) > 1]
    for i, (x, y, words) in enumerate(texts):
        for u, v, others in texts[i + 1 :]:
            assert abs(x - u) > 0.035 * (len(words) + len(others)) or abs(y - v) > 0.12, (
                words, others,
            )  # fmt: skip


@pytest.mark.parametrize("count", [1, 2, 12])
def test_any_number_of_bodies(count: int) -> None:
    bodies = [wb.Inertia(f"body-{i}", 1.0) for i in range(count)]
    shafts = [wb.Shaft(one.name, two.name, 1.0) for one, two in itertools.pairwise(bodies)]
    sketch = Sketch.of(wb.Machine(inertias=bodies, shafts=shafts))
    assert [one.name for one in sketch.discs] == [one.name for one in bodies]


def test_bodies_that_are_joined_stand_side_by_side() -> None:
    bodies = [wb.Inertia(name, 1.0) for name in ("a", "c", "b")]
    shafts = [wb.Shaft("a", "b", 1.0), wb.Shaft("b", "c", 1.0)]
    order = sorted(Sketch.of(wb.Machine(inertias=bodies, shafts=shafts)).discs,
                   key=lambda one: one.at)  # fmt: skip
    assert [one.name for one in order] == ["a", "b", "c"]


def test_a_picture_of_a_machine_and_of_a_driveline() -> None:
    figure = wb.plot(MACHINE)
    words = {one.get_text() for one in figure.axes[0].texts}
    assert set(MACHINE.parts()) <= words
    circles = [one for one in figure.axes[0].patches if isinstance(one, Circle)]
    assert len(circles) == len(MACHINE.inertias) + 1  # a driven body has two
    axes = Figure().add_subplot()
    wb.plot(wb.paper.system(), ax=axes)
    assert "brake" in {one.get_text() for one in axes.texts}


def test_what_is_not_a_machine_is_refused() -> None:
    with pytest.raises(wb.InputError, match="system"):
        Sketch.of(MACHINE.inertias[0])  # type: ignore[arg-type]

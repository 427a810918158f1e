"""Pictures of machines: their contents as data, and that every kind of machine can be drawn."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import machines
import wedgebrake as wb
from wedgebrake.figures.data.modes import Modes
from wedgebrake.figures.data.time_panels import TimePanels

FRICTION = wb.CoulombFriction(kinetic=0.6, static=1.0)


def contact(block, force=1.0, **more):
    more = {"name": f"on-{block}", "force": force, "base_speed": 0.2, **more}
    return machines.contact(block, friction=FRICTION, **more)


def chain(count, contacts):
    """Blocks in a row, each held by a spring, the first ones on a belt."""
    names = [f"block{i}" for i in range(count)]
    return wb.Machine(
        inertias=[wb.Inertia(name, 1.0) for name in names],
        shafts=[wb.Shaft(name, "ground", stiffness=1.0) for name in names]
        + [wb.Shaft(a, b, stiffness=1.2) for a, b in itertools.pairwise(names)],
        contacts=[contact(name, 1.0 - 0.06 * i) for i, name in enumerate(names[:contacts])],
    )


@pytest.fixture(scope="module")
def response():
    return wb.simulate(chain(2, 2), duration=30.0)


class TestHistory:
    def test_holds_the_response(self, response):
        data = TimePanels.of(response)
        assert (data.begin, data.end) == (0.0, 30.0)
        shown = data.panels
        assert set(shown) == {
            "velocity", "sliding_velocity", "brake_torque", "actuation_force", "shaft_torque",
        }  # fmt: skip
        for variable, (panel,) in shown.items():
            for i, line in enumerate(panel.lines):
                assert np.array_equal(line.y, response[variable][:, i])
        assert [line.name for line in shown["velocity"][0].lines] == ["block0", "block1"]
        assert [sticks.name for sticks in data.sticks] == ["on-block0", "on-block1"]
        for i, sticks in enumerate(data.sticks):
            own = response.stick_contact.to_numpy() == i
            assert np.array_equal(sticks.start, response.stick_start[own])
            assert np.array_equal(sticks.end, response.stick_end[own])

    def test_drag_has_no_sticks(self):
        machine = chain(2, 1)
        machine = machine.replace(contacts=[wb.Drag("block1", 0.1, name="air"), *machine.contacts])
        found = wb.simulate(machine, duration=20.0)
        data = TimePanels.of(found)
        lines = [one.name for panel in data.panels["brake_torque"] for one in panel.lines]
        assert set(lines) == {"air", "on-block0"}
        [sticks] = data.sticks
        own = found.contact.to_numpy()[found.stick_contact] == "on-block0"
        assert np.any(own)
        assert np.array_equal(sticks.start, found.stick_start[own])

    def test_external_torques_are_those_that_act(self):
        machine = chain(2, 0).replace(
            torques=[
                wb.Torque("block1", wb.Harmonic(1.0, 0.3), name="drive"),
                wb.Torque("block1", wb.Harmonic(1.0, 0.7), name="road"),
            ]
        )
        panels = TimePanels.of(wb.simulate(machine, duration=5.0)).panels
        [torque] = panels["torque"]
        assert [line.name for line in torque.lines] == ["drive + road"]

    def test_controllers_and_joints(self):
        machine = wb.Machine(
            inertias=[wb.Inertia("a", 1.0), wb.Inertia("b", 1.0, speed=2.0)],
            joints=[wb.Gear("a", "b", 2.0, name="gear")],
            contacts=[
                wb.Drag("b", 0.1, name="air"), wb.OneWayClutch("a", "ground", "backstop", -1.0),
            ],
            controllers=[
                wb.Controller("pi", {"b.speed": 1.0}, 1.0, "b.torque", proportional=1.0)
            ],
        )  # fmt: skip
        response = wb.simulate(machine, duration=5.0, method="smooth")
        data = TimePanels.of(response)
        for variable, name in (("joint_torque", "gear"), ("control_output", "pi")):
            [panel] = data.panels[variable]
            [line] = panel.lines
            assert line.name == name
            assert np.array_equal(line.y, response[variable][:, 0])

    def test_very_different_speeds_have_panels_of_their_own(self):
        """A vibration of 0.2 rad/s would not be seen beside a speed of 300 rad/s."""
        machine = chain(2, 2).replace(inertias=[
            *chain(2, 2).inertias, wb.Inertia("motor", 1.0, speed=300.0), wb.Inertia("idle", 1.0),
        ])  # fmt: skip
        fast, slow = TimePanels.of(wb.simulate(machine, duration=5.0)).panels["velocity"]
        assert [line.name for line in fast.lines] == ["motor"]
        assert [line.name for line in slow.lines] == ["block0", "block1", "idle"]


@pytest.mark.parametrize(("count", "contacts"), [(1, 0), (1, 1), (3, 2), (6, 6)])
def test_machines_of_all_sizes_are_drawn(count, contacts, tmp_path):
    figure = wb.plot(wb.simulate(chain(count, contacts), duration=8.0))
    figure.savefig(tmp_path / "picture.png")
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert len(labels) == len(set(labels))
    strips = figure.axes[0].get_yticklabels() if contacts else []
    assert len(strips) == contacts


class TestModes:
    def test_hold_the_modes_that_vibrate(self):
        machine = wb.Machine(
            inertias=[wb.Inertia("a", 1.0), wb.Inertia("b", 1.0)],
            shafts=[wb.Shaft("a", "b", stiffness=50.0, damping=0.1)],
        )
        found = wb.stability(machine)
        data = Modes.of(found)
        assert data.inertias == ("a", "b")
        [shape] = data.shapes
        assert np.allclose(np.abs(shape.deflection), 1.0)
        assert np.isclose(shape.deflection.sum(), 0.0)  # against each other
        assert not shape.grows

    @pytest.mark.parametrize(("count", "contacts"), [(1, 0), (2, 1), (6, 6)])
    def test_are_drawn(self, count, contacts, tmp_path):
        found = wb.stability(chain(count, contacts))
        figure = wb.plot(found)
        figure.savefig(tmp_path / "picture.png")
        assert sum(axes.axison for axes in figure.axes) == len(Modes.of(found).shapes)

"""Derivatives with respect to parameters of all parts against differences of runs at 50 digits."""

from __future__ import annotations

import numpy as np
import pytest

import part_digits
import wedgebrake as wb

COULOMB = wb.CoulombFriction(kinetic=0.3, static=0.33)
DISC = wb.Inertia("disc", 1.0, angle=0.01, speed=2.0)
HUB = wb.Inertia("hub", 0.5, angle=-0.02, speed=1.0)
ENGINE = wb.Torque("disc", wb.Harmonic(150.0, 7.0, 0.3), name="engine")
SPRING = wb.Shaft("disc", "ground", 1000.0, 2.0, name="spring", rest=0.02)
LINK = wb.Shaft("disc", "hub", 3000.0, 1.0, name="link", ratio=1.5, rest=-0.01)
MOUNT = wb.Shaft("hub", "ground", 900.0, 0.5, name="mount")
CONVENTIONAL = wb.ConventionalBrake(radius=0.2)


def contact(
    brake, friction=COULOMB, b="ground", name="brake", normal=None, **actuation
) -> wb.Contact:
    ratio = {"ratio": 1.2} if b != "ground" else {"base_speed": 0.2}
    given = wb.Actuation(**{"initial_force": 1200.0} | actuation)
    return wb.Contact(
        "disc", b, name=name, brake=brake, friction=friction, actuation=given,
        normal=normal or {}, **ratio
    )  # fmt: skip


def single(*contacts: wb.Contact, **more) -> wb.Machine:
    return wb.Machine(
        **{"inertias": [DISC], "shafts": [SPRING], "contacts": contacts, "torques": [ENGINE]} | more
    )


def pair(*contacts: wb.Contact, **more) -> wb.Machine:
    return single(*contacts, **{"inertias": [DISC, HUB], "shafts": [LINK, MOUNT]} | more)


LOOP = wb.Controller(
    "loop", {"disc.speed": 1.0, "link.torque": 0.001}, wb.Harmonic(3.0, 2.0, 0.1), "hub.torque",
    proportional=6.0, integral=35.0, derivative=0.3, filter_time=0.02,
)  # fmt: skip
PULSATING = 1200.0 * (1.0 + 0.5 * wb.Harmonic(1.0, 3.0, 0.2))


def loop(**changes) -> wb.Controller:
    """The controller with other fields."""
    return LOOP.model_copy(update=changes)


LAG = {"frequency": 60.0, "damping_ratio": 0.4}
MACHINES = {
    "wedge": single(contact(wb.WedgeBrake(angle=1.0, radius=0.2), slope=-3.0)),
    "band": single(
        contact(wb.BandBrake(radius=0.2, wrap_angle=2.5), initial_force=400.0, slope=-1.0)
    ),
    "leading shoe": single(
        contact(
            wb.LeadingShoeBrake(
                radius=0.2, actuation_arm=0.2, normal_arm=0.1, friction_arm=0.08
            ),
            initial_force=500.0,
        )
    ),
    "table": single(
        contact(
            CONVENTIONAL,
            wb.TabulatedFriction(
                speeds=[0.0, 0.1, 0.4, 1.0], coefficients=[0.35, 0.3, 0.25, 0.28], static=0.4
            ),
        )
    ),
    "Stribeck": single(
        contact(CONVENTIONAL, wb.StribeckFriction(kinetic=0.2, static=0.3, speed=0.4), slope=-5.0)
    ),
    "smoothed": single(
        contact(
            wb.WedgeBrake(angle=1.0, radius=0.2),
            wb.SmoothedFriction(kinetic=0.2, static=0.3, decay=2.0, steepness=5.0),
        )
    ),
    "lag": single(contact(CONVENTIONAL, initial_force=1500.0, slope=-4.0, lag=0.02)),
    "second-order lag": single(contact(CONVENTIONAL, initial_force=1500.0, slope=-4.0, **LAG)),
    "sampled": single(
        contact(
            CONVENTIONAL, initial_force=1500.0, slope=-9.0, sample_time=0.013, delay=1, **LAG
        )
    ),
    "clutch": pair(
        contact(wb.WedgeBrake(angle=1.0, radius=0.2), slope=-2.0),
        contact(CONVENTIONAL, b="hub", name="clutch", initial_force=150.0),
    ),
    "stages and curves": pair(
        contact(CONVENTIONAL),
        shafts=[
            LINK.model_copy(
                update={"stiffness": wb.Stages([-0.05, 0.03, 0.1], [900.0, 100.0, 400.0, 1500.0])}
            ),
            wb.Shaft("hub", "ground", 2000.0, 0.0, name="stop", gap=(-0.03, 0.05), rest=0.01),
            MOUNT,
        ],
        torques=[
            ENGINE,
            wb.Torque("hub", wb.OverSpeed([-2.0, 0.8, 3.0], [5.0, -3.0, -20.0]), name="motor"),
            wb.Torque(
                "disc", wb.OverAngle([-0.02, 0.12, 0.17], [5.0, 20.0, -15.0]), name="cog",
                relative_to="hub",
            ),
        ],
    ),
    "throttles": pair(
        contact(CONVENTIONAL),
        torques=[
            ENGINE,
            wb.Torque(
                "hub",
                wb.OverSpeed([-2.0, 0.8, 3.0], [5.0, -3.0, -20.0]) * wb.Harmonic(2.0, 3.0, 0.4),
                name="motor",
            ),
            wb.Torque(
                "disc",
                wb.OverAngle([-0.02, 0.12, 0.17], [5.0, 20.0, -15.0])
                * wb.Harmonic(1.5, 5.0, 1.2),
                name="cog", relative_to="hub",
            ),
        ],
    ),
    "normal force": single(
        contact(CONVENTIONAL, normal={"disc.angle": 900.0, "disc.speed": 20.0}),
    ),
    "drag": pair(
        contact(CONVENTIONAL),
        wb.Drag("hub", linear=0.4, quadratic=0.3, name="oil", relative_to="disc"),
    ),
    "freewheel": pair(
        wb.OneWayClutch("disc", "hub", name="freewheel", direction=-1, drag=4.0),
        contact(CONVENTIONAL, initial_force=200.0),
        shafts=[SPRING, MOUNT],
    ),
    "stop with damping": single(
        contact(CONVENTIONAL, initial_force=300.0),
        shafts=[SPRING, wb.Shaft("disc", "ground", 4000.0, 20.0, name="stop", gap=(-0.06, 0.05))],
    ),
    "PID": pair(
        contact(CONVENTIONAL),
        controllers=[LOOP],
    ),
    "driven": pair(
        contact(CONVENTIONAL), contact(CONVENTIONAL, b="end", name="clutch", initial_force=40.0),
        inertias=[DISC, HUB, wb.Driven("end", wb.Harmonic(3.0, 4.0, 0.2), angle=0.01)],
        shafts=[LINK, wb.Shaft("hub", "end", 1000.0, 0.5, name="mount")],
    ),
    "digital PID": pair(
        contact(CONVENTIONAL), controllers=[loop(sample_time=0.0137, delay=1)],
    ),
    "orders": single(
        contact(CONVENTIONAL),
        torques=[
            wb.Torque(
                "disc", name="engine",
                signal=wb.Orders(
                    wb.Ramp(30.0, 60.0, 0.31, begin=0.03), [(1.0, 150.0, 0.3), (2.5, 40.0, 0.1)]
                ),
            )
        ],
    ),
    "signals": pair(
        contact(
            CONVENTIONAL, slope=-3.0,
            initial_force=wb.Ramp(0.2, 1.1, 0.17, begin=0.041) * PULSATING,
        ),
        controllers=[
            loop(
                setpoint=wb.Ramp(0.5, 4.0, 0.13, begin=0.02, law="log")
                + wb.Table([0.053, 0.157, 0.313], [1.0, 3.0, -1.0], after="hold")
            )
        ],
        torques=[
            ENGINE,
            wb.Torque(
                "hub", wb.Ramp(20.0, 2.0, 0.23, begin=0.07, law="log") * wb.Harmonic(1.0, 5.0, 0.4),
                name="load",
            ),
        ],
    ),
    "force limits": single(
        contact(CONVENTIONAL, initial_force=PULSATING, slope=-60.0, limits=(300.0, 1300.0))
    ),
    "force limits and lag": single(
        contact(
            CONVENTIONAL, initial_force=PULSATING, slope=-60.0, limits=(300.0, 1300.0), lag=0.02
        )
    ),
    "PID with limits": pair(contact(CONVENTIONAL), controllers=[loop(limits=(-20.0, 25.0))]),
    "digital PID with limits": pair(
        contact(CONVENTIONAL),
        controllers=[loop(limits=(-20.0, 25.0), sample_time=0.0137, delay=1)],
    ),
    "joints": wb.Machine(
        inertias=[
            wb.Inertia("disc", 1.0), wb.Inertia("hub", 0.5), wb.Inertia("gear", 0.3),
            wb.Driven("end", wb.Harmonic(3.0, 4.0)),
        ],
        joints=[
            wb.Planetary("hub", "disc", "end", ratio=2.0, name="set"),
            wb.Gear("gear", "hub", -1.5, name="pair"),
        ],
        shafts=[
            wb.Shaft("disc", "ground", 1000.0, 0.5, name="mount"),
            wb.Shaft("gear", "ground", 500.0, 0.4, name="other"),
        ],
        contacts=[contact(CONVENTIONAL)], torques=[ENGINE],
    ),
}  # fmt: skip
END = 0.4
# Without a derivative, or with another number of states beside the value.
WITHOUT = ("delay", "tolerance", "resolution", "direction")


def names_of(kind: str, machine: wb.Machine) -> list[str]:
    grounded = {f"{one.name}.ratio" for one in machine.shafts if one.b == "ground"}
    grounded |= {f"{one.name}.base_speed" for one in machine.contacts if one.b != "ground"}
    grounded |= {f"{one.name}.ratio" for one in machine.contacts if one.b == "ground"}
    starts = {f"{one.name}.{what}" for one in machine.inertias for what in ("angle", "speed")}
    return [
        name
        for name, value in machine.parameters().items()
        if name.rpartition(".")[2] not in WITHOUT
        and name not in WITHOUT
        and name not in grounded
        and not (kind == "joints" and (name in starts or name == "end.speed.phase"))
        and np.isfinite(value)
        and (value != 0.0 or not name.endswith((".lag", ".slope", "stop.damping")))
    ]


# One parameter of each of these is always compared; all of all machines take many minutes.
ALWAYS = (
    "wedge", "table", "sampled", "throttles", "normal force", "freewheel", "stop with damping",
    "digital PID",
)  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "every"),
    [(one, False) for one in ALWAYS]
    + [pytest.param(one, True, marks=pytest.mark.slow) for one in MACHINES],
)
def test_parameters(kind: str, every: bool) -> None:
    """Compare the derivatives for one parameter of a machine, or for all of them."""
    machine = MACHINES[kind]
    names = names_of(kind, machine)
    names = names if every else [names[len(names) * 3 // 5]]
    method = "smooth" if kind in ("Stribeck", "smoothed", "drag") else "exact"
    run = {"times": [END], "method": method}
    response = wb.simulate(machine, END, **run)
    ours = np.concatenate([response[one].to_numpy()[0] for one in ("angle", "velocity")])
    state, events = part_digits.state(machine, END)
    assert events >= 4
    np.testing.assert_allclose(ours, state, rtol=1e-12, atol=1e-13)
    found = wb.sensitivity(machine, names, END, **run)
    assert not found["one_sided"].any()
    for name in names:
        exact = np.reshape(part_digits.derivative(machine, name, END), (2, -1))
        for variable, expected in zip(("angle", "velocity"), exact, strict=True):
            own = found[variable].sel(parameter=name).to_numpy()[0]
            error = np.max(np.abs(own - expected))
            assert error <= 1e-10 * np.max(np.abs(expected)) + 1e-12, (name, own, expected)

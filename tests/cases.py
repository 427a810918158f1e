"""Systems for comparison with other programs' answers: every branch of the physics once."""

from __future__ import annotations

import math

import wedgebrake as wb


def _paper(**changes) -> wb.BrakedDriveline:
    """The paper's wedge at eta = -24, F_0 = 0.036, f = 0.63, alpha = 1.18, then changed."""
    return wb.paper.system().replace(**changes)


def _conventional(eta: float, F0: float) -> wb.BrakedDriveline:
    return wb.paper.system(eta=eta, F0=F0, brake="conventional")


# In a small region of its parameters, motion of doubled period.
ISLAND = wb.BrakedDriveline(
    driveline=wb.Driveline(inertia=1.0, damping=0.15, stiffness=1e4, drive_speed=0.65),
    brake=wb.WedgeBrake(radius=0.2, angle=0.5324),
    friction=wb.CoulombFriction(kinetic=0.3147),
    actuation=wb.Actuation(initial_force=300.0, slope=-15.2, release=False),
    excitation=wb.HarmonicTorque(amplitude=1005.0, frequency=6.8),
)
REST = (0.0, 0.0)
CRITICAL = 200.0  # 2 sqrt(k J) [N m s/rad]

# name: (system, (angle, velocity) at t = 0)
CASES: dict[str, tuple[wb.BrakedDriveline, tuple[float, float]]] = {
    "wedge, sticks and releases": (_paper(), REST),
    "wedge, far unstable": (_paper(eta=-60.0), REST),
    "wedge, constant actuation": (_paper(slope=0.0, F0=0.09), REST),
    "conventional": (_conventional(-24.0, 0.036), REST),
    "conventional, sticks": (_conventional(-60.0, 0.2), (0.01, -1.0)),
    "band brake": (_paper(brake=wb.BandBrake(radius=0.2, wrap_angle=4.0)), REST),
    "leading shoe": (
        _paper(
            brake=wb.LeadingShoeBrake(
                radius=0.2, actuation_arm=0.2, normal_arm=0.1, friction_arm=0.08
            )
        ),
        REST,
    ),
    "overdamped by the brake": (_paper(slope=400.0), REST),
    "overdamped by the driveline": (_paper(slope=-40.0, damping=1000.0), REST),
    "critically damped": (_paper(slope=0.0, damping=CRITICAL), (0.02, 3.0)),
    "near critical, from the brake": (
        # One direction is damped by 2 sqrt(kJ) up to rounding, the other far less.
        _paper(damping=0.1, brake=wb.ConventionalBrake(radius=0.2), slope=199.9 / 0.06),
        (0.02, 3.0),
    ),
    "pieces that grow without oscillation": (
        _paper(slope=-1000.0, initial_force=3000.0, amplitude=5000.0),
        REST,
    ),
    "static above kinetic": (_paper(static=0.33), REST),
    "alpha just above 1": (_paper(alpha=1.001), REST),
    "self-locking": (_paper(alpha=0.9, slope=0.0), REST),
    "no friction": (_paper(kinetic=0.0, static=0.0), (0.01, 1.0)),
    "resonance without damping": (
        _paper(kinetic=0.0, static=0.0, damping=0.0, slope=0.0, f=1.0),
        REST,
    ),
    "almost resonance": (
        _paper(kinetic=0.0, static=0.0, damping=0.0, slope=0.0, f=1.0 + 1e-8),
        REST,
    ),
    "barely overdamped": (_paper(slope=0.0, damping=CRITICAL * (1.0 + 1e-9)), (0.02, 3.0)),
    "barely underdamped": (_paper(slope=0.0, damping=CRITICAL * (1.0 - 1e-9)), (0.02, 3.0)),
    "almost no spring": (_paper(stiffness=1e-6), REST),
    "resonance with friction": (
        _paper(damping=0.0, slope=0.0, f=1.0, brake=wb.ConventionalBrake(radius=0.2)),
        REST,
    ),
    "no spring": (_paper(stiffness=0.0), REST),
    "no initial actuation": (_paper(initial_force=0.0, slope=20.0), REST),
    "no torque": (_paper(amplitude=0.0, eta=0.0), (0.2, -1.0)),
    "no torque, growing": (_paper(amplitude=0.0), (0.2, 2.0)),
    "turning shaft": (_paper(drive_speed=3.0, static=0.33), REST),
    "turning backwards": (_paper(drive_speed=-3.0, static=0.33), (0.01, 3.0)),
    "turning and overdamped": (_paper(drive_speed=2.0, damping=300.0, slope=100.0), REST),
    "turning, slow torque": (_paper(drive_speed=0.5, f=0.2, static=0.34), REST),
    "fast torque": (_paper(f=5.0, F0=0.01), REST),
    "wrong way round": (_paper(f=math.sqrt(2.0), F0=0.2, alpha=3.0), (-0.05, 7.5)),
}

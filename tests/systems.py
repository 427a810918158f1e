"""Random braked drivelines for property tests, all dimensionless groups of order one."""

from __future__ import annotations

import math

from hypothesis import strategies as st

import wedgebrake as wb


def _logarithmic(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(math.log(low), math.log(high)).map(math.exp)


def _relative(low: float, high: float) -> st.SearchStrategy[float]:
    """Zero or clearly not zero: denormal numbers are a matter of their own."""
    return st.just(0.0) | st.floats(low, high).filter(lambda x: abs(x) > 1e-9)


@st.composite
def brakes(draw: st.DrawFn, mu: float) -> wb.Brake:
    """Every kind of brake, self-locking ones included."""
    radius = draw(st.floats(0.05, 1.0))
    kind = draw(st.sampled_from(("wedge", "conventional", "band", "leading-shoe")))
    if kind == "conventional":
        return wb.ConventionalBrake(radius=radius)
    if kind == "band":
        return wb.BandBrake(radius=radius, wrap_angle=draw(st.floats(0.5, 6.0)))
    # tan(angle)/mu, or the same for the shoe: below 1 it locks itself.
    alpha = draw(st.floats(0.7, 0.999) | st.floats(1.001, 1.3) | st.floats(1.3, 6.0))
    if kind == "wedge":
        return wb.WedgeBrake(radius=radius, angle=math.atan(alpha * mu))
    return wb.LeadingShoeBrake(
        radius=radius, actuation_arm=0.2, normal_arm=0.1, friction_arm=0.1 / (alpha * mu)
    )


@st.composite
def systems(draw: st.DrawFn) -> wb.BrakedDriveline:
    """A driveline of any damping, with every kind of brake, at rest or turning."""
    # Critical damping and resonance, where closed forms divide by almost nothing.
    near_one = st.just(1.0) | _logarithmic(1e-12, 1e-2).map(lambda x: 1.0 + x)
    inertia, natural = draw(_logarithmic(0.1, 10.0)), draw(_logarithmic(3.0, 300.0))
    impedance = inertia * natural
    mu = draw(st.floats(0.05, 0.6))
    brake = draw(brakes(mu))
    torque = draw(st.just(0.0) | _logarithmic(1.0, 1000.0))
    scale = torque or 100.0  # the unit of torque: the law is homogeneous
    damping = draw(st.just(0.0) | st.floats(1e-4, 0.1) | st.floats(0.1, 3.0) | near_one)
    tune = draw(_logarithmic(0.2, 5.0) | near_one)
    pushed = draw(st.just(0.0) | _logarithmic(1e-3, 1.0)) * scale / (mu * brake.radius)
    slope = draw(_relative(-1.0, 0.3)) * impedance / (mu * brake.radius)
    drive = draw(_relative(-1.0, 1.0)) * scale / impedance
    return wb.BrakedDriveline(
        driveline=wb.Driveline(
            inertia=inertia,
            damping=2.0 * damping * impedance,
            stiffness=inertia * natural**2,
            drive_speed=drive,
        ),
        brake=brake,
        friction=wb.CoulombFriction(kinetic=mu, static=mu * draw(st.floats(1.0, 1.5))),
        actuation=wb.Actuation(initial_force=pushed, slope=slope),
        excitation=wb.HarmonicTorque(amplitude=torque, frequency=tune * natural / (2.0 * math.pi)),
    )


@st.composite
def starts(draw: st.DrawFn, system: wb.BrakedDriveline) -> tuple[float, float]:
    """An initial state on the system's own scale; half of them at rest relative to the brake."""
    line = system.driveline
    scale = system.excitation.amplitude or 100.0
    angle = draw(_relative(-2.0, 2.0)) * scale / line.stiffness
    moving = draw(_relative(-2.0, 2.0)) * scale / (line.inertia * line.natural_frequency)
    return angle, moving if draw(st.booleans()) else -line.drive_speed


@st.composite
def cases(draw: st.DrawFn) -> tuple[wb.BrakedDriveline, tuple[float, float]]:
    """A system and where it starts."""
    system = draw(systems())
    return system, draw(starts(system))

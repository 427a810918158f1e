"""The wedge brake in plain numbers, as a user of another program would write it down.

    theta'' = T_e sin(omega t) - c theta' - k theta - torque(theta'),   J = 1

Friction without a static peak; an actuation force that releases. Nothing here is taken from
the package but the parameters of a system.
"""

import math
from typing import NamedTuple

import wedgebrake as wb


class Brake(NamedTuple):
    """Damping c, stiffness k, torque te and om, radius r, tan of the wedge angle, friction mu,

    actuation force fa + slope |theta'|, steepness of the smoothed law (0 for Coulomb friction).
    """

    c: float
    k: float
    te: float
    om: float
    r: float
    tan: float
    mu: float
    fa: float
    slope: float
    steep: float

    @classmethod
    def of(cls, system: wb.BrakedDriveline) -> "Brake":
        """The numbers of a system."""
        line, force, friction = system.driveline, system.actuation, system.friction
        assert isinstance(system.brake, wb.WedgeBrake)
        assert line.inertia == 1.0
        assert line.drive_speed == 0.0
        assert force.release
        assert friction.static == friction.kinetic
        return cls(
            c=line.damping,
            k=line.stiffness,
            te=system.excitation.amplitude,
            om=2.0 * math.pi * system.excitation.frequency,
            r=system.brake.radius,
            tan=math.tan(system.brake.angle),
            mu=friction.kinetic,
            fa=force.initial_force,
            slope=force.slope,
            steep=getattr(friction, "steepness", 0.0),
        )

    @property
    def release(self) -> float:
        """Speed at which the actuation force vanishes [rad/s]."""
        return -self.fa / self.slope if self.slope < 0.0 else math.inf

    def gain(self, side: int) -> float:
        """Brake torque over actuation force in one direction of sliding, positive."""
        return self.r * self.mu / (self.tan - side * self.mu)

    def piece(self, side: int, engaged: bool) -> tuple[float, float]:
        """g2, q of theta'' = te sin(om t) - k theta - g2 theta' + q in sliding."""
        gain = self.gain(side) if engaged else 0.0
        return self.c + gain * self.slope, -side * gain * self.fa

    def pull(self, t: float, angle: float) -> float:
        """Torque on the resting brake."""
        return self.te * math.sin(self.om * t) - self.k * angle

    def side_of(self, pull: float) -> int:
        """Where a pull moves the brake at rest; 0: it holds."""
        if pull > self.gain(1) * self.fa:
            return 1
        return -1 if pull < -self.gain(-1) * self.fa else 0

    def rest(self, t: float, angle: float) -> tuple[float, int]:
        """When and to which side a brake at rest breaks loose."""
        up = self._wait(self.gain(1) * self.fa + self.k * angle, self.om * t)
        down = self._wait(self.gain(-1) * self.fa - self.k * angle, self.om * t + math.pi)
        return t + min(up, down), 1 if up <= down else -1

    def _wait(self, level: float, phase: float) -> float:
        if level >= self.te:
            return math.inf
        return (math.asin(level / self.te) - phase) % (2.0 * math.pi) / self.om

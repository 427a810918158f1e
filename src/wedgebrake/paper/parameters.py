"""The fixed values of Chen and Xi (2014) and what its section 4 leaves unsaid.

Chen and Xi, Stability and response of a self-amplified braking system under
velocity-dependent actuation force, Nonlinear Dynamics (2014),
doi 10.1007/s11071-014-1603-y.
"""

from __future__ import annotations

from wedgebrake.errors import InputError, nearest
from wedgebrake.model.actuation import Actuation
from wedgebrake.model.brakes import Brake, ConventionalBrake, WedgeBrake
from wedgebrake.model.driveline import Driveline
from wedgebrake.model.excitation import HarmonicTorque
from wedgebrake.model.friction import CoulombFriction, Friction, SmoothedFriction
from wedgebrake.model.system import BrakedDriveline

KINETIC, RADIUS, INITIAL_FORCE = 0.30, 0.2, 300.0
INERTIA, STIFFNESS = 1.0, 1e4
"""mu_k, R [m], F_a0 [N], J [kg m^2] and k [N m/rad], of the paper's sections 3 and 4."""


def system(
    eta: float = -24.0,
    f: float = 0.63,
    F0: float = 0.036,  # noqa: N803 - the paper's symbol, fixed public name
    alpha: float = 1.18,
    brake: str = "wedge",
    friction: str = "coulomb",
    damping: float = 0.1,
    static: float = 0.30,
    release: bool = True,
) -> BrakedDriveline:
    """The paper's braked driveline at the given normalised groups.

    The paper prints damping c = 1 N m s/rad, mu_s = 0.33 and an actuation force that may
    become negative; its nonlinear figures follow only with c = 0.1, mu_s = mu_k = 0.30 and
    a brake that releases, the defaults here. ``damping=1.0, static=0.33, release=False``
    is the paper as printed.

    eta, f, F0, alpha : slope of the actuation force, frequency of the torque, initial actuation
                        force, wedge angle (``wb.Groups``)
    brake             : "wedge" or "conventional" (``alpha`` is then without effect)
    friction          : "coulomb" or "smoothed"
    damping, static   : c [N m s/rad] and mu_s [1]
    release           : whether a negative actuation force releases the brake

    Raises ``InputError`` for any other word or a value out of range.
    """
    frictions: dict[str, Friction] = {
        "coulomb": CoulombFriction(kinetic=KINETIC, static=static),
        "smoothed": SmoothedFriction(kinetic=KINETIC, static=static),
    }
    brakes: dict[str, Brake] = {
        "wedge": WedgeBrake(angle=0.34, radius=RADIUS),
        "conventional": ConventionalBrake(radius=RADIUS),
    }
    for name, value, allowed in (("brake", brake, brakes), ("friction", friction, frictions)):
        if value not in allowed:
            raise InputError(f"{name} = {value!r}: not known. {nearest(str(value), allowed)}")
    base = BrakedDriveline(
        driveline=Driveline(inertia=INERTIA, damping=damping, stiffness=STIFFNESS),
        brake=brakes[brake],
        friction=frictions[friction],
        actuation=Actuation(initial_force=INITIAL_FORCE, release=release),
        excitation=HarmonicTorque(amplitude=500.0, frequency=10.0),
    )
    chosen = {"eta": eta, "f": f, "F0": F0}
    if brake == "wedge":
        chosen["alpha"] = alpha
    return base.replace(**chosen)

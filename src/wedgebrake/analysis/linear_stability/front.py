"""``stability``: linear stability of drivelines and of machines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import overload

from wedgebrake.analysis.linear_stability.machine_stability import (
    MachineStability,
    check_sticking,
    machine_stability,
    with_held,
)
from wedgebrake.analysis.linear_stability.verdict import Stability, driveline_stability
from wedgebrake.model.machine import Machine
from wedgebrake.model.signals.signals import Signal
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance, wrong


@overload
def stability(system: BrakedDriveline, speeds: None = None, sticking: None = None) -> Stability: ...


@overload
def stability(
    system: Machine,
    speeds: Mapping[str, float] | Sequence[float] | None = None,
    sticking: Sequence[str] | None = None,
) -> MachineStability: ...


def stability(
    system: BrakedDriveline | Machine,
    speeds: Mapping[str, float] | Sequence[float] | None = None,
    sticking: Sequence[str] | None = None,
) -> Stability | MachineStability:
    """Linear stability of steady sliding.

    For a ``BrakedDriveline`` (eqs. 8 to 13, 23 to 29) sliding is evaluated at the speed of its
    shaft if the shaft turns, otherwise near rest in both directions, with the slope of the
    friction law and the release at that speed.

    For a ``Machine`` sliding is evaluated at given speeds of the inertias. A contact whose sliding
    speed is then 0 can begin to slide in either direction: each combination of directions is one
    case. If such contacts are pressed, the result also has the case in which they stick (``held``):
    the vibration with a locked clutch, until it slips. The linear system includes the shafts, the
    speeds, the lags of the actuators and the slope of each friction law. A force held by a limit
    or by the release is constant. Signals have their values at time 0, or at the first time at
    which they are known. With controllers (``sample_time``) the modes follow from the multipliers
    of the exactly discretised system; rounding of the force to the ``resolution`` is neglected. A
    mode with a negative multiplier changes its sign from sample to sample (``alternates``): its
    frequency is half the sampling rate.

    system   : the braked driveline or machine
    speeds   : for a ``Machine`` only: speeds of the inertias [rad/s], as a mapping from their names
               or a sequence in their order; by default, and where a mapping leaves them out, the
               initial speeds
    sticking : for a ``Machine`` only: names of contacts that stick, for example ("clutch",). They
               are constraints, and all other contacts slide

    Returns a ``Stability`` for a ``BrakedDriveline``, a ``MachineStability`` for a ``Machine``.

    Raises ``InputError`` for any other system, for a ``BrakedDriveline`` with lag, limits, sampling
    or signals (use ``system.machine``), for speeds that are not finite numbers or belong to no
    inertia, for contacts in ``sticking`` that do not stand, for more than 10 other contacts at
    rest, and for controllers with different sample times or with delays of more than 2000 samples.
    """
    if isinstance(system, Machine):
        if sticking is not None:
            return machine_stability(system, speeds, check_sticking(system, sticking))
        return with_held(system, machine_stability(system, speeds))
    check_instance("system", system, BrakedDriveline, "a BrakedDriveline or a Machine")
    if speeds is not None:
        raise wrong(
            "speeds", speeds, "left out for a BrakedDriveline",
            "Its shaft turns with driveline.drive_speed; a wb.Machine takes speeds.",
        )  # fmt: skip
    if sticking is not None:
        raise wrong(
            "sticking", sticking, "left out for a BrakedDriveline",
            "While its brake sticks nothing moves; a wb.Machine takes sticking contacts.",
        )  # fmt: skip
    at_once = system.actuation.immediate and not isinstance(system.actuation.initial_force, Signal)
    if not at_once or isinstance(system.driveline.drive_speed, Signal):
        raise wrong(
            "system", system, "a BrakedDriveline of plain numbers whose force acts at once",
            "With lag, limits, sampling or signals use wb.stability(system.machine).",
        )  # fmt: skip
    return driveline_stability(system)

"""The front door of linear stability, for drivelines and for general machines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import overload

from wedgebrake.analysis.linear_stability.machine_stability import (
    MachineStability,
    machine_stability,
)
from wedgebrake.analysis.linear_stability.verdict import Stability, driveline_stability
from wedgebrake.model.machine import Machine
from wedgebrake.model.signals import Signal
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance, wrong


@overload
def stability(system: BrakedDriveline, speeds: None = None) -> Stability: ...


@overload
def stability(
    system: Machine, speeds: Mapping[str, float] | Sequence[float] | None = None
) -> MachineStability: ...


def stability(
    system: BrakedDriveline | Machine,
    speeds: Mapping[str, float] | Sequence[float] | None = None,
) -> Stability | MachineStability:
    """Linear stability of steady sliding.

    Of a ``BrakedDriveline`` (eqs. 8 to 13, 23 to 29) sliding is evaluated at the speed of its
    shaft, if that turns, otherwise near rest in both directions, with the slope of the friction
    law and the release at that speed.

    Of a ``Machine`` it is evaluated at given speeds of the inertias. A contact whose sliding speed
    is then 0 can begin to slide in either direction: each pattern of directions is one case. The
    linear system holds the shafts, the speeds, the lags of the actuators, and the slope of each
    friction law. A force that a limit or the release holds is constant. Signals have their values
    at time 0, or at the first time at which they are known. With controllers (``sample_time``) the
    modes follow from the multipliers of the exactly discretised system; their rounding to the
    resolution is left out.

    system : the machine
    speeds : of a ``Machine`` alone: speeds of the inertias [rad/s], as a mapping from their names
             or a sequence in their order; by default, and where a mapping leaves them out, those
             at the start

    Returns a ``Stability`` of a ``BrakedDriveline``, a ``MachineStability`` of a ``Machine``.

    Raises ``InputError`` for anything else as system, for a ``BrakedDriveline`` with lag, limits,
    sampling or signals, which ``system.machine`` converts, for speeds that are not finite numbers
    or of no inertia, for more than 10 contacts that stand, and for controllers with different
    sample times or with delays of more than 2000 samples.
    """
    if isinstance(system, Machine):
        return machine_stability(system, speeds)
    check_instance("system", system, BrakedDriveline, "a BrakedDriveline or a Machine")
    if speeds is not None:
        raise wrong(
            "speeds", speeds, "left out for a BrakedDriveline",
            "Its shaft turns with driveline.drive_speed; a wb.Machine takes speeds.",
        )  # fmt: skip
    at_once = system.actuation.immediate and not isinstance(system.actuation.initial_force, Signal)
    if not at_once or isinstance(system.driveline.drive_speed, Signal):
        raise wrong(
            "system", system, "a BrakedDriveline of plain numbers whose force acts at once",
            "With lag, limits, sampling or signals use wb.stability(system.machine).",
        )  # fmt: skip
    return driveline_stability(system)

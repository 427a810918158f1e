"""``stability``: linear stability of drivelines and of machines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import cast, overload

from wedgebrake.analysis.linear_stability.machine_stability import (
    Stability,
    check_sticking,
    machine_stability,
    with_held,
)
from wedgebrake.analysis.linear_stability.one_inertia import (
    DrivelineStability,
    driveline_stability,
)
from wedgebrake.analysis.linear_stability.sliding_contact import CURVE, Method, check_method
from wedgebrake.model.machine import Machine
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance


@overload
def stability(
    system: BrakedDriveline, speeds: None = None, sticking: None = None, *, method: Method = CURVE
) -> DrivelineStability: ...


@overload
def stability(
    system: BrakedDriveline | Machine,
    speeds: Mapping[str, float] | Sequence[float] | None = None,
    sticking: Sequence[str] | None = None,
    *,
    method: Method = CURVE,
) -> Stability: ...


def stability(
    system: BrakedDriveline | Machine,
    speeds: Mapping[str, float] | Sequence[float] | None = None,
    sticking: Sequence[str] | None = None,
    *,
    method: Method = CURVE,
) -> Stability:
    """Linear stability of steady sliding.

    Sliding is evaluated at given speeds of the inertias. A contact whose sliding speed is then 0
    can begin to slide in either direction: each combination of directions is one case. If such
    contacts are pressed, the result also has the case in which they stick (``held``): the vibration
    with a locked clutch, until it slips. The linear system includes the shafts, the speeds, the
    lags of the actuators and the slope of each friction law. A force held by a limit or by the
    release is constant. Stages, gaps and torques over speeds and angles act with their line at the
    equilibrium; at a corner over the speed, with that of the two lines that has the larger slope.
    If there are several equilibria, the one found by Newton's method from the initial angles is
    used. Signals have their values at time 0, or at the first time at which they are known. With a
    ``sample_time`` of an actuation or a controller, the modes follow from the multipliers of the
    exactly discretised system; rounding to the ``resolution`` is neglected. A mode with a negative
    multiplier changes its sign from sample to sample (``alternates``): its frequency is half the
    sampling rate.

    A ``BrakedDriveline`` (eqs. 8 to 13, 23 to 29) slides at the speed of its shaft if the shaft
    turns, otherwise near rest in both directions. Without ``speeds`` and ``sticking``, its result
    also has the directions ``forward`` and ``backward``, with the Hopf and node-focus points in the
    slope of the actuation force.

    system   : the braked driveline or machine
    speeds   : of the inertias [rad/s], as a mapping from their names or a sequence in their order;
               by default, and where a mapping leaves them out, the initial speeds. The inertia of a
               ``BrakedDriveline`` is "driveline", and its speed is relative to the turning shaft
    sticking : names of contacts that stick, for example ("clutch",); that of a ``BrakedDriveline``
               is "brake". They are constraints, and all other contacts slide
    method   : how friction that varies with the sliding speed is linearised: "curve", by the
               derivative of its curve, which the method "smooth" of ``wb.simulate`` uses; "exact",
               by the slope of the straight lines that the method "exact" uses instead. For
               constant friction both give the same result

    Returns a ``Stability``, which names its ``method``; for a ``BrakedDriveline`` it is a
    ``DrivelineStability``, which has further fields.

    Raises ``InputError`` for any other system, for speeds that are not finite numbers or belong to
    no inertia, for contacts in ``sticking`` that do not stand, for more than 10 other contacts at
    rest, for a machine without an equilibrium or with one at a corner over an angle, for
    different sample times or delays of more than 2000 samples, and for friction that the method
    "exact" does not support.
    """
    chosen = check_method(method)
    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    machine = system.machine
    if sticking is not None:
        return machine_stability(machine, speeds, check_sticking(machine, sticking), chosen)
    if speeds is None and "inertia" not in system.coords:
        # Without names, the cases of sliding are told apart by their direction.
        return driveline_stability(cast("BrakedDriveline", system), chosen)
    return with_held(machine, machine_stability(machine, speeds, method=chosen), speeds)

"""``branches``: the branches of periodic orbits over a parameter, as one dataset."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from wedgebrake.continuation.branch import Branch
from wedgebrake.continuation.continuation import POINTS, STEP
from wedgebrake.continuation.diagram import SWITCH, follow
from wedgebrake.continuation.orbit import Orbit
from wedgebrake.continuation.ranges import Range, make_ranges
from wedgebrake.continuation.shooting import check, orbit_to_follow
from wedgebrake.errors import InputError
from wedgebrake.model.system import BrakedDriveline

if TYPE_CHECKING:
    import xarray as xr


def branches(
    system: BrakedDriveline,
    *,
    order: int | None = None,
    initial: tuple[float, float] | None = None,
    method: str | None = None,
    rtol: float = 1e-10,
    switch: int = SWITCH,
    opposite: bool = True,
    step: float = STEP,
    points: int = POINTS,
    progress: Callable[[Branch], None] | None = None,
    **parameter: tuple[float, float],
) -> xr.Dataset:
    """Branches of periodic orbits over one parameter, stable and unstable, with bifurcations.

    Parameters
    ----------
    system : BrakedDriveline
        What is changed.
    **parameter : (float, float)
        One SI parameter or group with its ends, for example ``eta=(12, -60)``. The first
        branch begins at the first end.
    order, initial, method, rtol
        Of the first orbit, as for ``wb.orbit``. If the motion is still irregular after the
        longest transient of ``wb.orbit``, the first orbit is a stable one near that motion.
    switch : int
        How many times over branches that leave a branch are followed (at period doublings,
        symmetry breakings, branch points, and where the motion jumps): 0 none, 1 those that
        leave the first, ... Of more than 16 periods none is.
    opposite : bool
        Whether a second branch begins at the other end, with the motion that settles there,
        unless the first one has come there.
    step, points
        As for ``wb.continuation``, for each branch.
    progress : callable
        Gets the ``Branch`` after each of its points.

    Returns
    -------
    xarray.Dataset
        Over ``point``, branch after branch: the parameter, ``branch``, ``order``, ``stable``,
        ``sequence``, Floquet multipliers, amplitudes, sticks and events in a period of the
        torque, Poincare points. Over ``bifurcation``: kind, value (located to 1e-8 of the
        range or better), effect. Over ``branch_number``: where each comes from and why it ends.

    Raises ``InputError`` for arguments that are wrong, and where there is no orbit to begin.
    """
    from wedgebrake.continuation.dataset import assemble

    check(system, order, method, rtol)
    (over,) = make_ranges(system, parameter, 1)
    first = begun(system, over, order=order, initial=initial, method=method, rtol=rtol)
    followed = follow(
        first, over, switch=switch, opposite=opposite, step=step, points=points, progress=progress
    )
    return assemble(system, over, followed)


def begun(system: BrakedDriveline, over: Range, **settings: Any) -> Orbit:
    """The orbit at the first end of a range; ``InputError`` where there is none.

    settings : of ``orbit_to_follow``
    """
    first = orbit_to_follow(system.replace(**{over.name: over.first}), **settings)
    if not first.found:
        raise InputError(
            f"{over.name} = {over.first:g}: there is no orbit to begin with. {first.message}"
        )
    return first

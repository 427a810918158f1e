"""Regime maps: a sweep over two parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from wedgebrake.errors import InputError
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.sweeps.sweep import execute, make_plan, split_options

if TYPE_CHECKING:
    import xarray as xr


def regime_map(system: BrakedDriveline, **options: Any) -> xr.Dataset:
    """Compute the map over two parameters of motion, stick-slip, exponent and peak torque.

    The zero line of ``sliding_damping`` is the limit of linear stability. The Poincare
    points are not kept (``keep_points=True`` keeps them).

    Parameters
    ----------
    system : BrakedDriveline
        The system whose parameters are changed.
    **options
        Two parameters with their values, for example ``eta=..., F0=...``, and arguments of
        ``sweep``.

    Returns
    -------
    xarray.Dataset
        As ``sweep``; ``wb.plot`` draws the map.

    Raises ``InputError`` as ``sweep``, and for other than two parameters.
    """
    parameters, settings, execution = split_options(options)
    if len(parameters) != 2:
        raise InputError(
            f"regime_map: {len(parameters)} parameters ({', '.join(parameters) or 'none'}), must"
            " be two, for example eta=np.linspace(-60, 12, 200), F0=np.linspace(0.01, 0.1, 100)."
        )
    settings.setdefault("keep_points", False)
    return execute(make_plan("regime_map", system, parameters, **settings), **execution)

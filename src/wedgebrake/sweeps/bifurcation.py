"""Bifurcation diagrams: a sweep over one parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from wedgebrake.errors import InputError
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance
from wedgebrake.sweeps.sweep import execute, make_plan, split_options

if TYPE_CHECKING:
    import xarray as xr


def bifurcation(system: BrakedDriveline, *, follow: bool = False, **options: Any) -> xr.Dataset:
    """Compute the bifurcation diagram over one parameter.

    Parameters
    ----------
    system : BrakedDriveline
        The system whose parameters are changed.
    follow : bool
        Each point starts where its neighbour ended, once up and once down: branches that
        differ show hysteresis.
    **options
        The parameter with its values, for example ``eta=np.linspace(-60, 12, 400)``, and
        arguments of ``sweep``.

    Returns
    -------
    xarray.Dataset
        As ``sweep``; ``wb.plot`` draws the diagram.

    Raises ``InputError`` as ``sweep``, and for more than one parameter.
    """
    parameters, settings, execution = split_options(options)
    if len(parameters) != 1:
        raise InputError(
            f"bifurcation: {len(parameters)} parameters ({', '.join(parameters) or 'none'}), must"
            " be one, for example eta=np.linspace(-60, 12, 400). For two use regime_map, for any"
            " number sweep."
        )
    check_instance("follow", follow, bool)
    along = next(iter(parameters)) if follow else None
    plan = make_plan("bifurcation", system, parameters, follow=along, **settings)
    return execute(plan, **execution)

"""The three sweeps that a user draws: bifurcation diagram, regime map, basins of attraction."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any

from wedgebrake.errors import InputError
from wedgebrake.model.sweep_settings import INITIAL
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance
from wedgebrake.sweeps.sweep import execute, make_plan, sweep

if TYPE_CHECKING:
    import xarray as xr

_EXECUTION = ("store", "resume", "threads", "client", "progress")


def bifurcation(system: BrakedDriveline, *, follow: bool = False, **options: Any) -> xr.Dataset:
    """The bifurcation diagram over one parameter.

    Parameters
    ----------
    system : BrakedDriveline
        What is changed.
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
    parameters, settings, execution = _split(options)
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


def regime_map(system: BrakedDriveline, **options: Any) -> xr.Dataset:
    """The map over two parameters of motion, stick-slip, exponent and peak torque.

    The zero line of ``sliding_damping`` is the limit of linear stability. The Poincare
    points are not kept (``keep_points=True`` keeps them).

    Parameters
    ----------
    system : BrakedDriveline
        What is changed.
    **options
        Two parameters with their values, for example ``eta=..., F0=...``, and arguments of
        ``sweep``.

    Returns
    -------
    xarray.Dataset
        As ``sweep``; ``wb.plot`` draws the map.

    Raises ``InputError`` as ``sweep``, and for other than two parameters.
    """
    parameters, settings, execution = _split(options)
    if len(parameters) != 2:
        raise InputError(
            f"regime_map: {len(parameters)} parameters ({', '.join(parameters) or 'none'}), must"
            " be two, for example eta=np.linspace(-60, 12, 200), F0=np.linspace(0.01, 0.1, 100)."
        )
    settings.setdefault("keep_points", False)
    return execute(make_plan("regime_map", system, parameters, **settings), **execution)


def basins(system: BrakedDriveline, **options: Any) -> xr.Dataset:
    """The map over initial angle and velocity of what the motion settles to.

    Parameters
    ----------
    system : BrakedDriveline
        What moves.
    **options
        ``initial_angle`` [rad] and ``initial_velocity`` [rad/s] with their values, and
        arguments of ``sweep``; ``transient`` is "auto" by default.

    Returns
    -------
    xarray.Dataset
        As ``sweep``, with ``attractor``, the number of the attractor of each point (-1
        undecided, -2 diverged, -3 self-locked, -4 not computed), and over ``attractor_id``
        its motion, order, share of the points, and Poincare points. A store holds the points
        alone: the attractors are told apart when it is complete, in the returned dataset.

    Raises ``InputError`` as ``sweep``, and without both initial conditions.
    """
    from wedgebrake.sweeps.attractors import label

    parameters, settings, execution = _split(options)
    if set(parameters) != set(INITIAL):
        raise InputError(
            f"basins: swept {', '.join(parameters) or 'nothing'}, must be initial_angle and"
            " initial_velocity, for example initial_angle=np.linspace(-0.2, 0.2, 100),"
            " initial_velocity=np.linspace(-20, 20, 100). Change the system with replace."
        )
    if not settings.get("keep_points", True):
        raise InputError("keep_points = False: the points tell basins apart. Leave it out.")
    settings.setdefault("transient", "auto")
    return label(execute(make_plan("basins", system, parameters, **settings), **execution))


def _split(options: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Parameters, settings of the plan, and how it is executed."""
    known = set(inspect.signature(sweep).parameters) - {"system", "parameters", "follow"}
    if "follow" in options:
        raise InputError("follow: only bifurcation and sweep follow a parameter.")
    parameters = {name: value for name, value in options.items() if name not in known}
    execution = {name: value for name, value in options.items() if name in _EXECUTION}
    settings = {
        name: value
        for name, value in options.items()
        if name not in parameters and name not in execution
    }
    return parameters, settings, execution

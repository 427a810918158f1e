"""Sweeps over any number of parameters, bifurcation diagrams over one, regime maps over two."""

from __future__ import annotations

import inspect
import os
import warnings
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import nullcontext
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from wedgebrake.analysis.run_settings import AUTO, SWEEP_LIMIT, protocol, returns_of
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.signals.signals import check_repeat
from wedgebrake.model.studies.sweep_settings import joined
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance, unknown, wrong
from wedgebrake.solvers.kernels import method_of
from wedgebrake.solvers.task import check_state
from wedgebrake.sweeps.grid import ChunkIndex, Chunks, Grid, make_axes
from wedgebrake.sweeps.progress import Bar, Meter, Report

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.sweeps.plan import Plan

_CHUNK_BYTES = 2**26
# A grid is divided into at least so many chunks, if each has the fewest points of a chunk.
_FEWEST_CHUNKS = 16


class StoreWarning(UserWarning):
    """Part of a store is damaged and is computed again."""


def sweep(
    system: BrakedDriveline | Machine,
    over: Mapping[str, Any] | None = None,
    *,
    periods: int | None = None,
    crossings: int | None = None,
    transient: int | Literal["auto"] = AUTO,
    limit: int = SWEEP_LIMIT,
    initial: tuple[float, float] = (0.0, 0.0),
    follow: str | None = None,
    method: str | None = None,
    rtol: float = 1e-9,
    max_events: int = 10_000_000,
    max_steps: int = 100_000_000,
    keep_points: bool = True,
    store: str | os.PathLike[str] | None = None,
    resume: bool = False,
    threads: int | None = None,
    client: Any = None,
    progress: bool | Report | None = None,
    **parameters: Any,
) -> xr.Dataset:
    """Compute Poincare points and class of motion over any number of parameters.

    Parameters
    ----------
    system : BrakedDriveline or Machine
        The system whose parameters are changed.
    over : mapping
        Swept values by name, instead of keywords. For a machine: dotted names, as "brake.slope".
    **parameters : array of float
        The swept values by name: SI parameters (``slope``, ``frequency``, ...), groups
        (``eta``, ``f``, ``F0``, ``alpha``), ``initial_angle``, ``initial_velocity``. Several
        parameters span a grid.
    periods, crossings, transient, limit
        As for ``motion``. By default each point is recorded for 50 returns after it has settled or
        ``limit`` returns have passed. With a number for ``transient``, ``periods`` and
        ``transient`` are the numbers of the last and of the first recorded return; 250 and 200 are
        approximately the paper's protocol.
    initial : (angle [rad], velocity [rad/s])
        State of a driveline at t = 0, where it is not swept.
    follow : str
        Name of a swept parameter along which each point starts from the final state of its
        neighbour, once in the order given ("up") and once in reverse ("down"). The result then has
        the dimension ``branch``.
    method, rtol, max_events, max_steps
        As in ``simulate``.
    keep_points : bool
        Include the Poincare points in the result.
    store : path
        A folder (zarr) to which the result is written chunk by chunk;
        ``xarray.open_dataset(path, engine="wedgebrake")`` reads it.
    resume : bool
        Continue an existing store; its results are kept, bit for bit.
    threads : int
        Number of threads; default: one per processor.
    client : distributed.Client
        Distribute the chunks over a Dask cluster (extra ``cluster``).
    progress : bool or callable
        True shows points, rate and time left on standard error (the default with a store);
        a callable receives a ``Progress``.

    Returns
    -------
    xarray.Dataset
        Over the swept names in the order given, then ``period``: angle [rad] and velocity
        [rad/s] at t = period/f_e; and for each point its ``status``, class of ``motion``
        and of stick-slip, exponents and the other variables of ``wedgebrake.sweeps.results``.
        With a store, values are read when they are used. ``status`` marks points that diverge,
        lock or are invalid. If no signal varies in time, ``crossing`` replaces ``period``, and
        ``motion_period`` is the period of the motion [s]. Variables of a machine also have the
        dimension ``inertia`` or ``contact``.

    Raises
    ------
    InputError
        For invalid arguments, or a store of another sweep.
    OutputError
        If the store cannot be written; its contents remain valid.
    WedgebrakeError
        If the Dask cluster is lost. The store remains valid.
    """
    kept = {
        "store": store, "resume": resume, "threads": threads, "client": client,
        "progress": progress,
    }  # fmt: skip
    check_execution(**kept)
    parameters = joined(over, parameters)
    plan = make_plan(
        "sweep", system, parameters, periods=periods, crossings=crossings, transient=transient,
        limit=limit, initial=initial, follow=follow, method=method, keep_points=keep_points,
        rtol=rtol, max_events=max_events, max_steps=max_steps,
    )  # fmt: skip
    return execute(plan, **kept)


def bifurcation(
    system: BrakedDriveline | Machine,
    over: Mapping[str, Any] | None = None,
    *,
    follow: bool = False,
    **options: Any,
) -> xr.Dataset:
    """Compute the bifurcation diagram over one parameter.

    Parameters
    ----------
    system : BrakedDriveline or Machine
        The system whose parameters are changed.
    over : mapping
        Swept values by name, instead of keywords.
    follow : bool
        Start each point from the final state of its neighbour, once up and once down. Branches
        that differ show hysteresis.
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
    parameters = joined(over, parameters)
    example = "eta=np.linspace(-60, 12, 400). For two use regime_map, for any number sweep."
    _check_count("bifurcation", parameters, 1, f"one, for example {example}")
    check_instance("follow", follow, bool)
    along = next(iter(parameters)) if follow else None
    plan = make_plan("bifurcation", system, parameters, follow=along, **settings)
    return execute(plan, **execution)


def regime_map(
    system: BrakedDriveline | Machine, over: Mapping[str, Any] | None = None, **options: Any
) -> xr.Dataset:
    """Compute a map of motion, stick-slip, exponent and peak torque over two parameters.

    The zero line of ``sliding_damping`` is the limit of linear stability. The Poincare
    points are not kept (``keep_points=True`` keeps them).

    Parameters
    ----------
    system : BrakedDriveline or Machine
        The system whose parameters are changed.
    over : mapping
        Swept values by name, instead of keywords.
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
    parameters = joined(over, parameters)
    example = "eta=np.linspace(-60, 12, 200), F0=np.linspace(0.01, 0.1, 100)."
    _check_count("regime_map", parameters, 2, f"two, for example {example}")
    settings.setdefault("keep_points", False)
    return execute(make_plan("regime_map", system, parameters, **settings), **execution)


def _check_count(name: str, parameters: Collection[str], count: int, allowed: str) -> None:
    if len(parameters) != count:
        given = ", ".join(parameters) or "none"
        raise InputError(f"{name}: {len(parameters)} parameters ({given}), must be {allowed}")


def make_plan(
    kind: str,
    system: BrakedDriveline | Machine,
    parameters: dict[str, Any],
    *,
    periods: int | None = None,
    crossings: int | None = None,
    transient: int | Literal["auto"] = AUTO,
    limit: int = SWEEP_LIMIT,
    initial: tuple[float, float] = (0.0, 0.0),
    follow: str | None = None,
    method: str | None = None,
    keep_points: bool = True,
    dim: str | None = None,
    **limits: Any,
) -> Plan:
    """Return the definition of a sweep after validation of its arguments.

    dim : dimension along which all parameters change together; default: they span a grid
    """
    from wedgebrake.sweeps.plan import Plan

    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    chosen = method_of(system, method)
    returns, name = returns_of(system.machine, periods, crossings)
    check_repeat(system.signals())
    axes = make_axes(system, parameters, dim)
    names = [axis.name for axis in axes]
    if follow is not None and not (isinstance(follow, str) and follow in names):
        raise unknown("follow", follow, names, "must be one of the swept parameters")
    check_instance("keep_points", keep_points, bool)
    state = check_state("initial", initial)
    if any(state) and system.holds_start:
        raise wrong(
            "initial", initial, "left out for a machine", "Change the angles and speeds of its"
            ' inertias, for example machine.replace({"disc.speed": 10.0}), or sweep them.',
        )  # fmt: skip
    return Plan(
        system=system,
        grid=Grid(axes, next((axis.dim for axis in axes if axis.name == follow), None)),
        protocol=protocol(returns, transient, limit, name=name, **limits),
        method=chosen,
        initial=state,
        keep_points=keep_points,
        kind=kind,
    )


def execute(
    plan: Plan,
    *,
    store: str | os.PathLike[str] | None = None,
    resume: bool = False,
    threads: int | None = None,
    client: Any = None,
    progress: bool | Report | None = None,
) -> xr.Dataset:
    """Compute a plan, in memory or into a store; the arguments have been checked."""
    from wedgebrake.sweeps.executor import by_threads

    shows = store is not None if progress is None else bool(progress)
    bar = Bar() if shows and not callable(progress) else None
    report = progress if callable(progress) else bar

    work: _Work = partial(by_threads, plan, threads)
    if client is not None:
        from wedgebrake.sweeps.cluster import Cluster

        work = Cluster(plan, client).chunks  # before a store is created: it may fail
    with bar or nullcontext():
        if store is None:
            return _in_memory(plan, work, report)
        return _in_store(plan, work, report, store, resume)


_EXECUTION = ("store", "resume", "threads", "client", "progress")


def check_execution(
    *,
    store: Any = None,
    resume: Any = False,
    threads: Any = None,
    client: Any = None,
    progress: Any = None,
) -> None:
    """Raise ``InputError`` for wrong arguments of ``execute``, even if nothing is executed."""
    from wedgebrake.sweeps.executor import check_workers

    check_instance("resume", resume, bool)
    if resume and store is None:
        raise InputError.of("resume", True, "needs store, the path of the store to continue.")
    check_workers("threads", threads)
    if client is not None and not hasattr(client, "submit"):
        raise wrong("client", client, "a distributed.Client (pip install 'wedgebrake[cluster]')")
    if not (progress is None or isinstance(progress, bool) or callable(progress)):
        raise wrong("progress", progress, "True, False or a callable")


def split_options(
    options: dict[str, Any],
) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Divide keyword arguments into parameters, settings of the plan, and of its execution.

    Raises ``InputError`` for a wrong argument of the execution.
    """
    known = set(inspect.signature(sweep).parameters) - {"system", "over", "parameters", "follow"}
    if "follow" in options:
        raise InputError("follow: only bifurcation and sweep follow a parameter.")
    parameters: dict[str, Any] = {}
    settings: dict[str, Any] = {}
    execution: dict[str, Any] = {}
    for name, value in options.items():
        part = parameters if name not in known else execution if name in _EXECUTION else settings
        part[name] = value
    check_execution(**execution)
    return parameters, settings, execution


_Work = Callable[[Chunks, list[ChunkIndex]], Iterator[tuple[ChunkIndex, Any]]]


def _in_memory(plan: Plan, work: _Work, report: Report | None) -> xr.Dataset:
    _check_memory(plan)
    chunks = plan.grid.chunks(_chunk_size(plan))
    arrays = plan.empty_arrays()
    meter = Meter(plan.grid.points, 0, report)
    for index, results in work(chunks, chunks.indices()):
        where = tuple(chunks.slices(index).values())
        for name, values in results.items():
            arrays[name][where] = values
        meter.add(chunks.points(index))
    return plan.dataset(arrays)


def _in_store(
    plan: Plan, work: _Work, report: Report | None, path: str | os.PathLike[str], resume: bool
) -> xr.Dataset:
    from wedgebrake.sweeps.store import SweepStore

    with SweepStore.open(path, plan, plan.grid.chunks(_chunk_size(plan)), resume=resume) as store:
        chunks, completed = store.chunks, store.completed()
        for damage in store.damaged:
            warnings.warn(
                f"{store.path}: chunk {damage.chunk} is damaged ({damage.why}) and is computed"
                " again.",
                StoreWarning,
                stacklevel=4,
            )
        meter = Meter(plan.grid.points, sum(map(chunks.points, completed)), report)
        try:
            wanted = [index for index in chunks.indices() if index not in completed]
            for index, results in work(chunks, wanted):
                store.write(index, results)
                meter.add(chunks.points(index))
        except BaseException as error:
            if not isinstance(error, Exception):  # Ctrl-C
                error.add_note(
                    f"{path}: valid, with {meter.done} of {plan.grid.points} points. The same"
                    " call with resume=True (--resume on the command line) goes on."
                )
            raise
        return store.dataset()


def _chunk_size(plan: Plan) -> int:
    """Return the number of points of a chunk, a balance of lost work and number of files."""
    fewest, most = plan.chunk_points
    share = max(fewest, plan.grid.points // _FEWEST_CHUNKS)
    record = max(1, 16 * plan.record_size)
    return max(1, min(most, share, _CHUNK_BYTES // record))


def _check_memory(plan: Plan) -> None:
    """Raise an error if the result would not fit into the memory of this computer."""
    point = sum(np.dtype(one.dtype).itemsize * plan.width(one) for one in plan.variables)
    needed = point * plan.grid.points
    if needed > _memory() / 2:
        raise InputError(
            f"sweep: the result would take {needed / 2**30:.3g} GiB of memory, this machine has"
            f" {_memory() / 2**30:.3g}. Give store='run.zarr' to write it chunk by chunk (--store"
            " on the command line), keep_points=False to leave the Poincare points out, or fewer"
            " values."
        )


def _memory() -> float:
    """Return the memory of this computer [bytes]; a modest value if it is unknown."""
    try:
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, ValueError, OSError):
        return 8.0 * 2**30

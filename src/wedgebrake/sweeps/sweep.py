"""The front door of sweeps: a system, some parameters, one labelled result."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from wedgebrake.analysis.run_settings import LIMIT, protocol
from wedgebrake.errors import InputError, nearest
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance, check_whole, shown
from wedgebrake.solvers.simulate import check_state, choose_method
from wedgebrake.sweeps.axes import make_axes
from wedgebrake.sweeps.grid import Grid
from wedgebrake.sweeps.progress import Bar, Meter, Report
from wedgebrake.sweeps.store_layout import ChunkIndex, Layout

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.sweeps.plan import Plan
    from wedgebrake.sweeps.store import SweepStore

# Points in a chunk of a store: about a second of work, and not too many files.
_CHUNK = 4096
_SLOW_CHUNK = 256
_CHUNK_BYTES = 2**26
_FEWEST, _PARTS = 16, 16


class StoreWarning(UserWarning):
    """A store was found damaged; what is damaged is computed again."""


def sweep(
    system: BrakedDriveline,
    *,
    periods: int | None = None,
    transient: int | Literal["auto"] = 200,
    limit: int = LIMIT,
    initial: tuple[float, float] = (0.0, 0.0),
    follow: str | None = None,
    method: str | None = None,
    rtol: float = 1e-9,
    step: float = 1e-4,
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
    """Poincare points and class of motion over any number of parameters.

    Parameters
    ----------
    system : BrakedDriveline
        What is changed.
    **parameters : array of float
        The swept values by name: SI parameters (``slope``, ``frequency``, ...), groups
        (``eta``, ``f``, ``F0``, ``alpha``), ``initial_angle``, ``initial_velocity``. Several
        span a grid.
    periods, transient, limit
        As for ``motion``: number of the last and of the first recorded period, default 250
        and 200; ``transient="auto"`` waits until each point has settled.
    initial : (angle [rad], velocity [rad/s])
        State at t = 0, where it is not swept.
    follow : str
        Name of a swept parameter along which each point starts where its neighbour ended,
        once in the order given ("up") and once back ("down"), along a dimension ``branch``.
    method, rtol, step, max_events, max_steps
        As in ``simulate``.
    keep_points : bool
        Whether the Poincare points are part of the result.
    store : path
        A folder (zarr) to which the result is written chunk by chunk.
    resume : bool
        Go on with a store that is there; its results stay as they are, bit for bit.
    threads : int
        How many; default one for each processor.
    client : distributed.Client
        Spread the chunks over a Dask cluster (extra ``cluster``).
    progress : bool or callable
        True shows points, rate and time left on standard error (the default with a store);
        a callable gets a ``Progress``.

    Returns
    -------
    xarray.Dataset
        Over the swept names in the order given, then ``period``: angle [rad] and velocity
        [rad/s] at t = period/f_e; and for each point its ``status``, class of ``motion``
        and of stick-slip, exponents and the rest of ``wedgebrake.sweeps.results``. With a
        store it is read from there when used. A point that diverges, locks or cannot be
        built says so in its status. Classes count periods 1/f_e of the torque, also where its
        amplitude is 0, see ``Motion``.

    Raises
    ------
    InputError
        For arguments that are wrong, or a store that does not fit.
    OutputError
        If the store cannot be written; what is in it stays valid.
    WedgebrakeError
        If the Dask cluster is lost. The store remains valid.
    """
    plan = make_plan(
        "sweep", system, parameters, periods=periods, transient=transient, limit=limit,
        initial=initial, follow=follow, method=method, keep_points=keep_points, rtol=rtol,
        step=step, max_events=max_events, max_steps=max_steps,
    )  # fmt: skip
    return execute(
        plan, store=store, resume=resume, threads=threads, client=client, progress=progress
    )


def make_plan(
    kind: str,
    system: BrakedDriveline,
    parameters: dict[str, Any],
    *,
    periods: int | None = None,
    transient: int | Literal["auto"] = 200,
    limit: int = LIMIT,
    initial: tuple[float, float] = (0.0, 0.0),
    follow: str | None = None,
    method: str | None = None,
    keep_points: bool = True,
    **limits: Any,
) -> Plan:
    """What a sweep is asked to compute, checked."""
    from wedgebrake.sweeps.plan import Plan

    check_instance("system", system, BrakedDriveline)
    chosen = choose_method(system, method)
    axes = make_axes(system, parameters)
    names = [axis.name for axis in axes]
    if follow is not None and follow not in names:
        raise InputError(
            f"follow = {shown(follow)}: must be one of the swept parameters."
            f" {nearest(str(follow), names)}"
        )
    check_instance("keep_points", keep_points, bool)
    return Plan(
        system=system,
        grid=Grid(axes, next((axis.dim for axis in axes if axis.name == follow), None)),
        protocol=protocol(periods, transient, limit, **limits),
        method=chosen,
        initial=check_state("initial", initial),
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
    """Compute a plan, in memory or into a store."""
    check_instance("resume", resume, bool)
    if resume and store is None:
        raise InputError("resume = True: needs store, the path of the store to go on with.")
    if threads is not None:
        check_whole("threads", threads, 1, 1024)
    if client is not None and not hasattr(client, "submit"):
        raise InputError(
            f"client = {shown(client)}: must be a distributed.Client (pip install"
            " 'wedgebrake[cluster]')."
        )
    if not (progress is None or isinstance(progress, bool) or callable(progress)):
        raise InputError(f"progress = {shown(progress)}: must be True, False or a callable.")
    shows = store is not None if progress is None else bool(progress)
    bar = Bar() if shows and not callable(progress) else None
    report = progress if callable(progress) else bar

    work = _workers(plan, threads, client)  # before a store is created: it may fail
    with bar or nullcontext():
        if store is None:
            return _in_memory(plan, work, report)
        return _in_store(plan, work, report, store, resume)


_Work = Callable[[Layout, list[ChunkIndex]], Iterator[tuple[ChunkIndex, Any]]]


def _workers(plan: Plan, threads: int | None, client: Any) -> _Work:
    """Function that computes the chunks of a plan, on a cluster or in threads of this machine."""
    from wedgebrake.sweeps.executor import Cluster, by_threads, processors

    if client is not None:
        return Cluster(plan, client).chunks
    return lambda layout, wanted: by_threads(plan, layout, wanted, threads or processors())


def _in_memory(plan: Plan, work: _Work, report: Report | None) -> xr.Dataset:
    import xarray as xr

    layout = plan.layout(_chunk_size(plan))
    _check_memory(layout)
    arrays = {
        one.name: np.full([layout.dims[dim] for dim in dims], one.fill, dtype=one.dtype)
        for one, dims in layout.variables
    }
    meter = Meter(plan.grid.points, 0, report)
    for index, results in work(layout, layout.indices()):
        where = tuple(layout.slices(index).values())
        for name, values in results.items():
            arrays[name][where] = values
        meter.add(results["status"].size)
    return xr.Dataset(
        {
            one.name: (tuple(dims), arrays[one.name], one.attributes())
            for one, dims in layout.variables
        },
        coords={name: (name, values, attrs) for name, (values, attrs) in layout.coords.items()},
        attrs=dict(layout.attrs),
    )


def _in_store(
    plan: Plan, work: _Work, report: Report | None, path: str | os.PathLike[str], resume: bool
) -> xr.Dataset:
    from wedgebrake.sweeps.store import SweepStore

    with SweepStore.open(
        path, plan.layout(_chunk_size(plan)), plan.identity(), resume=resume
    ) as target:
        layout = target.layout
        done = target.done()
        _say_damage(target)
        wanted = [index for index in layout.indices() if index not in done]
        resumed = sum(_points(layout, index) for index in done)
        meter = Meter(plan.grid.points, resumed, report)
        try:
            for index, results in work(layout, wanted):
                target.write(index, results)
                meter.add(results["status"].size)
        except BaseException as error:
            if not isinstance(error, Exception):  # Ctrl-C
                error.add_note(
                    f"{path}: valid, with {meter.done} of {plan.grid.points} points. The same"
                    " call with resume=True (--resume on the command line) goes on."
                )
            raise
        return target.dataset()


def _say_damage(store: SweepStore) -> None:
    for damage in store.damaged:
        warnings.warn(
            f"{store.path}: chunk {damage.chunk} is damaged ({damage.variable}: {damage.why}) and"
            " is computed again.",
            StoreWarning,
            stacklevel=5,
        )


def _points(layout: Layout, index: ChunkIndex) -> int:
    return math.prod(one.stop - one.start for one in layout.slices(index).values())


def _chunk_size(plan: Plan) -> int:
    """Points in a chunk: an amount of work that may be lost, not too many files."""
    slow = plan.method != "exact" or plan.protocol.automatic
    share = max(_FEWEST, plan.grid.points // _PARTS)
    record = 16 * (plan.protocol.recorded + 1) if plan.keep_points else 1
    return max(1, min(_SLOW_CHUNK if slow else _CHUNK, share, _CHUNK_BYTES // record))


def _check_memory(layout: Layout) -> None:
    """Refuse a result that would fill the memory of this machine."""
    needed = sum(
        math.prod(layout.dims[dim] for dim in dims) * np.dtype(one.dtype).itemsize
        for one, dims in layout.variables
    )
    if needed > _memory() / 2:
        raise InputError(
            f"sweep: the result would take {needed / 2**30:.3g} GiB of memory, this machine has"
            f" {_memory() / 2**30:.3g}. Give store='run.zarr' to write it chunk by chunk (--store"
            " on the command line), keep_points=False to leave the Poincare points out, or fewer"
            " values."
        )


def _memory() -> float:
    """Memory of this machine [bytes]; where it cannot be known, a modest one's."""
    try:
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, ValueError, OSError):
        return 8.0 * 2**30

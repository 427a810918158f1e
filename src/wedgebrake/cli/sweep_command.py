"""The work of ``wedgebrake sweep``: which sweep it is, progress, Ctrl-C, and the store."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wedgebrake.cli.interrupts import Interrupted, announce_compilation
from wedgebrake.cli.progress import Watch
from wedgebrake.errors import InputError, OutputError, nearest
from wedgebrake.model.study import Study
from wedgebrake.model.sweep_settings import INITIAL
from wedgebrake.model.validation import shown
from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.sweeps.progress import Progress

if TYPE_CHECKING:
    import xarray as xr

# Settings of [run] that a sweep takes; the others say how long a single run is.
_OF_RUN = ("initial", "method", "rtol", "step", "max_events", "max_steps")


@dataclass(frozen=True)
class Storing:
    """Where a sweep is kept while it runs, and whether to go on with what is there."""

    path: Path | None = None
    resume: bool = False


@dataclass
class Outcome:
    """A finished sweep.

    computed, resumed : points computed now, and found in the store
    seconds           : how long that took; ``compiled``: with compilation of the kernels
    warnings          : what was said about a damaged store
    """

    dataset: xr.Dataset
    computed: int
    resumed: int
    seconds: float
    compiled: bool
    warnings: list[str] = field(default_factory=list)


def kind_of(study: Study) -> str:
    """Which sweep a study asks for, by the number and the names of its axes."""
    names = [name for name, _ in study.sweep.axes]
    if len(names) == 1:
        return "bifurcation"
    if len(names) != 2 or study.sweep.follow is not None:
        return "sweep"
    return "basins" if set(names) == set(INITIAL) else "regime_map"


def check(study: Study, storing: Storing, *, picture: bool) -> None:
    """Refuse what cannot become a sweep, before any work is done.

    Raises ``InputError``.
    """
    names = [name for name, _ in study.sweep.axes]
    if not names:
        raise InputError(
            "sweep: nothing to sweep. Give --over NAME=FROM:TO:COUNT, for example --over"
            " eta=-60:12:400, or a [sweep] table in the study file."
        )
    follow = study.sweep.follow
    if follow not in (None, *names):
        raise InputError(
            f"follow = {shown(follow)}: must be a parameter that is swept."
            f" {nearest(str(follow), names)}"
        )
    if storing.resume and storing.path is None:
        raise InputError("--resume: needs --store, the store to go on with.")
    start = study.run.start_time
    if start != 0.0:
        raise InputError(
            f"run.start_time = {start!r}: must be 0 for a sweep, whose points all start at time 0."
            " Set it with --set start_time=0."
        )
    if picture and len(names) > 2:
        raise InputError(
            f"--plot: there are pictures of sweeps over one or two parameters, not over"
            f" {len(names)} ({', '.join(names)}). Leave it out, or sweep fewer."
        )
    if picture and len(names) == 1 and study.sweep.keep_points is False:
        raise InputError(
            "--plot: a bifurcation diagram is drawn from the Poincare points. Leave out"
            " keep_points = false, or --plot."
        )


def compute(study: Study, storing: Storing, threads: int | None) -> Outcome:
    """The sweep of a study; progress goes to standard error, and Ctrl-C is heard at once.

    Raises ``Interrupted`` with a note on what is kept, and what ``wedgebrake.sweep`` raises.
    """
    watch = Watch()
    told: list[str] = []

    def work() -> tuple[xr.Dataset, bool]:
        with announce_compilation("about half a minute") as compilation:
            dataset = _run(study, storing, threads, watch.hear)
            return dataset, compilation.said

    try:
        with watch, _telling(told):
            dataset, compiled = interruptible(work, watch.show)
    except Interrupted as interrupt:
        interrupt.add_note(_what_is_kept(storing, watch.last))
        raise
    except MemoryError as error:
        error.add_note("Sweep fewer values, or lower --periods, or give --store RUN.zarr.")
        raise
    except (InputError, OutputError) as error:
        raise type(error)(_in_options(str(error), storing)) from None
    last = watch.last
    if last is None or last.rate == 0.0:  # all was in the store
        return Outcome(dataset, 0, dataset["status"].size, 0.0, compiled, told)
    computed = last.total - last.resumed
    return Outcome(dataset, computed, last.resumed, computed / last.rate, compiled, told)


def _run(
    study: Study, storing: Storing, threads: int | None, hear: Callable[[Progress], None]
) -> xr.Dataset:
    from wedgebrake.sweeps.basins import basins
    from wedgebrake.sweeps.sweep import bifurcation, regime_map, sweep

    arguments: dict[str, Any] = {name: getattr(study.run, name) for name in _OF_RUN}
    arguments |= study.sweep.arguments()
    kind = kind_of(study)
    if kind == "bifurcation":
        arguments["follow"] = "follow" in arguments
    sweeps: dict[str, Callable[..., xr.Dataset]] = {
        "bifurcation": bifurcation, "basins": basins, "regime_map": regime_map, "sweep": sweep,
    }  # fmt: skip
    return sweeps[kind](
        study.system,
        **study.sweep.parameters(),
        **arguments,
        store=storing.path,
        resume=storing.resume,
        threads=threads,
        progress=hear,
    )


@contextmanager
def _telling(told: list[str]) -> Iterator[None]:
    """Inside, damage of a store is told in a line each, and noted."""
    from wedgebrake.sweeps.sweep import StoreWarning

    with warnings.catch_warnings():
        warnings.simplefilter("always", StoreWarning)
        otherwise = warnings.showwarning

        def tell(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
            if not issubclass(category, StoreWarning):
                otherwise(message, category, *where, **more)
                return
            told.append(str(message))
            if sys.stderr is not None:
                sys.stderr.write(f"warning: {message}\n")

        warnings.showwarning = tell
        yield


def _what_is_kept(storing: Storing, last: Progress | None) -> str:
    if storing.path is None:
        return "Nothing is kept. With --store RUN.zarr the points that are done would be."
    if not storing.path.exists():
        return "Nothing was computed yet."
    so_far = f" {last.done} of {last.total} points" if last is not None else " what was done"
    return f"{storing.path} keeps{so_far}. The same command with --resume goes on."


def _in_options(text: str, storing: Storing) -> str:
    """A message about the arguments of a store, about the options of the command line."""
    if storing.path is not None:
        # The path is absolute unless the working directory no longer exists.
        names = [str(storing.path)]
        with suppress(FileNotFoundError):
            names.append(str(storing.path.absolute()))
        for name in names:
            text = text.replace(f"path = {name!r}", f"--store {storing.path}")
    return text.replace("resume=True (--resume on the command line)", "--resume")

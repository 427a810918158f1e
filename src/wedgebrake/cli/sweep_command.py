"""Implementation of ``wedgebrake sweep``: kind of sweep, progress, Ctrl-C, and the store."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wedgebrake.cli.compilation import announce_compilation
from wedgebrake.cli.interrupts import Interrupted
from wedgebrake.cli.output import Output, of_option
from wedgebrake.cli.overrides import check_repeats, in_options, settings_of
from wedgebrake.cli.progress import ProgressDisplay
from wedgebrake.cli.streams import say
from wedgebrake.cli.sweep_report import sweep_report
from wedgebrake.cli.sweep_text import sweep_text
from wedgebrake.cli.workers import Workers
from wedgebrake.errors import InputError, OutputError, nearest
from wedgebrake.model.studies.study import Study
from wedgebrake.model.validation import unknown
from wedgebrake.sweeps.basins import basins
from wedgebrake.sweeps.progress import Progress
from wedgebrake.sweeps.sweep import StoreWarning, bifurcation, regime_map, sweep

if TYPE_CHECKING:
    import xarray as xr


def run(
    study: Study,
    kept: tuple[Path | None, bool],
    workers: Workers,
    output: Output,
    drawn: Mapping[str, str | None],
) -> None:
    """Compute the sweep of a study, write and print its results.

    kept  : path of the store, and whether it is resumed
    drawn : options of the picture: quantity, inertia, contact

    Raises ``InputError``, ``Interrupted`` with a note on kept results, and the errors of
    ``wedgebrake.sweep``.
    """
    options = {name: one for name, one in drawn.items() if one is not None}
    store, resume = kept
    _check(study, store, resume, options, picture=output.picture is not None)
    watch = ProgressDisplay()
    damage: list[str] = []
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", StoreWarning)
            warnings.showwarning = _recorded(damage, warnings.showwarning)
            with workers.started() as given, announce_compilation() as announced:
                execution = {"store": store, "resume": resume, "progress": watch.hear, **given}
                dataset = watch.wait(lambda: _sweep(study, **execution))
    except Interrupted as interrupt:
        interrupt.add_note(what_is_kept(store, watch.last))
        raise
    except MemoryError as error:
        error.add_note("Sweep fewer values, or lower --periods, or give --store RUN.zarr.")
        raise
    except (InputError, OutputError) as error:
        named = of_option(error, "--store", store)
        if isinstance(named, InputError):
            named = in_options(named, ("transient", "periods", "crossings"))
        raise named from None
    speed = {**_speed(watch.last, dataset), "with_compilation": bool(announced)}
    report = sweep_report(study, dataset, speed, damage, options.get("quantity"))
    text = partial(sweep_text, study.system, report)
    output.finish(report, text, dataset, lambda: (dataset, options), store)


def _check(
    study: Study, store: Path | None, resume: bool, drawn: Mapping[str, str], *, picture: bool
) -> None:
    """Refuse an impossible sweep, before the computation."""
    names = [name for name, _ in study.sweep.axes]
    if not names:
        raise InputError(
            "sweep: nothing to sweep. Give --over NAME=FROM:TO:COUNT, for example --over"
            " slope=-60:0:50 (in a machine brake.slope=-60:0:50), or a [sweep] table in the study"
            " file."
        )
    check_repeats(study, "a sweep classifies steady motions")
    _check_returns(study)
    follow = study.sweep.follow
    if follow not in (None, *names):
        raise unknown("follow", follow, names, "must be a parameter that is swept")
    if resume and store is None:
        raise InputError("--resume: needs --store, the store to continue.")
    if picture and len(names) > 2:
        raise InputError(
            f"--plot: there are pictures of sweeps over one or two parameters, not over"
            f" {len(names)} ({', '.join(names)}). Leave it out, or sweep fewer."
        )
    points = drawn.get("quantity", "velocity") in ("velocity", "angle")
    if picture and len(names) == 1 and study.sweep.keep_points is False and points:
        raise InputError(
            "--plot: a bifurcation diagram is drawn from the Poincare points. Leave out"
            " keep_points = false, or --plot, or give --quantity response."
        )
    if drawn and not picture:
        raise InputError(f"--{next(iter(drawn))}: applies to the picture. Give --plot too.")
    if "quantity" in drawn:
        _check_quantity(drawn["quantity"], len(names))
    for name in ("inertia", "contact"):
        parts = study.system.coords.get(name, ())
        if name in drawn and drawn[name] not in parts:
            hint = nearest(drawn[name], parts) if parts else "Leave it out: the study has only one."
            raise InputError(f"--{name} {drawn[name]}: no such {name}. {hint}")


def _check_quantity(quantity: str, axes: int) -> None:
    """Refuse what no picture over this number of parameters draws, before the computation."""
    from wedgebrake.figures import style
    from wedgebrake.figures.data.response_diagram import RESPONSE
    from wedgebrake.sweeps.results import VARIABLES

    results = VARIABLES
    curves = [
        RESPONSE,
        *style.SECTION,
        *(n for n, one in results.items() if one.dtype == "float64"),
    ]
    allowed = curves if axes == 1 else list(results)
    if quantity not in allowed:
        over = "one parameter" if axes == 1 else "two parameters"
        raise unknown("--quantity", quantity, allowed, f"not drawn over {over}")


def _check_returns(study: Study) -> None:
    """Refuse periods of a motion that has crossings, and the reverse."""
    crosses = study.system.machine.autonomous
    given, wanted = ("periods", "crossings") if crosses else ("crossings", "periods")
    if getattr(study.sweep, given) is not None:
        why = "no signal varies in time, so that there is no period"
        what = why if crosses else "counts returns where no signal varies in time; here signals do"
        raise InputError(f"--{given}: {what}. Give --{wanted}.")


def _sweep(study: Study, **settings: Any) -> xr.Dataset:
    """The sweep of a study, by the number and the names of its axes."""
    parameters = study.sweep.parameters()
    settings |= settings_of(study, "sweep") | study.sweep.arguments()
    compute: Callable[..., xr.Dataset] = sweep
    if len(parameters) == 1:
        compute = bifurcation
        settings["follow"] = study.sweep.follow is not None
    elif len(parameters) == 2 and study.sweep.follow is None:
        initial = set(study.system.initial_conditions)
        compute = basins if set(parameters) <= initial else regime_map
    return compute(study.system, parameters, **settings)


def _recorded(damage: list[str], otherwise: Callable[..., None]) -> Callable[..., None]:
    """A ``warnings.showwarning`` that reports damage of a store in a line, and records it."""

    def record(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
        if not issubclass(category, StoreWarning):
            otherwise(message, category, *where, **more)
            return
        damage.append(str(message))
        say(f"warning: {message}")

    return record


def _speed(last: Progress | None, dataset: xr.Dataset) -> dict[str, Any]:
    """Points computed now and found in the store, and the duration."""
    if last is None or last.rate == 0.0:  # all was in the store
        size = dataset["status"].size
        return {"computed": 0, "resumed": size, "seconds": 0.0, "points_per_second": None}
    computed = last.total - last.resumed
    return {
        "computed": computed,
        "resumed": last.resumed,
        "seconds": computed / last.rate,
        "points_per_second": last.rate,
    }


def what_is_kept(store: Path | None, last: Progress | None) -> str:
    """What an interrupted sweep keeps, in words."""
    if store is None:
        return "Nothing is kept. With --store RUN.zarr, computed points are kept."
    if not store.exists():
        return "Nothing was computed yet."
    so_far = "the computed points" if last is None else f"{last.done} of {last.total} points"
    return f"{store} keeps {so_far}. The same command with --resume continues."

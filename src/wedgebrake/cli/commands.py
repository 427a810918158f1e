"""The commands. Everything heavy is imported when a command runs, so that help is instant."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import xarray as xr

    from wedgebrake.errors import WedgebrakeError
    from wedgebrake.model.study import Study


app = typer.Typer(
    name="wedgebrake",
    help="Vibration of self-amplified friction brakes: is this brake on this driveline stable,"
    " does it stick and slip, and how?",
    epilog="A study is a TOML file that describes brake and driveline: `wedgebrake example paper"
    " --out paper.toml` writes one, and `wedgebrake schema` says all that can stand in it. Exit"
    " status: 0 done, 2 the input is wrong, 1 anything else.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["--help", "-h"]},
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

StudyPath = Annotated[
    Path,
    typer.Argument(metavar="STUDY.toml", help="The study file, for example paper.toml."),
]
Changes = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="Change one value of the study, written as in the file: a parameter (inertia=2), a"
        " group (eta=-30, f, F0, alpha) or a run setting (periods=50). Repeatable.",
    ),
]
Method = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="The solver: exact (Coulomb and tabulated friction, its default), smooth (smoothed"
        " friction, its default) or ode14x (the paper's fixed step).",
    ),
]
AsJson = Annotated[
    bool,
    typer.Option(
        "--json",
        help="Print one JSON object on standard output and nothing else. Infinite numbers are"
        ' the texts "inf" and "-inf".',
    ),
]


def _version(wanted: bool) -> None:
    if wanted:
        from wedgebrake._version import __version__

        typer.echo(f"wedgebrake {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
) -> None:
    """Common options."""


@app.command(
    short_help="Is steady sliding stable, and from which slope on?",
    epilog="Example: wedgebrake stability paper.toml --set eta=-3",
)
def stability(study: StudyPath, changes: Changes = None, as_json: AsJson = False) -> None:
    """Linear stability of sliding, forwards and backwards.

    Prints the eigenvalues, the bifurcation points (Hopf and node-focus, in eta and as slopes
    of the actuation force), of a wedge the angles of Hopf points and of self-locking, and a
    verdict in words. Nothing is simulated.
    """
    from wedgebrake._version import __version__
    from wedgebrake.analysis.linear_stability import stability as judge
    from wedgebrake.cli.report import stability_text, to_json

    system = _load(study, changes).system
    verdict = judge(system)
    if as_json:
        about = {"wedgebrake": __version__, "system": system.as_dict()}
        typer.echo(to_json({**about, "groups": system.groups.as_dict(), **verdict.as_dict()}))
    else:
        typer.echo(stability_text(system, verdict))


@app.command(
    short_help="Does it stick and slip, and how?",
    epilog="Example: wedgebrake simulate paper.toml --set eta=-30 --plot run.png --out run.nc",
)
def simulate(
    study: StudyPath,
    changes: Changes = None,
    method: Method = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="RUN.nc",
            help="Write the response as netCDF: time history, events, sticks and Poincare"
            " points, with units.",
        ),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            metavar="RUN.png",
            help="Draw history, phase portrait, Poincare section and spectrum; the suffix"
            " (.png, .svg or .pdf) sets the format.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """The response in time: 250 periods of the torque, unless the study says otherwise.

    Prints how the brake vibrates in the last fifth of the run, the class of stick-slip, the
    events, and the final state. With --json: parameters, groups, status, sticks, Poincare
    points, class, stability and versions. A run that diverges or locks is an answer (exit
    status 0); one that stops at max_events or max_steps is not (1).
    """
    from wedgebrake.cli.output import DATA, PICTURES, check_netcdf, check_target, write_netcdf
    from wedgebrake.cli.report import response_text, to_json
    from wedgebrake.solvers.interrupts import interruptible
    from wedgebrake.solvers.status import Status

    check_target("--out", out, DATA)
    check_netcdf(out)
    check_target("--plot", plot, PICTURES)
    loaded = _load(study, changes, method)
    response, report = interruptible(lambda: _simulated(loaded))
    if out is not None:
        write_netcdf(response, out)
    if plot is not None:
        from wedgebrake.figures.matplotlib.overview import overview
        from wedgebrake.figures.matplotlib.save import save

        save(overview(loaded.system, response, report["summary"]), plot)
    if as_json:
        typer.echo(to_json(report))
    else:
        typer.echo(response_text(loaded.system, report))
        for what, path in (("Picture", plot), ("Data", out)):
            if path is not None:
                typer.echo(f"{what}: {path.resolve()}")
    if response.attrs["status"] in (Status.EVENT_LIMIT.value, Status.STEP_LIMIT.value):
        sys.exit(1)


@app.command(
    short_help="How does it vibrate over a range of parameters?",
    epilog="Examples: wedgebrake sweep sweep.toml --plot eta.png;"
    " wedgebrake sweep paper.toml --over eta=-60:12:300 --over F0=0.01:0.2:200:log"
    " --store map.zarr --plot map.png;"
    " wedgebrake sweep paper.toml --over eta=-40:0:200 --follow eta --json",
)
def sweep(
    study: StudyPath,
    over: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUES",
            help="What to sweep, instead of the axes in [sweep]: a parameter (inertia), a group"
            " (eta, f, F0, alpha), initial_angle or initial_velocity. The values are"
            " FROM:TO:COUNT in equal steps (eta=-60:12:400), FROM:TO:COUNT:log in equal ratios"
            " (F0=0.01:0.2:100:log), or a list (F0=0.03,0.036,0.05). Repeatable: several span"
            " a grid, with its dimensions in this order.",
        ),
    ] = None,
    changes: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="Change one value of the study, written as in the file: a parameter (inertia=2),"
            " a group (F0=0.05) or a setting of [run] or [sweep] (initial=[0.01, 0.0],"
            " limit=5000, keep_points=false). Repeatable.",
        ),
    ] = None,
    method: Method = None,
    transient: Annotated[
        str | None,
        typer.Option(
            metavar="N|auto",
            help="First period of the torque that is looked at (default 200), or auto: wait until"
            " each point has settled (default for basins), at most limit periods (--set"
            " limit=20000).",
        ),
    ] = None,
    periods: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Last period that is looked at (default 250); with --transient auto, how many"
            " are looked at once a point has settled (default 50).",
        ),
    ] = None,
    follow: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Start each point where its neighbour along this parameter ended, once up and"
            " once down: branches that differ show hysteresis.",
        ),
    ] = None,
    store: Annotated[
        Path | None,
        typer.Option(
            metavar="RUN.zarr",
            help="Keep the points in this folder (zarr) as they are computed, so that nothing"
            " is lost where the sweep is interrupted.",
        ),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option("--resume", help="Go on with what is in the store, if it is there."),
    ] = False,
    threads: Annotated[
        int | None,
        typer.Option(metavar="N", help="How many threads compute; default one per processor."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DATA.nc", help="Write the whole result as netCDF, with units."),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            metavar="PICTURE.png",
            help="Draw it: bifurcation diagram, map or basins; the suffix (.png, .svg or .pdf)"
            " sets the format.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """The motion at each point of a grid of parameters: periodic, chaotic, sticking.

    What is swept is said by --over or by the table [sweep] of the study. One parameter gives a
    bifurcation diagram; initial_angle with initial_velocity give basins of attraction; two
    others give a map, which keeps no Poincare points (--set keep_points=true); more, or two
    with --follow, give a plain sweep.

    Prints the classes of motion and of stick-slip with their shares, the limit of linear
    stability and, along one parameter, the intervals of each motion; progress goes to standard
    error.

    Every point starts at time 0 from initial of [run]; of [run], method, rtol, step, max_events
    and max_steps count too. Its duration, periods and samples_per_period belong to simulate:
    here --transient and --periods (or [sweep]) say what is looked at.

    A point that diverges, locks, or is no possible brake is an answer (exit status 0). Ctrl-C
    ends the sweep at once (exit status 1); with --store the points that are done stay, and
    the same command with --resume goes on.
    """
    from wedgebrake.cli.output import DATA, PICTURES, check_netcdf, check_target, write_netcdf
    from wedgebrake.cli.report import to_json
    from wedgebrake.cli.sweep_command import Storing, check, compute
    from wedgebrake.cli.sweep_report import sweep_report
    from wedgebrake.cli.sweep_text import sweep_text

    check_target("--out", out, DATA)
    check_netcdf(out)
    check_target("--plot", plot, PICTURES)
    storing = Storing(store, resume)
    given = {"transient": transient, "periods": periods, "follow": follow}
    asked = _sweep_of(_load(study, changes, method, _NOT_SWEPT, given), over, given)
    check(asked, storing, picture=plot is not None)
    outcome = compute(asked, storing, threads)
    places, failures = _written(
        data=(out, lambda path: write_netcdf(outcome.dataset, path)),
        picture=(plot, lambda path: _draw(path, outcome.dataset)),
    )
    report = sweep_report(asked, outcome, {**places, "store": store and store.resolve()})
    typer.echo(to_json(report) if as_json else sweep_text(asked.system, report))
    if failures:
        raise failures[0]


@app.command(
    "continue",
    short_help="Down to where is a periodic motion stable, and what comes then?",
    epilog="Examples: wedgebrake continue paper.toml --over eta=12:-60 --plot eta.png;"
    " wedgebrake continue conventional.toml --over slope=0:-160 --out slope.nc;"
    " wedgebrake continue paper.toml --over eta=-10:-22 --and F0=0.02:0.09 --plot"
    " plane.png",
)
def continue_(
    study: StudyPath,
    over: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=FROM:TO",
            help="What to follow the motion over: a parameter (inertia) or a group (eta, f, F0,"
            " alpha). At FROM the first orbit is looked for, and there its branch begins.",
        ),
    ] = None,
    second: Annotated[
        str | None,
        typer.Option(
            "--and",
            metavar="NAME=FROM:TO",
            help="Follow what bifurcates in a second parameter too: the boundaries of the motions"
            " in the plane of both, which --plot then draws.",
        ),
    ] = None,
    changes: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="Change one value of the study, written as in the file: a parameter (inertia=2),"
            " a group (F0=0.05) or a setting of [run] (initial=[0.01, 0.0], rtol=1e-9)."
            " Repeatable.",
        ),
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="The solver: exact (Coulomb and tabulated friction, its default) or smooth"
            " (smoothed friction, its default).",
        ),
    ] = None,
    order: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Periods of the torque in the first orbit, which may then be unstable; initial"
            " of [run], if it is given, is a guess of it. Default: the motion that settles from"
            " initial (or from rest).",
        ),
    ] = None,
    switch: Annotated[
        int,
        typer.Option(
            metavar="N",
            help="How many times over branches that leave a branch are followed, as at period"
            " doublings; 0: only the first branch.",
        ),
    ] = 2,
    step: Annotated[
        float,
        typer.Option(metavar="SHARE", help="Longest step along a branch, as a share of the range."),
    ] = 0.02,
    points: Annotated[
        int,
        typer.Option(metavar="N", help="Most points of a branch, after which it is left."),
    ] = 2000,
    beneath: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Columns of simulated points beneath the picture, as sweep draws them, 0 for"
            " none; with --and a map of N times N cells. Default: 200 beneath branches of the"
            " method exact, else none.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DATA.nc",
            help="Write the branches as netCDF, with units. (Boundaries have their points in"
            " --json.)",
        ),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            metavar="PICTURE.png",
            help="Draw branches, stable and unstable, and bifurcations, or with --and the"
            " boundaries; the suffix (.png, .svg or .pdf) sets the format.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Periodic motions over a parameter, stable or not, and where they change.

    Looks for a periodic orbit at FROM and follows it to TO, with the branches that leave it.
    Bifurcations are located to about nine digits: period doublings, folds, tori, and those that
    only friction has, where a stick begins or ends.

    Prints how far the first motion is stable and what comes then, the branches with the
    intervals where they are stable, the bifurcations, and what their names mean; progress goes
    to standard error. Of [run], initial, method and rtol count, and max_events and max_steps
    for the points beneath.

    Stable means against small disturbances: other motions may live beside a stable one. Seconds for
    a few branches; minutes where there are many, as near self-locking or with smooth friction.

    Exit status 2 where there is no orbit to begin with. Ctrl-C ends at once (exit status 1),
    and nothing is written.
    """
    from wedgebrake.cli.continue_command import carry_out, ordered
    from wedgebrake.cli.continue_report import continue_report
    from wedgebrake.cli.continue_text import continue_text
    from wedgebrake.cli.output import DATA, PICTURES, check_netcdf, check_target, write_netcdf
    from wedgebrake.cli.report import to_json

    check_target("--out", out, DATA)
    check_netcdf(out)
    check_target("--plot", plot, PICTURES)
    loaded = _load(study, changes, method, _NOT_CONTINUED)
    settings = {"switch": switch, "step": step, "points": points}
    asked = ordered(loaded, over, second, order, settings, beneath, picture=plot is not None)
    outcome = carry_out(asked)
    places, failures = _written(
        data=(out, lambda path: write_netcdf(outcome.dataset, path)),
        picture=(plot, lambda path: _draw(path, **outcome.picture)),
    )
    report = continue_report(asked, outcome, places)
    typer.echo(to_json(report) if as_json else continue_text(loaded.system, report))
    if failures:
        raise failures[0]


@app.command(
    short_help="What of Chen and Xi (2014) can be reproduced?",
    epilog="Examples: wedgebrake paper fig8 fig9 --out figures; wedgebrake paper claims;"
    " wedgebrake paper all --out paper",
)
def paper(
    targets: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="TARGET",
            help="fig1 to fig19, claims, or all; several may be given. Without one, what there is"
            " is listed.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="Where the files go, by default the folder paper; it is made if need be.",
        ),
    ] = None,
    method: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="How the runs are made: smooth (smoothed friction, adaptive), exact (Coulomb"
            " friction) or ode14x (smoothed friction, the paper's fixed step; slow).",
        ),
    ] = "smooth",
    threads: Annotated[
        int | None,
        typer.Option(metavar="N", help="How many threads compute; default one per processor."),
    ] = None,
    kind: Annotated[
        str,
        typer.Option("--format", metavar="KIND", help="Of the figures' files: png, svg or pdf."),
    ] = "png",
    as_json: AsJson = False,
) -> None:
    """The figures and statements of the source paper, computed again and judged.

    Without a target, lists the figures. A figure is drawn into the folder, as fig8.png. claims
    tests each statement of the paper and prints the verdicts. all draws every figure, tests the
    statements and writes report.html, one page that needs no connection, and claims.json; it takes
    one to two minutes. Figures are 183 mm wide, two columns of a journal.

    A verdict follows from numbers: reproduced, reproduced with a stated correction,
    contradicted, or undecidable from the text. Whatever they are, the exit status is 0. Files
    are whole or not there; Ctrl-C ends at once (exit status 1) and leaves the complete ones.
    """
    from wedgebrake.cli.interrupts import announce_compilation
    from wedgebrake.cli.report import to_json

    with announce_compilation("about half a minute"):
        from wedgebrake.cli import paper_command as work

    if not targets:
        typer.echo(to_json(work.listing_report()) if as_json else work.listing())
        return
    order = work.ordered(targets, out, method, threads, kind)
    outcome = work.carry_out(order)
    typer.echo(to_json(work.report(order, outcome)) if as_json else work.text(outcome))


@app.command(
    "app",
    short_help="A page to move sliders and see: the explorer in a browser.",
    epilog="Example: wedgebrake app paper.toml --port 8000",
)
def explore(
    study: Annotated[
        Path | None,
        typer.Argument(
            metavar="[STUDY.toml]",
            help="What lies on the desk at the beginning; by default the brake of the source"
            " paper.",
        ),
    ] = None,
    port: Annotated[
        int, typer.Option(metavar="N", help="The port to listen on; 0 takes any that is free.")
    ] = 5006,
    address: Annotated[
        str,
        typer.Option(
            metavar="HOST",
            help="The address to listen on. By default this machine alone; 0.0.0.0 for all that"
            " can reach it.",
        ),
    ] = "127.0.0.1",
    allow: Annotated[
        list[str] | None,
        typer.Option(
            "--allow",
            metavar="HOST:PORT",
            help="What stands in the browser's address line, where it is not this machine's own"
            " name: HOST, or HOST:PORT. Repeatable.",
        ),
    ] = None,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in a browser.")
    ] = True,
) -> None:
    """The explorer: a page where sliders move the machine and everything follows.

    Verdict, time history, phase portrait, Poincare section, spectrum, the drawn brake in motion,
    bifurcation diagram, maps of regimes and stability, basins. Loads and saves study files;
    exports pictures, data and a Python program that computes what is on the screen. Prints the
    address of the page and serves it until Ctrl-C. Needs the extra app.
    """
    from wedgebrake.cli.app_command import explore as work

    work(study, port, address, tuple(allow or ()), browser)


@app.command(short_help="What can stand in a study file?")
def schema() -> None:
    """The JSON schema of study files: every table and parameter, with unit and range.

    Editors that know JSON schemas for TOML complete and check study files with it.
    """
    from wedgebrake.model.study import schema as study_schema

    typer.echo(json.dumps(study_schema(), indent=2))


@app.command(
    short_help="A study file to begin with.",
    epilog="Example: wedgebrake example paper --out paper.toml",
)
def example(
    name: Annotated[
        str | None,
        typer.Argument(metavar="[NAME]", help="Of the example. Without one, all are listed."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="STUDY.toml",
            help="Write the example to this file, which must not exist yet, instead of printing"
            " it.",
        ),
    ] = None,
) -> None:
    """Study files that come with wedgebrake, to run and to change.

    paper is the wedge brake of the source paper, sweep the same over the slope of its actuation
    force. Without a name, lists all.
    """
    from wedgebrake.cli import examples

    if name is None:
        typer.echo(examples.listing())
    elif out is None:
        typer.echo(examples.example(name), nl=False)
    else:
        typer.echo(f"Study: {examples.written(name, out)}")


@app.command(
    short_help="What is installed, what is compiled, and is anything wrong?",
    epilog="Example: wedgebrake doctor",
)
def doctor(as_json: AsJson = False) -> None:
    """What is installed and compiled, and what to do if something is wrong.

    Prints versions of wedgebrake, Python and all packages, which extras are complete, processors
    and threads, where compiled kernels are kept and which are there, and a sentence for each
    thing that is wrong. Each package is imported, which takes some seconds. Exit status: 0 all
    is well, 1 something is wrong.
    """
    from wedgebrake.cli import doctor as work

    report = work.examine()
    typer.echo(json.dumps(report) if as_json else work.text(report))
    if not report["healthy"]:
        sys.exit(1)


# Settings that a sweep has no use for, and what to give instead; and that orbits have none for.
_NOT_SWEPT = {
    "periods": "belongs to simulate. For a sweep give --periods.",
    "duration": "belongs to simulate. For a sweep give --periods, in periods of the torque.",
    "samples_per_period": "belongs to simulate. A sweep looks once in each period. Leave it out.",
}
_NOT_CONTINUED = {
    **dict.fromkeys(
        ("periods", "duration", "samples_per_period"),
        "belongs to simulate. An orbit lasts as many periods as --order says. Leave it out.",
    ),
    **dict.fromkeys(
        ("transient", "limit", "follow", "keep_points"), "belongs to sweep. Leave it out."
    ),
    "step": "belongs to the fixed step of simulate. Along a branch it is --step.",
}


def _load(
    path: Path,
    changes: list[str] | None,
    method: str | None = None,
    unused: Mapping[str, str] = MappingProxyType({}),
    options: Mapping[str, Any] = MappingProxyType({}),
) -> Study:
    """The study of a file with the changes of the command line.

    unused  : settings that the command has no use for, and what to give instead
    options : of the command, which must not be set twice
    """
    from wedgebrake.cli.overrides import parse_changes
    from wedgebrake.errors import InputError, nearest
    from wedgebrake.model.study import METHODS, load_study

    wanted = parse_changes(changes or [])
    if method is not None:
        if method not in METHODS:
            raise InputError(f"--method {method}: not known. {nearest(method, METHODS)}")
        if "method" in wanted:
            raise InputError("--method and --set method: both given. Give one of them.")
    for name in wanted:
        if name in unused:
            raise InputError(f"--set {name}: {unused[name]}")
        if options.get(name) is not None:
            raise InputError(f"--{name} and --set {name}: both given. Give one of them.")
    study = load_study(path)
    try:
        study = study.changed(**wanted)
    except InputError as error:
        raise InputError(f"--set: {error}") from None
    return study if method is None else study.changed(method=method)


def _sweep_of(study: Study, over: list[str] | None, given: dict[str, Any]) -> Study:
    """The study with what the options say about its sweep."""
    from wedgebrake.cli.overrides import short
    from wedgebrake.cli.ranges import parse_axes
    from wedgebrake.errors import InputError
    from wedgebrake.model.sweep_settings import Sweep

    settings = {name: value for name, value in given.items() if value is not None}
    if settings.get("transient", "auto") != "auto":
        try:
            settings["transient"] = int(settings["transient"])
        except ValueError:
            raise InputError(
                f"--transient {short(settings['transient'])}: must be a whole number of periods, or"
                " auto."
            ) from None
    kept = study.sweep.arguments()
    axes = parse_axes(over, study.system) if over else study.sweep.axes
    try:
        return study.changed(sweep=Sweep(**{**kept, **settings}, axes=axes))
    except InputError as error:
        raise InputError(re.sub(r"(?m)^sweep\.(\w+) = ", r"--\1 ", str(error))) from None


def _written(
    **files: tuple[Path | None, Callable[[Path], None]],
) -> tuple[dict[str, Path | None], list[WedgebrakeError]]:
    """Where the picture and the data lie that were asked for, and why one could not be written.

    files : "data", "picture" -> where it is to lie, and what writes it
    """
    from wedgebrake.errors import WedgebrakeError

    places: dict[str, Path | None] = {"picture": None, "data": None}
    failures = []
    for what, (path, write) in files.items():
        try:
            if path is not None:
                write(path)
                places[what] = path.resolve()
        except WedgebrakeError as error:  # the words are said all the same
            failures.append(error)
    return places, failures


def _draw(path: Path, dataset: xr.Dataset, **options: Any) -> None:
    from wedgebrake.figures.matplotlib.draw import plot
    from wedgebrake.figures.matplotlib.save import save

    save(plot(dataset, **options), path)


def _simulated(study: Study) -> tuple[Any, dict[str, Any]]:
    """The response of a study, and the report on it."""
    from wedgebrake.cli.interrupts import announce_compilation
    from wedgebrake.cli.report import response_report
    from wedgebrake.solvers.simulate import simulate as solve

    with announce_compilation():
        response = solve(study.system, **study.run.arguments())
        return response, response_report(study.system, response)

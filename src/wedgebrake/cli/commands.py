"""The commands. Everything heavy is imported when a command runs, so that help is instant."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from wedgebrake.model.study import Study


app = typer.Typer(
    name="wedgebrake",
    help="Vibration of self-amplified friction brakes: is this brake on this driveline stable,"
    " does it stick and slip, and how?",
    epilog="A study is a TOML file that describes brake and driveline; examples/paper.toml is"
    " one, and `wedgebrake schema` says all that can stand in it. Exit status: 0 done, 2 the"
    " input is wrong, 1 anything else.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["--help", "-h"]},
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

StudyPath = Annotated[
    Path,
    typer.Argument(metavar="STUDY.toml", help="The study file, for example examples/paper.toml."),
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
    epilog="Example: wedgebrake stability examples/paper.toml --set eta=-3",
)
def stability(study: StudyPath, changes: Changes = None, as_json: AsJson = False) -> None:
    """Linear stability of sliding, forwards and backwards.

    Prints the eigenvalues, the bifurcation points (Hopf and node-focus, in eta and as slopes
    of the actuation force), and a verdict in words. Nothing is simulated.
    """
    from wedgebrake._version import __version__
    from wedgebrake.cli.report import stability_text, to_json
    from wedgebrake.linear_stability import stability as judge

    system = _load(study, changes).system
    verdict = judge(system)
    if as_json:
        about = {"wedgebrake": __version__, "system": system.as_dict()}
        typer.echo(to_json({**about, "groups": system.groups.as_dict(), **verdict.as_dict()}))
    else:
        typer.echo(stability_text(system, verdict))


@app.command(
    short_help="Does it stick and slip, and how?",
    epilog="Example: wedgebrake simulate examples/paper.toml --set eta=-30 --plot run.png"
    " --out run.nc",
)
def simulate(
    study: StudyPath,
    changes: Changes = None,
    method: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="The solver: exact (Coulomb and tabulated friction, its default), smooth"
            " (smoothed friction, its default) or ode14x (the paper's fixed step).",
        ),
    ] = None,
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
    from wedgebrake.cli.waiting import interruptible
    from wedgebrake.solvers.status import Status

    check_target("--out", out, DATA)
    check_netcdf(out)
    check_target("--plot", plot, PICTURES)
    loaded = _load(study, changes, method)
    response, report = interruptible(lambda: _simulated(loaded))
    if out is not None:
        write_netcdf(response, out)
    if plot is not None:
        from wedgebrake.plots.overview import overview
        from wedgebrake.plots.save import save

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


@app.command(short_help="What can stand in a study file?")
def schema() -> None:
    """The JSON schema of study files: every table and parameter, with unit and range.

    Editors that know JSON schemas for TOML complete and check study files with it.
    """
    from wedgebrake.model.study import schema as study_schema

    typer.echo(json.dumps(study_schema(), indent=2))


def _load(path: Path, changes: list[str] | None, method: str | None = None) -> Study:
    """The study of a file with the changes of the command line."""
    from wedgebrake.cli.changes import parse_changes
    from wedgebrake.errors import InputError, nearest
    from wedgebrake.model.study import METHODS, load_study

    wanted = parse_changes(changes or [])
    if method is not None:
        if method not in METHODS:
            raise InputError(f"--method {method}: not known. {nearest(method, METHODS)}")
        if "method" in wanted:
            raise InputError("--method and --set method: both given. Give one of them.")
    study = load_study(path)
    try:
        study = study.changed(**wanted)
    except InputError as error:
        raise InputError(f"--set: {error}") from None
    return study if method is None else study.changed(method=method)


def _simulated(study: Study) -> tuple[Any, dict[str, Any]]:
    """The response of a study, and the report on it."""
    from wedgebrake.cli.report import response_report
    from wedgebrake.cli.waiting import announce_compilation
    from wedgebrake.solvers.solve import simulate as solve

    with announce_compilation():
        response = solve(study.system, **study.run.arguments())
        return response, response_report(study.system, response)

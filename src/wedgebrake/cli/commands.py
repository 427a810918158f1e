"""The commands. Everything heavy is imported when a command runs, so that help is instant."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(
    name="wedgebrake",
    help="Vibration of self-amplified friction brakes: is this brake on this driveline stable,"
    " does it stick and slip, and how?",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

StudyPath = Annotated[Path, typer.Argument(metavar="STUDY.toml", help="The study file.")]
Changes = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="Change a parameter, a group (eta, f, F0, alpha) or a run setting. Repeatable.",
    ),
]
AsJson = Annotated[
    bool, typer.Option("--json", help="Print one JSON object on standard output, nothing else.")
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
        typer.Option("--version", callback=_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    """Common options."""


@app.command()
def stability(study: StudyPath, changes: Changes = None, as_json: AsJson = False) -> None:
    """Linear stability in both directions: eigenvalues, bifurcation points, verdict."""
    from wedgebrake.cli.report import stability_text, to_json
    from wedgebrake.linear_stability import stability as judge

    loaded = _load(study, changes)
    verdict = judge(loaded.system)
    if as_json:
        groups = loaded.system.groups.as_dict()
        tables = loaded.system.as_dict()
        typer.echo(to_json({"system": tables, "groups": groups, **verdict.as_dict()}))
    else:
        typer.echo(stability_text(loaded.system, verdict))


@app.command()
def simulate(
    study: StudyPath,
    changes: Changes = None,
    method: Annotated[
        str | None, typer.Option(help="exact, smooth or ode14x; default by the friction law.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="RUN.nc", help="Write the response as netCDF.")
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="RUN.png", help="Draw the response (png, svg or pdf)."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """The response: time history, sticks, Poincare points, spectrum, and a verdict in words."""
    from wedgebrake.cli.output import DATA, PICTURES, check_target, write_netcdf
    from wedgebrake.cli.report import response_report, response_text, to_json
    from wedgebrake.cli.waiting import announce_compilation
    from wedgebrake.solvers.solve import simulate as solve
    from wedgebrake.solvers.status import Status

    check_target("--out", out, DATA)
    check_target("--plot", plot, PICTURES)
    loaded = _load(study, changes, method)
    with announce_compilation():
        response = solve(loaded.system, **loaded.run.arguments())
        report = response_report(loaded.system, response)
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


@app.command()
def schema() -> None:
    """The JSON schema of study files."""
    from wedgebrake.model.study import schema as study_schema

    typer.echo(json.dumps(study_schema(), indent=2))


def _load(path: Path, changes: list[str] | None, method: str | None = None):  # type: ignore[no-untyped-def]
    from wedgebrake.cli.changes import parse_changes
    from wedgebrake.model.study import load_study

    wanted = parse_changes(changes or [])
    if method is not None:
        wanted["method"] = method
    study = load_study(path)
    return study.changed(**wanted) if wanted else study

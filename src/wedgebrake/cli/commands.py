"""The commands. Large packages are imported when a command runs, so that help is fast."""

from __future__ import annotations

import json
import sys
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from wedgebrake.cli import options

app = typer.Typer(
    name="wedgebrake",
    help="Vibration of self-amplified friction brakes: stability and stick-slip motion of a brake"
    " on a driveline, or of a machine with several inertias, brakes and clutches.",
    epilog="A study is a TOML file that describes a brake and its driveline, or a machine, and"
    " the settings of the run: `wedgebrake example paper"
    " --out paper.toml` writes an example, and `wedgebrake schema` describes its contents. Exit"
    " status: 0 success, 2 invalid input, 1 any other error.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["--help", "-h"]},
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


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
    short_help="Evaluate the linear stability of steady sliding.",
    epilog="Example: wedgebrake stability belt.toml --speeds 0.1:2:40 --plot limits.png",
)
def stability(
    study: options.StudyPath,
    changes: options.ParameterChanges = None,
    speeds: options.Speeds = None,
    sticking: options.Sticking = None,
    method: options.OfCurve = "curve",
    plot: options.StabilityPicture = None,
    as_json: options.AsJson = False,
) -> None:
    """Linear stability of sliding, forwards and backwards.

    Prints a verdict, the eigenvalues, the bifurcation points (Hopf and node-focus, in eta and as
    slopes of the actuation force) and, for a wedge, the angles of the Hopf points and of
    self-locking. For a machine, prints the modes at the initial speeds, with frequency, damping
    ratio and shape. For a machine, and for a driveline whose shaft turns, also prints the
    stability limits: the values of the actuation slopes, the friction and the damping of each shaft
    at which vibration begins to grow or to decay (Hopf or divergence), and those at which a brake
    locks itself or an actuator is released. Nothing is simulated: the settings in [run], including
    the solver's method, are ignored, and --set refuses them.

    --plot draws damping ratios and stability limits over the sliding speed.
    """
    from wedgebrake.cli import simulate_command as work
    from wedgebrake.cli.output import Output

    work.stability(study, changes, speeds, sticking, method, Output(None, plot, as_json))


@app.command(
    short_help="Simulate the response in time: sticking, slipping, stopping.",
    epilog="Example: wedgebrake simulate paper.toml --set eta=-30 --plot run.png --out run.nc",
)
def simulate(
    study: options.StudyPath,
    changes: options.Changes = None,
    method: options.Method = None,
    samples: options.Samples = None,
    out: options.RunData = None,
    plot: options.RunPicture = None,
    begin: options.Begin = None,
    end: options.End = None,
    check: options.Check = False,
    as_json: options.AsJson = False,
) -> None:
    """The response in time: by default, 250 periods of the torque.

    Prints how the brake vibrates in the last fifth of the run, the class of stick-slip, the
    events, and the final state. With --json: parameters, groups, status, sticks, Poincare
    points, class, stability and versions.

    For a machine with several inertias the default is 10 s, and the command prints how each
    contact sticks and slides, the range of the output of each controller and its time at limits,
    the largest torques of joints and driven bodies, how the run ended, and its energy balance.

    A run that diverges or locks counts as a result (exit status 0); a run stopped by max_events or
    max_steps gives exit status 1, as does a violation that --check finds.
    """
    from wedgebrake.cli import simulate_command as work
    from wedgebrake.cli.output import Output

    given = {"method": method, "samples": samples}
    work.simulate(study, changes, given, (begin, end), check, Output(out, plot, as_json))


@app.command(
    short_help="Fit parameters to a measured trace.",
    epilog="Examples: wedgebrake fit paper.toml trace.csv --free kinetic=0.1:0.5 --free"
    " slope=-100:0 --plot fit.png --save fitted.toml; wedgebrake fit belt.toml --free"
    " belt.base_speed=0.3:0.8 --measured period=6.8:0.01 --window 20s:90s",
)
def fit(
    study: options.StudyPath,
    free: options.Free,
    trace: options.TracePath = None,
    observe: options.Observe = None,
    measured: options.Measured = None,
    window: options.NumberWindow = None,
    time: options.TimeColumn = None,
    sigma: options.Sigma = None,
    loss: options.Loss = "linear",
    segments: options.Segments = 1,
    start: options.FitStart = "values",
    changes: options.Changes = None,
    method: options.Method = None,
    save: options.FittedStudy = None,
    out: options.MeasureData = None,
    plot: options.FitPicture = None,
    as_json: options.AsJson = False,
) -> None:
    """Fit parameters to a measured trace, to measured numbers, or to both, by least squares.

    Derivatives are exact. The simulation starts at the first sample, from the initial state of the
    study, and ends with the trace; the duration in [run] is not used. Measured numbers, such as a
    period or a stick time, are given by --measured, with a trace or without one. Prints the values
    with standard errors, correlations and residuals, what is not determined, and signs of a
    clipped, filtered, delayed or inverted column.
    """
    from wedgebrake.cli import fit_command as work
    from wedgebrake.cli.output import Output

    given = {
        "free": free, "observe": observe, "time": time, "sigma": sigma, "loss": loss,
        "method": method, "measured": measured, "window": window, "segments": segments,
        "start": start,
    }  # fmt: skip
    work.fit(study, trace, changes, given, save, Output(out, plot, as_json))


@app.command(
    short_help="Measure a stop: time, angle, heat, torque, jerk and judder.",
    epilog="Example: wedgebrake stop driveline.toml --plot stop.png",
)
def stop(
    study: options.StudyPath,
    changes: options.Changes = None,
    method: options.Method = None,
    windows: options.Windows = 20,
    out: options.MeasureData = None,
    plot: options.MeasurePicture = None,
    as_json: options.AsJson = False,
) -> None:
    """Measures of the stop of a simulated run.

    Prints its time, the angles, the heat and the torque of each contact, and the accelerations.
    --plot draws speed, judder and jerk. The run must end with a contact that sticks to the ground.
    """
    from wedgebrake.analysis.responses.stopping import stopping
    from wedgebrake.cli import measures_command as work
    from wedgebrake.cli.output import Output

    measure = partial(stopping, windows=windows)
    work.measure(study, changes, method, measure, {}, Output(out, plot, as_json))


@app.command(
    short_help="Map the amplitudes of a run over speed and order.",
    epilog="Example: wedgebrake orders driveline.toml --variable shaft_torque --part disc-vehicle"
    " --hertz --plot orders.png",
)
def orders(
    study: options.StudyPath,
    changes: options.Changes = None,
    method: options.Method = None,
    variable: options.OrderVariable = "velocity",
    part: options.OrderPart = None,
    reference: options.Reference = None,
    highest: options.Highest = 10.0,
    turns: options.Turns = 8,
    hertz: options.Hertz = False,
    out: options.MeasureData = None,
    plot: options.MeasurePicture = None,
    as_json: options.AsJson = False,
) -> None:
    """Amplitudes of a quantity over speed and order, for example during a run-up or a stop.

    Prints the largest amplitude, with its order, speed in rpm and frequency in Hz. --plot draws the
    map over speed and order, with --hertz over speed in rpm and frequency in Hz.
    """
    from wedgebrake.analysis.responses.order_map import order_map
    from wedgebrake.cli import measures_command as work
    from wedgebrake.cli.output import Output

    measure = partial(
        order_map, variable=variable, part=part, reference=reference, highest=highest, turns=turns
    )
    work.measure(study, changes, method, measure, {"hertz": hertz}, Output(out, plot, as_json))


@app.command(
    short_help="Compute the temperature of a disc in a run.",
    epilog="Example: wedgebrake temperature driveline.toml --mass 8 --specific-heat 500 --plot"
    " temperature.png",
)
def temperature(
    study: options.StudyPath,
    changes: options.Changes = None,
    method: options.Method = None,
    contact: options.HeatedContact = None,
    share: options.Share = "1",
    mass: options.Mass = None,
    specific_heat: options.SpecificHeat = None,
    conductivity: options.Conductivity = None,
    density: options.Density = None,
    area: options.Area = None,
    out: options.MeasureData = None,
    plot: options.MeasurePicture = None,
    as_json: options.AsJson = False,
) -> None:
    """Temperature rise of a disc from the heat of a contact in a simulated run.

    The disc has a uniform temperature (--mass, --specific-heat) or is heated on an area of its
    surface (--conductivity, --density, --specific-heat, --area). Cooling is not modelled.
    """
    from wedgebrake.analysis.responses.temperature import temperature as rise
    from wedgebrake.cli import measures_command as work
    from wedgebrake.cli.assignments import parse_number
    from wedgebrake.cli.output import Output

    disc = work.disc_of(
        {"mass": mass, "specific_heat": specific_heat, "conductivity": conductivity,
         "density": density, "area": area}
    )  # fmt: skip
    measure = partial(rise, disc=disc, contact=contact, share=parse_number("--share", share, "1"))
    work.measure(study, changes, method, measure, {}, Output(out, plot, as_json))


@app.command(
    short_help="Classify the motion over a range of parameters.",
    epilog="Examples: wedgebrake sweep sweep.toml --plot eta.png;"
    " wedgebrake sweep paper.toml --over eta=-60:12:300 --over F0=0.01:0.2:200:log"
    " --store map.zarr --plot map.png;"
    " wedgebrake sweep paper.toml --over eta=-40:0:200 --follow eta --json;"
    " wedgebrake sweep belt.toml --over belt.base_speed=0.1:2:200 --follow belt.base_speed --plot"
    " response.png --quantity response",
)
def sweep(
    study: options.StudyPath,
    over: options.Over = None,
    changes: options.SweepChanges = None,
    method: options.Method = None,
    transient: options.Transient = None,
    periods: options.Periods = None,
    crossings: options.Crossings = None,
    follow: options.Follow = None,
    store: options.Store = None,
    resume: options.Resume = False,
    threads: options.Threads = None,
    processes: options.Processes = None,
    out: options.SweepData = None,
    plot: options.SweepPicture = None,
    quantity: options.Quantity = None,
    inertia: options.Part = None,
    contact: options.ContactName = None,
    as_json: options.AsJson = False,
) -> None:
    """The motion at each point of a grid of parameters: periodic, chaotic, sticking.

    The axes are given by --over or by the table [sweep] of the study. One parameter gives a
    bifurcation diagram; initial_angle with initial_velocity (of a machine two of the initial
    angles and speeds of its inertias) give basins of attraction; any other two give a map, without
    Poincare points (--set keep_points=true keeps them). Three or more, or two with --follow, give
    the Poincare points and classes of every point of the grid; there are no pictures of more than
    two parameters.

    Prints the classes of motion and of stick-slip with their shares and, along one parameter, the
    intervals of each motion; for a brake on a driveline also the limit of linear stability.
    Progress goes to standard error. The signals of a machine must be constant or periodic; if
    none varies in time, returns of the motion to its section are counted instead of periods.

    Without --follow every point starts at time 0: a brake on a driveline from initial of [run], a
    machine from the initial angles and speeds of its inertias. Of the other settings of [run],
    method, rtol, max_events and max_steps apply, but not duration, until, periods and
    samples_per_period: --transient and --periods (or [sweep]) set the evaluated periods. start_time
    must be 0.

    A point that diverges, locks, or is invalid is recorded as a result (exit status 0). Ctrl-C ends
    the sweep at once (exit status 1); with --store the finished chunks are kept, and the same
    command with --resume continues. With --follow over one parameter there is a single chunk.
    """
    from wedgebrake.cli.output import Output
    from wedgebrake.cli.overrides import load_for_sweep
    from wedgebrake.cli.sweep_command import run
    from wedgebrake.cli.workers import Workers

    output = Output(out, plot, as_json)
    output.check()
    given = {
        "transient": transient, "periods": periods, "crossings": crossings, "follow": follow,
    }  # fmt: skip
    asked = load_for_sweep(study, changes, method, over, given)
    drawn = {"quantity": quantity, "inertia": inertia, "contact": contact}
    run(asked, (store, resume), Workers(threads, processes), output, drawn)


@app.command(
    short_help="Estimate probabilities of outcomes for uncertain parameters.",
    epilog="Examples: wedgebrake scatter paper.toml --vary kinetic=0.28..0.34 --vary"
    ' "slope=norm(-40,3)" --samples 1024 --plot scatter.png; wedgebrake scatter paper.toml --vary'
    " kinetic=0.28..0.42 --outcome self_locked --indices",
)
def scatter(
    study: options.StudyPath,
    vary: options.Vary = None,
    samples: options.SampleCount = 1024,
    seed: options.Seed = 0,
    outcome: options.Outcomes = None,
    limit: options.Limits = None,
    indices: options.Indices = False,
    changes: options.SweepChanges = None,
    method: options.Method = None,
    transient: options.Transient = None,
    periods: options.Periods = None,
    crossings: options.Crossings = None,
    store: options.ScatterStore = None,
    resume: options.Resume = False,
    threads: options.Threads = None,
    processes: options.Processes = None,
    out: options.SweepData = None,
    plot: options.ScatterPicture = None,
    as_json: options.AsJson = False,
) -> None:
    """Estimate probabilities of instability, self-locking, stick-slip and exceeded limits.

    The parameters given by --vary have independent distributions. Prints the probability of each
    outcome with its 95 % interval (Wilson), and quantiles of amplitude, torque and growth rate.
    Undecided and failed samples are never counted as safe. If only outcomes of linear stability are
    requested, nothing is simulated. --indices adds Sobol indices.

    Simulations, settings and stores are those of sweep, except that each sample has its own values
    of all parameters.
    """
    from wedgebrake.cli.output import Output
    from wedgebrake.cli.overrides import load_for_sweep
    from wedgebrake.cli.scatter_command import run
    from wedgebrake.cli.workers import Workers

    output = Output(out, plot, as_json)
    output.check()
    given = {"transient": transient, "periods": periods, "crossings": crossings}
    asked = load_for_sweep(study, changes, method, None, given)
    arguments = {"samples": samples, "seed": seed, "outcomes": outcome, "indices": indices}
    asked_workers = Workers(threads, processes)
    run(asked, vary or (), arguments, limit or (), (store, resume), asked_workers, output)


@app.command(
    "rare-event",
    short_help="Estimate a small probability of an outcome for uncertain parameters.",
    epilog='Examples: wedgebrake rare-event paper.toml --vary "kinetic=norm(0.25,0.02)" --runs 500;'
    ' wedgebrake rare-event paper.toml --vary "initial_force=norm(300,10)" --outcome'
    ' "peak_torque > 380" --runs 500 --transient 20 --periods 30',
)
def rare_event(
    study: options.StudyPath,
    vary: options.Vary = None,
    outcome: options.RareOutcome = "self_locked",
    runs: options.Runs = 10_000,
    seed: options.Seed = 0,
    changes: options.SweepChanges = None,
    method: options.Method = None,
    transient: options.Transient = None,
    periods: options.Periods = None,
    crossings: options.Crossings = None,
    threads: options.Threads = None,
    processes: options.Processes = None,
    as_json: options.AsJson = False,
) -> None:
    """Estimate a small probability, such as 1e-6, of one outcome from a few thousand samples.

    The parameters given by --vary have independent distributions, as in scatter. For probabilities
    above 1 %, and for several outcomes together, use scatter. The method is line sampling: on
    parallel lines through the space of the parameters, the boundary of the outcome is located by
    bisection, and the probability beyond it is computed exactly.

    Prints the probability with its 95 % interval, the number of samples that were evaluated, and
    the most probable values for which the outcome occurs. Where the outcome is unknown, it is
    assumed to occur. If no occurrence is found within 8 standard deviations, the probability is 0
    (exit status 0) and has no interval. If the outcome occurs in samples but on none of the lines,
    the probability is not determined. If it also occurs outside the regions that could be examined
    with --runs, the upper end of the interval is not determined: increase --runs.

    Outcomes of linear stability need no simulation; the others use the settings of sweep.
    """
    from wedgebrake.cli.overrides import load_for_sweep
    from wedgebrake.cli.rare_event_command import run
    from wedgebrake.cli.workers import Workers

    given = {"transient": transient, "periods": periods, "crossings": crossings}
    asked = load_for_sweep(study, changes, method, None, given)
    arguments = {"outcome": outcome, "runs": runs, "seed": seed}
    run(asked, vary or (), arguments, Workers(threads, processes), as_json=as_json)


@app.command(
    short_help="Find the values of a parameter for which a criterion holds.",
    epilog="Examples: wedgebrake margin paper.toml --parameter slope=-60:12;"
    ' wedgebrake margin paper.toml --parameter slope=-60:12 --vary "kinetic=norm(0.3,0.01)"'
    " --quantile 0.95 --samples 64; wedgebrake margin paper.toml --parameter slope=-60:12 --over"
    " kinetic=0.28:0.34",
)
def margin(
    study: options.StudyPath,
    parameter: options.Parameter,
    criterion: options.Criterion = "stable",
    over: options.MarginOver = None,
    vary: options.Vary = None,
    quantile: options.Probability = 0.95,
    samples: options.SampleCount = 256,
    seed: options.Seed = 0,
    points: options.ScanPoints = 33,
    changes: options.SweepChanges = None,
    method: options.Method = None,
    transient: options.Transient = None,
    periods: options.Periods = None,
    crossings: options.Crossings = None,
    as_json: options.AsJson = False,
) -> None:
    """Find the values of a parameter for which sliding is stable, or another criterion holds.

    Prints the interval that contains the present value, or the nearest one, and the distance of the
    present value from its nearer end. A scan brackets the ends of the intervals, which are then
    located by bisection. The criterion must hold for the study; with --over at all values, or in
    the whole range, of other parameters; with --vary for a fraction of the samples.

    Undecided and failed samples do not meet the criterion. Limits of results and stick-slip need
    simulations, with the settings of sweep.
    """
    from wedgebrake.cli.margin_command import run
    from wedgebrake.cli.overrides import load_for_sweep

    given = {"transient": transient, "periods": periods, "crossings": crossings}
    asked = load_for_sweep(study, changes, method, None, given)
    arguments = {
        "criterion": criterion, "quantile": quantile, "samples": samples, "seed": seed,
        "points": points,
    }  # fmt: skip
    run(asked, parameter, over or (), vary or (), arguments, as_json=as_json)


@app.command(
    "continue",
    short_help="Follow periodic motions, stable and unstable, over a parameter.",
    epilog="Examples: wedgebrake continue paper.toml --over eta=12:-60 --plot eta.png;"
    " wedgebrake continue conventional.toml --over slope=0:-160 --out slope.nc;"
    " wedgebrake continue paper.toml --over eta=-10:-22 --and F0=0.02:0.09 --plot"
    " plane.png; wedgebrake continue belt.toml --over belt.base_speed=0.5:3 --hopf --plot belt.png",
)
def continue_(
    study: options.StudyPath,
    over: options.OrbitOver = None,
    second: options.Second = None,
    changes: options.OrbitChanges = None,
    method: options.Method = None,
    order: options.Order = None,
    hopf: options.Hopf = False,
    switch: options.Switch = 2,
    step: options.Step = 0.02,
    points: options.Points = 2000,
    beneath: options.Beneath = None,
    out: options.OrbitData = None,
    plot: options.OrbitPicture = None,
    as_json: options.AsJson = False,
) -> None:
    """Stable and unstable periodic motions over a parameter, and their bifurcations.

    Finds a periodic orbit at FROM and follows it to TO, with the branches that leave it. In a
    machine in which no signal varies in time, the orbit is a limit cycle, whose period is unknown;
    with --hopf the branch begins at the Hopf point, where steady sliding becomes unstable. A brake
    on a driveline with signals, lag, limits or sampling, or without a torque, is solved as a
    machine, over the same parameters and groups.

    Bifurcations are located to about nine digits: period doublings, folds, tori, and those of
    friction, where a stick begins or ends or the motion grazes a breakpoint.

    Prints how far the first motion is stable and what replaces it, the branches with the
    intervals where they are stable, the bifurcations, and the meaning of their names; progress goes
    to standard error. Of the settings in [run], initial, method and rtol apply (for a machine only
    method); to simulated points also max_events and max_steps.

    Stability refers to small disturbances: other motions may coexist with a stable one. A few
    branches take seconds; many, as near self-locking or with smooth friction, take minutes.

    Exit status 2 if there is no orbit at FROM, or with --hopf no Hopf point in the range. Ctrl-C
    ends at once (exit status 1), and nothing is written.
    """
    from wedgebrake.cli.continue_command import ContinueRequest, run
    from wedgebrake.cli.output import Output
    from wedgebrake.cli.overrides import load_for

    output = Output(out, plot, as_json)
    output.check()
    loaded = load_for("continue", study, changes, method)
    settings = {"switch": switch, "step": step, "points": points}
    run(ContinueRequest(loaded, over, second, order, hopf, settings, beneath, output))


@app.command(
    short_help="Amplitude and phase over the frequency at levels of the torque.",
    epilog="Examples: wedgebrake response paper.toml --over frequency=5:40"
    " --level amplitude=400,500,700 --plot curves.png; wedgebrake response belt.toml"
    " --over belt.base_speed=0.6:0.7 --level belt.initial_force=1,1.2 --out curves.csv",
)
def response(
    study: options.StudyPath,
    over: options.OrbitOver = None,
    level: options.Level = None,
    changes: options.OrbitChanges = None,
    method: options.Method = None,
    order: options.ResponseOrder = 1,
    folds: options.Folds = False,
    samplings: options.Samplings = None,
    switch: options.Switch = 0,
    step: options.Step = 0.02,
    points: options.Points = 2000,
    out: options.ResponseData = None,
    plot: options.ResponsePicture = None,
    quantity: options.ResponseQuantity = None,
    inertia: options.Part = None,
    contact: options.ContactName = None,
    shaft: options.ShaftName = None,
    as_json: options.AsJson = False,
) -> None:
    """Amplitude and phase of the vibration over one parameter, at several values of a second one.

    Periodic motions, stable and unstable, are followed over the parameter of --over, usually the
    frequency of the torque, also through folds, at each value of --level, usually the amplitude of
    the torque. The results contain amplitude (half range), fundamental and phase of each angle, the
    heat and the equivalent viscous damping of each brake, shares of sticking and bifurcations.

    Prints the largest amplitude at each level, with its frequency, and the folds and other
    bifurcations; progress goes to standard error. Of the settings in [run], method and rtol apply.
    Branches begin at both ends of the range, and between them where none has passed.

    Exit status 2 if there is no periodic motion at any level. Ctrl-C ends at once (exit status 1),
    and nothing is written.
    """
    from wedgebrake.cli.output import Output
    from wedgebrake.cli.overrides import load_for
    from wedgebrake.cli.response_command import ResponseRequest, run

    output = Output(out, plot, as_json)
    output.check()
    loaded = load_for("response", study, changes, method)
    settings = {
        "order": order, "folds": folds, "samplings": samplings, "switch": switch, "step": step,
        "points": points,
    }  # fmt: skip
    drawn = {"quantity": quantity, "inertia": inertia, "contact": contact, "shaft": shaft}
    run(ResponseRequest(loaded, over, level, settings, drawn, output))


@app.command(
    short_help="Reproduce the figures and statements of Chen and Xi (2014).",
    epilog="Examples: wedgebrake paper fig8 fig9 --out figures; wedgebrake paper claims;"
    " wedgebrake paper all --out paper",
)
def paper(
    targets: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="TARGET",
            help="fig1 to fig19, claims, or all; repeatable. Without a target, the targets are"
            " listed.",
        ),
    ] = None,
    out: options.Folder = None,
    method: options.PaperMethod = "smooth",
    threads: options.Threads = None,
    kind: options.PictureKind = "png",
    as_json: options.AsJson = False,
) -> None:
    """The figures and statements of the source paper, recomputed and evaluated.

    Without a target, lists the figures. A figure is drawn into the folder, as fig8.png. claims
    tests each statement of the paper and prints the verdicts. all draws every figure, tests the
    statements and writes report.html, a self-contained page, and claims.json; it takes
    one to two minutes. Figures are 183 mm wide, two columns of a journal.

    A verdict follows from numbers: reproduced, reproduced with a stated correction,
    contradicted, or undecidable from the text. The exit status is 0 for all verdicts. Each file
    is written completely or not at all; Ctrl-C ends at once (exit status 1) and keeps the complete
    ones.
    """
    from wedgebrake.cli.compilation import announce_compilation

    with announce_compilation():
        from wedgebrake.cli.paper_command import run

    run(targets or [], out, method, threads, kind, as_json)


@app.command(
    "app",
    short_help="Open the explorer, a page in the browser with sliders.",
    epilog="Example: wedgebrake app paper.toml --port 8000",
)
def explore(
    study: Annotated[
        Path | None,
        typer.Argument(
            metavar="[STUDY.toml]", help="Study to open; by default the brake of the source paper."
        ),
    ] = None,
    port: options.Port = 5006,
    address: options.Address = "127.0.0.1",
    allow: options.Allow = None,
    browser: options.Browser = True,
) -> None:
    """The explorer: an interactive page with the verdict and pictures of a machine.

    Verdict, time history, phase portrait, Poincare section, spectrum, an animation of the brake,
    bifurcation diagram, maps of regimes and stability, basins, amplitude curves, fits to measured
    traces. Loads and saves study files; exports pictures, data and a Python program that
    computes the current picture. Prints the address of the page and serves it until Ctrl-C. Needs
    the extra app.
    """
    from wedgebrake.cli.app_command import explore as work

    work(study, port, address, tuple(allow or ()), browser)


@app.command(short_help="Print the JSON schema of study files.")
def schema() -> None:
    """The JSON schema of study files: every table and parameter, with unit and range.

    Editors that know JSON schemas for TOML complete and check study files with it.
    """
    from wedgebrake.model.studies.study import schema as study_schema

    typer.echo(json.dumps(study_schema(), indent=2))


@app.command(
    short_help="Print or write an example study file.",
    epilog="Example: wedgebrake example paper --out paper.toml",
)
def example(
    name: Annotated[
        str | None,
        typer.Argument(metavar="[NAME]", help="Name of the example. Default: list all."),
    ] = None,
    out: options.NewStudy = None,
) -> None:
    """Example study files of wedgebrake, to run and to edit.

    paper is the wedge brake of the source paper; sweep varies the slope of its actuation
    force; driveline is a machine with four inertias and a brake; belt vibrates by itself. Without a
    name, lists all.
    """
    from wedgebrake.cli import examples

    if name is None:
        typer.echo(examples.listing())
    elif out is None:
        typer.echo(examples.example(name), nl=False)
    else:
        typer.echo(f"Study: {examples.written(name, out)}")


@app.command(
    "compile",
    short_help="Compile the solvers before their first use.",
    epilog="Example: wedgebrake compile drivelines machines",
)
def compile_ahead(
    groups: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="GROUP",
            help="drivelines, smooth or machines; one or more. Default: all.",
        ),
    ] = None,
    as_json: options.AsJson = False,
) -> None:
    """Compile the solvers in advance, so that no command or function has to compile them later.

    The group drivelines is for braked drivelines, and smooth for those with smooth friction laws;
    machines includes drivelines with signals or sampled actuations. Compiled code is kept on disk
    until wedgebrake, Numba or the processor changes (wedgebrake doctor prints the folder). A
    friction law or brake of your own is compiled at its first use.
    """
    from wedgebrake.cli import compile_command as work

    report = work.run(groups or [])
    typer.echo(json.dumps(report) if as_json else work.text(report))


@app.command(
    short_help="Check the installation, and report problems.",
    epilog="Example: wedgebrake doctor",
)
def doctor(as_json: options.AsJson = False) -> None:
    """Installed packages, with remedies for problems.

    Prints versions of wedgebrake, Python and all packages, which extras are complete, processors
    and threads, the folder of compiled kernels, and a sentence for each problem. Each package is
    imported, which takes some seconds. Exit status: 0 no problem, 1 at least one problem.
    """
    from wedgebrake.cli import doctor as work

    report = work.examine()
    typer.echo(json.dumps(report) if as_json else work.text(report))
    if not report["healthy"]:
        sys.exit(1)

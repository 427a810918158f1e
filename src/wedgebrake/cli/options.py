"""Arguments and options of the commands, with their help. Imports no large packages."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer


def _option(metavar: str, text: str, *names: str, **more: Any) -> Any:
    return typer.Option(*names, metavar=metavar, help=text, **more)


def _checked_workers(parameter: typer.CallbackParam, count: int | None) -> int | None:
    """Check a number of threads or processes before the command begins."""
    if count is None:
        return None
    from wedgebrake.errors import InputError
    from wedgebrake.sweeps.executor import check_workers

    try:
        check_workers(str(parameter.name), count)
    except InputError as error:
        raise error.renamed("--{}".format, " ") from None
    return count


def _set(group: str) -> Any:
    return _option(
        "NAME=VALUE",
        "Change a value of the study, written as in the file: a parameter (inertia=2; in a machine"
        f" by its dotted name, brake.slope=-40){group}; none unsets an optional value"
        " (resolution=none). Repeatable.",
        "--set",
    )


StudyPath = Annotated[Path, typer.Argument(metavar="STUDY.toml", help="Study file.")]
Changes = Annotated[list[str] | None, _set(", a group (F0=0.05) or a run setting (periods=50)")]
ParameterChanges = Annotated[list[str] | None, _set(" or a group (F0=0.05)")]
SweepChanges = Annotated[
    list[str] | None,
    _set(
        ", a group (F0=0.05) or a setting of [run] or [sweep] (initial=[0.01, 0.0], limit=5000,"
        " keep_points=false)",
    ),
]
OrbitChanges = Annotated[
    list[str] | None,
    _set(", a group (F0=0.05) or a setting of [run] (initial=[0.01, 0.0], rtol=1e-9)"),
]
Method = Annotated[
    str | None,
    _option(
        "NAME",
        "Solver: exact (default for Coulomb, tabulated and Stribeck friction) or smooth (default"
        " for smooth friction laws).",
    ),
]
PaperMethod = Annotated[
    str,
    _option(
        "NAME",
        "Solver of the runs: smooth (smoothed friction, adaptive), exact (Coulomb friction) or"
        " ode14x (smoothed friction, the paper's fixed step; slow).",
    ),
]
AsJson = Annotated[
    bool,
    typer.Option(
        "--json",
        help="Print one JSON object on standard output and nothing else. Infinite numbers are the"
        ' strings "inf" and "-inf".',
    ),
]
Check = Annotated[
    bool,
    typer.Option(
        "--check",
        help="Check that the response obeys the laws of friction and the balances of torques and of"
        " energy, at all samples and events; violations are listed, with exit status 1.",
    ),
]
Threads = Annotated[
    int | None,
    _option("N", "Number of threads. Default: one for each processor.", callback=_checked_workers),
]
Processes = Annotated[
    int | None,
    _option(
        "N",
        "Number of worker processes to use instead of threads (extra cluster); not with --threads."
        " They take seconds to start. Faster for machines, whose threads wait for each other.",
        callback=_checked_workers,
    ),
]

# Files.
_SUFFIX = "; the suffix (.png, .svg or .pdf) sets the format."
RunData = Annotated[
    Path | None,
    _option(
        "RUN.nc",
        "Write the response: time history, events, sticks and Poincare points, with units, as"
        " netCDF (.nc) or for MATLAB (.mat), or the time history as a table (.csv).",
    ),
]
RunPicture = Annotated[
    Path | None,
    _option(
        "RUN.png",
        "Draw time history, phase portrait, Poincare section and spectrum; of a machine speeds,"
        " sticks, torques and forces" + _SUFFIX,
    ),
]
SweepData = Annotated[
    Path | None,
    _option(
        "DATA.nc",
        "Write the complete result, with units, as netCDF (.nc) or for MATLAB (.mat), or a table of"
        " its points (.csv).",
    ),
]
SweepPicture = Annotated[
    Path | None,
    _option("PICTURE.png", "Draw the bifurcation diagram, map or basins" + _SUFFIX),
]
StabilityPicture = Annotated[
    Path | None,
    _option(
        "PICTURE.png",
        "Draw damping ratios and stability limits of slope, friction and damping over the speed"
        + _SUFFIX,
    ),
]
OrbitData = Annotated[
    Path | None,
    _option(
        "DATA.nc",
        "Write the branches, with units, as netCDF (.nc), for MATLAB (.mat) or as a table (.csv)."
        " (The points of boundaries are in --json.)",
    ),
]
OrbitPicture = Annotated[
    Path | None,
    _option(
        "PICTURE.png",
        "Draw branches, stable and unstable, and bifurcations, or with --and the boundaries"
        + _SUFFIX,
    ),
]
Folder = Annotated[
    Path | None,
    _option("FOLDER", "Folder of the files; default paper. It is created if necessary."),
]
PictureKind = Annotated[str, _option("KIND", "Format of the figures: png, svg or pdf.", "--format")]
NewStudy = Annotated[
    Path | None,
    _option("STUDY.toml", "Write the example to this new file instead of printing it."),
]

# Of simulate.
Samples = Annotated[
    int | None,
    _option(
        "N",
        "Number of samples of the response, at equal distances. Default: at least 50 in each period"
        " of the fastest vibration, up to 200000.",
    ),
]
Begin = Annotated[
    str | None,
    _option("TIME", "First time shown by --plot, in s or with a unit (1.5, 20ms).", "--from"),
]
End = Annotated[str | None, _option("TIME", "Last time shown by --plot.", "--to")]

# Of stop, orders and temperature.
MeasureData = Annotated[
    Path | None,
    _option(
        "DATA.nc",
        "Write the result, with units, as netCDF (.nc), for MATLAB (.mat) or as a table (.csv).",
    ),
]
MeasurePicture = Annotated[Path | None, _option("PICTURE.png", "Draw the result" + _SUFFIX)]
TracePath = Annotated[
    Path | None,
    typer.Argument(
        metavar="TRACE.csv",
        help="Measured columns over time: .csv with a header, .mat, .nc, .tdms, .mf4 or .uff. Times"
        " in seconds. Optional with --measured.",
    ),
]
Measured = Annotated[
    list[str] | None,
    _option(
        "NAME=VALUE:DEVIATION",
        "Measured number and its standard deviation, in addition to a trace or instead of one, in"
        " SI units or with units: disc.period=0.103:0.001, brake.stick_time=12ms:1ms,"
        " disc.harmonic_2, disc.order_2, or a measure such as brake.peak_torque. The name of the"
        " part can be omitted if there is only one of its kind. Columns of a trace then need"
        " --sigma. Repeatable.",
        "--measured",
    ),
]
NumberWindow = Annotated[
    str | None,
    _option(
        "START:END",
        "Times between which the numbers of --measured were measured [s]. Default: the whole trace."
        " Required without a trace: the run then starts at 0 and ends with the window.",
    ),
]
Free = Annotated[
    list[str],
    _option(
        "NAME=LOW:HIGH",
        "What is fitted, with its range: a parameter of the study (brake.kinetic=0.1:0.5), the"
        " initial state of a driveline (initial_velocity=-1:1), time_shift=-0.01:0.01 [s],"
        " COLUMN.scale or COLUMN.offset. Repeatable.",
        "--free",
    ),
]
Segments = Annotated[
    int,
    _option(
        "N",
        "Number of segments into which a long or chaotic trace is divided. Each is simulated from"
        " its own initial state, which is fitted too; they must join without gaps. Not with"
        " --measured.",
    ),
]
FitStart = Annotated[
    str,
    _option(
        "NAME",
        "Starting values: values (those of the study), or features (also values within"
        " the ranges of --free at which the simulated columns have features like those of the"
        " trace; slower).",
    ),
]
Observe = Annotated[
    list[str] | None,
    _option(
        "COLUMN=QUANTITY",
        "Quantity that a column measures: disc.speed, disc.angle, shaft.torque, brake.torque,"
        " brake.force; with one inertia also velocity, angle, brake_torque. Default: the columns"
        " with the name of a quantity, also with its unit. Repeatable.",
        "--observe",
    ),
]
Sigma = Annotated[
    list[str] | None,
    _option(
        "COLUMN=NUMBER",
        "Standard deviation of the measurement noise of a column, in SI units; for all columns or"
        " none. Default: columns are weighted by their own standard deviation. Required with"
        " --measured. Repeatable.",
        "--sigma",
    ),
]
TimeColumn = Annotated[
    str | None,
    _option(
        "NAME",
        "Name of the column of times. Default: time or t, also with a unit, or the first column.",
    ),
]
Loss = Annotated[
    str,
    _option(
        "NAME",
        "Loss function: linear (least squares), or soft_l1, huber, cauchy or arctan to reduce the"
        " influence of outliers.",
    ),
]
FittedStudy = Annotated[
    Path | None, _option("FITTED.toml", "Write the study with the fitted values.", "--save")
]
FitPicture = Annotated[
    Path | None,
    _option("PICTURE.png", "Draw measured and fitted columns with their residuals" + _SUFFIX),
]
Windows = Annotated[int, _option("N", "Number of windows in which judder is measured.")]
OrderVariable = Annotated[
    str,
    _option(
        "NAME",
        "Quantity: velocity, torque, shaft_torque, brake_torque, actuation_force or"
        " sliding_velocity.",
    ),
]
OrderPart = Annotated[
    str | None, _option("NAME", "Inertia, shaft or contact of the quantity; default the only one.")
]
Reference = Annotated[
    str | None,
    _option("NAME", "Inertia whose turns the orders count; default the first, or the drive."),
]
Highest = Annotated[float, _option("ORDER", "Highest order.")]
Turns = Annotated[int, _option("N", "Length of a window in turns.")]
Hertz = Annotated[bool, typer.Option("--hertz", help="Draw over speed in rpm and frequency in Hz.")]
HeatedContact = Annotated[
    str | None, _option("NAME", "Contact whose heat flows into the disc; default the only one.")
]
Share = Annotated[str, _option("SHARE", "Share of the heat that flows into the disc (50 %).")]
Mass = Annotated[str | None, _option("MASS", "Mass of the disc [kg].")]
SpecificHeat = Annotated[str | None, _option("HEAT", "Specific heat capacity [J/(kg K)].")]
Conductivity = Annotated[str | None, _option("VALUE", "Thermal conductivity [W/(m K)].")]
Density = Annotated[str | None, _option("VALUE", "Density [kg/m^3].")]
Area = Annotated[str | None, _option("VALUE", "Heated area [m^2].")]

# Of stability.
Speeds = Annotated[
    str | None,
    _option(
        "FROM:TO:COUNT",
        "Sliding speeds for --plot [rad/s], of the contact that slides fastest: FROM:TO:COUNT,"
        " FROM:TO:COUNT:log or a list. Default: up to three times the speed of the study.",
    ),
]

Sticking = Annotated[
    list[str] | None,
    _option(
        "CONTACT",
        "Name of a contact of a machine that sticks, such as a locked clutch; all others slide."
        " Repeatable. Default: contacts that stand slide, and a sentence tells what holds while"
        " those that are pressed stick.",
    ),
]

OfCurve = Annotated[
    str,
    _option(
        "METHOD",
        "How to linearise friction that varies with the sliding speed: curve, the derivative of the"
        " curve that the solver smooth uses; exact, the slope of the straight lines that the solver"
        " exact uses.",
    ),
]

# Of sweep.
Over = Annotated[
    list[str] | None,
    _option(
        "NAME=VALUES",
        "Sweep this instead of the axes in [sweep]: a parameter (inertia), a group (eta, f, F0,"
        " alpha), initial_angle or initial_velocity; of a machine a dotted name (brake.slope). The"
        " values are FROM:TO:COUNT in equal steps"
        " (eta=-60:12:400), FROM:TO:COUNT:log in equal ratios (F0=0.01:0.2:100:log), or a list"
        " (F0=0.03,0.036,0.05). Repeatable: several parameters span a grid, with its dimensions in"
        " this order.",
    ),
]
Transient = Annotated[
    str | None,
    _option(
        "N|auto",
        "Number of periods or crossings discarded as transient, or auto (default): wait until"
        " each point has settled, for at most as many as the setting limit (--set limit=20000).",
    ),
]
Periods = Annotated[
    int | None,
    _option(
        "N",
        "Number of periods evaluated once a point has settled (default 50); with a number for"
        " --transient, number of the last period evaluated (default 250).",
    ),
]
Crossings = Annotated[
    int | None,
    _option(
        "N",
        "Replaces --periods where no signal varies: number of returns of the motion to its section"
        " (default 50).",
    ),
]
Follow = Annotated[
    str | None,
    _option(
        "NAME",
        "Start each point where its neighbour along this parameter ended, once upwards and once"
        " downwards: branches that differ show hysteresis.",
    ),
]
Quantity = Annotated[
    str | None,
    _option(
        "NAME",
        "What --plot draws: response (amplitudes of speed, torque and jerk, and the share of time"
        " stuck, over one parameter), velocity or angle (Poincare points, the default over one"
        " parameter), a result of the sweep (rms_velocity, peak_jerk, ...), or over two parameters"
        " a class (motion, the default, or stick_class). Over one parameter the largest value of"
        " each result is also printed.",
    ),
]
Part = Annotated[
    str | None, _option("NAME", "Inertia of a machine that --plot shows; default the first.")
]
ContactName = Annotated[
    str | None, _option("NAME", "Contact of a machine that --plot shows; default the first.")
]
_KEEP = (
    "Keep the points in this folder (zarr), so that an interrupted computation can be continued."
    " Points are written in chunks"
)
Store = Annotated[
    Path | None,
    _option(
        "RUN.zarr",
        _KEEP + ", and with --follow a chunk consists of whole lines: a sweep over one parameter is"
        " then a single chunk, kept only at its end.",
    ),
]
ScatterStore = Annotated[Path | None, _option("RUN.zarr", _KEEP + ".")]
Resume = Annotated[
    bool, typer.Option("--resume", help="Continue the computation in the store, if there is one.")
]

# Of scatter.
Vary = Annotated[
    list[str] | None,
    _option(
        "NAME=DISTRIBUTION",
        "Uncertain parameter: FROM..TO (uniform), or a continuous distribution of scipy.stats with"
        ' its arguments: "slope=norm(-60,5)" has the mean -60 and the standard deviation 5'
        ' (default 1); "kinetic=triang(0.5, loc=0.28, scale=0.14)". Names as for --over of sweep;'
        " NAME,NAME: parameters that share one value. Repeatable.",
    ),
]
SampleCount = Annotated[
    int, _option("N", "Number of samples of a Sobol sequence; powers of 2 are best.", "--samples")
]
Seed = Annotated[int, _option("N", "Seed of the samples; the same seed gives the same samples.")]
Outcomes = Annotated[
    list[str] | None,
    _option(
        "NAME",
        "Outcome whose probability is estimated: unstable_forwards, unstable_backwards, self_locked"
        " (these without a simulation), stick_slip, undecided, safe. Repeatable. Default: all.",
        "--outcome",
    ),
]
Limits = Annotated[
    list[str] | None,
    _option(
        "NAME=VALUE",
        "Limit of a result, in SI units or with a unit: amplitude (half the range of the speed),"
        " rms_torque, peak_torque, peak_jerk, ...; exceeding it is a further outcome."
        " Repeatable.",
        "--limit",
    ),
]
Indices = Annotated[
    bool,
    typer.Option(
        "--indices",
        help="Compute Sobol indices: how much each parameter contributes to the variance of each"
        " quantity. Needs (k + 2) times as many samples for k parameters.",
    ),
]
ScatterPicture = Annotated[
    Path | None,
    _option(
        "PICTURE.png",
        "Draw probabilities with intervals, Sobol indices and samples coloured by class" + _SUFFIX,
    ),
]

# Of rare-event.
RareOutcome = Annotated[
    str,
    _option(
        "TEXT",
        "Outcome whose probability is estimated: unstable_forwards, unstable_backwards, self_locked"
        " (these without a simulation), stick_slip, undecided, or a result above a limit in SI"
        ' units ("rms_torque > 20"; amplitude is half the range of the speed).',
    ),
]
Runs = Annotated[int, _option("N", "Approximate number of samples to evaluate, at least 500.")]

# Of margin.
Parameter = Annotated[
    str,
    _option("NAME=FROM:TO", "Parameter whose margin is sought, and the range searched."),
]
Criterion = Annotated[
    str,
    _option(
        "TEXT",
        'What must hold: stable, "no self-locking", "no stick-slip", or a result below a limit in'
        ' SI units ("rms_torque < 20"; amplitude is half the range of the speed).',
    ),
]
MarginOver = Annotated[
    list[str] | None,
    _option(
        "NAME=VALUES",
        "Other parameter, and where the criterion must hold: at all values, but not between them"
        " (kinetic=0.28:0.34:7 or 0.28,0.31,0.34); or, for one parameter, in a whole range"
        " (frequency=5:40), which is examined at --points values and more closely where the"
        " criterion fails first. Repeatable.",
        "--over",
    ),
]
Probability = Annotated[
    float,
    _option("FRACTION", "With --vary: fraction of the samples for which the criterion must hold."),
]
ScanPoints = Annotated[
    int, _option("N", "Number of values of the scan, and of the first values of a range of --over.")
]

# Of continue.
OrbitOver = Annotated[
    list[str] | None,
    _option(
        "NAME=FROM:TO",
        "Parameter over which the motion is followed: a parameter (inertia; for a machine"
        " brake.slope) or a group (eta, f, F0, alpha). The first orbit is searched for at FROM.",
        "--over",
    ),
]
Second = Annotated[
    str | None,
    _option(
        "NAME=FROM:TO",
        "Also follow the bifurcations in a second parameter: the boundaries of the motions in the"
        " plane of both, which --plot then draws.",
        "--and",
    ),
]
Order = Annotated[
    int | None,
    _option(
        "N",
        "Number of torque periods of the first orbit, which may then be unstable; initial of"
        " [run], if given, is its initial guess. Default: that of the steady motion reached from"
        " initial (or from rest). If no signal varies in time: number of returns of the motion to"
        " its section.",
    ),
]
Hopf = Annotated[
    bool,
    typer.Option(
        "--hopf",
        help="Begin at the Hopf point of steady sliding between FROM and TO, and follow the limit"
        " cycles that branch off there. Only where no signal varies in time.",
    ),
]
Switch = Annotated[
    int,
    _option(
        "N",
        "Levels of branches to follow that leave other branches, as at period doublings; 0:"
        " the first branch only.",
    ),
]
Step = Annotated[float, _option("SHARE", "Largest step along a branch, as a share of the range.")]
Points = Annotated[int, _option("N", "Largest number of points of a branch.")]
Beneath = Annotated[
    int | None,
    _option(
        "N",
        "Number of values at which simulated points are drawn beneath the branches, as by sweep;"
        " 0 for none; with --and a map of N by N cells. Default: 200 beneath branches of method"
        " exact, except of limit cycles, otherwise none.",
    ),
]

# Of response.
Level = Annotated[
    list[str] | None,
    _option(
        "NAME=A,B,...",
        "Second parameter and its values, with a curve for each: the amplitude of the torque, or"
        " any other parameter or group.",
        "--level",
    ),
]
ResponseOrder = Annotated[
    int, _option("N", "Number of torque periods of the orbits, which may be unstable.")
]
Folds = Annotated[
    bool,
    typer.Option("--folds", help="Also follow the folds over both parameters, between the levels."),
]
Samplings = Annotated[
    int | None,
    _option(
        "N",
        "Number of samplings in a period of the torque, for curves over the frequency with sampled"
        " actuations or digital controllers: their sample_time is then the period divided by N.",
    ),
]
ResponseQuantity = Annotated[
    str | None,
    _option(
        "NAME",
        "What --plot draws: angle_amplitude, velocity_amplitude (half ranges), angle_fundamental,"
        " angle_phase, twist_fundamental, twist_phase, friction_heat, equivalent_damping,"
        " stick_share or peak_torque; default: amplitude and phase of the angle.",
    ),
]
ShaftName = Annotated[
    str | None, _option("NAME", "Shaft of a machine that --plot shows; default the first.")
]
ResponseData = Annotated[
    Path | None,
    _option(
        "DATA.nc",
        "Write the curves, with units, as netCDF (.nc), for MATLAB (.mat) or as a table (.csv).",
    ),
]
ResponsePicture = Annotated[
    Path | None,
    _option("PICTURE.png", "Draw the curves, stable and unstable, sticks and folds" + _SUFFIX),
]

# Of app.
Port = Annotated[int, _option("N", "Port to listen on; 0 selects a free port.")]
Address = Annotated[
    str,
    _option(
        "HOST",
        "Address to listen on. Default: this computer only; 0.0.0.0 accepts other computers.",
    ),
]
Allow = Annotated[
    list[str] | None,
    _option(
        "HOST:PORT",
        "Host name under which browsers on other computers open the page: HOST, or HOST:PORT."
        " Repeatable.",
        "--allow",
    ),
]
Browser = Annotated[
    bool, typer.Option("--browser/--no-browser", help="Open the page in a browser.")
]

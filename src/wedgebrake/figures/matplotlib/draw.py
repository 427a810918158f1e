"""``wb.plot``: the picture for a kind of dataset."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from wedgebrake.errors import InputError, nearest
from wedgebrake.figures.matplotlib.given import GivenAxes, given_axes
from wedgebrake.figures.matplotlib.style import PAGE, drawn, inches_wide
from wedgebrake.model.system_base import System
from wedgebrake.model.validation import check_number

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from wedgebrake.analysis.linear_stability import Stability

# The attribute "kind" of a dataset is the name of the function that draws it. These are in modules
# of other names.
_MODULES = {
    "boundary": "maps", "order_map": "maps", "orbits": "orbit_branches",
    "stability_limits": "speed_limits",
}  # fmt: skip
# Smallest and largest width of a figure [inch] for its type size.
_NARROW, _WIDE = 2.5, 40.0
_RESULTS = (
    "wb.simulate(...), wb.stability(machine), wb.poincare(...), wb.spectrum(...),"
    " wb.stopping(...), wb.order_map(...), wb.temperature(...),"
    " wb.bifurcation(...), wb.regime_map(...), wb.basins(...), wb.scatter(...),"
    " wb.branches(...), wb.boundary(...), wb.response_curve(...),"
    " wb.stability_map(...), wb.stability_limits(...), wb.sweep(...) over one or two parameters, or"
    " a machine"
)


def plot(
    dataset: xr.Dataset | Stability | System, *, ax: Any = None, style: Any = None, **options: Any
) -> Figure:
    """The picture of a result: a new figure, without pyplot, or in given axes.

    ======================================  =============================================
    result of                               picture
    ======================================  =============================================
    ``simulate``                            overview: history, phase portrait, Poincare
                                            section, spectrum; for a machine speeds,
                                            sticks, torques and forces, or with inertia="..."
                                            and contact="..." the overview of these
    ``poincare``                            Poincare section
    ``spectrum``                            amplitude spectrum
    ``stopping``                            speed, judder and jerk of a stop
    ``order_map``                           amplitudes over speed and order
    ``temperature``                         temperature rise, heat flow and heat
    ``bifurcation``, ``sweep`` (one axis)   bifurcation diagram; with quantity="response",
                                            amplitudes of speed, torque and jerk
    ``regime_map``, ``sweep`` (two axes)    map of a class or another result
    ``basins``                              basins of attraction
    ``scatter``                             probabilities, Sobol indices, samples by class
    ``fit``                                 measured and fitted columns, residuals
    ``branches``                            branches of periodic orbits, bifurcations
    ``response_curve``                      amplitude and phase over a parameter, by levels
    ``boundary``                            line of a bifurcation over two parameters
    ``stability_map``                       map of linear stability over two parameters; for a
                                            machine also curves over one parameter
    ``stability_limits``                    damping ratios and stability limits over the speed
    ``stability`` of a machine              modes: shape, frequency, damping ratio
    ``Machine``, ``BrakedDriveline``        sketch: bodies, parts, controllers
    ======================================  =============================================

    dataset : xarray.Dataset, the result of ``stability`` for a machine, or a system
    ax      : Matplotlib Axes in which to draw; of a picture with several panels an array or
              sequence of as many, from the upper left, row by row. The caption is left out, so that
              the title is yours. Default: a new figure
    style   : changes of the style, as for ``matplotlib.style.use``: the name of a style, a dict of
              rcParams or a list of these; ``plt.rcParams`` for your current settings. Default: the
              style of wedgebrake; in given axes, your current settings. Colours with a meaning
              do not change, and suit a light background
    options : of the picture, see ``wedgebrake.figures.matplotlib``; for example ``quantity``,
              ``width`` [inch], ``beneath`` (of orbits), ``boundaries`` (of a map)

    A notebook displays the figure if it is the last expression of a cell, or with ``display``.
    ``figure.savefig(path)`` writes it to a file in the format of the suffix (.png, .svg, .pdf).

    Returns the new figure, or that of the given axes.

    Raises ``InputError`` for anything else, an option that the picture does not have, another
    number of axes than of panels, a style that Matplotlib does not know, and as the picture does.
    """
    picture, arguments = _choice(dataset, options)
    allowed = list(inspect.signature(picture).parameters)[len(arguments) :]
    for name in options:
        if name not in allowed:
            raise InputError(
                f"{name}: no option of the picture {picture.__name__!r}."
                f" {nearest(name, [*allowed, 'ax', 'style'])}"
            )
    width = options.get("width", PAGE)
    inches = f"a number of inches, {_NARROW:g} to {_WIDE:g}"
    check_number("width", width, _NARROW, _WIDE, inches)
    axes = given_axes(ax)
    if axes and "width" in options:
        raise InputError("width: that of given axes is their own. Leave out width or ax.")
    if axes and "width" in allowed:
        options["width"] = min(max(inches_wide(axes[0]), _NARROW), _WIDE)
    try:
        with drawn(style, axes):
            figure = picture(*arguments, **options)
        return GivenAxes(axes).root if axes else figure
    except KeyError as error:
        raise InputError(
            f"dataset: lacks {error}, which the picture needs. Give the result of {_RESULTS}, with"
            " all its variables."
        ) from None


def _named(kind: Any) -> Callable[..., Figure] | None:
    """The function that draws the datasets of a kind; None if there is none."""
    module, package = _MODULES.get(kind, kind), "wedgebrake.figures.matplotlib"
    if not str(kind).isidentifier() or find_spec(f"{package}.{module}") is None:
        return None
    return getattr(import_module(f"{package}.{module}"), kind, None)


def _picture(name: str) -> Callable[..., Figure]:
    """The function of a name, ``module.function``; only its module is imported."""
    module, _, function = name.partition(".")
    found: Callable[..., Figure] = getattr(
        import_module(f"wedgebrake.figures.matplotlib.{module}"), function
    )
    return found


def _choice(
    dataset: Any, options: Collection[str]
) -> tuple[Callable[..., Figure], tuple[Any, ...]]:
    """The function that draws a dataset, and its first arguments."""
    from wedgebrake.figures.data.axes import swept_parameters

    if isinstance(dataset, System):
        return _picture("sketch.sketch"), (dataset,)
    names = set(getattr(dataset, "data_vars", {}))
    kind = getattr(dataset, "attrs", {}).get("kind", getattr(type(dataset), "kind", None))
    if named := _named(kind):
        return named, (dataset,)
    swept = swept_parameters(dataset)
    if len(swept) > 2:
        raise InputError(
            f"dataset: is swept over {', '.join(swept)}; there are pictures of sweeps over one or"
            f" two parameters. Choose values of the others, for example"
            f" dataset.isel({swept[-1]}=0)."
        )
    response = "stick_start" in names and "time" in dataset.coords
    if response and ("inertia" not in dataset.dims or {"inertia", "contact"} & set(options)):
        from wedgebrake.analysis.responses.repeat import system_of

        return _picture("motion.overview"), (system_of(dataset), dataset)
    if response:
        return _picture("time_panels.history"), (dataset,)
    from wedgebrake.analysis.linear_stability import Stability
    from wedgebrake.figures.data.class_map import VARIABLES as STABILITY

    stability_map = names.issuperset(STABILITY)
    one_parameter = stability_map and len(dataset["stable"].dims) == 1
    over_period = {"angle", "velocity"} <= names and dataset["angle"].dims == ("period",)
    for belongs, picture in (
        (isinstance(dataset, Stability), "modes.modes"),
        (one_parameter and "growth_rate" in names, "speed_limits.stability_lines"),
        (stability_map, "maps.stability_map"),
        (len(swept) == 1, "bifurcation.bifurcation"),
        (len(swept) == 2 and "attractor" in names, "maps.basins"),
        (len(swept) == 2, "maps.regime_map"),
        ("amplitude" in names and "frequency" in dataset.dims, "motion.spectrum"),
        (over_period, "motion.section"),
    ):
        if belongs:
            return _picture(picture), (dataset,)
    raise InputError.of(
        "dataset", dataset, f"there is no picture of it. Give the result of {_RESULTS}.",
        allowed=f"the result of {_RESULTS}", said=type(dataset).__name__,
    )  # fmt: skip

"""Maps of a sweep over two parameters: the class of motion, or any other result, by colour.

Also what all pictures of sweeps share: classes of points, axes of parameters, cells, caption.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.errors import InputError, nearest
from wedgebrake.measures.classes import MotionClass, StickClass
from wedgebrake.model.groups import SETTERS
from wedgebrake.plots import style
from wedgebrake.sweeps.results import PointStatus

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LOOKS = tuple(style.MOTIONS.values())
_CODES = {key: code for code, key in enumerate(style.MOTIONS)}
# Classes of points without a result, whatever is drawn of the others.
_WITHOUT = ("diverged", "limit", "invalid", "not_computed")

SYNCHRONOUS, DIVERGED = _CODES["period_1"], _CODES["diverged"]
PERIODIC = frozenset(code for key, code in _CODES.items() if key.startswith("period_"))
# Of these, two points may be the same motion or not.
UNSETTLED = frozenset(_CODES[key] for key in ("undecided", "limit", "invalid", "not_computed"))

_BY_MOTION = {
    MotionClass.AT_REST: "at_rest",
    MotionClass.SYNCHRONOUS: "period_1",
    MotionClass.PERIODIC: "period_more",
    MotionClass.QUASI_PERIODIC: "quasi_periodic",
    MotionClass.CHAOTIC: "chaotic",
    MotionClass.DIVERGED: "diverged",
    MotionClass.SELF_LOCKED: "self_locked",
}
_BY_STATUS = {
    PointStatus.EVENT_LIMIT: "limit",
    PointStatus.STEP_LIMIT: "limit",
    PointStatus.INVALID: "invalid",
    PointStatus.NOT_COMPUTED: "not_computed",
}
_UNCLASSED = {
    PointStatus.DIVERGED: "diverged",
    PointStatus.NO_FORWARD_SOLUTION: "self_locked",
}

# Results that have a sign: drawn about zero.
_SIGNED = ("largest_exponent", "second_exponent", "sliding_damping")
# A scale is logarithmic if values are positive and span more than this.
_WIDE = 300.0
# Values beyond these percentiles are drawn in the last colour.
_OUTLIERS = 1.0

# Height of a map [inch].
_HIGHEST = 4.0

# The SI parameters that each group depends on: a sweep over one of them changes the group.
_DEPENDS = {
    "eta": {"slope", "radius", "kinetic", "damping"},
    "f": {"frequency", "stiffness", "inertia"},
    "F0": {"initial_force", "kinetic", "radius", "amplitude"},
    "alpha": {"angle", "kinetic"},
    "loss_factor": {"damping", "stiffness", "inertia"},
    "kinetic": {"kinetic"},
    "static_ratio": {"static", "kinetic"},
    "drive": {"drive_speed", "stiffness", "inertia", "amplitude"},
}
_METHODS = {"exact": "exact solution", "smooth": "adaptive solution", "ode14x": "ODE14x scheme"}


def regime_map(
    dataset: xr.Dataset, quantity: str = "motion", *, width: float = style.COLUMN
) -> Figure:
    """A sweep over two parameters, the first to the right and the second upwards: a new figure.

    dataset  : as ``wb.regime_map`` or ``wb.sweep`` gives it; with a dimension ``branch``,
               one map for each branch
    quantity : "motion" or "stick_class" (a colour for each class), "order",
               "largest_exponent" (blue below zero, red above) or any other result of a
               point, such as "peak_torque", "friction_power", "stick_share"
    width    : of the figure [inch]; a journal's column is 3.5, its page 7.2

    The line is the linear stability limit, where ``sliding_damping`` changes sign. Axes
    are logarithmic where values are spaced so. A picture of fewer pixels than the map has
    cells shows one cell in each pixel, never a mixture of colours.

    Raises ``InputError`` for a dataset that is no sweep over two parameters, or a quantity
    that it does not have.
    """
    names = swept(dataset, 2)
    _check_quantity(dataset, quantity, names)
    with style.use():
        branches = split(dataset)
        beside = len(branches) > 1 and width >= 1.5 * style.COLUMN
        across = len(branches) if beside else 1
        entries = _entries(dataset, quantity)
        words = [str(one.get_label()) for one in entries]
        height = min(0.72 * width / across, _HIGHEST)
        below = style.legend_height(words, width - 0.2)
        rows = [height] * (len(branches) // across) + [below] * (below > 0.0)
        sentences = about(dataset, names)
        above = style.caption_height(sentences, width)
        figure = style.new_figure(width, sum(rows) + above + 0.5)
        grid = figure.add_gridspec(len(rows), across, height_ratios=rows)
        for place, (word, part) in enumerate(branches):
            axes = figure.add_subplot(grid[place // across, place % across])
            _draw_map(axes, part, quantity, dataset)
            if word:
                axes.set_title(direction(dataset, word), fontsize=7.5)
        if entries:
            style.legend_alone(figure.add_subplot(grid[-1, :]), entries, width - 0.2)
        style.caption(figure, sentences)
        return figure


def draw(axes: Axes, dataset: xr.Dataset, quantity: str = "motion") -> None:
    """The same on axes of your own, without legend; a colour bar comes beside them.

    Of a dataset with branches, one: ``dataset.sel(branch="up")``.
    """
    names = swept(dataset, 2)
    _check_quantity(dataset, quantity, names)
    if "branch" in dataset.dims:
        raise InputError(
            "dataset: has branches, but axes hold one map. Choose one with"
            " dataset.sel(branch='up'), or use regime_map for all."
        )
    _draw_map(axes, dataset, quantity, dataset)


def _draw_map(axes: Axes, dataset: xr.Dataset, quantity: str, whole: xr.Dataset) -> None:
    """One branch, in the scale of all of them."""
    x, y = (axis(dataset, name) for name in swept(dataset, 2))
    style.hatching(axes)
    set_axes(axes, x, y)
    found = arranged(classes(dataset), x, y)
    if quantity == "motion":
        draw_classes(axes, x, y, found, LOOKS)
    elif quantity == "stick_class":
        sticks = arranged(stick_classes(dataset), x, y)
        draw_classes(axes, x, y, sticks, tuple(style.STICK_CLASSES.values()))
        _draw_without(axes, x, y, found, found < 0)
    else:
        values = arranged(_values(dataset, quantity), x, y)
        _draw_scale(axes, x, y, values, _values(whole, quantity))
        _draw_without(axes, x, y, found, np.isnan(values))
    _draw_limit(axes, x, y, arranged(dataset["sliding_damping"], x, y))


# What all pictures of sweeps share.


@dataclass(frozen=True)
class Axis:
    """One swept parameter as an axis of a picture.

    values : ascending, (n,)
    order  : places of these values in the dataset, (n,)
    edges  : of the cells about the values, (n + 1,)
    log    : values are spaced evenly in their logarithm
    even   : values are spaced evenly
    """

    name: str
    label: str
    values: np.ndarray
    order: np.ndarray
    edges: np.ndarray
    log: bool
    even: bool

    def places(self, values: np.ndarray) -> np.ndarray:
        """Values as places along the axis: their logarithms if it is logarithmic."""
        return np.log10(values) if self.log else np.asarray(values, dtype=float)


def swept(dataset: xr.Dataset, number: int) -> list[str]:
    """Names of the swept parameters of a dataset, which must be so many.

    Raises ``InputError`` for a dataset that is no sweep, or over another number of them.
    """
    names = axes_of(dataset)
    if not names:
        raise InputError(
            f"dataset = {type(dataset).__name__}: must be the result of wb.sweep(...),"
            " wb.bifurcation(...), wb.regime_map(...) or wb.basins(...)."
        )
    if len(names) != number:
        one = "one parameter" if number == 1 else "two parameters"
        way = f"Choose values of {' or '.join(names)}, for example dataset.isel({names[-1]}=0)."
        other = "plots.regime.regime_map" if number == 1 else "plots.bifurcation.bifurcation"
        if len(names) < 3:
            way = f"Use wedgebrake.{other}, or choose a value with dataset.isel(...)."
        raise InputError(
            f"dataset: is swept over {', '.join(names)}, but this picture needs a sweep over"
            f" {one}. {way}"
        )
    return names


def axes_of(dataset: Any) -> list[str]:
    """Swept parameters of a dataset, those that are still dimensions; [] if it is no sweep."""
    known = getattr(dataset, "data_vars", {})
    if any(name not in known for name in ("motion", "order", "status", "sliding_damping")):
        return []
    names = [str(name) for name in dataset["status"].dims if name != "branch"]
    if all(name in dataset.coords for name in names) and dataset["status"].size:
        return names
    return []


def axis(dataset: xr.Dataset, name: str) -> Axis:
    """The axis of a swept parameter.

    Raises ``InputError`` for values that are no finite numbers.
    """
    coordinate = dataset[name]
    given = coordinate.to_numpy()
    if given.dtype.kind not in "iuf" or not np.all(np.isfinite(given)):
        raise InputError(f"{name}: values of the axis must be finite numbers.")
    order = np.argsort(given, kind="stable")
    values = given[order].astype(float)
    log = bool(values[0] > 0.0 and not evenly(values) and evenly(np.log(values)))
    places = np.log10(values) if log else values
    if values.size > 1:
        middle = 0.5 * (places[1:] + places[:-1])
        edges = np.concatenate(
            ([2.0 * places[0] - middle[0]], middle, [2.0 * places[-1] - middle[-1]])
        )
    else:
        half = 0.05 * abs(places[0]) or 0.5
        edges = np.array([places[0] - half, places[0] + half])
    return Axis(
        name=name,
        label=style.named(
            name,
            str(coordinate.attrs.get("long_name", "")),
            str(coordinate.attrs.get("units", "1")),
        ),
        values=values,
        order=order,
        edges=10.0**edges if log else edges,
        log=log,
        even=not log and evenly(values),
    )


def evenly(values: np.ndarray) -> bool:
    """Whether steps between values are equal, but for rounding."""
    steps = np.diff(values)
    return steps.size == 0 or bool(np.ptp(steps) <= 1e-6 * abs(float(np.mean(steps))))


def set_axes(axes: Axes, x: Axis | None, y: Axis | None) -> None:
    """Labels, scales, limits and ticks of parameters."""
    for one, way in ((x, "x"), (y, "y")):
        if one is None:
            continue
        matplotlib_axis = getattr(axes, f"{way}axis")
        getattr(axes, f"set_{way}label")(one.label)
        if one.log:
            getattr(axes, f"set_{way}scale")("log")
            style.round_ticks(matplotlib_axis, one.edges[0], one.edges[-1])
        elif one.values.size == 1:
            matplotlib_axis.set_ticks(one.values, labels=[f"${style.number(one.values[0])}$"])
        getattr(axes, f"set_{way}lim")(one.edges[0], one.edges[-1])
    if all(one is None or one.log or one.values.size > 1 for one in (x, y)):
        style.few_ticks(axes)


def classes(dataset: xr.Dataset) -> xr.DataArray:
    """The class of each point: its place in ``LOOKS``, over the dimensions of the sweep."""
    motion, order = dataset["motion"], dataset["order"]
    code = motion.copy(data=np.full(motion.shape, _CODES["undecided"], dtype=np.int8))
    status = dataset["status"].transpose(*motion.dims).to_numpy()
    orders = order.transpose(*motion.dims).to_numpy()
    values, motions = code.to_numpy(), motion.to_numpy()
    for one, key in _BY_MOTION.items():
        values[motions == one] = _CODES[key]
    for n in range(1, 5):
        values[(motions == MotionClass.PERIODIC) & (orders == n)] = _CODES[f"period_{n}"]
    for ended, key in _UNCLASSED.items():
        values[(status == ended) & (motions == MotionClass.NONE)] = _CODES[key]
    for ended, key in _BY_STATUS.items():
        values[status == ended] = _CODES[key]
    return code


def stick_classes(dataset: xr.Dataset) -> xr.DataArray:
    """The class of stick-slip of each point: its place in ``style.STICK_CLASSES``."""
    given = dataset["stick_class"]
    keys = list(style.STICK_CLASSES)
    code = given.copy(data=np.full(given.shape, keys.index("none"), dtype=np.int8))
    values, found = code.to_numpy(), given.to_numpy()
    for one in StickClass:
        values[found == one] = keys.index(one.name.lower())
    return code


def draw_cells(axes: Axes, x: Axis, y: Axis, values: np.ndarray, **how: Any) -> Any:
    """Cells of colour over two axes; values (y, x). Gives what a colour bar needs."""
    if not (x.even and y.even):
        # On logarithmic axes too: releases of Matplotlib disagree on what an image is there.
        return axes.pcolormesh(x.edges, y.edges, values, rasterized=True, zorder=1.0, **how)
    extent = (x.edges[0], x.edges[-1], y.edges[0], y.edges[-1])
    limits = axes.get_xlim(), axes.get_ylim()
    image = axes.imshow(
        values,
        origin="lower",
        extent=extent,
        aspect="auto",
        interpolation="nearest",
        zorder=1.0,
        **how,
    )
    axes.set_xlim(limits[0])
    axes.set_ylim(limits[1])
    return image


def draw_classes(
    axes: Axes, x: Axis, y: Axis, codes: np.ndarray, looks: Sequence[style.Look]
) -> None:
    """Cells in the colours of classes; where a code is below 0, nothing."""
    draw_cells(
        axes,
        x,
        y,
        np.ma.masked_less(codes, 0),
        cmap=style.colours(looks),
        vmin=-0.5,
        vmax=len(looks) - 0.5,
    )


def present(codes: np.ndarray, looks: Sequence[style.Look], *, shares: bool) -> list[Any]:
    """Legend entries of the classes that occur, with their shares of all points."""
    counts = np.bincount(codes[codes >= 0].ravel(), minlength=len(looks))
    return [
        style.swatch(look, count / codes.size if shares else None)
        for look, count in zip(looks, counts, strict=True)
        if count
    ]


def split(dataset: xr.Dataset) -> list[tuple[str, xr.Dataset]]:
    """The branches of a dataset with their words; itself, without a word, if it has none."""
    if "branch" not in dataset.dims:
        return [("", dataset)]
    return [
        (str(word), dataset.isel(branch=place))
        for place, word in enumerate(dataset["branch"].to_numpy())
    ]


def direction(dataset: xr.Dataset, branch: str) -> str:
    """Words for a branch: which parameter goes where."""
    followed = _protocol(dataset).get("follow")
    if not (followed and branch):
        return branch
    words = {"up": "increasing", "down": "decreasing"}
    return f"{style.short(str(followed))} {words.get(branch, branch)}"


def about(dataset: xr.Dataset, names: Sequence[str]) -> list[str]:
    """Sentences for the caption: the machine with its groups; method and protocol."""
    fixed = {
        str(name): float(value)
        for name, value in dataset.coords.items()
        if value.ndim == 0 and value.dtype.kind in "iuf" and name != "period"
    }
    return [
        sentence
        for sentence in (_machine(dataset, names, fixed), _how(dataset, names, fixed))
        if sentence
    ]


def _machine(dataset: xr.Dataset, names: Sequence[str], fixed: dict[str, float]) -> str:
    """Brake, friction and the groups that no swept parameter changes."""
    system, groups = _json(dataset, "system"), _json(dataset, "groups")
    kinds = [
        f"{str(system[part]['kind']).replace('-', ' ')} {part}".replace("coulomb", "Coulomb")
        for part in ("brake", "friction")
        if "kind" in system.get(part, {})
    ]
    changed = {SETTERS[name].target if name in SETTERS else name for name in (*names, *fixed)}
    values = {
        name: value
        for name, value in groups.items()
        if value is not None
        and not changed & _DEPENDS.get(name, {name})
        and not (name == "drive" and value == 0.0)
    }
    values |= fixed
    numbers = ", ".join(f"{_equal(name, value)}" for name, value in values.items())
    words = ", ".join(kinds)
    return ": ".join(part for part in (words[:1].upper() + words[1:], numbers) if part)


def _how(dataset: xr.Dataset, names: Sequence[str], fixed: dict[str, float]) -> str:
    """Method and protocol."""
    method, protocol = str(dataset.attrs.get("method", "")), _protocol(dataset)
    parts = [_METHODS.get(method, method)] if method else []
    periods, transient = protocol.get("periods"), protocol.get("transient")
    if periods is not None:
        left_out = "" if transient is None else f", the first {transient} left out"
        if transient == "auto":
            most = protocol.get("limit")
            left_out = " after a transient as long as needed" + (
                f", at most {most}" if most is not None else ""
            )
        parts.append(f"{periods} periods{left_out}")
    initial = protocol.get("initial")
    started = {"initial_angle", "initial_velocity"} & {*names, *fixed}
    if protocol.get("follow"):
        parts.append("each point from the end of its neighbour")
    elif initial is not None and len(np.shape(initial)) == 1 and not started:
        parts.append("from (" + ", ".join(f"{value:g}" for value in initial) + ")")
    return "; ".join(parts)[:1].upper() + "; ".join(parts)[1:]


def _equal(name: str, value: float) -> str:
    """An equation for running text."""
    if name in style.SYMBOLS:
        return f"${style.SYMBOLS[name]} = {style.number(value)}$"
    return f"{name.replace('_', ' ')} = ${style.number(value)}$"


def _protocol(dataset: xr.Dataset) -> dict[str, Any]:
    return _json(dataset, "protocol")


def _json(dataset: xr.Dataset, name: str) -> dict[str, Any]:
    """An attribute that holds a JSON object; {} if it is missing or something else."""
    try:
        found = json.loads(dataset.attrs.get(name, "{}"))
    except (TypeError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


# The map alone.


def _check_quantity(dataset: xr.Dataset, quantity: str, names: list[str]) -> None:
    """Refuse what is no result of each point."""
    allowed = [
        str(name)
        for name, one in dataset.data_vars.items()
        if set(one.dims) - {"branch"} == set(names)
        and (one.dtype.kind == "f" or name in ("motion", "stick_class", "order"))
    ]
    if quantity not in allowed:
        raise InputError(
            f"quantity = {quantity!r}: no such result of each point."
            f" {nearest(str(quantity), allowed)}"
        )


def arranged(values: xr.DataArray, x: Axis, y: Axis) -> np.ndarray:
    """Values as (y, x), both ascending; a copy."""
    plain: np.ndarray = values.transpose(y.name, x.name).to_numpy()[np.ix_(y.order, x.order)]
    return plain


def _values(dataset: xr.Dataset, quantity: str) -> xr.DataArray:
    """A result as numbers, NaN where there is none."""
    values = dataset[quantity].transpose(*dataset["motion"].dims).astype(float)
    without = np.isin(classes(dataset).to_numpy(), [_CODES[key] for key in _WITHOUT])
    if quantity == "order":
        without |= values.to_numpy() <= 0.0
    return values.where(~without)  # keeps name and attributes


def _draw_without(axes: Axes, x: Axis, y: Axis, found: np.ndarray, missing: np.ndarray) -> None:
    """Cells without a result, in the look that says why; ``missing`` ones else as hatching."""
    codes = found.astype(np.int8)
    without = np.isin(found, [_CODES[key] for key in _WITHOUT])
    codes[~without] = -1
    codes[missing & ~without] = _CODES["undecided"]
    if np.any(codes >= 0):
        draw_classes(axes, x, y, codes, LOOKS)


def _draw_scale(axes: Axes, x: Axis, y: Axis, values: np.ndarray, whole: xr.DataArray) -> None:
    """Cells in a scale of colours, with its bar; the scale is that of all the values."""
    everything = whole.to_numpy()
    if not np.any(np.isfinite(everything)):
        style.say(axes, "no values")
        return
    norm, colours = _scale(str(whole.name), everything[np.isfinite(everything)])
    low, high = norm.vmin, norm.vmax
    # Infinite values too get the last colour: just beyond the scale.
    beyond = 0.01 * (high - low)
    shown = np.clip(values, low - beyond if low <= 0.0 else 0.99 * low, high + beyond)
    cells = draw_cells(axes, x, y, np.ma.masked_invalid(shown), cmap=colours, norm=norm)
    cut = bool(np.any(everything < low)), bool(np.any(everything > high))
    bar = axes.figure.colorbar(
        cells,
        ax=axes,
        extend=(("neither", "max"), ("min", "both"))[cut[0]][cut[1]],
        pad=0.02,
        aspect=25,
    )
    attributes = whole.attrs
    bar.set_label(
        style.named(
            str(whole.name),
            str(attributes.get("long_name", "")),
            str(attributes.get("units", "1")),
        )
    )
    bar.outline.set_linewidth(0.5)


def _scale(name: str, finite: np.ndarray) -> tuple[Any, Any]:
    """Normalisation and colours for the finite values of a result."""
    from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize

    least, most = float(np.min(finite)), float(np.max(finite))
    low, high = (float(v) for v in np.percentile(finite, (_OUTLIERS, 100.0 - _OUTLIERS)))
    # Outliers a little beyond are no reason to cut the scale.
    if most - least <= 2.0 * (high - low):
        low, high = least, most
    if name in _SIGNED:
        largest = max(abs(low), abs(high)) or 1.0
        colours = LinearSegmentedColormap.from_list("signs", style.SIGNS)
        return Normalize(-largest, largest), colours
    if low > 0.0 and high > _WIDE * low:
        return LogNorm(low, high), style.SIZES
    return Normalize(low, high if high > low else low + (abs(low) or 1.0)), style.SIZES


def _draw_limit(axes: Axes, x: Axis, y: Axis, damping: np.ndarray) -> None:
    """The line where the damping of sliding changes sign, if it does."""
    from matplotlib.patheffects import Stroke

    finite = damping[np.isfinite(damping)]
    if not (np.any(finite > 0.0) and np.any(finite <= 0.0)):
        return
    # On to the edges of the outer cells, as a contour ends at the last points.
    for one, along in ((y, 0), (x, 1)):
        damping = _to_edges(damping, one, along)
    xs, ys = (np.concatenate((a.edges[:1], a.values, a.edges[-1:])) for a in (x, y))
    lines = axes.contour(
        xs,
        ys,
        np.ma.masked_invalid(damping),
        levels=[0.0],
        colors=[style.LIMIT],
        linewidths=1.1,
        linestyles=[style.DASHES],
        zorder=3.0,
    )
    lines.set_path_effects([Stroke(linewidth=2.4, foreground="white"), Stroke()])


def _to_edges(values: np.ndarray, one: Axis, along: int) -> np.ndarray:
    """Values continued in a straight line from the outer points to the edges."""
    places, edges = one.places(one.values), one.places(one.edges)
    values = np.moveaxis(values, along, 0)
    first, last = values[0], values[-1]
    if places.size > 1:
        share = (edges[0] - places[0]) / (places[1] - places[0])
        first = values[0] + share * (values[1] - values[0])
        share = (edges[-1] - places[-1]) / (places[-1] - places[-2])
        last = values[-1] + share * (values[-1] - values[-2])
    return np.moveaxis(np.concatenate((first[None], values, last[None])), 0, along)


def _entries(dataset: xr.Dataset, quantity: str) -> list[Any]:
    """The legend: classes, points without a result, the linear limit."""
    found = classes(dataset).to_numpy()
    if quantity == "motion":
        entries = present(found, LOOKS, shares=True)
    else:
        codes = np.where(np.isin(found, [_CODES[key] for key in _WITHOUT]), found, -1)
        entries = []
        if quantity == "stick_class":
            looks = tuple(style.STICK_CLASSES.values())
            sticks = stick_classes(dataset).transpose(*dataset["motion"].dims).to_numpy()
            entries = present(np.where(codes < 0, sticks, -1), looks, shares=True)
        else:
            none = np.isnan(_values(dataset, quantity).to_numpy()) & (codes < 0)
            if np.any(none):
                entries = [style.swatch(style.NO_VALUE, float(np.mean(none)))]
        entries += present(codes, LOOKS, shares=True)
    damping = dataset["sliding_damping"].to_numpy()
    if np.any(damping > 0.0) and np.any(damping <= 0.0):
        entries.append(style.limit_entry())
    return entries

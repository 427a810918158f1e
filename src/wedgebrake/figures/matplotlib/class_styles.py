"""Looks of classes: of motion, of stick-slip, of points without a result, of attractors.

A class is drawn and named in a legend by its look: a colour, opaque or over hatching, and
words. Arrays hold classes as places in ``MOTION_LOOKS`` or ``STICK_LOOKS``. Orbits have colours
by their period, bifurcations symbols and lines by their kind.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.dynamics.enums import MotionClass, StickClass
from wedgebrake.figures.matplotlib import style
from wedgebrake.sweeps.results import PointStatus

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Look:
    """How one class is drawn: its words in the legend, and its colour.

    opacity : of the colour over the hatching that lies behind all cells; 0 is hatching alone
    """

    word: str
    colour: str
    opacity: float = 1.0


# Classes of motion, in the order of legends. Each differs from all others in the eyes of
# people with protanopia, deuteranopia and tritanopia too, by lightness where not by hue.
MOTIONS: dict[str, Look] = {
    "at_rest": Look("at rest", style.PALE_GREY),
    "period_1": Look("synchronous ($T$)", style.PALE_BLUE),
    "period_2": Look("$2T$", style.BLUE),
    "period_3": Look("$3T$", style.GREEN),
    "period_4": Look("$4T$", style.NAVY),
    "period_more": Look("$nT$, $n>4$", style.PURPLE),
    "quasi_periodic": Look("quasi-periodic", style.YELLOW),
    "chaotic": Look("chaotic", style.VERMILLION),
    "self_locked": Look("self-locked", style.DARK_GREY),
    "diverged": Look("diverged", style.BLACK),
    "undecided": Look("undecided", "#FFFFFF", 0.0),
    "limit": Look("stopped at a limit", style.BLACK, 0.15),
    "invalid": Look("invalid system", style.BLACK, 0.4),
    "not_computed": Look("not computed", "#FFFFFF"),
}
# Classes of stick-slip: the more sticks, the deeper; colours that no motion has.
STICK_CLASSES: dict[str, Look] = {
    "at_rest": Look("at rest", style.PALE_GREY),
    "non_stick_slip": Look("non-stick-slip", "#FFE3A8"),
    "unidirectional": Look("unidirectional", style.ORANGE),
    "bidirectional": Look("bidirectional", "#6B3000"),
    "none": Look("no class", "#FFFFFF", 0.0),
}
NO_VALUE = Look("no value", "#FFFFFF", 0.0)
DIFFER = Look("branches differ", "#FBF3B4")
EMPTY = Look("no points", "#EDEDED")
# Attractors, the largest share first. From the ninth on colours were chosen by computer, far
# from all others in all four kinds of sight; each attractor also has its number.
ATTRACTORS = (
    style.PALE_BLUE, style.VERMILLION, style.YELLOW, style.BLUE,
    style.GREEN, style.PURPLE, style.NAVY, style.ORANGE,
    "#6A320D", "#6AFF8F", "#8F6AFF", "#8FA257", "#571F6A", "#3232C7",
    "#B4FFC7", "#A25745", "#B47DEC", "#7D0D32", "#DAB457", "#FF7D8F",
)  # fmt: skip
OTHERS = "#D0D0D0"

# Orbits by their periods, as lines on white and grey: found like the colours of attractors.
ORBITS = {
    1: Look("$T$", style.BLUE),
    2: Look("$2T$", style.VERMILLION),
    3: Look("$3T$", style.GREEN),
    4: Look("$4T$", "#9900EE"),
    5: Look("$5T$", "#662200"),
    6: Look("$6T$", "#EE44FF"),
    8: Look("$8T$", "#440055"),
}
OTHER_ORBITS = Look("$nT$", style.DARK_GREY)


@dataclass(frozen=True)
class Mark:
    """How one kind of bifurcation is drawn: a symbol with letters, and in a plane a line.

    friction : of friction, with no multiplier at -1 or 1: a hollow symbol, a light line
    dashes   : of the line
    """

    letters: str
    symbol: str
    dashes: Any = "-"
    friction: bool = False


# Kinds of bifurcation, in the order of legends and of labels where there is no room for all.
# Patterns are no longer than a line in a legend.
_DOTS, _DASHES, _DASH_DOT, _DASH_DOT_DOT = (
    (0, pattern)
    for pattern in ((1.0, 1.1), (2.6, 1.4), (4.0, 1.2, 1.0, 1.2), (3.0, 1.0, 1.0, 1.0, 1.0, 1.0))
)
BIFURCATIONS = {
    "fold": Mark("LP", "s"),
    "period doubling": Mark("PD", "D", _DOTS),
    "Neimark-Sacker": Mark("NS", "*", _DASH_DOT),
    "symmetry breaking": Mark("SB", "P", _DASHES),
    "branch point": Mark("BP", "X", _DASH_DOT_DOT),
    "grazing-sliding": Mark("GS", "o", friction=True),
    "crossing-sliding": Mark("CS", "^", _DOTS, friction=True),
    "switching-sliding": Mark("SS", "v", _DASH_DOT, friction=True),
    "adding-sliding": Mark("AS", "p", _DASHES, friction=True),
    "grazing": Mark("G", "h", _DASH_DOT_DOT, friction=True),
}

_HATCH = "#8C8C8C"
_HATCHES = "/////////"

MOTION_LOOKS, STICK_LOOKS = tuple(MOTIONS.values()), tuple(STICK_CLASSES.values())
_CODES = {key: code for code, key in enumerate(MOTIONS)}
SYNCHRONOUS, DIVERGED, UNDECIDED = (_CODES[key] for key in ("period_1", "diverged", "undecided"))
PERIODIC = frozenset(code for key, code in _CODES.items() if key.startswith("period_"))
# Of these, two points may be the same motion or not.
UNSETTLED = frozenset(_CODES[key] for key in ("undecided", "limit", "invalid", "not_computed"))
# Points without a result, whatever is drawn of the others.
_WITHOUT = [_CODES[key] for key in ("diverged", "limit", "invalid", "not_computed")]

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


def classes(dataset: xr.Dataset) -> xr.DataArray:
    """The class of each point: its place in ``MOTION_LOOKS``, over the sweep's dimensions."""
    motion, order = dataset["motion"], dataset["order"]
    code = motion.copy(data=np.full(motion.shape, UNDECIDED, dtype=np.int8))
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
    """The class of stick-slip of each point: its place in ``STICK_LOOKS``."""
    given = dataset["stick_class"]
    keys = list(STICK_CLASSES)
    code = given.copy(data=np.full(given.shape, keys.index("none"), dtype=np.int8))
    values, found = code.to_numpy(), given.to_numpy()
    for one in StickClass:
        values[found == one] = keys.index(one.name.lower())
    return code


def without(codes: np.ndarray) -> np.ndarray:
    """Which points have no result, by their classes of motion."""
    found: np.ndarray = np.isin(codes, _WITHOUT)
    return found


def period(order: int) -> str:
    """A periodic motion by its period: T, 2T, 3T."""
    return f"${order}T$" if order > 1 else "$T$"


def orbit(order: int) -> Look:
    """The look of orbits of so many periods of the torque."""
    return ORBITS.get(order, OTHER_ORBITS)


def colours(looks: Sequence[Look]) -> Any:
    """A colour map with one colour for each class, opacity included."""
    from matplotlib.colors import ListedColormap, to_rgba

    return ListedColormap([to_rgba(look.colour, look.opacity) for look in looks])


def blended(look: Look, behind: str = "white") -> tuple[float, float, float]:
    """The colour of a class over another one, as it is seen."""
    from matplotlib.colors import to_rgb

    pairs = zip(to_rgb(look.colour), to_rgb(behind), strict=True)
    red, green, blue = (look.opacity * one + (1.0 - look.opacity) * other for one, other in pairs)
    return red, green, blue


def hatching(axes: Axes) -> None:
    """Hatching over all of the axes, behind everything: seen where cells let it through."""
    from matplotlib.patches import Rectangle

    axes.add_patch(
        Rectangle(
            (0.0, 0.0),
            1.0,
            1.0,
            transform=axes.transAxes,
            facecolor="white",
            edgecolor=_HATCH,
            hatch=_HATCHES,
            linewidth=0.0,
            zorder=0.1,
        )
    )


def swatch(look: Look, share: float | None = None) -> Any:
    """The entry of a class in a legend, with its share of all points if given."""
    from matplotlib.patches import Patch

    return Patch(
        facecolor=blended(look),
        edgecolor=blended(look, _HATCH) if look.opacity < 1.0 else "#808080",
        hatch=_HATCHES if look.opacity < 1.0 else None,
        linewidth=0.3,
        label=look.word if share is None else f"{look.word}, {style.percent(share)}",
    )


def present(codes: np.ndarray, looks: Sequence[Look], *, shares: bool) -> list[Any]:
    """Legend entries of the classes that occur, with their shares of all points.

    Codes below 0 count as points, but have no entry.
    """
    counts = np.bincount(codes[codes >= 0].ravel(), minlength=len(looks))
    return [
        swatch(look, count / codes.size if shares else None)
        for look, count in zip(looks, counts, strict=True)
        if count
    ]


def limit_entry() -> Any:
    """The entry of the linear stability limit in a legend."""
    from matplotlib.lines import Line2D

    return Line2D(
        [],
        [],
        color=style.LIMIT,
        linewidth=1.1,
        linestyle=style.DASHES,
        label="linear stability limit",
    )

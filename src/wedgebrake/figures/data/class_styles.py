"""Colours, lines, symbols and words of classes, attractors, orbits and bifurcations; legends.

Arrays hold a class as its position in ``MOTIONS`` or ``STICK_CLASSES``, its code. The pictures,
their legends and the page all use the styles of this file.
"""

from __future__ import annotations

import colorsys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.enums import MotionClass, StickClass
from wedgebrake.figures import style
from wedgebrake.sweeps.results import PointStatus

if TYPE_CHECKING:
    import xarray as xr

Colour = tuple[float, float, float]
"""Red, green and blue, from 0 to 1."""

HATCH = "#8C8C8C"
"""Colour of the hatching behind cells that are not opaque."""
# Largest relative luminance of points on white.
_LIGHTEST = 0.42


@dataclass(frozen=True)
class ClassStyle:
    """Appearance of one class.

    word    : for legends, with formulas as mathtext
    colour  : #RRGGBB
    opacity : of the colour over the hatching behind all cells; 0 is hatching only
    symbol  : of a point, as in Matplotlib; hollow where the colour is not opaque
    """

    word: str
    colour: str
    opacity: float = 1.0
    symbol: str = "o"

    @property
    def plain(self) -> str:
        """The word as plain text."""
        return style.plain(self.word)

    @property
    def rgba(self) -> str:
        """The colour with its opacity, #RRGGBBAA."""
        return f"{self.colour}{round(255 * self.opacity):02X}"

    def over(self, background: str = "#FFFFFF") -> Colour:
        """The colour as it appears over another one."""
        pairs = zip(style.rgb(self.colour), style.rgb(background), strict=True)
        red, green, blue = (self.opacity * a + (1.0 - self.opacity) * b for a, b in pairs)
        return red, green, blue

    @property
    def css(self) -> str:
        """The colour, with hatching where it is not opaque, as a CSS background."""
        if self.opacity == 1.0:
            return self.colour
        lines, ground = _hexadecimal(self.over(HATCH)), _hexadecimal(self.over())
        return f"repeating-linear-gradient(135deg, {lines} 0 1px, {ground} 1px 4px)"

    def marker(self, size: float) -> MarkerStyle:
        """A point of a size [pt] on white."""
        if self.opacity == 1.0:
            return MarkerStyle(self.symbol, size, self.on_white, self.on_white, 0.0)
        return MarkerStyle(self.symbol, 1.4 * size, "white", style.DARK_GREY, 0.6)

    @property
    def on_white(self) -> str:
        """The colour for points on white: darker where it would be too light."""
        colour = self.over(HATCH)
        hue, lightness, saturation = colorsys.rgb_to_hls(*colour)
        while style.luminance(colour) > _LIGHTEST:
            lightness *= 0.97
            colour = colorsys.hls_to_rgb(hue, lightness, saturation)
        return _hexadecimal(colour)


@dataclass(frozen=True)
class LineStyle:
    """Appearance of a line.

    width  : [pt]
    dashes : as Matplotlib's line styles
    casing : colour on both sides of the line, which makes it visible on any background
    """

    colour: str
    width: float = 1.0
    dashes: Any = "-"
    casing: str = ""


@dataclass(frozen=True)
class MarkerStyle:
    """Appearance of a point: symbol of Matplotlib, colours, and sizes [pt]."""

    symbol: str
    size: float
    face: str
    edge: str
    edge_width: float


@dataclass(frozen=True)
class LegendEntry:
    """Entry of a legend: a colour, line or symbol and its label, which may contain mathtext."""

    label: str
    style: ClassStyle | LineStyle | MarkerStyle

    @property
    def css(self) -> tuple[str, str]:
        """CSS background and plain words of the entry on a page."""
        words = style.plain(self.label)
        if isinstance(self.style, ClassStyle):
            return self.style.css, words
        if isinstance(self.style, MarkerStyle):
            face, edge = self.style.face, self.style.edge
            return f"radial-gradient({face} 2px, {edge} 2px 3px, transparent 3px)", words
        colour, half = self.style.colour, 5 if self.style.width < _BROAD else 40
        if self.style.dashes != "-":
            dashes = f"repeating-linear-gradient(90deg, {colour} 0 4px, transparent 4px 6px)"
            return f"{dashes} center / 100% 2px no-repeat", words
        edges = f"{50 - half}%", f"{50 + half}%"
        line = f"transparent {edges[0]}, {colour} {edges[0]} {edges[1]}, transparent {edges[1]}"
        return f"linear-gradient({line})", words


# Width from which a line is a band in the legends of the page [pt].
_BROAD = 4.0
# Sizes of the symbols of bifurcations [pt]; those with thin arms are larger by a factor.
_SIZE, _LARGER, _THIN = 4.0, 1.5, "*PX"


@dataclass(frozen=True)
class BifurcationStyle:
    """Appearance of one kind of bifurcation: a symbol with letters; a line over two parameters.

    friction : a bifurcation of friction, without a multiplier at -1 or 1: hollow symbol, light
               line
    dashes   : of the line
    """

    letters: str
    symbol: str
    dashes: Any = "-"
    friction: bool = False

    def marker(self, size: float = _SIZE) -> MarkerStyle:
        """The symbol at a point."""
        size *= _LARGER if self.symbol in _THIN else 1.0
        if self.friction:
            return MarkerStyle(self.symbol, size, "white", "black", 0.7)
        return MarkerStyle(self.symbol, size, "black", "white", 0.35)

    @property
    def line(self) -> LineStyle:
        """The line over two parameters."""
        inner, outer = ("white", "black") if self.friction else ("black", "white")
        return LineStyle(inner, 1.0, self.dashes, outer)


# Colours of the classes of motion, in the order of legends. Also with protanopia, deuteranopia and
# tritanopia each one differs from all others, in hue or in lightness.
_MOTION_COLOURS = {
    MotionClass.AT_REST: style.PALE_GREY,
    MotionClass.STEADY_SLIDING: "#7FE0A8",
    MotionClass.LIMIT_CYCLE: "#7A2A0A",
    MotionClass.FREE_VIBRATION: "#8800DD",
    MotionClass.STEADY_ROTATION: "#A578FF",
    MotionClass.SYNCHRONOUS: style.PALE_BLUE,
    MotionClass.PERIODIC: style.PURPLE,
    MotionClass.QUASI_PERIODIC: style.YELLOW,
    MotionClass.CHAOTIC: style.VERMILLION,
    MotionClass.SELF_LOCKED: style.DARK_GREY,
    MotionClass.DIVERGED: style.BLACK,
    MotionClass.UNDECIDED: "#FFFFFF",
}


def _motion_styles() -> dict[str, ClassStyle]:
    """Styles of the classes of motion; periodic motions are divided by their number of periods."""
    styles: dict[str, ClassStyle] = {}
    for one, colour in _MOTION_COLOURS.items():
        if one == MotionClass.SYNCHRONOUS:
            styles["period_1"] = ClassStyle(f"{one.word} ($T$)", colour)
        elif one == MotionClass.UNDECIDED:
            styles["undecided"] = ClassStyle(one.word, colour, 0.0, "x")
        elif one == MotionClass.PERIODIC:
            for n, shade in enumerate((style.BLUE, style.GREEN, style.NAVY), start=2):
                styles[f"period_{n}"] = ClassStyle(f"${n}T$", shade)
            styles["period_more"] = ClassStyle("$nT$, $n>4$", colour)
        else:
            styles[one.name.lower()] = ClassStyle(one.word, colour)
    return styles


# Classes of motion, and points that have none.
MOTION_STYLES: dict[str, ClassStyle] = {
    **_motion_styles(),
    "limit": ClassStyle("stopped at a limit", style.BLACK, 0.15, "s"),
    "invalid": ClassStyle("invalid system", style.BLACK, 0.4, "^"),
    "not_computed": ClassStyle("not computed", "#FFFFFF"),
}
# Classes of stick-slip: the more sticks, the deeper; colours that no motion has.
STICK_STYLES: dict[str, ClassStyle] = {
    "at_rest": ClassStyle("at rest", style.PALE_GREY),
    "non_stick_slip": ClassStyle("non-stick-slip", "#FFE3A8"),
    "unidirectional": ClassStyle("unidirectional", style.ORANGE),
    "bidirectional": ClassStyle("bidirectional", "#6B3000"),
    "none": ClassStyle("no class", "#FFFFFF", 0.0),
}
MOTIONS, STICK_CLASSES = tuple(MOTION_STYLES.values()), tuple(STICK_STYLES.values())
"""The styles of all codes."""
UNDECIDED = MOTION_STYLES["undecided"]
NO_VALUE = ClassStyle("no value", "#FFFFFF", 0.0)
DIFFER = ClassStyle("branches differ", "#FBF3B4")
EMPTY = ClassStyle("no points", "#EDEDED")
# Attractors, the largest share first. From the ninth on colours were chosen by computer, far
# from all others for all four kinds of colour vision; each attractor also has its number.
ATTRACTOR_COLOURS = (
    style.PALE_BLUE, style.VERMILLION, style.YELLOW, style.BLUE,
    style.GREEN, style.PURPLE, style.NAVY, style.ORANGE,
    "#6A320D", "#6AFF8F", "#8F6AFF", "#8FA257", "#571F6A", "#3232C7",
    "#B4FFC7", "#A25745", "#B47DEC", "#7D0D32", "#DAB457", "#FF7D8F",
)  # fmt: skip
OTHER_ATTRACTORS = "#D0D0D0"
# Orbits by their periods, as lines on white and grey: found like the colours of attractors.
ORBIT_COLOURS = {
    1: style.BLUE, 2: style.VERMILLION, 3: style.GREEN, 4: "#9900EE", 5: "#662200", 6: "#EE44FF",
    8: "#440055",
}  # fmt: skip

# Kinds of bifurcation, in the order of legends and in the order of priority of labels.
# Patterns are no longer than a line in a legend.
_DOTS, _DASHES, _DASH_DOT, _DASH_DOT_DOT = (
    (0, pattern)
    for pattern in ((1.0, 1.1), (2.6, 1.4), (4.0, 1.2, 1.0, 1.2), (3.0, 1.0, 1.0, 1.0, 1.0, 1.0))
)
BIFURCATIONS = {
    "fold": BifurcationStyle("LP", "s"),
    "period doubling": BifurcationStyle("PD", "D", _DOTS),
    "Neimark-Sacker": BifurcationStyle("NS", "*", _DASH_DOT),
    "symmetry breaking": BifurcationStyle("SB", "P", _DASHES),
    "branch point": BifurcationStyle("BP", "X", _DASH_DOT_DOT),
    "Hopf": BifurcationStyle("H", "d", _DASHES),
    "grazing-sliding": BifurcationStyle("GS", "o", friction=True),
    "crossing-sliding": BifurcationStyle("CS", "^", _DOTS, friction=True),
    "switching-sliding": BifurcationStyle("SS", "v", _DASH_DOT, friction=True),
    "adding-sliding": BifurcationStyle("AS", "p", _DASHES, friction=True),
    "grazing": BifurcationStyle("G", "h", _DASH_DOT_DOT, friction=True),
}
STABILITY_LIMIT = LineStyle(style.LIMIT, 1.1, style.DASHES, "white")
LIMIT_ENTRY = LegendEntry("linear stability limit", STABILITY_LIMIT)

CODES = {key: code for code, key in enumerate(MOTION_STYLES)}
"""Codes of motion by name."""
PERIODIC = frozenset(code for key, code in CODES.items() if key.startswith("period_"))
# Classes of points whose motions cannot be compared.
UNSETTLED = frozenset(CODES[key] for key in ("undecided", "limit", "invalid", "not_computed"))
_WITHOUT_RESULT = [CODES[key] for key in ("diverged", "limit", "invalid", "not_computed")]

# Codes by class of motion, as far as their names differ; by status; by status without a class.
_RENAMED = {"none": "undecided", "synchronous": "period_1", "periodic": "period_more"}
_BY_STATUS = {
    PointStatus.EVENT_LIMIT: "limit",
    PointStatus.STEP_LIMIT: "limit",
    PointStatus.INVALID: "invalid",
    PointStatus.NOT_COMPUTED: "not_computed",
}
_UNCLASSED = {PointStatus.DIVERGED: "diverged", PointStatus.NO_FORWARD_SOLUTION: "self_locked"}


def class_entry(one: ClassStyle, share: float | None = None) -> LegendEntry:
    """The entry of a class, with its share of all points if given."""
    return LegendEntry(one.word if share is None else f"{one.word}, {style.percent(share)}", one)


def class_entries(
    codes: NDArray[Any], styles: Sequence[ClassStyle], *, shares: bool, size: float | None = None
) -> list[LegendEntry]:
    """Entries of the classes that occur, with their shares of all points.

    Codes below 0 count as points, but have no entry.

    size : of the points that stand for the classes [pt]; None: areas
    """
    counts = np.bincount(codes[codes >= 0].ravel(), minlength=len(styles))
    found = [
        (one, class_entry(one, count / codes.size if shares else None))
        for one, count in zip(styles, counts, strict=True)
        if count
    ]
    if size is None:
        return [entry for _, entry in found]
    return [replace(entry, style=one.marker(size)) for one, entry in found]


def motion_codes(dataset: xr.Dataset) -> xr.DataArray:
    """The code of the motion of each point, over the sweep's dimensions."""
    motion, order = dataset["motion"], dataset["order"]
    code = motion.copy(data=np.full(motion.shape, CODES["undecided"], dtype=np.int8))
    status = dataset["status"].transpose(*motion.dims).to_numpy()
    orders = order.transpose(*motion.dims).to_numpy()
    values, motions = code.to_numpy(), motion.to_numpy()
    for one in MotionClass:
        name = one.name.lower()
        values[motions == one] = CODES[_RENAMED.get(name, name)]
    for n in range(1, 5):
        values[(motions == MotionClass.PERIODIC) & (orders == n)] = CODES[f"period_{n}"]
    for ended, key in _UNCLASSED.items():
        values[(status == ended) & (motions == MotionClass.NONE)] = CODES[key]
    for ended, key in _BY_STATUS.items():
        values[status == ended] = CODES[key]
    return code


def stick_codes(dataset: xr.Dataset) -> xr.DataArray:
    """The code of the stick-slip class of each point."""
    given = dataset["stick_class"]
    keys = list(STICK_STYLES)
    code = given.copy(data=np.full(given.shape, keys.index("none"), dtype=np.int8))
    values, found = code.to_numpy(), given.to_numpy()
    for one in StickClass:
        values[found == one] = keys.index(one.name.lower())
    return code


def without_result(codes: np.ndarray) -> np.ndarray:
    """Mask of the points without a result, from their codes of motion."""
    found: np.ndarray = np.isin(codes, _WITHOUT_RESULT)
    return found


def period(order: int) -> str:
    """A periodic motion by its period: T, 2T, 3T."""
    return f"${order}T$" if order > 1 else "$T$"


def motion_label(motion: int, order: int) -> str:
    """A class of motion in words; a periodic motion by its period."""
    if motion == MotionClass.SYNCHRONOUS:
        return MOTION_STYLES["period_1"].word
    if motion == MotionClass.PERIODIC and order > 0:
        return period(order)
    return MotionClass(motion).word if motion in set(MotionClass) else "?"


def orbit_colour(order: int) -> str:
    """The colour of orbits that repeat after ``order`` periods of the torque."""
    return ORBIT_COLOURS.get(order, style.DARK_GREY)


def _hexadecimal(colour: Colour) -> str:
    return "#" + "".join(f"{round(255 * one):02X}" for one in colour)

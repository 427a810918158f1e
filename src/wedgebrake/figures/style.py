"""Colours, symbols, sizes and number formats common to all pictures and renderers."""

from __future__ import annotations

import math
import re
from typing import Any

# Okabe and Ito's palette, distinguishable with colour blindness (jfly.uni-koeln.de/color, 2002).
BLACK = "#000000"
ORANGE = "#E69F00"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
VERMILLION = "#D55E00"
PURPLE = "#CC79A7"
GREY = "#767676"

# Meanings of the colours.
MOTION = BLUE
SWITCHING = BLACK
RELEASE = GREEN
FORCING = VERMILLION
NATURAL = GREEN
TORQUE = "#8A8A8A"
# Sticks, by the sign of the sliding velocity before: colour and label.
STICKS = {
    1: (VERMILLION, "stick from $v>0$"),
    -1: (PURPLE, "stick from $v<0$"),
    0: (GREY, "rest from the start"),
}

# Parts of a machine: contacts, whose sticks are shaded, and inertias or shafts.
CONTACTS = (ORANGE, GREEN, PURPLE, "#B8A800", "#8C510A", GREY)
PARTS = (BLUE, VERMILLION, BLACK, "#56B4E9", "#8A8A8A", "#1A0F7A")

# Two more shades of blue, so that T, 2T and 4T become darker in this order; and greys.
PALE_BLUE = "#9FC0FF"
NAVY = "#1A0F7A"
PALE_GREY = "#D4D4D4"
DARK_GREY = "#565656"

# Colour scales: many points (a single one stays visible on white), sizes, signs.
DENSITY = ("#8AB4E0", "#3F83C4", "#184C86", "#04142E")
DENSITY_DOWN = ("#F0AC7C", "#D8661E", "#8F3A08", "#2E1003")
DENSITY_BENEATH = ("#C8C8C8", "#BEBEBE", "#B3B3B3", "#A8A8A8")
SIGNS = ("#0A2A52", BLUE, "#F7F7F7", VERMILLION, "#571C00")
SIZES = "viridis"

# The linear stability limit.
LIMIT = BLACK
DASHES: Any = (0, (4.0, 1.5))
# Unstable orbits.
UNSTABLE: Any = (0, (3.2, 1.6))

# Labels of the state's axes: in time, and at the points of a section.
STATE = {"angle": r"angle $\theta$  [rad]", "velocity": r"velocity $\dot\theta$  [rad/s]"}
SECTION = {"angle": r"angle $\theta_n$  [rad]", "velocity": r"velocity $\dot\theta_n$  [rad/s]"}
# Labels of quantities whose long name in a dataset is a formula.
MEANINGS = {
    "eta": "slope of the actuation force",
    "f": "forcing frequency",
    "F0": "initial actuation force",
    "alpha": "relative wedge angle",
    "peak_torque": "brake torque",
    "return_distance": "return distance",
}
# Symbols in mathtext, by the name of a parameter, group or result in a dataset.
SYMBOLS = {
    "eta": r"\eta",
    "f": "f",
    "F0": "F_0",
    "alpha": r"\alpha",
    "loss_factor": r"c/\sqrt{kJ}",
    "static_ratio": r"\mu_s/\mu_k",
    "drive": r"\Omega\sqrt{kJ}/T_e",
    "inertia": "J",
    "damping": "c",
    "stiffness": "k",
    "drive_speed": r"\Omega",
    "radius": "R",
    "brake_angle": r"\alpha_w",
    "wrap_angle": r"\beta",
    "actuation_arm": "a",
    "normal_arm": "b",
    "friction_arm": "d",
    "kinetic": r"\mu_k",
    "static": r"\mu_s",
    "decay": r"\varsigma",
    "steepness": r"\xi",
    "width": "v_0",
    "speed": "v_0",
    "tolerance": r"\varepsilon",
    "initial_force": "F_{a0}",
    "slope": r"\delta",
    "amplitude": "T_e",
    "frequency": "f_e",
    "initial_angle": r"\theta(0)",
    "initial_velocity": r"\dot\theta(0)",
    "angle": r"\theta",
    "velocity": r"\dot\theta",
    "brake_torque": r"RF_\mu",
    "drive_torque": "T",
    "largest_exponent": r"\lambda_1",
    "second_exponent": r"\lambda_2",
    "peak_torque": r"\max\,|RF_\mu|",
}

# Widths of a journal's single and double column, 89 and 183 mm, in inches.
COLUMN = 3.5
PAGE = 7.2

# Sizes of type [pt].
LABELS = 7.5
TICKS = 7.0
SMALL = 6.5

# Lines and points beyond this number are drawn as pixels inside vector files.
RASTER_FROM = 20_000
# Most points of a curve over an axis, two in each column of pixels.
MOST_ACROSS = 4000


_LOWERED = str.maketrans("0123456789aehklmnoprstuvx", "₀₁₂₃₄₅₆₇₈₉ₐₑₕₖₗₘₙₒₚᵣₛₜᵤᵥₓ")
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def plain(words: str) -> str:
    """Words with mathtext as plain text."""
    return re.sub(r"_(\w)", lambda found: found[1].translate(_LOWERED), words.replace("$", ""))


def rgb(colour: str) -> tuple[float, float, float]:
    """Red, green and blue, from 0 to 1, of a colour #RRGGBB."""
    red, green, blue = (int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    return red, green, blue


def luminance(colour: tuple[float, float, float]) -> float:
    """Relative luminance of red, green and blue, as in WCAG 2."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in colour]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def text_colour(colour: str) -> str:
    """Black or white, whichever is easier to read on a colour #RRGGBB."""
    return "black" if luminance(rgb(colour)) > 0.18 else "white"


def axis_label(name: str, meaning: str, unit: str) -> str:
    """Label of an axis: meaning, symbol if there is a usual one, unit.

    A long meaning is cut before its first comma, semicolon or bracket. The part of a dotted name
    comes first: "belt: speed of the base".
    """
    part, dot, _ = name.rpartition(".")
    words = re.split(r"[,;]| \(", meaning)[0].strip()
    if not words or re.search(r"[_/=`]", words):
        words = MEANINGS.get(name, words or name.replace("_", " "))
    symbol = SYMBOLS.get(name)
    unit = unit.replace("^2", "²").replace("^3", "³")
    words = f"{part}: {words}" if dot else words
    return words + (f" ${symbol}$" if symbol else "") + f"  [{unit or '1'}]"


def symbol(name: str) -> str:
    """Symbol of a parameter for running text, or its name."""
    if name in SYMBOLS:
        return f"${SYMBOLS[name]}$"
    return name if "." in name else name.replace("_", " ")


def percent(share: float) -> str:
    """Format a share in percent; only exact 0 and 1 give 0 and 100."""
    if 0.0 < share < 0.001:
        return "<0.1 %"
    if 0.995 <= share < 1.0:
        return f"{math.floor(1000.0 * share) / 10.0:.1f} %"
    return f"{100.0 * share:.1f} %" if share < 0.1 else f"{100.0 * share:.0f} %"


def number(value: float, digits: int = 4) -> str:
    """Format a number for text in figures and on the page: −24, 0.036, 2·10⁷."""
    text = f"{value:.{digits}g}"
    if "e" in text and 1.0 <= abs(value) < 1e6:
        text = f"{float(text):.0f}"
    elif "e" in text:
        mantissa, power = text.split("e")
        text = f"{mantissa}·10{str(int(power)).translate(_RAISED)}".removeprefix("1·")
    return minus_signs(text)


def signed(value: float, digits: int = 4) -> str:
    """Format a number, with a plus sign if it is positive."""
    return ("+" if value > 0.0 else "") + number(value, digits)


def minus_signs(words: str) -> str:
    """Text with minus signs instead of hyphens before numbers; 2-3 and 1e-3 are unchanged."""
    return re.sub(r"(?<![\w.)])-(?=\d)", "−", words)


def time_text(time: float, span: float) -> str:
    """Format a time [s] with enough digits for a span of times [s]."""
    digits = 4
    if 0.0 < span < abs(time):
        digits += math.ceil(math.log10(abs(time) / span))
    return f"{time:.{min(digits, 17)}g}"


def margins(low: float, high: float, least: float, share: float = 0.06) -> tuple[float, float]:
    """Limits about low..high with a margin, never narrower than ``least``.

    Otherwise the scatter of rounding would fill the picture of a constant motion.
    """
    middle = 0.5 * (low + high)
    half = max(0.5 * (high - low) * (1.0 + 2.0 * share), 0.5 * least)
    if half == 0.0:
        half = 1.0
    return middle - half, middle + half

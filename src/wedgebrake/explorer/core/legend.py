"""Classes of motion and attractors as entries of a legend: a background and words."""

from __future__ import annotations

import colorsys
from collections.abc import Sequence

import numpy as np

from wedgebrake.figures.matplotlib.class_styles import MOTION_LOOKS, Look, blended
from wedgebrake.figures.matplotlib.style import percent

Chip = tuple[str, str]
"""CSS background, words."""

HATCH = "#8C8C8C"
LINE = "linear-gradient(transparent 42%, #1B2430 42% 58%, transparent 58%)"
THIN_LINE = "linear-gradient(transparent 46%, #8A94A0 46% 56%, transparent 56%)"
"""Chips of lines."""
# Points on white are at least so dark: relative luminance.
_LIGHTEST = 0.42


def words(look: Look) -> str:
    """The words of a class, without the marks of formulas."""
    return look.word.replace("$", "")


def background(look: Look) -> str:
    """The colour of a class as a CSS background; over hatching where it is not opaque."""
    if look.opacity == 1.0:
        return look.colour
    lines, ground = _hex(blended(look, HATCH)), _hex(blended(look))
    return f"repeating-linear-gradient(135deg, {lines} 0 1px, {ground} 1px 4px)"


def rgba(look: Look) -> str:
    """The colour of a class with its opacity, #RRGGBBAA."""
    return f"{look.colour}{round(255 * look.opacity):02X}"


def present(codes: np.ndarray, looks: Sequence[Look] = MOTION_LOOKS) -> list[Chip]:
    """Chips of the classes that occur, with their shares where there are several."""
    counts = np.bincount(codes.ravel(), minlength=len(looks))
    several = np.count_nonzero(counts) > 1
    return [
        (
            background(look),
            f"{words(look)} {percent(count / codes.size)}" if several else words(look),
        )
        for look, count in zip(looks, counts, strict=True)
        if count
    ]


def ink(look: Look) -> str:
    """The colour of a class for points on white: darker where it would be too light."""
    red, green, blue = blended(look, HATCH)
    hue, lightness, saturation = colorsys.rgb_to_hls(red, green, blue)
    while _luminance(red, green, blue) > _LIGHTEST:
        lightness *= 0.97
        red, green, blue = colorsys.hls_to_rgb(hue, lightness, saturation)
    return _hex((red, green, blue))


def _luminance(red: float, green: float, blue: float) -> float:
    """Relative luminance, as in WCAG 2."""
    linear = [
        one / 12.92 if one <= 0.04045 else ((one + 0.055) / 1.055) ** 2.4
        for one in (red, green, blue)
    ]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def _hex(colour: tuple[float, float, float]) -> str:
    return "#" + "".join(f"{round(255 * one):02X}" for one in colour)

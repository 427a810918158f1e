"""Curves of bifurcations of periodic orbits over two parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.errors import InputError
from wedgebrake.figures.data import class_styles
from wedgebrake.figures.data.legend import LegendEntry


@dataclass(frozen=True, eq=False)
class BifurcationCurve:
    """One curve.

    kind   : of bifurcation
    order  : period of its orbits, in periods of the torque
    points : values of both parameters, (n, 2)
    """

    kind: str
    order: int
    points: NDArray[np.float64]


def curves_over(boundaries: Any, names: Sequence[str]) -> list[BifurcationCurve]:
    """Curves over two parameters, the first to the right, from results of ``wb.boundary``.

    Raises ``InputError`` for anything else, or a result over other parameters.
    """
    if not isinstance(boundaries, list | tuple):
        raise InputError(
            f"boundaries = {type(boundaries).__name__}: must be a list of results of"
            " wb.boundary(...)."
        )
    for place, one in enumerate(boundaries):
        own = parameters(one, f"boundaries[{place}]")
        if set(own) != set(names):
            raise InputError(
                f"boundaries[{place}]: is a line over {' and '.join(own)}, but the picture is one"
                f" over {' and '.join(names)}. Follow it over these with wb.boundary(...)."
            )
    return [
        BifurcationCurve(
            str(one.attrs["bifurcation"]),
            int(one.attrs["order"]),
            np.column_stack([one[name].to_numpy() for name in names]),
        )
        for one in boundaries
    ]


def parameters(dataset: Any, argument: str) -> list[str]:
    """The two parameters of a result of ``wb.boundary``.

    Raises ``InputError`` for anything else, with the name of the argument.
    """
    attributes = getattr(dataset, "attrs", {})
    if attributes.get("kind") != "boundary":
        raise InputError(
            f"{argument} = {type(dataset).__name__}: must be the result of wb.boundary(...)."
        )
    return [str(name) for name in attributes["parameters"]]


def entries(curves: Sequence[BifurcationCurve]) -> list[LegendEntry]:
    """Legend entries of the kinds that occur, each with the periods of its orbits."""
    found: dict[str, set[int]] = {}
    for one in curves:
        found.setdefault(one.kind, set()).add(one.order)
    return [
        LegendEntry(
            f"{kind} of {', '.join(map(class_styles.period, sorted(found[kind])))}", style.line
        )
        for kind, style in class_styles.BIFURCATIONS.items()
        if kind in found
    ]

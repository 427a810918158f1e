"""Contents of the picture of ``scatter``: probabilities, Sobol indices, samples."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.figures import style
from wedgebrake.figures.data import class_styles as classes
from wedgebrake.model.validation import unknown
from wedgebrake.sweeps.outcomes import LOCKED, SAFE, UNSTABLE
from wedgebrake.sweeps.results import PointStatus

if TYPE_CHECKING:
    import xarray as xr

# Classes of samples without runs, by the first outcome that occurs.
_LINEAR = {
    LOCKED: classes.ClassStyle("self-locked", style.VERMILLION),
    UNSTABLE[0]: classes.ClassStyle("unstable forwards", style.ORANGE),
    UNSTABLE[1]: classes.ClassStyle("unstable backwards", style.YELLOW),
    "": classes.ClassStyle("linearly stable", style.BLUE),
    "invalid": classes.MOTION_STYLES["invalid"],
}


class Probability(NamedTuple):
    """The probability of an outcome with the ends of its interval, and how it is written."""

    outcome: str
    value: float
    low: float
    high: float
    words: str


class Influence(NamedTuple):
    """Sobol indices of a parameter, with the half-widths of their intervals."""

    parameter: str
    first: float
    first_conf: float
    total: float
    total_conf: float


@dataclass(frozen=True, eq=False)
class Scatter:
    """Probabilities of the outcomes, Sobol indices of an effect, and classes over two parameters.

    influences : the largest total index last; empty without indices
    x, y       : (n,) values of two parameters; y is None if only one varies
    codes      : (n,) place of the class of each sample in ``styles``
    """

    probabilities: tuple[Probability, ...]
    effect: str
    influences: tuple[Influence, ...]
    x: FloatArray
    y: FloatArray | None
    labels: tuple[str, str]
    codes: NDArray[np.int8]
    styles: tuple[classes.ClassStyle, ...]
    sentences: tuple[str, ...]

    @classmethod
    def of(
        cls, dataset: xr.Dataset, x: str | None = None, y: str | None = None,
        effect: str | None = None,
    ) -> Scatter:  # fmt: skip
        """Contents for a dataset of ``wb.scatter``.

        Raises ``InputError`` for names that it does not have.
        """
        influences, effect = _influences(dataset, effect)
        names = json.loads(dataset.attrs["axes"])
        ranked = [one.parameter for one in reversed(influences)] or names
        first = _named("x", x, names) or ranked[0]
        others = [one for one in ranked if one != first]
        second = _named("y", y, names) or next(iter(others), None)
        codes, styles = _classes(dataset)
        return cls(
            probabilities=tuple(_probabilities(dataset)),
            effect=effect,
            influences=influences,
            x=dataset[first].to_numpy(),
            y=None if second is None else dataset[second].to_numpy(),
            labels=(_label(dataset, first), "" if second is None else _label(dataset, second)),
            codes=codes,
            styles=styles,
            sentences=tuple(_sentences(dataset)),
        )


def _named(argument: str, name: str | None, names: list[str]) -> str | None:
    if name is not None and name not in names:
        raise unknown(argument, name, names, "not a varied parameter")
    return name


def _label(dataset: xr.Dataset, name: str) -> str:
    unit = dataset[name].attrs.get("units", "1")
    return name if unit in ("1", "-") else f"{name}  [{unit}]"


def percent(value: float) -> str:
    """A probability in percent, as text."""
    return f"{100.0 * value:.3g} %"


def _probabilities(dataset: xr.Dataset) -> list[Probability]:
    found = []
    for name in dataset["outcome"].to_numpy():
        one = dataset.sel(outcome=name)
        value, low, high = (float(one[key]) for key in ("probability", "low", "high"))
        words = f"{percent(value)} ({percent(low)} to {percent(high)})"
        found.append(Probability(str(name), value, low, high, words))
    return found


def _influences(dataset: xr.Dataset, effect: str | None) -> tuple[tuple[Influence, ...], str]:
    if "ST" not in dataset:
        if effect is not None:
            raise InputError(
                f"effect = {effect!r}: the result has no Sobol indices. Compute them with"
                " scatter(..., indices=True).",
                name="effect", value=effect, allowed="left out",
            )  # fmt: skip
        return (), ""
    known = [
        str(one) for one in dataset["effect"].to_numpy()
        if np.isfinite(dataset["ST"].sel(effect=one)).all()
    ]  # fmt: skip
    if effect is None:
        effect = next(iter(known), "")
    elif effect not in known:
        raise unknown("effect", effect, known, "has no indices")
    if not effect:
        return (), ""
    one = dataset.sel(effect=effect)
    rows = [
        Influence(str(name), *(float(one[key][i]) for key in ("S1", "S1_conf", "ST", "ST_conf")))
        for i, name in enumerate(dataset["parameter"].to_numpy())
    ]
    return tuple(sorted(rows, key=lambda row: row.total)), effect


def _classes(dataset: xr.Dataset) -> tuple[NDArray[np.int8], tuple[classes.ClassStyle, ...]]:
    if "motion" in dataset:
        return classes.motion_codes(dataset).to_numpy(), classes.MOTIONS
    status, keys = dataset["status"].to_numpy(), list(_LINEAR)
    codes = np.full(status.size, keys.index(""), np.int8)
    outcomes = dataset["outcome"].to_numpy().tolist()
    for name in (UNSTABLE[1], UNSTABLE[0], LOCKED):
        if name in outcomes:
            occurs = dataset["occurs"].to_numpy()[:, outcomes.index(name)]
            codes[occurs == 1] = keys.index(name)
    codes[status == PointStatus.INVALID] = keys.index("invalid")
    return codes, tuple(_LINEAR.values())


def _sentences(dataset: xr.Dataset) -> list[str]:
    total = dataset.sizes["sample"]
    found = [f"{total} samples. Lines show 95 % intervals (Wilson)."]
    failed = int((dataset["status"] != PointStatus.COMPLETED).sum())
    if failed:
        found.append(
            f"{failed} samples are invalid or not completed; unknown outcomes widen the intervals."
        )
    if SAFE in dataset["outcome"]:
        found.append("Safe: no other outcome occurs; undecided samples do not count as safe.")
    return found

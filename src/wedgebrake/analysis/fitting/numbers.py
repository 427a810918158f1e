"""Numbers, such as a period, that were measured in addition to a trace or instead of one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wedgebrake.analysis.derivatives.observables import WORDS, Observable, observable
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError, nearest
from wedgebrake.model.validation import wrong

if TYPE_CHECKING:
    from wedgebrake.analysis.derivatives.varied_motion import VariedMotion
    from wedgebrake.model.machine import Machine
    from wedgebrake.model.system import BrakedDriveline

_FORM = 'a mapping of names to (value, standard deviation), such as {"period": (0.103, 0.001)}'


class MeasuredNumber(NamedTuple):
    """A measured number that describes a run.

    name  : as given by the user
    value : measured value, and ``sigma`` its standard deviation
    part  : index of the part along the dimension of the observable
    kind  : what is measured
    """

    name: str
    value: float
    sigma: float
    part: int
    kind: Observable

    @property
    def why(self) -> str:
        """The reason why it does not exist, as a sentence."""
        told = self.kind.missing or "it has no value in the window"
        return f"{told[0].upper()}{told[1:]}."

    def of(self, varied: VariedMotion) -> tuple[float, FloatArray]:
        """Its value in a motion, and the derivatives (q,); nan if it does not exist."""
        values, changes = self.kind.of(varied)
        return float(values[self.part]), changes[self.part]


def numbers_of(
    system: BrakedDriveline | Machine, given: Mapping[str, tuple[float, float]] | None
) -> list[MeasuredNumber]:
    """The measured numbers.

    given : value and standard deviation by name

    Raises ``InputError`` for unknown names, and for anything but a value and a positive standard
    deviation.
    """
    if given is None:
        return []
    if not isinstance(given, Mapping) or not given:
        raise wrong("measured", given, _FORM)
    found = []
    for name, pair in given.items():
        part, kind = _place(system, name)
        try:
            value, sigma = map(float, pair)
        except (TypeError, ValueError):
            value = sigma = np.nan
        if not (np.isfinite(value) and 0.0 < sigma < np.inf):
            raise wrong(
                f"measured[{name!r}]", pair,
                "two numbers: the value, and its standard deviation, which is positive",
            )  # fmt: skip
        found.append(MeasuredNumber(name, value, sigma, part, kind))
    return found


def unit_of(system: BrakedDriveline | Machine, name: str) -> str:
    """Unit of the number with a name.

    Raises ``InputError`` for an unknown name.
    """
    return _place(system, name)[1].unit


def _place(system: BrakedDriveline | Machine, name: str) -> tuple[int, Observable]:
    """The observable that a name refers to, and before it the index of its part."""
    part, _, word = str(name).rpartition(".")
    kind, along = observable(word), system.machine.parts_along
    names = {dim: [one.name for one in parts] for dim, parts in along.items()}
    if kind is not None:
        own = names[kind.dim]
        if part in own:
            return own.index(part), kind
        if not part and len(own) == 1:
            return 0, kind
    known = []
    for one in WORDS:
        meant = observable(one)
        own = names[meant.dim] if meant is not None else []
        known += [f"{each}.{one}" for each in own] + ([one] if len(own) == 1 else [])
    raise InputError(
        f"measured[{name!r}]: no such number. {nearest(str(name), known)} A name is that of a part,"
        f" a dot and one of {', '.join(WORDS)}. Harmonics and orders have any number from 1 on.",
        name=f"measured[{name!r}]", value=name, allowed=tuple(known),
    )  # fmt: skip


class Numbers(NamedTuple):
    """Measured numbers, and the window of the run that they describe [s]."""

    each: list[MeasuredNumber]
    window: tuple[float, float]

    @property
    def measured(self) -> FloatArray:
        """The measured values."""
        return np.array([one.value for one in self.each])

    @property
    def sigmas(self) -> FloatArray:
        """Their standard deviations."""
        return np.array([one.sigma for one in self.each])


def check_window(given: Any, span: tuple[float, float] | None) -> tuple[float, float]:
    """The window of the numbers [s].

    span : first and last time of the trace [s]; None if there is no trace

    Raises ``InputError`` for a window outside the trace, and for neither a window nor a trace.
    """
    if given is None:
        if span is None:
            raise wrong(
                "window", given, "two times [s] if there is no trace",
                "The run starts at 0 s and ends with the window.",
            )  # fmt: skip
        return span
    low, high = (0.0, np.inf) if span is None else span
    try:
        first, last = map(float, given)
    except (TypeError, ValueError):
        first = last = np.nan
    if not (low <= first < last <= high and np.isfinite(last)):
        within = "from 0 s on" if span is None else f"within the trace, {low:g} s to {high:g} s"
        raise wrong("window", given, f"two times [s], the earlier first, {within}")
    return first, last

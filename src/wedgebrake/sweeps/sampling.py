"""Samples of uncertain parameters: distributions, correlation."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from numbers import Real
from typing import Any, NamedTuple

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError, nearest
from wedgebrake.model.studies.sweep_settings import tied_names
from wedgebrake.model.units import with_unit
from wedgebrake.model.validation import as_typed, check_number, is_finite, shown, wrong

# Smallest eigenvalue of a correlation matrix.
_SINGULAR = 1e-12
_EXAMPLE = "for example scipy.stats.uniform(0.28, 0.14) or scipy.stats.norm(-60, 5)"
_CALL = re.compile(r"(?P<name>[a-z_0-9]+)\((?P<arguments>[^()]*)\)")
_TEXTS = (
    "FROM..TO (uniform), or a distribution of scipy.stats with its arguments, such as norm(-60, 5)"
    " or uniform(loc=0.28, scale=0.14)"
)


class Distributions(NamedTuple):
    """Distributions of parameters, joined by a Gaussian copula.

    quantiles : for each parameter, the function from a probability to its value
    factor    : (k, k) lower triangular factor of the correlation matrix of the copula
    """

    quantiles: Mapping[str, Any]
    factor: FloatArray

    @property
    def independent(self) -> bool:
        """True if no parameters are correlated."""
        return bool(np.array_equal(self.factor, np.eye(len(self.factor))))

    def values(self, points: FloatArray) -> dict[str, FloatArray]:
        """Values of the parameters, (n,) each, at points in the unit cube, (n, k)."""
        from scipy.special import ndtr, ndtri

        if not self.independent:
            points = ndtr(ndtri(points) @ self.factor.T)
        return {
            name: np.asarray(quantile(column), float)
            for (name, quantile), column in zip(self.quantiles.items(), points.T, strict=True)
        }

    def at_normal(self, points: FloatArray) -> dict[str, FloatArray]:
        """Values at points of independent standard normal numbers, (n, k).

        Values are exact far in the upper tail, too, where a probability is 1 up to rounding.
        """
        from scipy.special import ndtr

        joined = points @ self.factor.T
        found = {}
        for (name, quantile), column in zip(self.quantiles.items(), joined.T, strict=True):
            upper = getattr(getattr(quantile, "__self__", None), "isf", None)
            values = np.asarray(quantile(ndtr(column)), float)
            if upper is not None:
                values = np.where(column > 0.0, upper(ndtr(-column)), values)
            found[name] = values
        return found


def distributions(given: Mapping[Any, Any], correlation: Any = None) -> Distributions:
    """Check distributions of parameters and their correlation.

    correlation : (k, k) matrix in the order of the parameters, or a mapping from pairs of names to
                  coefficients; None: independent

    Raises ``InputError``.
    """
    quantiles = {name: _quantile(name, one) for name, one in tied_names(given).items()}
    return Distributions(quantiles, _factor(list(quantiles), correlation))


def _quantile(name: str, given: Any) -> Any:
    from scipy import stats

    # A distribution that is not frozen would silently have the location 0 and the scale 1.
    family = getattr(stats, str(getattr(given, "name", "")), None) is given
    for method in () if family else ("ppf", "icdf"):
        if callable(found := getattr(given, method, None)) and not isinstance(given, type):
            middle = found(0.5)
            if np.ndim(middle) == 0 and is_finite(float(middle)):
                return found
    raise wrong(name, given, "a frozen distribution of scipy.stats", f"Give one, {_EXAMPLE}.")


def _factor(names: list[str], given: Any) -> FloatArray:
    count = len(names)
    matrix = np.eye(count)
    allowed = f"a symmetric {count} x {count} matrix with 1 on its diagonal, or a mapping of pairs"
    allowed += " of parameters to coefficients"
    example = 'For example {("kinetic", "slope"): 0.5}.'
    if isinstance(given, Mapping):
        for pair, value in given.items():
            two = isinstance(pair, tuple) and len(pair) == 2 and pair[0] != pair[1]
            if not two or not set(pair) <= set(names):
                raise wrong("correlation", pair, "pairs of two of the parameters", example)
            value = check_number("correlation", value, -1.0, 1.0)
            i, j = map(names.index, pair)
            matrix[i, j] = matrix[j, i] = value
    elif given is not None:
        try:
            matrix = np.array(given, dtype=float)
        except (TypeError, ValueError):
            raise wrong("correlation", given, allowed, example) from None
        right = matrix.shape == (count, count) and np.all(np.isfinite(matrix))
        if not (right and np.array_equal(matrix, matrix.T) and np.all(np.diag(matrix) == 1.0)):
            raise wrong("correlation", given, allowed, example)
    if np.linalg.eigvalsh(matrix).min() < _SINGULAR:
        raise wrong(
            "correlation", given, "positive definite",
            "These correlations are inconsistent, or make one parameter a function of others;"
            " reduce them.",
        )  # fmt: skip
    return np.asarray(np.linalg.cholesky(matrix), float)


def given_sample(given: Mapping[Any, Any]) -> dict[str, FloatArray] | None:
    """The values of a given sample, (n,) each; None where there are distributions instead.

    Raises ``InputError`` for values that are not of one length, and for a tuple of two numbers,
    which elsewhere is a range.
    """
    named = tied_names(given)
    for name, one in named.items():
        if isinstance(one, tuple) and len(one) == 2 and all(isinstance(x, Real) for x in one):
            low, high = sorted(one)
            raise wrong(
                name, one, "a frozen distribution of scipy.stats, or an array of values",
                f"For a range, give scipy.stats.uniform({low:g}, {high - low:g}); for a sample of"
                f" two values, the array numpy.array([{one[0]:g}, {one[1]:g}]).",
            )  # fmt: skip
    if not named or any(hasattr(one, "ppf") or hasattr(one, "icdf") for one in named.values()):
        return None
    found = {}
    for name, one in named.items():
        try:
            found[name] = np.array(one, dtype=float)
        except (TypeError, ValueError):
            raise wrong(
                name, one, "a frozen distribution of scipy.stats, or an array of values",
                f"Give one, {_EXAMPLE}.",
            ) from None  # fmt: skip
        if found[name].ndim != 1 or found[name].size < 2 or not np.all(np.isfinite(found[name])):
            raise wrong(
                name, one, "a frozen distribution of scipy.stats, or an array of finite values",
                f"Give one, {_EXAMPLE}.",
            )  # fmt: skip
    sizes = {name: values.size for name, values in found.items()}
    if len(set(sizes.values())) > 1:
        listed = ", ".join(f"{name} {size}" for name, size in sizes.items())
        raise InputError(
            f"over: a sample needs the same number of values of each parameter, not {listed}."
        )
    return found


def parse_distribution(where: str, text: str, unit: str) -> Any:
    """The frozen distribution that a text names: ``FROM..TO``, or ``norm(-60, 5)``.

    where : begin of messages
    unit  : of the parameter, in whose other units numbers may be given

    Raises ``InputError``.
    """
    from scipy import stats

    ends = text.split("..")
    if len(ends) == 2:
        low, high = (_number(where, one, unit) for one in ends)
        if not low < high:
            raise InputError(
                f"{where}the first value must be less than the second, as in 0.28..0.42."
            )
        return stats.uniform(low, high - low)
    call = _CALL.fullmatch(text.strip())
    if call is None:
        raise InputError(f"{where}must be {_TEXTS}.")
    known = [name for name in dir(stats) if isinstance(getattr(stats, name), stats.rv_continuous)]
    if call["name"] not in known:
        raise InputError(
            f"{where}{as_typed(call['name'])} is not a continuous distribution of scipy.stats."
            f" {nearest(call['name'], known)}"
        )
    values: list[float] = []
    named: dict[str, float] = {}
    for part in filter(None, (one.strip() for one in call["arguments"].split(","))):
        name, equals, value = part.rpartition("=")
        number = _number(where, value, unit)
        if equals:
            named[name.strip()] = number
        else:
            values.append(number)
    law = getattr(stats, call["name"])
    try:
        found = law(*values, **named)
        right = math.isfinite(float(found.ppf(0.5)))
    except (TypeError, ValueError):
        right = False
    if not right:
        shapes = f"{law.shapes}, " if law.shapes else ""
        raise InputError(
            f"{where}{shown(text)} is not a valid distribution: {call['name']} takes {shapes}loc"
            " and scale (above 0)."
        )
    return found


def _number(where: str, text: str, unit: str) -> float:
    value = with_unit(f"{where}value", text.strip(), unit)
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"{where}{shown(text)} is not a finite number. Must be {_TEXTS}.")
    return number

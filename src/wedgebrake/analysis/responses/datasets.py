"""Datasets of measures of a response."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.model.validation import wrong

if TYPE_CHECKING:
    import xarray as xr


def labelled(dims: Any, values: Any, unit: str, meaning: str) -> tuple[Any, Any, dict[str, str]]:
    """A variable or coordinate of a dataset, with its unit and meaning."""
    return dims, values, {"units": unit, "long_name": meaning}


def dataset_over(
    dimension: str, spec: Mapping[str, tuple[str, str]], values: Mapping[str, Any]
) -> xr.Dataset:
    """Dataset of variables over one dimension; ``spec``: their names, units and meanings."""
    import xarray as xr

    found = {}
    for name, words in spec.items():
        dims, of, attrs = labelled(dimension, np.asarray(values[name]), *words)
        found[name] = xr.Variable(dims, of, attrs, fastpath=True)  # otherwise dask is imported
    return xr.Dataset(found)


def attributes(response: xr.Dataset, *names: str) -> dict[str, Any]:
    """Attributes of a response that exist."""
    return {name: response.attrs[name] for name in names if name in response.attrs}


def of_part(response: xr.Dataset, dimension: str, name: str | None, argument: str) -> xr.Dataset:
    """Return a response with the variables of one part, of those along a dimension.

    name     : of the part; None if there is only one
    argument : that gives the name, for messages

    Raises ``InputError`` for an unknown part, and for None where there are several.
    """
    names = response[dimension].to_numpy().tolist()
    if name is None and len(names) == 1:
        name = names[0]
    if name not in names:
        one = f"one of {', '.join(names)}"
        raise wrong(argument, name, one, "Name one of them.")
    import xarray as xr

    at, coordinate = names.index(name), response[dimension].variable
    chosen = response.drop_vars(dimension).isel({dimension: at}, missing_dims="ignore")
    # As ``response.isel`` alone, which imports dask for the scalar coordinate.
    scalar = xr.Variable((), coordinate.values[at : at + 1].reshape(()), fastpath=True)
    return chosen.assign_coords({dimension: scalar})

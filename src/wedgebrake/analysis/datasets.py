"""Datasets of measures of a response."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr


def dataset_over(
    dimension: str, spec: Mapping[str, tuple[str, str]], values: Mapping[str, Any]
) -> xr.Dataset:
    """Dataset of variables over one dimension; ``spec``: their names, units and meanings."""
    import xarray as xr

    return xr.Dataset(
        {
            name: (dimension, values[name], {"units": unit, "long_name": meaning})
            for name, (unit, meaning) in spec.items()
        }
    )


def attributes(response: xr.Dataset, *names: str) -> dict[str, Any]:
    """Attributes of a response that exist."""
    return {name: response.attrs[name] for name in names if name in response.attrs}

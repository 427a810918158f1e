"""Datasets of measures of a response."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from wedgebrake.errors import InputError

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


def is_of_machine(response: Any) -> bool:
    """Return True for the response of a ``Machine``, which may have several contacts."""
    return "stick_contact" in getattr(response, "data_vars", {})


def check_machine_response(response: Any) -> None:
    """Raise ``InputError`` for anything but the response of a ``Machine``."""
    if not is_of_machine(response):
        raise InputError(
            f"response = {type(response).__name__}: must be the response of a machine, the result"
            " of wb.simulate(machine, ...)."
        )


def refuse_machine_response(response: Any) -> None:
    """Raise ``InputError`` for the response of a ``Machine``."""
    if is_of_machine(response):
        raise InputError(
            "response: is that of a machine, must be that of a BrakedDriveline here. wb.plot,"
            " wb.energy and wb.final_state accept responses of machines; a spectrum needs one of"
            " their parts, for example wb.spectrum(response.sel(inertia='disc'))."
        )

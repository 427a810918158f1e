"""Datasets of measures of a response."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from wedgebrake.errors import InputError
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

    return xr.Dataset(
        {name: labelled(dimension, values[name], *words) for name, words in spec.items()}
    )


def attributes(response: xr.Dataset, *names: str) -> dict[str, Any]:
    """Attributes of a response that exist."""
    return {name: response.attrs[name] for name in names if name in response.attrs}


def check_response(response: Any) -> None:
    """Raise ``InputError`` for anything but a response: other results describe a system too."""
    if "stick_start" not in getattr(response, "data_vars", {}):
        raise wrong("response", response, "the result of wb.simulate(...)")


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
            "response: is that of a machine, must be that of a BrakedDriveline here. Of a machine"
            " wb.plot, wb.energy, wb.stopping, wb.spectrum and wb.sticks take the response; the"
            " torque is response.brake_torque, and wb.motion(machine).contacts has its peaks."
        )


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
        raise wrong(argument, name, one, f"For example {argument}={names[0]!r}.")
    return response.sel({dimension: name})

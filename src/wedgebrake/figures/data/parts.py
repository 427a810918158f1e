"""One inertia and one contact of a response or a sweep, in the form of those of a driveline."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.analysis.responses.datasets import of_part
from wedgebrake.model.validation import unknown, wrong
from wedgebrake.model.view import DRIVELINE
from wedgebrake.solvers.layout import full
from wedgebrake.sweeps.plan import CROSSING, PERIOD
from wedgebrake.sweeps.results import CONTACT, EXPONENT, INERTIA

if TYPE_CHECKING:
    import xarray as xr

# Exponents of a machine, by their names in the sweep of a driveline.
_EXPONENTS = ("largest_exponent", "second_exponent")


def of_one_part(
    response: xr.Dataset, inertia: str | None = None, contact: str | None = None
) -> xr.Dataset:
    """The motion of one inertia and one contact of a response, without a section that it lacks.

    The torque is zero where there is no contact. Raises ``InputError`` for a part that the response
    does not have, or where it has several.
    """
    whole = full(response)
    chosen = of_part(whole, INERTIA, inertia, INERTIA)
    if contact is None and not whole.sizes[CONTACT]:
        still = {
            name: ("time", np.zeros(one.sizes["time"], one.dtype))
            for name, one in chosen.data_vars.items()
            if CONTACT in one.dims
        }
        return chosen.drop_dims(CONTACT).assign(still).rename(DRIVELINE.names)
    chosen = of_part(chosen, CONTACT, contact, CONTACT)
    if whole is not response:  # the response of a driveline
        return response
    number = response[CONTACT].to_numpy().tolist().index(chosen[CONTACT].item())
    own = {
        dim: np.flatnonzero(chosen[f"{dim}_contact"].to_numpy() == number)
        for dim in ("event", "stick")
    }
    return chosen.isel(own).rename(DRIVELINE.names)


def with_one_part(
    dataset: xr.Dataset,
    inertia: str | None = None,
    contact: str | None = None,
    shaft: str | None = None,
) -> xr.Dataset:
    """A sweep with one inertia, contact and shaft, whose returns are over ``period``.

    inertia, contact, shaft : names; None for the first one, or for the one that was selected before

    Other datasets are returned as they are. Raises ``InputError`` for a part that the sweep does
    not have.
    """
    if not hasattr(dataset, "data_vars"):
        return dataset
    for dim, name in ((INERTIA, inertia), (CONTACT, contact), ("shaft", shaft)):
        dataset = _selected(dataset, dim, name)
    if CROSSING in dataset.dims:
        dataset = dataset.rename({CROSSING: PERIOD})
    if EXPONENT in dataset.dims:
        exponents = dataset["exponents"]
        named = {
            name: exponents.isel({EXPONENT: place}, drop=True)
            for place, name in enumerate(_EXPONENTS[: dataset.sizes[EXPONENT]])
        }
        dataset = dataset.drop_dims(EXPONENT).assign(named)
    return dataset


def selected_part(dataset: xr.Dataset, dim: str) -> str | None:
    """The name of the only inertia or contact of a dataset; None where it has another number."""
    coordinate = dataset.coords.get(dim)
    return None if coordinate is None or coordinate.dims else str(coordinate.item())


def _selected(dataset: xr.Dataset, dim: str, name: str | None) -> xr.Dataset:
    # The inertia of a driveline is a parameter, which may be swept: its values are numbers.
    parts = dim in dataset.dims and dataset[dim].dtype.kind not in "iuf"
    names = [str(one) for one in dataset[dim].to_numpy()] if parts else []
    if not names:
        if name is not None and name != selected_part(dataset, dim):
            raise wrong(dim, name, f"None for a dataset without several values of {dim}")
        return dataset
    if name is not None and name not in names:
        raise unknown(dim, name, names)
    return dataset.sel({dim: names[0] if name is None else name})

"""The commands ``stop``, ``orders`` and ``temperature``: measures of a simulated run."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wedgebrake.cli.assignments import parse_number
from wedgebrake.cli.output import Output, describe, header, nearly_zero
from wedgebrake.cli.overrides import in_options, load_for, named_as_in_study
from wedgebrake.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

_DISCS = {
    "mass": "kg", "specific_heat": "J/(kg K)", "conductivity": "W/(m K)",
    "density": "kg/m^3", "area": "m^2",
}  # fmt: skip
# Arguments of the measures that are options.
_OPTIONS = (
    "variable", "part", "reference", "highest", "turns", "windows", "contact", "share", *_DISCS,
)  # fmt: skip


def measure(
    path: Path,
    changes: list[str] | None,
    method: str | None,
    of: Callable[[xr.Dataset], xr.Dataset],
    drawn: Mapping[str, Any],
    output: Output,
) -> None:
    """Simulate, measure the response, print the result and write its files.

    of    : the measure of a response
    drawn : options of the picture
    """
    from wedgebrake.cli.compilation import announce_compilation
    from wedgebrake.solvers.interrupts import interruptible
    from wedgebrake.solvers.simulate import simulate

    output.check()
    study = load_for("simulate", path, changes, method)
    system, arguments = study.system, study.arguments()

    def work() -> xr.Dataset:
        with named_as_in_study(system), announce_compilation():
            return of(simulate(system, **arguments))

    try:
        found = interruptible(work)
    except InputError as error:
        raise in_options(error, _OPTIONS) from None
    values: dict[str, Any] = {
        str(name): {
            "dims": list(one.dims), "units": one.attrs.get("units", "1"), "values": one.to_numpy()
        }
        for name, one in found.variables.items()
        if "time" not in one.dims
    }  # fmt: skip
    report = {**header(system), **values, "files": {"data": None, "picture": None}}
    output.finish(
        report,
        lambda: "\n".join([describe(system), "", *_lines(found)]),
        found,
        lambda: (found, drawn),
    )


def disc_of(given: Mapping[str, str | None]) -> Any:
    """The disc that the options of ``temperature`` describe: lumped or semi-infinite."""
    from wedgebrake.model.discs import LumpedDisc, SemiInfiniteDisc

    values = {
        name: parse_number(f"--{name.replace('_', '-')}", text, _DISCS[name])
        for name, text in given.items()
        if text is not None
    }
    kind = LumpedDisc if "mass" in values else SemiInfiniteDisc
    wanted = {"mass", "specific_heat"}
    if kind is SemiInfiniteDisc:
        wanted = {"conductivity", "density", "specific_heat", "area"}
    if set(values) != wanted:
        raise InputError(
            "temperature: needs a disc. Give --mass and --specific-heat (of uniform temperature),"
            " or --conductivity, --density, --specific-heat and --area (heated on an area of its"
            " surface)."
        )
    return kind(**values)


def _lines(found: xr.Dataset) -> list[str]:
    """The values of a result: numbers, and a table over each kind of parts."""
    lines = []
    for name, one in found.data_vars.items():
        words, unit = str(one.attrs.get("long_name", name)), one.attrs.get("units", "1")
        unit = "" if unit == "1" else f" {unit}"
        if not one.dims:
            lines.append(f"{words}: {float(one):.6g}{unit}")
        elif one.dims in (("inertia",), ("contact",)):
            each = zip(found[one.dims[0]].to_numpy(), one.to_numpy(), strict=True)
            most = float(abs(one).max())
            known = [
                f"{part} {nearly_zero(value, most):.6g}{unit}"
                for part, value in each
                if not math.isnan(value)
            ]
            lines += [f"{words}: {', '.join(known)}"] if known else []
    if found.attrs["kind"] == "order_map":
        amplitude = found["amplitude"].where(found["order"] >= 0.5, drop=True)
        top = amplitude.isel(amplitude.argmax(...))
        turns = float(top["speed"]) / (2.0 * math.pi)
        order = float(top["order"])
        lines.append(
            f"Largest amplitude {float(top):.6g} {amplitude.attrs['units']}: order {order:g} at"
            f" {60.0 * turns:.5g} rpm ({order * turns:.5g} Hz)"
        )
    return lines

"""Installed versions of the packages that wedgebrake and its extras need."""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, requires, version

from wedgebrake.errors import InputError

EXTRAS = {
    "netcdf": "--out in netCDF",
    "app": "the explorer, wedgebrake app",
    "cluster": "client= of sweeps",
}
"""Extras that add something to the use of wedgebrake, and what."""

# Packages that are imported under another name.
_MODULES = {"pillow": "PIL"}


@dataclass(frozen=True)
class Package:
    """A package that is needed, and what is there of it.

    name      : as pip knows it
    needed    : least version; "" where any will do
    installed : version; None where there is none
    problem   : why it does not serve; "" where it does
    """

    name: str
    needed: str
    installed: str | None
    problem: str

    @property
    def requirement(self) -> str:
        """Requirement for pip."""
        return f"{self.name}>={self.needed}" if self.needed else self.name


def packages(extra: str = "") -> tuple[Package, ...]:
    """The packages of an extra, or those always needed, each one tried.

    Raises ``InputError`` where Python does not know what wedgebrake needs.
    """
    try:
        lines = requires("wedgebrake") or []
    except PackageNotFoundError:
        raise InputError(
            "doctor: wedgebrake is imported from a folder and not installed, so its needs are not"
            " known. Install it: pip install wedgebrake, or in a clone pip install -e ."
        ) from None
    found = []
    for line in lines:
        requirement, _, condition = line.partition(";")
        of = re.search(r"extra\s*==\s*['\"]([\w-]+)", condition)
        if (of[1] if of else "") == extra:
            name, least = re.findall(r"^([\w.-]+)(?:.*?>=\s*([\w.]+))?", requirement.strip())[0]
            found.append(_tried(name, least))
    return tuple(found)


def _tried(name: str, needed: str) -> Package:
    try:
        installed = version(name)
    except PackageNotFoundError:
        return Package(name, needed, None, "is not installed")
    if _numbers(installed) < _numbers(needed):
        return Package(name, needed, installed, f"is too old: at least {needed} is needed")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import_module(_MODULES.get(name, name.replace("-", "_")))
    except Exception as error:  # whatever a broken package does at its import
        why = " ".join(f"{type(error).__name__}: {error}".split())
        return Package(name, needed, installed, f"cannot be imported ({why[:200]})")
    return Package(name, needed, installed, "")


def _numbers(text: str) -> tuple[int, ...]:
    """The leading numbers of a version, so that versions compare."""
    return tuple(int(number) for number in re.findall(r"\d+", text.partition("+")[0])[:3])

"""wedgebrake: the vibration of self-amplified friction brakes.

    import wedgebrake as wb
    system = wb.paper.system(eta=-24, f=0.63, F0=0.036, alpha=1.18, brake="wedge")
    wb.stability(system)                         # the linear verdict
    response = wb.simulate(system, periods=250)  # the exact response

The public names are listed in ``__all__`` and imported when first used, so that
``import wedgebrake`` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from wedgebrake._version import __version__

if TYPE_CHECKING:
    from wedgebrake import paper
    from wedgebrake.errors import InputError, OutputError, WedgebrakeError
    from wedgebrake.linear_stability import stability, stability_map
    from wedgebrake.measures.poincare import poincare
    from wedgebrake.measures.spectrum import spectrum
    from wedgebrake.measures.sticking import sticks
    from wedgebrake.model.actuation import Actuation
    from wedgebrake.model.brakes import (
        BandBrake,
        Brake,
        ConventionalBrake,
        LeadingShoeBrake,
        WedgeBrake,
    )
    from wedgebrake.model.characteristic import Characteristic
    from wedgebrake.model.driveline import Driveline
    from wedgebrake.model.excitation import HarmonicTorque
    from wedgebrake.model.friction import (
        CoulombFriction,
        CustomFriction,
        SmoothedFriction,
        TabulatedFriction,
    )
    from wedgebrake.model.groups import Groups
    from wedgebrake.model.study import Study, load_study
    from wedgebrake.model.system import BrakedDriveline
    from wedgebrake.solvers.solve import simulate
    from wedgebrake.solvers.status import Status

# Where each public name lives.
_HOMES = {
    "Actuation": "model.actuation",
    "BandBrake": "model.brakes",
    "Brake": "model.brakes",
    "BrakedDriveline": "model.system",
    "Characteristic": "model.characteristic",
    "ConventionalBrake": "model.brakes",
    "CoulombFriction": "model.friction",
    "CustomFriction": "model.friction",
    "Driveline": "model.driveline",
    "Groups": "model.groups",
    "HarmonicTorque": "model.excitation",
    "InputError": "errors",
    "LeadingShoeBrake": "model.brakes",
    "OutputError": "errors",
    "SmoothedFriction": "model.friction",
    "Status": "solvers.status",
    "Study": "model.study",
    "TabulatedFriction": "model.friction",
    "WedgeBrake": "model.brakes",
    "WedgebrakeError": "errors",
    "load_study": "model.study",
    "poincare": "measures.poincare",
    "simulate": "solvers.solve",
    "spectrum": "measures.spectrum",
    "stability": "linear_stability",
    "stability_map": "linear_stability",
    "sticks": "measures.sticking",
}

__all__ = [
    "Actuation",
    "BandBrake",
    "Brake",
    "BrakedDriveline",
    "Characteristic",
    "ConventionalBrake",
    "CoulombFriction",
    "CustomFriction",
    "Driveline",
    "Groups",
    "HarmonicTorque",
    "InputError",
    "LeadingShoeBrake",
    "OutputError",
    "SmoothedFriction",
    "Status",
    "Study",
    "TabulatedFriction",
    "WedgeBrake",
    "WedgebrakeError",
    "__version__",
    "load_study",
    "paper",
    "poincare",
    "simulate",
    "spectrum",
    "stability",
    "stability_map",
    "sticks",
]


def __getattr__(name: str) -> Any:
    if name == "paper":
        return import_module("wedgebrake.paper")
    if name in _HOMES:
        return getattr(import_module(f"wedgebrake.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'wedgebrake' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__

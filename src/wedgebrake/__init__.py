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

from wedgebrake._version import __version__

# As in the module typing, whose import takes longer than the rest of this file.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from wedgebrake import paper
    from wedgebrake.app.notebook import explore
    from wedgebrake.errors import InputError, OutputError, WedgebrakeError
    from wedgebrake.linear_stability import stability, stability_map
    from wedgebrake.measures.energy import energy
    from wedgebrake.measures.lines import spectral_lines
    from wedgebrake.measures.motion import Motion, motion
    from wedgebrake.measures.poincare import poincare
    from wedgebrake.measures.spectrum import spectrum
    from wedgebrake.measures.sticking import sticks
    from wedgebrake.measures.torque import BrakeTorque, brake_torque
    from wedgebrake.model.actuation import Actuation
    from wedgebrake.model.brakes import (
        BandBrake,
        Brake,
        ConventionalBrake,
        LeadingShoeBrake,
        LeverBrake,
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
    from wedgebrake.model.study import Study, load_study, read_study
    from wedgebrake.model.study_text import save_study
    from wedgebrake.model.system import BrakedDriveline
    from wedgebrake.orbits.boundary import boundaries, boundary
    from wedgebrake.orbits.branch import Branch
    from wedgebrake.orbits.branches import branches
    from wedgebrake.orbits.continuation import continuation
    from wedgebrake.orbits.orbit import Orbit
    from wedgebrake.orbits.point import BranchPoint
    from wedgebrake.orbits.shooting import orbit
    from wedgebrake.plots.draw import plot
    from wedgebrake.solvers.solve import simulate
    from wedgebrake.solvers.status import Status
    from wedgebrake.sweeps.maps import basins, bifurcation, regime_map
    from wedgebrake.sweeps.run import sweep

# Where each public name lives.
_HOMES = {
    "Actuation": "model.actuation",
    "BandBrake": "model.brakes",
    "Branch": "orbits.branch",
    "BranchPoint": "orbits.point",
    "Brake": "model.brakes",
    "BrakeTorque": "measures.torque",
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
    "LeverBrake": "model.brakes",
    "Motion": "measures.motion",
    "Orbit": "orbits.orbit",
    "OutputError": "errors",
    "SmoothedFriction": "model.friction",
    "Status": "solvers.status",
    "Study": "model.study",
    "TabulatedFriction": "model.friction",
    "WedgeBrake": "model.brakes",
    "WedgebrakeError": "errors",
    "basins": "sweeps.maps",
    "bifurcation": "sweeps.maps",
    "boundaries": "orbits.boundary",
    "boundary": "orbits.boundary",
    "brake_torque": "measures.torque",
    "branches": "orbits.branches",
    "continuation": "orbits.continuation",
    "energy": "measures.energy",
    "explore": "app.notebook",
    "load_study": "model.study",
    "motion": "measures.motion",
    "orbit": "orbits.shooting",
    "plot": "plots.draw",
    "poincare": "measures.poincare",
    "read_study": "model.study",
    "regime_map": "sweeps.maps",
    "save_study": "model.study_text",
    "simulate": "solvers.solve",
    "spectral_lines": "measures.lines",
    "spectrum": "measures.spectrum",
    "stability": "linear_stability",
    "stability_map": "linear_stability",
    "sticks": "measures.sticking",
    "sweep": "sweeps.run",
}

__all__ = [
    "Actuation",
    "BandBrake",
    "Brake",
    "BrakeTorque",
    "BrakedDriveline",
    "Branch",
    "BranchPoint",
    "Characteristic",
    "ConventionalBrake",
    "CoulombFriction",
    "CustomFriction",
    "Driveline",
    "Groups",
    "HarmonicTorque",
    "InputError",
    "LeadingShoeBrake",
    "LeverBrake",
    "Motion",
    "Orbit",
    "OutputError",
    "SmoothedFriction",
    "Status",
    "Study",
    "TabulatedFriction",
    "WedgeBrake",
    "WedgebrakeError",
    "__version__",
    "basins",
    "bifurcation",
    "boundaries",
    "boundary",
    "brake_torque",
    "branches",
    "continuation",
    "energy",
    "explore",
    "load_study",
    "motion",
    "orbit",
    "paper",
    "plot",
    "poincare",
    "read_study",
    "regime_map",
    "save_study",
    "simulate",
    "spectral_lines",
    "spectrum",
    "stability",
    "stability_map",
    "sticks",
    "sweep",
]


def __getattr__(name: str) -> Any:
    if name == "paper":
        return import_module("wedgebrake.paper")
    if name in _HOMES:
        return getattr(import_module(f"wedgebrake.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'wedgebrake' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__

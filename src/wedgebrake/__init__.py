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
    from wedgebrake.analysis.energy import energy
    from wedgebrake.analysis.linear_stability import stability, stability_map
    from wedgebrake.analysis.motion import Motion, motion
    from wedgebrake.analysis.poincare import poincare
    from wedgebrake.analysis.spectral_peaks import spectral_lines
    from wedgebrake.analysis.spectrum import spectrum
    from wedgebrake.analysis.sticking import sticks
    from wedgebrake.analysis.torque import BrakeTorque, brake_torque
    from wedgebrake.errors import InputError, OutputError, WedgebrakeError
    from wedgebrake.explorer.notebook import explore
    from wedgebrake.figures.matplotlib.draw import plot
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
    from wedgebrake.orbits.branch import Branch, continuation
    from wedgebrake.orbits.branch_point import BranchPoint
    from wedgebrake.orbits.codim2 import boundaries, boundary
    from wedgebrake.orbits.diagram import branches
    from wedgebrake.orbits.orbit import Orbit
    from wedgebrake.orbits.shooting import orbit
    from wedgebrake.solvers.simulate import simulate
    from wedgebrake.solvers.status import Status
    from wedgebrake.sweeps.basins import basins
    from wedgebrake.sweeps.bifurcation import bifurcation
    from wedgebrake.sweeps.regime_map import regime_map
    from wedgebrake.sweeps.sweep import sweep

# Where each public name lives.
_HOMES = {
    "Actuation": "model.actuation",
    "BandBrake": "model.brakes",
    "Branch": "orbits.branch",
    "BranchPoint": "orbits.branch_point",
    "Brake": "model.brakes",
    "BrakeTorque": "analysis.torque",
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
    "Motion": "analysis.motion",
    "Orbit": "orbits.orbit",
    "OutputError": "errors",
    "SmoothedFriction": "model.friction",
    "Status": "solvers.status",
    "Study": "model.study",
    "TabulatedFriction": "model.friction",
    "WedgeBrake": "model.brakes",
    "WedgebrakeError": "errors",
    "basins": "sweeps.basins",
    "bifurcation": "sweeps.bifurcation",
    "boundaries": "orbits.codim2",
    "boundary": "orbits.codim2",
    "brake_torque": "analysis.torque",
    "branches": "orbits.diagram",
    "continuation": "orbits.branch",
    "energy": "analysis.energy",
    "explore": "explorer.notebook",
    "load_study": "model.study",
    "motion": "analysis.motion",
    "orbit": "orbits.shooting",
    "plot": "figures.matplotlib.draw",
    "poincare": "analysis.poincare",
    "read_study": "model.study",
    "regime_map": "sweeps.regime_map",
    "save_study": "model.study_text",
    "simulate": "solvers.simulate",
    "spectral_lines": "analysis.spectral_peaks",
    "spectrum": "analysis.spectrum",
    "stability": "analysis.linear_stability",
    "stability_map": "analysis.linear_stability",
    "sticks": "analysis.sticking",
    "sweep": "sweeps.sweep",
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

"""The public names, each with its module: ``lazy_loader`` and type checkers read them here."""

from . import paper as paper
from . import testing as testing
from ._version import __version__
from .analysis.derivatives.sensitivity import sensitivity
from .analysis.fitting.fit import Fit, fit
from .analysis.linear_stability import (
    hopf,
    stability,
    stability_limits,
    stability_map,
    steady_sliding,
)
from .analysis.motion import Motion, motion
from .analysis.poincare import poincare
from .analysis.responses.check import Violation, check
from .analysis.responses.energy import energy
from .analysis.responses.order_map import order_map
from .analysis.responses.spectral_peaks import spectral_lines
from .analysis.responses.spectrum import spectrum
from .analysis.responses.sticking import sticks
from .analysis.responses.stopping import stopping
from .analysis.responses.temperature import temperature
from .analysis.responses.torque import BrakeTorque, brake_torque
from .errors import InputError, OutputError, WedgebrakeError
from .explorer.notebook import explore
from .figures.matplotlib.draw import plot
from .model.actuation import Actuation
from .model.brakes import (
    BandBrake,
    Brake,
    ConventionalBrake,
    LeadingShoeBrake,
    LeverBrake,
    WedgeBrake,
)
from .model.characteristic import Characteristic
from .model.controller import Controller
from .model.discs import LumpedDisc, SemiInfiniteDisc
from .model.driveline import Driveline
from .model.friction import (
    CoulombFriction,
    CustomFriction,
    SetValuedFriction,
    SmoothedFriction,
    SmoothFriction,
    TabulatedFriction,
)
from .model.groups import Groups
from .model.machine import Machine
from .model.machine_parts import (
    Contact,
    Driven,
    Gear,
    Inertia,
    OverAngle,
    OverSpeed,
    Planetary,
    Rigid,
    Shaft,
    Stages,
    Torque,
)
from .model.part import parameter
from .model.signals.excitation import HarmonicTorque
from .model.signals.signal_tables import Chirp, Ramp, Table
from .model.signals.signals import Constant, Harmonic, Orders, Signal
from .model.stribeck import StribeckFriction
from .model.studies.study import Study, load_study, read_study, save_study
from .model.system import BrakedDriveline
from .model.torque_contacts import Drag, OneWayClutch
from .orbits.branches.branch import Branch
from .orbits.codim2 import boundaries, boundary
from .orbits.continuation import continuation
from .orbits.diagram import branches
from .orbits.orbit import BranchPoint, Orbit
from .orbits.response_curve import response_curve
from .orbits.shooting import orbit
from .solvers.machine.final_state import FinalState, final_state
from .solvers.simulate import simulate
from .solvers.status import Status
from .sweeps.basins import basins
from .sweeps.margin import Margin, margin
from .sweeps.rare_event import rare_event
from .sweeps.scatter import scatter
from .sweeps.sweep import bifurcation, regime_map, sweep

__all__ = [
    "Actuation",
    "BandBrake",
    "Brake",
    "BrakeTorque",
    "BrakedDriveline",
    "Branch",
    "BranchPoint",
    "Characteristic",
    "Chirp",
    "Constant",
    "Contact",
    "Controller",
    "ConventionalBrake",
    "CoulombFriction",
    "CustomFriction",
    "Drag",
    "Driveline",
    "Driven",
    "FinalState",
    "Fit",
    "Gear",
    "Groups",
    "Harmonic",
    "HarmonicTorque",
    "Inertia",
    "InputError",
    "LeadingShoeBrake",
    "LeverBrake",
    "LumpedDisc",
    "Machine",
    "Margin",
    "Motion",
    "OneWayClutch",
    "Orbit",
    "Orders",
    "OutputError",
    "OverAngle",
    "OverSpeed",
    "Planetary",
    "Ramp",
    "Rigid",
    "SemiInfiniteDisc",
    "SetValuedFriction",
    "Shaft",
    "Signal",
    "SmoothFriction",
    "SmoothedFriction",
    "Stages",
    "Status",
    "StribeckFriction",
    "Study",
    "Table",
    "TabulatedFriction",
    "Torque",
    "Violation",
    "WedgeBrake",
    "WedgebrakeError",
    "__version__",
    "basins",
    "bifurcation",
    "boundaries",
    "boundary",
    "brake_torque",
    "branches",
    "check",
    "continuation",
    "energy",
    "explore",
    "final_state",
    "fit",
    "hopf",
    "load_study",
    "margin",
    "motion",
    "orbit",
    "order_map",
    "paper",
    "parameter",
    "plot",
    "poincare",
    "rare_event",
    "read_study",
    "regime_map",
    "response_curve",
    "save_study",
    "scatter",
    "sensitivity",
    "simulate",
    "spectral_lines",
    "spectrum",
    "stability",
    "stability_limits",
    "stability_map",
    "steady_sliding",
    "sticks",
    "stopping",
    "sweep",
    "temperature",
    "testing",
]

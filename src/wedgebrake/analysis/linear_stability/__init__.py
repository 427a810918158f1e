"""Linear stability of steady sliding (section 3 of the paper), of drivelines and of machines.

front             : ``stability``, for a driveline or a machine
one_inertia       : the result for a driveline: short names, damping, Hopf points, margins
maps              : ``stability_map``: stability over a grid of groups or parameters
parameter_map     : the same over any parameters
sliding_contact   : a contact of a machine, linearised about steady sliding
equilibrium       : a machine made linear about its equilibrium
linear_system     : the linear system of a machine, including its samples
controllers       : its controllers
modes             : its eigenvalues and modes
machine_stability : verdict on every case of steady sliding
verdict_changes   : changes of the verdict over a parameter: their values and kinds
steady_sliding    : ``steady_sliding``: speeds at which the torques on a machine are in balance
several_rotations : steady sliding of machines with several free rotations
hopf              : ``hopf``: the values of a parameter at which the verdict changes
varied_parameters : parameters for which stability limits are computed
speed_limits      : ``stability_limits``: limits of slope, friction and damping over the speed
"""

from wedgebrake.analysis.linear_stability.front import stability
from wedgebrake.analysis.linear_stability.hopf import StabilityLimit, hopf
from wedgebrake.analysis.linear_stability.machine_stability import (
    SlidingCase,
    Stability,
    unpressed_sentences,
)
from wedgebrake.analysis.linear_stability.maps import AXES, stability_map
from wedgebrake.analysis.linear_stability.modes import Mode
from wedgebrake.analysis.linear_stability.one_inertia import (
    DirectionStability,
    DrivelineStability,
    damping_at,
    sliding_damping,
)
from wedgebrake.analysis.linear_stability.sliding_contact import linearisation_of
from wedgebrake.analysis.linear_stability.speed_limits import (
    ParameterLimit,
    limits_of,
    stability_limits,
)
from wedgebrake.analysis.linear_stability.steady_sliding import steady_sliding
from wedgebrake.analysis.linear_stability.verdict_changes import VerdictChange

__all__ = [
    "AXES",
    "DirectionStability",
    "DrivelineStability",
    "Mode",
    "ParameterLimit",
    "SlidingCase",
    "Stability",
    "StabilityLimit",
    "VerdictChange",
    "damping_at",
    "hopf",
    "limits_of",
    "linearisation_of",
    "sliding_damping",
    "stability",
    "stability_limits",
    "stability_map",
    "steady_sliding",
    "unpressed_sentences",
]

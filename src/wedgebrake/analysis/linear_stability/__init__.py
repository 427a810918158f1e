"""Linear stability of steady sliding (section 3 of the paper).

damping : definition of steady sliding and of its damping
verdict : ``stability``: eigenvalues, bifurcation points, margins and the verdict in words
maps    : ``stability_map``: stability over a grid of groups
"""

from wedgebrake.analysis.linear_stability.damping import damping_at, sliding_damping
from wedgebrake.analysis.linear_stability.maps import AXES, stability_map
from wedgebrake.analysis.linear_stability.verdict import DirectionStability, Stability, stability

__all__ = [
    "AXES",
    "DirectionStability",
    "Stability",
    "damping_at",
    "sliding_damping",
    "stability",
    "stability_map",
]

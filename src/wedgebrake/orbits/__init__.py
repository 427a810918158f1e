"""Periodic orbits, stable or not: found, continued over parameters, and their bifurcations.

What an orbit is:

section        where orbits are sampled, and whether two of them agree
problem        the system, the parameters that vary, and their ranges
equations      the protocol of an orbit's equations, stated in two ways:
segment_bvp    set-valued friction: a boundary-value problem of segments, with its kernels
               ``segment_kernel`` (equations), ``segment_margins`` (distances from where a
               segment begins or ceases to be) and ``segment_orbit`` (log, extremes, monodromy)
stroboscopic_map  smooth friction: multiple shooting from period to period

How it is found and continued:

curves         an orbit at given parameters; orbits and bifurcations as curves
palc           pseudo-arclength continuation: Newton's method, tangent and step length
orbit          one orbit as a result
shooting       ``orbit``: near a guess, by Newton's method
branch_point   an orbit on a branch
branch         ``continuation``: one branch, point by point
deduplication  orbits and branches that have already been computed

Where it changes:

bifurcation_types      the bifurcations by name
bifurcation_detection  their location between two points of a branch
discontinuity_induced  the sequence of segments beyond a bifurcation of friction
branch_restart         the branch beyond it, and the onset of permanent sticking
branch_switching       the branches that leave a bifurcation

All together:

diagram        ``branches``: all branches from the ends of a range
dataset        branches as a dataset
stability_intervals  where a branch is stable
codim2         ``boundary`` and ``boundaries``: bifurcations over two parameters
"""

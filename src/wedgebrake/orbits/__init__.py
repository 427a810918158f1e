"""Periodic orbits, stable and unstable: search, continuation over parameters, bifurcations.

From the bottom to the top:

section                section at which orbits are sampled, and their distance there
bifurcation_types      the bifurcations by name, and the stable intervals between them
orbit_status           outcome of the search for an orbit
equations              the equations of an orbit, and its multipliers
problems               a system whose parameters vary: a driveline or a machine
curves                 an orbit at given parameters; orbits and bifurcations as curves
orbit_derivatives      derivatives of an orbit with respect to parameters
orbit                  results: one orbit, and a point of a branch
palc                   pseudo-arclength continuation, and bifurcations between two points
ranges                 parameters and the ends between which they vary
friction_bifurcations  bifurcations that smooth systems do not have, and the orbits beyond them
branches               one branch, its beginning at a Hopf point, and branches that leave it
shooting               ``orbit``: an orbit near a guess, by Newton's method
continuation           ``continuation``: the branch of an orbit, or from a Hopf point
diagram                ``branches``: all branches from the ends of a range, as a dataset
codim2                 ``boundary`` and ``boundaries``: bifurcations over two parameters
cycle                  fundamentals, heat and equivalent damping of the cycle of an orbit
response_curve         ``response_curve``: amplitude curves at levels of a second parameter
"""

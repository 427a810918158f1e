"""Periodic orbits, stable and unstable: search, continuation over parameters, bifurcations.

Definition of an orbit:

problem            a system whose parameters vary: ``driveline_problem`` and
                   ``machine_problem``, of which ``choose_problem`` chooses one
section            section at which orbits are sampled, and their distance there
equations          base class of the equations of an orbit, which are of these kinds:
segment_bvp        set-valued friction: a boundary-value problem of segments, with its kernels
                   ``segment_kernel`` (equations) and ``segment_orbit`` (log, extremes, monodromy
                   matrix, and distances from the beginning or end of a segment)
multiple_shooting  equations for the points at successive returns
stroboscopic_map   the same with smooth friction, from period to period
return_map         the same for machines, from return to return of the flow, which
                   ``machine_flow`` computes in ``section_coordinates``; ``odd_symmetry``
                   detects a flow that is its own mirror image half a period later
floquet            multipliers, and functions that vanish where they leave the unit circle
curves             an orbit at given parameters; orbits and bifurcations as curves
orbit              results: one orbit, and a point of a branch; ``orbit_status``: the outcome
                   of a search

Search, continuation and bifurcations:

shooting               ``orbit``: an orbit near a guess, by Newton's method
ranges                 parameters and the ends between which they vary
hopf_start             first limit cycle near a Hopf point of steady sliding
palc                   pseudo-arclength continuation, and bifurcations between two points
continuation           ``continuation``: the branch of an orbit, or from a Hopf point
branch                 one branch, point by point
bifurcation_types      the bifurcations by name, and the stable intervals between them
discontinuity_induced  drivelines: the segments beyond a bifurcation of friction, and the branch
                       with these segments
event_changes          machines: the same, from the slips and sticks on both sides, and grazing
segments               segments of orbits of machines, and those that vanish at a bifurcation
breakpoints            breakpoints of the torques of a machine, and the segments between them
branch_switching       branches that leave a bifurcation, and those already computed
diagram                ``branches``: all branches from the ends of a range, as a dataset
friction_condition     machines: an orbit at such a bifurcation as a solution of the equations
                       of ``mode_sequence``, with imposed directions of sliding; ``imposed_run``
                       runs the machine with these directions
codim2                 ``boundary`` and ``boundaries``: bifurcations over two parameters
"""

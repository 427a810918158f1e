"""Equations whose solutions are periodic orbits, and what follows from a solution.

equations          base class
segment_bvp        one inertia, set-valued friction: a boundary-value problem of segments, with its
                   kernels ``segment_kernel`` (equations), ``segment_changes`` (their derivatives
                   with respect to the numbers of the problem) and ``segment_orbit`` (log, extremes,
                   monodromy matrix, and distances from the beginning or end of a segment)
multiple_shooting  equations for the points at successive returns to a section
stroboscopic_map   the same for one inertia with smooth friction, from period to period
return_map         the same for machines, from return to return of the flow, which
                   ``machine_flow`` computes in ``section_coordinates``. The points lie on the
                   section, which is the phase condition. ``odd_symmetry`` detects a flow that is
                   its own mirror image half a period later
varied_segments    derivatives of the numbers of a problem of segments with respect to parameters
varied_return      derivative of the return map of a machine with respect to parameters
segments           segments of orbits of machines, and those that vanish at a bifurcation
breakpoints        breakpoints of the torques of a machine, and the segments between them
floquet            multipliers, and functions that vanish where they leave the unit circle
"""

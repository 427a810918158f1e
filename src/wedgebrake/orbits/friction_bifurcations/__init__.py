"""Bifurcations that smooth systems do not have: a slip, a stick or a crossing begins or ends.

discontinuity_induced  drivelines: the segments beyond such a bifurcation, and the branch with
                       these segments; the onset of permanent sticking
event_changes          machines: the same, from the slips and sticks on both sides, and grazing
friction_condition     machines: an orbit at such a bifurcation as a solution of the equations of
                       ``mode_sequence``, with imposed directions of sliding
mode_sequence          equations of an orbit with imposed directions of sliding
permanent_sticking     machines: its onset, where the last slips of a contact vanish together
imposed_run            run of a machine with these directions
"""

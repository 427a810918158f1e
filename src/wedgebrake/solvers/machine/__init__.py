"""Exact solver for machines with any number of inertias.

The method: docs/numerics.md, "Exact solution of machines".

series           the kernel of ``simulate``
solve            a machine and a task to an answer
assemble         the numbers of a machine; problem: their description
trajectory       from event to event
events           the first event, and what follows it
friction_lines   friction over the speed as straight lines, or as pieces of a curve
shares           torques of contacts that depend on each other, as a response has them
rotations        free rotations, taken out of the angles of a run
rest             the proof that contacts stay at rest
passage          a run that is continued from return to return
quantity_statistics  root mean squares and peaks over a passage
power_rows       the powers whose integrals are the work of each part
sticks           intervals of rest
final_state      restarts
tangents         derivatives of a run with respect to parameters
"""

"""Exact solver for machines with any number of inertias (docs/theory.md, section 14).

simulate         wb.simulate for a machine; driveline: for a driveline with signals
solve            a machine and a task to an answer; response: the answer as a dataset
assemble         the numbers of a machine; problem: their description
trajectory       the loop: cell, first event, log; clock: its time, with the signals at this time
stride           cells of equal length without events; stride_matrices: their matrices
friction_lines   friction over the speed as straight lines, or as pieces of a curve
cells            Taylor series, and the first zero of a condition, which is never passed
curves           series of torques that are curves over the sliding speed
modes            the linear system and the conditions of a mode
events           what changes at an event; arrivals: contacts that come to rest
complementarity  which contacts hold, and which slip
least_torques    torques of contacts that depend on each other; shares: as a response has them
imposed          directions of sliding that last beyond their conditions
rest             the proof that contacts stay at rest
passage          a run that is continued from return to return; watch: what is recorded of it
quantity_statistics  root mean squares and peaks over a passage
follow           the same cell by cell; section: returns; variation: derivative of the flow
observers        samples and work; power_rows: the powers whose integrals it is
                 sticks: intervals of rest; final_state: restarts
"""

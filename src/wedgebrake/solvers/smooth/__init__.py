"""Adaptive solution for smooth friction laws: Taylor series and Runge-Kutta.

For one inertia. ``solvers/machine/events/curves.py`` solves machines with ``method="smooth"``.

solve                   a system and a task to a trajectory
course                  a motion passage by passage, for classes of motion and orbits
solve_periods           motions period by period, alone or several at once
assemble, laws          from a system to numbers and compiled laws
problem                 those numbers: the velocity axis cut into stretches
trajectory              the loop: step, event, log
steps                   one step, by either method or in closed form
taylor                  the series of a step; simd_codegen compiles it for vector lanes
runge_kutta             the stages of a step; continuous_extension finds kinks inside
simd_batch              several systems side by side
dense_output            steps by series after the fact
accumulators            sums over a motion
variational             the derivative of the flow
"""

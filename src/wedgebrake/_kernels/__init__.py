"""Compiled functions on floats and arrays only: no objects, no names of brakes.

codes       numbers that stand for outcomes and kinds of event
compiling   how every kernel is compiled and cached
flow        closed-form motion inside one linear piece, and its time derivatives
bound       the step that provably contains no root
slip        the first event inside a piece
hold        the end of an interval of rest
torque      brake torque of any smooth law
exact       piece to piece: the event-driven trajectory, and its evaluation at any times
lines       the straight lines of a brake's torque (plain Python, for one brake and for many)
assemble    from the numbers of a brake and a driveline to the arguments of ``exact.run``
tangent     the derivative of the flow along a logged trajectory, with saltation
chain       a periodic orbit as pieces in a given order: equations, margins, multipliers
tally       what a logged trajectory adds up to: rest, sticks, heat, peak torque, size
motion      the class of a motion from its Poincare points and the growth of deviations
point       one system run and judged
batch       many systems, one after another
along       a smooth law's torque at many velocities
dop853      the Dormand-Prince 8(5,3) step with its continuous extension
series      a step by Taylor series, for mu tanh and brakes whose g is a fraction
past        such steps seen again, side by side: derivatives, and the motion inside
smooth      any smooth law: the layer by series or DOP853, saturated speeds in closed form
smooth_tangent  the derivative of its flow: the variational equation on the same steps
smooth_tally  what it adds up to: heat, range, time at rest
smooth_periods  period by period, with both
trace       a formula written once, as vector instructions for several systems at once
lanes       several smooth motions side by side, by series
ode14x      the paper's fixed-step extrapolated linearly implicit Euler

State convention: ``theta`` is the driveline angle [rad] and ``w`` its velocity [rad/s].
Brake pieces are given over ``w``, that is already shifted by the drive speed, so that
the drive speed itself appears only as ``w_rest``, the velocity of rest relative to the
brake. Time is a period number and a time inside the period, so that rounding in the
phase of the torque does not grow with the length of the run.
"""

"""Analysis of systems, responses and trajectories.

Of a system:

linear_stability       damping, eigenvalues and bifurcation points of steady sliding
solved_as              whether a system is solved as a machine, and how its returns are counted
motion                 ``motion``: class of the steady motion and its exponents
machine_motion         the same for machines
poincare               ``poincare``: states once in every period of the torque

Of a response, as datasets:

spectrum               one-sided amplitude spectrum in physical units
spectral_peaks         lines of a spectrum, named by f_e and f_n
sticking               intervals of rest and class of stick-slip
energy                 work, losses and heat in every period; of a machine: machine_energy
contacts               sticks and slips of each contact of a machine
stopping               time, angle, heat, torque, jerk and judder of a stop
order_map              amplitudes over speed and order
temperature            temperature of a disc from the heat of a contact
machine_series         motion of a machine as polynomials, on which these measures are based
torque                 mean and peak of the brake torque
segments, dense_motion motion and brake torque between the recorded states
datasets               labels of the results

Of trajectories, compiled:

accumulators           rest, sticks, heat, peak torque and size of a motion
vibration              root mean squares and peaks of speed, acceleration, jerk and torque
saltation              derivative of the flow along a trajectory
growth                 growth of small deviations: exponents and multipliers
classify               class of a motion from its returns and the growth of deviations
settling               end of an automatic transient
driveline_passage      runs of some returns of one driveline, and the orbit that it approaches
evaluate_point, batch  evaluation of one system and of many, for sweeps; part_tables: their parts
classify_driveline     simulation and class of motion of one driveline, with any solver
run_settings           transient and record of a run
"""

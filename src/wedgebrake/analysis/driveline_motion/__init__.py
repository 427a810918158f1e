"""Class of the motion of a driveline with one inertia.

classify_driveline     simulation and class of motion of one driveline, with any solver
closed_form            evaluation of machines that have the closed form of one inertia
evaluate_point, batch  evaluation of one driveline and of many, for sweeps; part_tables: their parts
driveline_passage      runs of some returns, and the orbit that a driveline approaches
accumulators           rest, sticks, heat, peak torque and size of a motion
vibration              root mean squares and peaks of speed, acceleration, jerk and torque
saltation              derivative of the flow along a trajectory
"""

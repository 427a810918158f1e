"""Class of the motion of one inertia, by the closed form.

closed_form            run and class of motion, as the result of a machine
evaluate_point, batch  evaluation of one driveline and of many, for sweeps; part_tables: their parts
driveline_passage      runs of some returns, and the orbit that a driveline approaches
accumulators           rest, sticks, heat, peak torque and size of a motion
vibration              root mean squares and peaks of speed, acceleration, jerk and torque
saltation              derivative of the flow along a trajectory
"""

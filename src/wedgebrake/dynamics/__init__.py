"""The machine as numbers, and the compiler of kernels.

jit                    how kernels are compiled and cached
compilation            machine code only for the kernels that Python calls
compile_progress       reports on the progress of compilation
references             named tuples that kernels pass by reference
records, enums         structured arrays with attributes; classes and outcomes as numbers
problem                what every kernel is given: driveline, torque and brake
assemble               conversion of a system to this problem
harmonic               the harmonic torque of one inertia: its value, rate and phase
signals                torques, forces and speeds of machines, as Taylor series
actuator               the actuation force and the speed of its release
brake_torque           brake torque over speed, of a compiled law
piecewise_linear       brake torque as straight lines, for set-valued friction
linear_flow            the motion in a linear piece, in closed form
deviations             small deviations through a linear piece
section                the section at which a motion is sampled
segment_log            the record of events that every solver writes
motion_sums            sums over a motion
"""

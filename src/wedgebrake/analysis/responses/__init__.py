"""Measures of a response, as datasets.

spectrum            one-sided amplitude spectrum in physical units
spectral_peaks      lines of a spectrum, named by f_e and f_n
sticking            intervals of rest and class of stick-slip
energy              work, losses and heat in every period; of every part: machine_energy
check               laws of friction and balances at all samples and events
contacts            sticks and slips of each contact
reactions           outputs of controllers, torques of joints and of driven bodies
repeat              the system of a response and its run, which measures repeat
torque              mean and peak of the brake torque
stopping            time, angle, heat, torque, jerk and judder of a stop
order_map           amplitudes over speed and order
temperature         temperature of a disc from the heat of a contact
machine_series      the repeated motion as polynomials, on which these measures are based
segments, dense_motion
                    motion and brake torque between the recorded states of one inertia
datasets            labels of the results
"""

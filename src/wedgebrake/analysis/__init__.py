"""What is measured on a response: each measure takes a dataset and gives one.

poincare   the state once in every period of the torque
spectrum   one-sided amplitude spectrum, in physical units
lines      the lines of a spectrum, named against f_e and f_n
sticking   the intervals of rest, and the class of stick-slip
energy     work, losses and heat in every period
torque     the brake's torque: mean, mean size and peak
arcs       the motion between samples (machine, along: the brake's torque there)
motion     the class of a motion and its exponents, with the evidence (judge: how it is run;
           protocol: for how long; classes: the words)
"""

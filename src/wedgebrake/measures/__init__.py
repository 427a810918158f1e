"""What is measured on a response: each measure takes a dataset and gives one.

poincare   the state once in every period of the torque
spectrum   one-sided amplitude spectrum, in physical units
sticking   the intervals of rest, and the class of stick-slip
"""

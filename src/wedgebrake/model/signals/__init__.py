"""Functions of time.

signals          torques, forces and speeds as functions of time (signal_base: their base class)
signal_tables    tables and ramps
excitation       the torque of the paper, with further orders
signal_calculus  phases, common periods, sums and integrals of signals
signal_tangents  derivatives of signals with respect to a parameter and to time
"""

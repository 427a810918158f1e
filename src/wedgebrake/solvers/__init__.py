"""From a system to its response.

solve        simulate, the front door
exact        closed forms from event to event, set-valued friction
smooth       adaptive, any smooth friction law
ode14x       the paper's fixed-step scheme, as a reference
laws         friction and brake laws as compiled functions
sticks       rest, for solvers whose velocity never rests
trajectory   what a solver is asked and what it answers
response     the answer as a labelled dataset
status       how a simulation can end
waiting      long computations in a thread, interrupted by Ctrl-C
"""

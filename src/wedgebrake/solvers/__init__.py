"""From a system to its response.

simulate      ``simulate``: choice of the solver, and checks
event_driven  closed forms from event to event, set-valued friction
machine       any number of inertias, contacts and signals, any friction
smooth        adaptive, smooth friction laws, one inertia
solution      the task of a solver and its answer
log_reader    events, returns and sticks from the segment log
response      the answer as a labelled dataset
status        how a simulation can end
times         output times of a response
interrupts    long computations in a thread, interrupted by Ctrl-C
"""

"""From a system to its response.

simulate      the front door
event_driven  closed forms from event to event, set-valued friction
smooth        adaptive, any smooth friction law
ode14x        the paper's fixed-step scheme, as a reference
solution      the task of a solver and its answer
log_reader    events, returns and sticks from the segment log
response      the answer as a labelled dataset
status        how a simulation can end
interrupts    long computations in a thread, interrupted by Ctrl-C
"""

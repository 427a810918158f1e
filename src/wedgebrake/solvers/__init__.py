"""From a system to its response.

simulate      ``simulate``, the front door
task          the task of a kernel, from the arguments of ``simulate``
kernels       the choice of the kernel
event_driven  closed forms from event to event, set-valued friction
machine       any number of inertias, contacts and signals, any friction
smooth        adaptive, smooth friction laws, one inertia
solution      the task of a kernel and its answer
log_reader    the answer of the kernels for one inertia, from the segment log
response      the answer as a labelled dataset
layout        variables of a response, how a system shows them, and the way back
status        how a simulation can end
times         output times of a response
interrupts    long computations in a thread, interrupted by Ctrl-C
"""

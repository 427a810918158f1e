"""The class of a motion of any machine, driven or self-excited.

The rules: docs/numerics.md, "Classes of motion".

coordinates   scaled coordinates of the state, in which distances are measured
section       definition of the returns: periods of the signals, or crossings of a speed
crossings     crossings of a given speed, and instants at which a contact begins to slide
steady        proof that a motion ends in steady sliding, at rest or as free vibration
return_run    the run, continued by returns to a section of its motion
tori          tori of two or more dimensions
classify_machine  simulation and classification: transient, windows, record
result        result of a run
"""

"""The class of a motion of any machine, driven or self-excited (docs/theory.md, section 15).

coordinates   scaled coordinates of the state, in which distances are measured
section       the returns that are counted: periods of the signals, or crossings of a speed
steady        proof that a motion ends in steady sliding or at rest
growth        growth of small deviations, exponents and multipliers
tori          tori of two or more dimensions
run           the run: transient, windows, record
result        what a run found; a table of results serves sweeps
"""

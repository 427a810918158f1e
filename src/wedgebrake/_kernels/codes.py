"""Numbers that the kernels return for words: how a run ended, and what a row of a log is."""

# Outcome of a run. NO_SLIDING: a self-locking brake cannot slide on. LOG_FULL: run again
# with more room.
COMPLETED, DIVERGED, NO_SLIDING, EVENT_LIMIT, STEP_LIMIT, LOG_FULL = range(6)

# Kinds of row. The last two: the speed enters or leaves the stick band of a smooth law.
START, PERIOD, STICK, SLIP, REVERSAL, BREAKPOINT, END, BAND_ENTERED, BAND_LEFT = range(9)

"""Numbers that the kernels return for words: how a run ended, and what a row of a log is."""

# Outcome of a run. NO_SLIDING: a self-locking brake cannot continue to slide, or sticks
# permanently on a turning shaft. LOG_FULL: no room for another row.
COMPLETED, DIVERGED, NO_SLIDING, EVENT_LIMIT, STEP_LIMIT, LOG_FULL = range(6)

# Kinds of row. The last two: the speed enters or leaves the stick band of a smooth law.
START, PERIOD, STICK, SLIP, REVERSAL, BREAKPOINT, END, BAND_ENTERED, BAND_LEFT = range(9)

# Class of motion (docs/theory.md, section 9).
(
    UNDECIDED,
    AT_REST,
    SYNCHRONOUS,
    PERIODIC,
    QUASI_PERIODIC,
    CHAOTIC,
    RUNAWAY,
    LOCKED,
) = range(8)

# Class of stick-slip.
NO_SLIP, NON_STICK_SLIP, UNIDIRECTIONAL, BIDIRECTIONAL = range(4)

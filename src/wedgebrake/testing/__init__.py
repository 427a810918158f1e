"""Checks that every brake, friction law, signal and other part must pass, also one of your own.

    wb.testing.check_brake(DrumBrake(radius=0.2, ...))

Each check returns None, or raises ``AssertionError`` with a sentence that names the class, what was
found and what is expected. Checks of laws and signals include those of any part; they run the
compiled solvers, which takes some seconds the first time.

parts    check_part: parameters, equality, copies, names in a system, study files
laws     check_brake, check_friction: signs, finite values, and the solvers against the law
signals  check_signal: values, bound, knots, integral, period, and the solver against the values
derivatives  check_derivatives: those with respect to each parameter against differences of runs
"""

from wedgebrake.testing.derivatives import check_derivatives
from wedgebrake.testing.laws import check_brake, check_friction
from wedgebrake.testing.parts import check_part
from wedgebrake.testing.signals import check_signal

__all__ = ["check_brake", "check_derivatives", "check_friction", "check_part", "check_signal"]

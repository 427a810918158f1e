"""The paper of Chen and Xi (2014): its figures, and an audit of its statements.

Its machines are data in ``wedgebrake.model.paper_machines``. Nothing imports this package but
the command line and ``wb.paper``.

laboratory      the paper's experiment: runs of 25 s, each done once, by any method
visual_criteria kinds of motion as seen in a printed diagram
signal_features features of responses and spectra, as numbers
fixed_step      the scheme of the paper's program, ODE14x: ``wb.paper.ode14x``
diagrams        bifurcation diagrams, and the limits visible in them
claims          a statement, its parts, and the verdict that follows
statements      every statement, in the order of the figures
identification  which assumptions satisfy how many statements
smoothing       smoothed and exact friction compared
timing          run time of the paper's example
figures         the pictures, one file per kind
report          all of it on one page
"""

from wedgebrake.model.paper_machines import system
from wedgebrake.paper.fixed_step.simulate import ode14x

__all__ = ["ode14x", "system"]

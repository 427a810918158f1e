"""The paper of Chen and Xi (2014): its parameters, its figures, and an audit of its statements.

parameters      ``wb.paper.system``: the machine at given groups
assumptions     the cases, and what the paper leaves unsaid
laboratory      the paper's experiment: runs of 25 s, each done once, by any method
sight, traits   what a reader sees of points, responses and spectra, as numbers
diagrams        bifurcation diagrams, and the limits of what is seen in them
claims          a statement, its parts, and the verdict that follows
statements      every statement, in the order of the figures
identification  which reading of the unsaid satisfies how many statements
smoothing       smoothed against exact friction
corrections     what is printed, and what it should be
timing          run time of the paper's example
figures         the pictures, one file per kind
report          all of it on one page
"""

from wedgebrake.paper.parameters import system

__all__ = ["system"]

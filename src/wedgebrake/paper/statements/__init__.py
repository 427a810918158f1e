"""Every statement of the paper that can be tested, in the order of its figures.

linear       : S1 to S6, stability of sliding
laws         : S7 to S9 and K1, friction laws and forces
motions      : M1 to M4, a constant actuation force
bifurcations : B1 to B7, the diagrams
responses    : R1 to R7, responses beside the diagrams
"""

from concurrent.futures import ThreadPoolExecutor

from wedgebrake.paper.claims import Finding, Statement, examine
from wedgebrake.paper.laboratory import Laboratory
from wedgebrake.paper.statements import bifurcations, laws, linear, motions, responses
from wedgebrake.paper.timing import measure

STATEMENTS: tuple[Statement, ...] = (
    *linear.STATEMENTS,
    *laws.FRICTION,
    *motions.STATEMENTS,
    *bifurcations.STATEMENTS,
    *responses.STATEMENTS,
    *laws.DISSIPATION,
)


def audit(laboratory: Laboratory) -> tuple[Finding, ...]:
    """What comes of every statement, by the laboratory's method and assumptions."""
    measure()  # its answer is kept, and nothing else computes yet
    # The laboratory's own threads share the runs; these prepare and look.
    with ThreadPoolExecutor(laboratory.threads) as pool:
        return tuple(pool.map(lambda statement: examine(statement, laboratory), STATEMENTS))

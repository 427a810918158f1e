"""Every statement of the paper that can be tested, in the order of its figures.

statements.toml : what each says, how it is tested, and what counts as agreement
linear          : S1 to S6, stability of sliding
laws            : S7 to S9 and K1, friction laws and forces
bifurcations    : B1 to B7, the diagrams
responses       : M1 to M4 at a constant actuation force, R1 to R7 beside the diagrams
"""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

from wedgebrake.paper.claims import Check, Finding, Statement, examine, read_table
from wedgebrake.paper.diagrams import PLANS
from wedgebrake.paper.laboratory import Laboratory
from wedgebrake.paper.statements import bifurcations, laws, linear, responses
from wedgebrake.paper.timing import measure
from wedgebrake.paper.visual_criteria import THRESHOLDS

_CHECKS: dict[str, Check] = {}
for _chapter in (linear, laws, bifurcations, responses):
    _CHECKS |= _chapter.CHECKS


def _tolerance(table: dict[str, Any]) -> str:
    shares = {"most": bifurcations.MOST, **THRESHOLDS._asdict()}
    percent = {name: 100.0 * share for name, share in shares.items()}
    plan = PLANS.get(table["figure"])
    return str(table["tolerance"]).format(**percent, resolution=plan.resolution if plan else 0.0)


STATEMENTS = tuple(
    Statement(name, check=_CHECKS[name], **{**table, "tolerance": _tolerance(table)})
    for name, table in read_table(__name__, "statements.toml").items()
)


def audit(laboratory: Laboratory) -> tuple[Finding, ...]:
    """Examine every statement, by the laboratory's method and assumptions."""
    measure()  # its answer is kept, and nothing else computes yet
    # The laboratory's own threads share the runs; these prepare and evaluate.
    with ThreadPoolExecutor(laboratory.threads) as pool:
        return tuple(pool.map(lambda statement: examine(statement, laboratory), STATEMENTS))

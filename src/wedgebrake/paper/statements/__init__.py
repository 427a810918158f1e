"""Every statement of the paper that can be tested, in the order of its figures.

statements.toml : what each says, how it is tested, and what counts as agreement
linear          : S1 to S6, stability of sliding
laws            : S7 to S9 and K1, friction laws and forces
motions         : M1 to M4, a constant actuation force
bifurcations    : B1 to B7, the diagrams
responses       : R1 to R7, responses beside the diagrams
parts           : what the tests of motions share
"""

import tomllib
from concurrent.futures import ThreadPoolExecutor
from importlib.resources import files
from typing import Any

from wedgebrake.paper.claims import Check, Finding, Statement, examine
from wedgebrake.paper.diagrams import PLANS
from wedgebrake.paper.laboratory import Laboratory
from wedgebrake.paper.statements import bifurcations, laws, linear, motions, responses
from wedgebrake.paper.timing import measure
from wedgebrake.paper.visual_criteria import THRESHOLDS

_CHECKS: dict[str, Check] = {
    **linear.CHECKS,
    **laws.CHECKS,
    **motions.CHECKS,
    **bifurcations.CHECKS,
    **responses.CHECKS,
}


def _statement(name: str, table: dict[str, Any]) -> Statement:
    """Join a table with its check, and fill the thresholds into its tolerance."""
    percent = {key: 100.0 * value for key, value in THRESHOLDS._asdict().items()}
    plan = PLANS.get(table["figure"])
    resolution = plan.resolution if plan else 0.0
    tolerance = table["tolerance"].format(
        **percent, most=100.0 * bifurcations.MOST, resolution=resolution
    )
    return Statement(name, check=_CHECKS[name], **{**table, "tolerance": tolerance})


STATEMENTS: tuple[Statement, ...] = tuple(
    _statement(name, table)
    for name, table in tomllib.loads(
        files(__name__).joinpath("statements.toml").read_text(encoding="utf-8")
    ).items()
)


def audit(laboratory: Laboratory) -> tuple[Finding, ...]:
    """Examine every statement, by the laboratory's method and assumptions."""
    measure()  # its answer is kept, and nothing else computes yet
    # The laboratory's own threads share the runs; these prepare and evaluate.
    with ThreadPoolExecutor(laboratory.threads) as pool:
        return tuple(pool.map(lambda statement: examine(statement, laboratory), STATEMENTS))

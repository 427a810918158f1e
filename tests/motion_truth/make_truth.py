"""Judge all cases and write truth.json:  python -m tests.motion_truth.make_truth

Some five minutes on one core. The answers are deterministic; on another processor the last
digit of a trajectory may differ, and with it how long a chaotic transient lasts.
"""

from __future__ import annotations

import json
import sys
import time
from collections import Counter
from collections.abc import Iterator
from typing import Any

from .judge import UNDECIDED, judge
from .named import Case, named_cases
from .systems import PATH, random_systems

ABOUT = (
    "Class of motion by slow methods (tests/motion_truth/judge.py), from `initial` at phase"
    " zero of the torque. order: torque periods in one of the motion. settled: torque periods"
    " until all later section points are within 1e-6 of the final orbit. exponent, error: mean"
    " rate of separation of neighbours and its standard error [1/s]. close_to: what a run of"
    " some hundred periods may take it for."
)


def cases() -> Iterator[Case]:
    """Named ones first, then the random ones."""
    yield from named_cases()
    for name, system, initial in random_systems():
        yield Case(name, "random", system, initial)


def record(case: Case) -> dict[str, Any]:
    """The case with its verdict, as it stands in truth.json."""
    verdict = judge(case.system, case.initial).as_dict()
    return {
        "name": case.name,
        "group": case.group,
        "system": case.system.as_dict(),
        "initial": list(case.initial),
        "known": None if case.known is None else list(case.known),
        **verdict,
    }


def contradicted(one: dict[str, Any]) -> bool:
    """Whether the verdict is not the answer that is known."""
    return one["known"] is not None and one["known"][:2] != [one["motion"], one["order"]]


def main() -> int:
    """Write truth.json; 1 if a known answer is contradicted."""
    began, records, wrong = time.perf_counter(), [], 0
    for case in cases():
        started = time.perf_counter()
        one = record(case)
        records.append(one)
        wrong += contradicted(one)
        flag = "WRONG" if contradicted(one) else ""
        flag = "?" if one["motion"] == UNDECIDED else flag
        seconds = time.perf_counter() - started
        sys.stdout.write(
            f"{case.name:42s} {one['motion']:14s} {one['order']:5d} settled {one['settled']}"
            f" exponent {one['exponent']} +- {one['error']} {one['sticks']}"
            f" ({seconds:.1f} s) {flag}\n"
        )
        sys.stdout.flush()
    lines = ",\n".join(json.dumps(one, separators=(",", ":")) for one in records)
    PATH.write_text(f'{{"about":{json.dumps(ABOUT)},\n"cases":[\n{lines}\n]}}\n')
    counts = Counter(one["motion"] for one in records)
    sys.stdout.write(f"{dict(counts)}\n{wrong} known answers contradicted\n")
    sys.stdout.write(f"{time.perf_counter() - began:.0f} s, {PATH.stat().st_size} bytes\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

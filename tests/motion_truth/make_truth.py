"""Judge all cases again and write truth.json:  python -m tests.motion_truth.make_truth

Some five minutes on one core. The answers are deterministic; on another processor the last
digit of a trajectory may differ, and with it how long a chaotic transient lasts.
"""

from __future__ import annotations

import json
import sys
from typing import Any

from .judge import judge
from .systems import PATH, cases, from_tables

ABOUT = (
    "Class of motion by slow methods (tests/motion_truth/judge.py), from `initial` at phase"
    " zero of the torque. order: torque periods in one of the motion. periods: torque periods"
    " simulated to find out. exponent, error: mean rate of separation of neighbours and its"
    " standard error [1/s]."
)


def judged(case: dict[str, Any]) -> dict[str, Any]:
    """The case with a new verdict."""
    return case | judge(from_tables(case["system"]), tuple(case["initial"])).as_dict()


def contradicted(one: dict[str, Any]) -> bool:
    """Whether the verdict is not the answer that is known."""
    return one["known"] is not None and one["known"][:2] != [one["motion"], one["order"]]


def main() -> int:
    """Write truth.json; 1 if a known answer is contradicted."""
    records = []
    for case in cases():
        one = judged(case)
        records.append(one)
        flag = "WRONG" if contradicted(one) else ""
        sys.stdout.write(f"{one['name']:42s} {one['motion']:14s} {one['order']:5d} {flag}\n")
        sys.stdout.flush()
    lines = ",\n".join(json.dumps(one, separators=(",", ":")) for one in records)
    PATH.write_text(f'{{"about":{json.dumps(ABOUT)},\n"cases":[\n{lines}\n]}}\n')
    return int(any(map(contradicted, records)))


if __name__ == "__main__":
    sys.exit(main())

"""Judge all machines again and write truth.json.

Run it as  PYTHONPATH=src:tests python -m machine_truth.make_truth

With ``draw`` as an argument, of machines that are drawn anew, otherwise of those in the file. Some
ten minutes on one core.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import machine_plain

from .draw import tables
from .judge import judge
from .systems import PATH, cases

ABOUT = (
    "Class of motion of machines by long runs (tests/machine_truth/judge.py), from their initial"
    " state. order: periods of the signals in one of the motion. period: of a motion that repeats"
    " [s]. units: periods of the signals, or of the slowest free vibration, simulated to find out."
    " exponent, error: rate at which neighbours part and its standard error [1/s]."
)
NUMBER = 200


def judged(case: dict[str, Any]) -> dict[str, Any]:
    """The case with a new verdict."""
    return case | judge(machine_plain.machine(case["machine"])).as_dict()


def main() -> int:
    """Write truth.json."""
    if "draw" in sys.argv[1:]:
        given = [{"number": k, "machine": tables(k)} for k in range(NUMBER)]
    else:
        given = cases()
    records = []
    for case in given:
        one = judged(case)
        records.append(one)
        sys.stdout.write(f"{one['number']:4d} {one['motion']:16s} {one['order']:5d}\n")
        sys.stdout.flush()
    lines = ",\n".join(json.dumps(one, separators=(",", ":")) for one in records)
    PATH.write_text(f'{{"about":{json.dumps(ABOUT)},\n"cases":[\n{lines}\n]}}\n')
    return 0


if __name__ == "__main__":
    sys.exit(main())

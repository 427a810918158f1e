"""The same work through the package and its peers, in one table: ``make bench``.

Writes out/benchmarks.json and out/benchmarks.md, and prints the table. ``--write-docs`` makes
docs/benchmarks.md from the JSON that is there, without measuring.
"""

import argparse
import json
import sys
from pathlib import Path

from pages import page, whole
from peers import all_peers
from table import measure
from work import DIAGRAM_FORCE, ETAS, PERIODS

ROOT = Path(__file__).parents[1]
MEASURED = ROOT / "out" / "benchmarks.json"
MACHINES = ROOT / "out" / "machines.json"
HARMONICS = ROOT / "out" / "harmonics.json"
FITTING = ROOT / "out" / "fitting.json"
PRINTED = ROOT / "out" / "benchmarks.md"
DOCS = ROOT / "docs" / "benchmarks.md"


def main() -> None:
    """Measure and print, or write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="the first case of each law alone")
    parser.add_argument("--write-docs", action="store_true", help="docs from the last measurement")
    chosen = parser.parse_args()
    if chosen.write_docs:
        if not MEASURED.exists():
            sys.exit(f"error: {MEASURED} is not there: measure first (make bench)")
        found = json.loads(MEASURED.read_text(encoding="utf-8"))
        kept = [
            json.loads(one.read_text(encoding="utf-8")) if one.exists() else {}
            for one in (MACHINES, HARMONICS, FITTING)
        ]
        text = page(found, *kept, periods=PERIODS, points=ETAS.size, force=DIAGRAM_FORCE)
        DOCS.write_text(text, encoding="utf-8")
        return
    found = measure(
        all_peers(), quick=chosen.quick, say=lambda words: print(f"... {words}", file=sys.stderr)
    )
    MEASURED.parent.mkdir(exist_ok=True)
    table = whole(found)
    print(table)
    # A quick look must not stand where the documentation takes its numbers from.
    if not chosen.quick:
        MEASURED.write_text(json.dumps(found, indent=1), encoding="utf-8")
        PRINTED.write_text(table, encoding="utf-8")


if __name__ == "__main__":
    main()

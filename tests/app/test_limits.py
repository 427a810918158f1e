"""The table of limits in docs/explorer.md is that of the program."""

import re
from pathlib import Path

from wedgebrake.explorer.core import limits

TEXT = (Path(__file__).parents[2] / "docs" / "explorer.md").read_text(encoding="utf-8")
LIMITS = {
    "periods of the torque in one run": limits.MOST_PERIODS,
    "periods shown": limits.MOST_SHOWN,
    "events in one run of the exact solver": limits.MOST_EVENTS,
    "steps in one run of the other solvers": limits.MOST_STEPS,
    "values in a bifurcation diagram, at once": limits.COARSE_POINTS,
    "values in a bifurcation diagram, when all is still": limits.FINE_POINTS,
    "cells of a map, at once": limits.COARSE_MAP,
    "cells of a map, when all is still": limits.FINE_MAP,
    "seconds of one computation": limits.LONGEST_STEP,
    "seconds of one export": limits.LONGEST_EXPORT,
    "study file": limits.MOST_UPLOAD,
    "message of a browser": limits.MOST_MESSAGE,
    "exports of one page in hand": limits.MOST_FILES,
    "pages of one server": limits.MOST_SESSIONS,
}


def test_the_table_of_limits_is_that_of_the_program():
    table = TEXT.split("## Limits")[1].split("##")[0]
    rows = re.findall(r"^\| ([a-z][^|]+?) \| ([^|]+?) \|$", table.replace(" 000", "000"), re.M)
    found = {name: [int(one) for one in re.findall(r"\d+", value)] for name, value in rows}
    assert found == {name: [*value] if isinstance(value, tuple) else [value]
                     for name, value in LIMITS.items()}  # fmt: skip

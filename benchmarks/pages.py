"""The table in words: on the screen, in out/benchmarks.md and in docs/benchmarks.md."""

from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import Any

LAW_WORDS = {"coulomb": "Coulomb friction", "smoothed": "Smoothed friction"}
COLUMNS = (
    "program", "asked for", "time", "a second", "ratio", "at equal error", "error, velocity",
    "angle",
)  # fmt: skip
HEAD = f"| {' | '.join(COLUMNS)} |"
RULE = "|---|---|--:|--:|--:|--:|--:|--:|"
TEMPLATES = Path(__file__).with_name("templates")


def one_table(rows: list[dict[str, Any]]) -> str:
    """Markdown; a heading for each case, and the rows under it."""
    parts = []
    for law, of_law in groupby(rows, key=lambda row: row["law"]):
        for case, several in groupby(of_law, key=lambda row: row["case"]):
            chosen = list(several)
            compared = chosen[0]["compared"]
            title = "bifurcation diagram" if case == "diagram" else case
            parts.append(f"**{LAW_WORDS[law]}, {title}**; errors after {compared} periods\n")
            parts.append("\n".join([HEAD, RULE, *map(line, chosen)]) + "\n")
    return "\n".join(parts)


def line(row: dict[str, Any]) -> str:
    """One row of the table."""
    name = f"**{row['program']}**" if row["reference"] else row["program"]
    if "points" in row:
        name += f" ({row['points']} points)"
    equal = "–" if row["own"] else times(row["ratio_equal"])
    asked = row["asked"].replace("e-0", "e-")
    cells = [
        name, asked, duration(row["seconds"]), rounded(1.0 / row["seconds"]), times(row["ratio"]),
        equal, size(row["error_velocity"]), size(row["error_angle"]),
    ]  # fmt: skip
    return "| " + " | ".join(cells) + " |"


def branch_table(rows: list[dict[str, Any]]) -> str:
    """Following a branch, in a table of its own: its unit is an orbit."""
    if not rows:
        return ""
    head = "| program | asked for | orbits | time an orbit | error of η at the period doubling |"
    lines = [
        f"| {row['program']} | {row['asked']} | {row['orbits']} | {duration(row['seconds'])}"
        f" | {size(row['error'])} |"
        for row in rows
    ]
    title = "**The synchronous orbit of the smoothed brake followed from η = 12 to −22**; the"
    title += " period doubling against AUTO-07p with twice as many intervals\n"
    return "\n".join([title, head, "|---|---|--:|--:|--:|", *lines, ""])


def machine_table(found: dict[str, Any]) -> str:
    """Table of machines: kernels of wedgebrake beside other programs."""
    if not found:
        return ""
    title = f"**Machines**, in a separate run at load {found['load']:.1f}"
    lines = [
        f"{title}; errors of the final state\n",
        "| machine | program | asked for | time | compiled | ratio | error, velocity | angle |",
        "|---|---|---|--:|--:|--:|--:|--:|",
    ]
    for row in found["rows"]:
        own = row["program"] == "wedgebrake"
        inside = duration(row["inside"]) if "inside" in row else "–"
        cells = [
            row["case"] if own else "", f"**{row['program']}**" if own else row["program"],
            row["asked"].replace("e-0", "e-"), duration(row["seconds"]), inside,
            times(row["ratio"]), size(row["error_velocity"]), size(row["error_angle"]),
        ]  # fmt: skip
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join([*lines, ""])


def basin_table(found: dict[str, Any]) -> str:
    """Table of basins of attraction: the whole call of the public function."""
    if not found:
        return ""
    title = f"**Basins of attraction** of {found['points']} initial conditions, at load"
    lines = [
        f"{title} {found['load']:.1f}\n",
        "| friction | threads | time | processor time | time per point |", "|---|--:|--:|--:|--:|",
    ]  # fmt: skip
    for row in found["rows"]:
        cells = [
            row["friction"], str(row["threads"]), duration(row["seconds"]), duration(row["work"]),
            duration(row["seconds"] / found["points"]),
        ]  # fmt: skip
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join([*lines, ""])


def harmonic_table(found: dict[str, Any]) -> str:
    """Table of the errors and times of harmonic balance."""
    if not found:
        return ""
    title = "**Amplitudes over the frequency** of a machine with sticks"
    own = f"**wedgebrake**, with multipliers and {found['bifurcations']} bifurcations"
    lines = [
        f"{title}, at load {found['load']:.1f}\n",
        "| program | harmonics | time per orbit | error, amplitude | error, stick share |",
        "|---|--:|--:|--:|--:|",
        f"| {own} | – | {duration(found['own'])} | – | – |",
    ]
    for row in found["rows"]:
        cells = [
            "harmonic balance", str(row["harmonics"]), duration(row["seconds"]),
            size(row["error_amplitude"]), f"{row['error_sticking']:.2g}",
        ]  # fmt: skip
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join([*lines, ""])


def fit_table(found: dict[str, Any]) -> str:
    """Table of fits with exact derivatives and with differences."""
    if not found:
        return ""
    lines = [
        f"**Fit** of 5 parameters to a trace of 25 s at 1 kHz, at load {found['load']:.1f}\n",
        "| derivatives | processor time | simulations | largest error, in standard errors |",
        "|---|--:|--:|--:|",
    ]
    for row in found["rows"]:
        own = row["derivatives"].startswith("exact")
        name = f"**{row['derivatives']}**" if own else row["derivatives"]
        cells = [name, duration(row["seconds"]), str(row["runs"]), rounded(row["error"])]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join([*lines, ""])


def absent(left_out: dict[str, str]) -> str:
    """A word on each peer that is not there."""
    return "".join(f"{name}: {why}.\n\n" for name, why in left_out.items())


def whole(found: dict[str, Any]) -> str:
    """The table as it is printed."""
    parts = (one_table(found["rows"]), branch_table(found["branch"]), absent(found["left_out"]))
    return "\n".join(part for part in parts if part)


def page(
    found: dict[str, Any], machines: dict[str, Any], harmonics: dict[str, Any],
    fits: dict[str, Any], *, periods: int, points: int, force: float,
) -> str:  # fmt: skip
    """Text of docs/benchmarks.md, with the measurements of other programs of this folder."""
    here = found["machine"]
    versions = ", ".join(f"{name} {number}" for name, number in here["versions"].items())
    text = (TEMPLATES / "benchmarks.md").read_text(encoding="utf-8").format(
        **{**here, "versions": versions}, periods=periods, points=points, force=force,
        table=one_table(found["rows"]), branch=branch_table(found["branch"]),
        machines=machine_table(machines), basins=basin_table(machines.get("basins", {})),
        harmonics=harmonic_table(harmonics), fits=fit_table(fits),
        absent=absent(found["left_out"]),
    )  # fmt: skip
    return "\n".join(_squeezed(text.splitlines())) + "\n"


def _squeezed(lines: list[str]) -> Iterator[str]:
    """Without two empty lines in a row."""
    before = ""
    for text in lines:
        if text or before:
            yield text
        before = text


def duration(seconds: float) -> str:
    """With its unit, to three digits."""
    for unit, factor in (("s", 1.0), ("ms", 1e3), ("µs", 1e6)):
        if seconds * factor >= 1.0 or unit == "µs":
            return f"{rounded(seconds * factor)} {unit}"
    raise AssertionError


def rounded(value: float) -> str:
    """Three digits, without an exponent; thousands apart."""
    if value >= 100.0:
        return f"{value:,.0f}".replace(",", " ")
    return f"{value:.3g}"


def times(ratio: float) -> str:
    """A ratio."""
    return f"{rounded(ratio)} ×"


def size(error: float) -> str:
    """An error, to one digit."""
    return "0" if error == 0.0 else f"{error:.0e}".replace("e-0", "e-")

"""The table in words: on the screen, in out/benchmarks.md and in docs/benchmarks.md."""

from collections.abc import Iterator
from itertools import groupby
from typing import Any

LAW_WORDS = {"coulomb": "Coulomb friction", "smoothed": "Smoothed friction"}
HEAD = "| program | asked for | time | a second | ratio | at equal error | error, velocity | angle |"
RULE = "|---|---|--:|--:|--:|--:|--:|--:|"

PAGE = """# Benchmarks

Written by `make bench-docs` from what `make bench` measured; nothing here is typed by hand.

The same work through wedgebrake and through what one would use instead, in one run on one
machine: {processor}, {processors} processors, load {load:.1f} at the start; Python {python},
{versions}. Everything runs on one core, but for the row that says otherwise.

**The work.** The wedge brake of the [theory](theory.md), section 4, without a static peak, from rest
over {periods} periods of the torque, in four cases; and a bifurcation diagram over η of {points}
points of {periods} periods each at F₀ = {force}.

**Time** is that of one trajectory (in the diagram, of one point), the best of several runs, without
what is compiled or started once: wedgebrake's kernels are compiled and cached, heyoka has built its
integrator, XPPAUT's start is taken off. wedgebrake's own rows are its kernels without the making of a
dataset; rows of the diagram are the public call, which gives each point its class of motion,
exponents, sticks and torques as well. The others compute a point's last state and nothing else.

**Ratio** is the time over that of wedgebrake's row in bold. A fast wrong answer is not a peer:
**at equal error** is the time over that of wedgebrake's fastest row whose velocity is no further from
the truth than the peer's (errors below 1e-9 count as 1e-9).

**Error** is the distance from the truth, of the velocity [rad/s] and the angle [rad], at the end of
the period that the heading names; in the diagram the largest over its points. The truth for Coulomb
friction is the exact solver, for smoothed friction the smooth one at 1e-13. The tests hold both
against an independent Taylor integrator (heyoka) to 1e-9, and the solvers against 50-digit arithmetic.
A chaotic motion is compared before rounding has grown to 1e-9: at η = −24, F₀ = 0.036 with Coulomb
friction a change of the torque in its last bit grows to 1e-10 in 30 periods and to 0.1 in 100.

{table}
{branch}
{absent}
## What the rows are

- **heyoka**: Taylor series in compiled code. It needs its terminal events to be right here. Without
  them it is wrong in the first digits: for speeds beyond 1 rad/s tanh(ξRv) is 1 in double precision,
  the series does not see the steep layer about zero velocity, and a step goes over a whole reversal.
  Splitting at v = 0 alone does not cure it; steps must also end at the border of the layer. With
  Coulomb friction reversals, sticks and releases are switched in Python callbacks. In vector lanes
  neighbouring machines run side by side; with Coulomb friction a brake at rest is then a mode of the
  equations, whose events are the ends of the rest.
- **SciPy** `solve_ivp`, right side compiled by Numba. Coulomb friction by pieces with terminal
  events, smoothed friction as one right side. Steps are held below 2 ms, or all its methods step over
  reversals; even so its events miss what happens twice within a step. `Radau` is measured on the
  first case of each law only: half a minute a trajectory.
- **Siconos**: Moreau's time-stepping on the Coulomb system, the friction a relay. Its error falls with
  the first power of the step. The smallest step is measured on the first case only.
- **XPPAUT** without a screen, `cvode`; it prints eight digits. **Octave** `lsode`, interpreted.
- **AUTO-07p** continues orbits; it is compared on that, not on trajectories.
"""


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
    cells = [
        name, row["asked"], duration(row["seconds"]), f"{rounded(1.0 / row['seconds'])}",
        times(row["ratio"]), equal, size(row["error_velocity"]), size(row["error_angle"]),
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


def absent(left_out: dict[str, str]) -> str:
    """A word on each peer that is not there."""
    return "".join(f"{name}: {why}.\n\n" for name, why in left_out.items())


def whole(found: dict[str, Any]) -> str:
    """The table as it is printed."""
    parts = (one_table(found["rows"]), branch_table(found["branch"]), absent(found["left_out"]))
    return "\n".join(part for part in parts if part)


def page(found: dict[str, Any], *, periods: int, points: int, force: float) -> str:
    """docs/benchmarks.md."""
    here = found["machine"]
    versions = ", ".join(f"{name} {number}" for name, number in here["versions"].items())
    text = PAGE.format(
        **{**here, "versions": versions}, periods=periods, points=points, force=force,
        table=one_table(found["rows"]), branch=branch_table(found["branch"]),
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

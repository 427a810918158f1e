"""Text of the titles: machine, assumptions, method and protocol."""

from __future__ import annotations

import math

from wedgebrake.figures.data import caption
from wedgebrake.model.paper_machines import DURATION, HERTZ, PRINTED_F0, WEDGE, Assumptions, Case
from wedgebrake.paper.laboratory import METHOD_WORDS, STEADY, Laboratory

GROUPS = ("eta", "f", "F0", "alpha")
SECTION = rf"$t = {STEADY:g}\,\mathrm{{s}} + n/f_e$ up to {DURATION:g} s"


def brake(case: Case) -> str:
    """Name of a case's brake."""
    return f"{case.brake.capitalize()} brake"


def groups(case: Case, names: tuple[str, ...] = GROUPS) -> str:
    """Groups of a case as equations; the wedge angle of wedge brakes only."""
    shown = {name: getattr(case, name) for name in names}
    if case.brake != WEDGE:
        shown.pop("alpha", None)
    return caption.equations(shown)


def others(*varied: str) -> tuple[str, ...]:
    """Groups that are not varied."""
    return tuple(name for name in GROUPS if name not in varied)


def printed(number: int, case: Case) -> str:
    """Printed F_0 in brackets, for figures where it differs."""
    if number not in (14, 15, 16) or case.F0 == PRINTED_F0:
        return ""
    return f" (printed: {groups(case.at(F0=PRINTED_F0), ('F0',))})"


def row(case: Case, varied: tuple[str, ...]) -> str:
    """Groups in which the rows of a figure differ, one per line, with whole hertz."""
    lines = [groups(case, (name,)) for name in varied]
    hertz = case.f / HERTZ
    if varied == ("f",) and math.isclose(hertz, round(hertz)):
        lines.append(f"({round(hertz)} Hz)")
    return "\n".join(lines)


def assumptions(chosen: Assumptions) -> str:
    """Assumptions as formulas."""
    words = f"Assumed: {chosen.words()}."
    for plain, formula in (
        ("c =", "$c$ ="),
        ("μ_s", r"$\mu_s$"),
        ("|θ'|", r"$|\dot\theta|$"),
        ("|v_r|", "$|v_r|$"),
    ):
        words = words.replace(plain, formula)
    return words


def both(laboratories: list[Laboratory]) -> str:
    """Methods with their colours."""
    return " ".join(
        f"{colour}: {METHOD_WORDS[one.method]}."
        for colour, one in zip(("Blue", "Orange"), laboratories, strict=False)
    )


def compared(laboratory: Laboratory) -> list[Laboratory]:
    """Laboratories to compare: the given one and, unless it is that, the exact solution."""
    if laboratory.method == "exact":
        return [laboratory]
    return [laboratory, laboratory.like(method="exact")]

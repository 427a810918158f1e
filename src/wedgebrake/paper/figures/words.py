"""The words of the titles: the machine, the assumptions, the method, the protocol."""

from __future__ import annotations

import math

from wedgebrake.figures.data import caption
from wedgebrake.paper.assumptions import WEDGE, Assumptions, Case
from wedgebrake.paper.diagrams import HERTZ, PRINTED_F0
from wedgebrake.paper.laboratory import DURATION, METHOD_WORDS, STEADY, Laboratory

GROUPS = ("eta", "f", "F0", "alpha")
SECTION = rf"$t = {STEADY:g}\,\mathrm{{s}} + n/f_e$ up to {DURATION:g} s"


def brake(case: Case) -> str:
    """The brake of a case."""
    return f"{case.brake.capitalize()} brake"


def groups(case: Case, names: tuple[str, ...] = GROUPS) -> str:
    """Groups of a case as equations; the wedge angle only of wedge brakes."""
    shown = {name: getattr(case, name) for name in names}
    if case.brake != WEDGE:
        shown.pop("alpha", None)
    return caption.equations(shown)


def others(*varied: str) -> tuple[str, ...]:
    """The groups that are not varied."""
    return tuple(name for name in GROUPS if name not in varied)


def printed(number: int, case: Case) -> str:
    """What the paper prints for F_0 instead, in brackets, of figures where that is another."""
    if number not in (14, 15, 16) or case.F0 == PRINTED_F0:
        return ""
    return f" (printed: {groups(case.at(F0=PRINTED_F0), ('F0',))})"


def row(case: Case, varied: tuple[str, ...]) -> str:
    """The groups that tell the rows of a figure apart, one a line; whole hertz where they are."""
    lines = [groups(case, (name,)) for name in varied]
    hertz = case.f / HERTZ
    if varied == ("f",) and math.isclose(hertz, round(hertz)):
        lines.append(f"({round(hertz)} Hz)")
    return "\n".join(lines)


def assumptions(chosen: Assumptions) -> str:
    """What the paper leaves unsaid, in formulas."""
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
    """The methods with their colours."""
    return " ".join(
        f"{colour}: {METHOD_WORDS[one.method]}."
        for colour, one in zip(("Blue", "Orange"), laboratories, strict=False)
    )


def compared(laboratory: Laboratory) -> list[Laboratory]:
    """The laboratory and, unless it is that already, the exact solution beside it."""
    if laboratory.method == "exact":
        return [laboratory]
    return [laboratory, laboratory.like(method="exact")]

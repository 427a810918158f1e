"""Errors name the argument, the value, what is allowed and the way out.

By what is written in the sources, and by what the public functions say of bad values.
"""

from __future__ import annotations

import ast
import inspect
import math
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import wedgebrake as wb

PACKAGE = Path(wb.__file__).parent
# What the caller completes: "paper.toml: is empty."
_CONTINUED = ("is ", "no such file", "missing: ", "cannot be read ")
# What must be, or what to do: a verb that begins a sentence or clause; or a word nearby.
_WAY_OUT = re.compile(
    r"\b(?:[Mm]ust|at most|needs|only|Allowed|for example|shows)\b"
    r"|\{nearest\(|\{(?:\w+\.)?(?:error|message|hint|way|why|what|more)\b|\{unused"
    r"|(?:^|[.;:,] |, or )(?:Change|Choose|Combine|Create|Edit|Fill|Find|Follow|Give|Install|Leave"
    r"|Lower|Make|Mend|Move|Raise|Remove|Save|Set|Simulate|Sort|Sweep|Take|Use|Wait|Widen|Write)\b",
    re.IGNORECASE,
)
# It says by itself what is wrong and what would be right.
_PLAIN = {"path = {path}: no name of a folder has a null character."}


def messages() -> Iterator[tuple[str, str]]:
    """(place, text) of every InputError and OutputError; values stand in braces."""
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            call = node.exc if isinstance(node, ast.Raise) else None
            name = call.func if isinstance(call, ast.Call) else None
            if isinstance(name, ast.Name) and name.id in ("InputError", "OutputError"):
                for text in texts(call.args[0]):
                    yield f"{path.relative_to(PACKAGE).as_posix()}:{node.lineno}", text


def texts(node: ast.expr) -> list[str]:
    """What an expression says, each way; nothing where it only hands on another error."""
    if isinstance(node, ast.Constant):
        return [str(node.value)]
    if isinstance(node, ast.JoinedStr):
        return ["".join(part(value) for value in node.values)]
    if isinstance(node, ast.IfExp):
        return texts(node.body) + texts(node.orelse)
    return []


def part(node: ast.expr) -> str:
    if isinstance(node, ast.FormattedValue):
        return "{" + ast.unparse(node.value).replace("{", "(").replace("}", ")") + "}"
    return str(node.value) if isinstance(node, ast.Constant) else ""


def names_its_subject(text: str) -> bool:
    """Whether no sentence ends before the first colon: "name = value: ", "--option value: "."""
    subject, colon, _ = text.partition(": ")
    return text.startswith((*_CONTINUED, "{")) or (bool(colon) and ". " not in subject)


MESSAGES = dict(messages())


def test_there_are_enough_of_them():
    assert len(MESSAGES) > 200


@pytest.mark.parametrize("place", MESSAGES)
def test_what_is_written(place):
    text = MESSAGES[place]
    assert names_its_subject(text), "names what is wrong first, then a colon"
    assert text.endswith((".", "}", "'")), "is a sentence"
    assert _WAY_OUT.search(text) or text in _PLAIN, "says what must be, or what to do"
    words = re.sub(r"\{[^}]*\}", "", text)
    assert not re.search(r"\b(?:invalid|illegal|failed|bad|oops|sorry|please)\b", words, re.I)


SYSTEM = wb.paper.system()
STUDY = wb.load_study(Path(__file__).parents[2] / "examples" / "paper.toml")


class Odd:
    """Something that nothing takes."""

    def __repr__(self) -> str:
        return "Odd()"


# Arguments with which a function does its work at once.
GOOD = {
    wb.simulate: {"system": SYSTEM, "periods": 2},
    wb.poincare: {"system": SYSTEM, "periods": 3, "transient": 1},
    wb.motion: {"system": SYSTEM, "periods": 30, "transient": 10},
    wb.orbit: {"system": SYSTEM, "order": 1, "initial": (0.01, 0.0)},
    wb.sweep: {"system": SYSTEM, "eta": [-6.0], "periods": 3, "transient": 1},
    wb.bifurcation: {"system": SYSTEM, "eta": [-6.0], "periods": 3, "transient": 1},
    wb.stability: {"system": SYSTEM},
    wb.stability_map: {"system": SYSTEM, "eta": [-6.0]},
    wb.load_study: {"path": "no.toml"},
    wb.read_study: {"content": ""},
    wb.save_study: {"study": STUDY, "path": "study.toml"},
}
OF_A_RESPONSE = (wb.spectrum, wb.sticks, wb.energy, wb.brake_torque, wb.plot)
BAD = {"odd": Odd(), "word": "nonsense", "nan": math.nan, "negative": -1.5, "huge": 10**30}
CASES = [
    (function, name)
    for function in (*GOOD, *OF_A_RESPONSE, wb.spectral_lines)
    for name, parameter in inspect.signature(function).parameters.items()
    if parameter.kind is not inspect.Parameter.VAR_KEYWORD and name not in ("store", "progress")
]


@pytest.fixture(scope="module")
def good() -> dict:
    response = wb.simulate(SYSTEM, periods=4)
    lines = {wb.spectral_lines: {"spectrum": wb.spectrum(response)}}
    first = {one: next(iter(inspect.signature(one).parameters)) for one in OF_A_RESPONSE}
    return {**GOOD, **lines, **{one: {name: response} for one, name in first.items()}}


@pytest.mark.parametrize("kind", BAD)
@pytest.mark.parametrize(("function", "name"), CASES, ids=lambda one: getattr(one, "__name__", one))
def test_what_is_said_of_a_bad_value(function, name, kind, good, tmp_path, monkeypatch):
    """It is refused in our words, or it is good: never another exception."""
    monkeypatch.chdir(tmp_path)
    arguments = {**good[function], name: BAD[kind]}
    if name == "duration":
        arguments.pop("periods")
    try:
        function(**arguments)
    except (wb.InputError, wb.OutputError) as error:
        text = str(error)
        assert re.search(rf"\b{name}\b|\bpath\b|nonsense|^study: is not TOML", text)
        assert text.endswith((".", ")", "?"))
        assert names_its_subject(text)
        assert len(text) < 700
    else:
        assert kind != "odd", "was taken"


def test_axes_of_sweeps_and_maps_say_the_same():
    for function in (wb.sweep, wb.bifurcation, wb.stability_map):
        for value in (Odd(), "nonsense", [math.nan], [], [[1.0], [2.0, 3.0]], np.eye(2)):
            with pytest.raises(wb.InputError, match=r"^(?:\w+ \()?eta\b.*\."):
                function(SYSTEM, eta=value)
        with pytest.raises(wb.InputError, match=r"^etta: .*(?:Did you mean 'eta'|Allowed)"):
            function(SYSTEM, etta=[1.0])

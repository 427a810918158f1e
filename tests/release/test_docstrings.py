"""Docstrings and signatures agree: what is described exists, and what exists is described."""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cached_property

import pytest
from pydantic import BaseModel

import wedgebrake as wb

# "start, stop : of the stretch [s]", "order, initial, method", "**axes : array of float".
_LISTED = re.compile(r"(\*{0,2}[a-zA-Z]\w*(?:, \*{0,2}[a-zA-Z]\w*)*)(?:\s+:(?:\s.*)?)?")


def public_functions() -> Iterator[tuple[str, Callable, type | None]]:
    """Every public function and method: its name, itself, and its class."""
    for name in wb.__all__:
        thing = getattr(wb, name)
        if inspect.isfunction(thing):
            yield name, thing, None
        elif inspect.isclass(thing):
            for method, raw in vars(thing).items():
                function = plain(raw)
                if function is None or method.startswith("_") or not ours(function):
                    continue
                yield f"{name}.{method}", function, thing
    yield "paper.system", wb.paper.system, None


def plain(raw: object) -> Callable | None:
    """The function behind a member of a class, if it is one."""
    if isinstance(raw, staticmethod | classmethod):
        raw = raw.__func__
    if isinstance(raw, property):
        raw = raw.fget
    if isinstance(raw, cached_property):
        raw = raw.func
    return raw if inspect.isfunction(raw) else None


def ours(function: Callable) -> bool:
    """Whether it is written here, not made by pydantic."""
    return (function.__module__ or "").startswith("wedgebrake")


FUNCTIONS = {name: (function, owner) for name, function, owner in public_functions()}
CLASSES = {name: getattr(wb, name) for name in wb.__all__ if inspect.isclass(getattr(wb, name))}


def described(function: Callable, owner: type | None) -> str:
    """The docstring, with those of the methods that this one overrides."""
    texts = [inspect.getdoc(function) or ""]
    for base in owner.__mro__[1:] if owner else ():
        overridden = plain(vars(base).get(function.__name__))
        if overridden is not None and ours(overridden):
            texts.append(inspect.getdoc(overridden) or "")
    return "\n".join(texts)


def parameters(function: Callable) -> list[str]:
    return [name for name in inspect.signature(function).parameters if name not in ("self", "cls")]


def listed(text: str) -> list[str]:
    """Names that a docstring lists as parameters: in their section, or "name : what it is"."""
    section = re.search(r"^Parameters\n-+\n(.*?)(?=^\w+\n-+\n|^Raises |\Z)", text, re.M | re.S)
    names: list[str] = []
    for line in (section[1] if section else re.sub(r"\w+\n-+\n.*", "", text, flags=re.S)).split(
        "\n"
    ):
        found = _LISTED.fullmatch(line)
        if found and (section or re.match(r"\S.*\s:\s", line)):
            names += re.split(r", ", found[1].replace("*", ""))
    return names


def raised(function: Callable) -> set[str]:
    """The exceptions that a function itself raises."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    calls = (node.exc for node in ast.walk(tree) if isinstance(node, ast.Raise))
    names = (call.func if isinstance(call, ast.Call) else call for call in calls)
    return {name.id for name in names if isinstance(name, ast.Name)}


def test_the_reader_of_docstrings_reads_them():
    section = "Parameters\n----------\na, b : int\n    Of both.\n**c\n    More.\n\n"
    assert listed(f"One.\n\n{section}Returns\n-------\nd : int\n") == ["a", "b", "c"]
    assert listed("One.\n\na    : of the first\n       and: of it\nb, c : others\n") == [*"abc"]
    assert listed("A sentence: with a colon.\n\nRaises ``InputError`` for x : y.") == []
    assert raised(wb.stability_map) <= {"InputError"}


def test_there_are_enough_of_them():
    assert len(FUNCTIONS) > 80
    assert len(CLASSES) > 20
    for name in ("simulate", "sweep", "BrakedDriveline.replace", "Branch.stop", "WedgeBrake.law"):
        assert name in FUNCTIONS or name == "WedgeBrake.law"


@pytest.mark.parametrize("name", FUNCTIONS)
class TestFunctions:
    def test_has_a_docstring_of_its_own(self, name):
        text = FUNCTIONS[name][0].__doc__
        assert text
        assert re.match(r"\S", text), "begins on the first line"
        assert re.search(r"[.:;]$", inspect.cleandoc(text).split("\n\n")[0]), "is a sentence"

    def test_every_parameter_is_described(self, name):
        function, owner = FUNCTIONS[name]
        text = described(function, owner)
        missing = [one for one in parameters(function) if not re.search(rf"\b{one}\b", text)]
        assert missing == []

    def test_with_a_list_of_parameters_the_list_is_theirs(self, name):
        function, _ = FUNCTIONS[name]
        names = listed(inspect.getdoc(function))
        assert len(set(names)) == len(names)
        if names:
            assert set(names) == set(parameters(function))

    def test_what_it_raises_is_told(self, name):
        function, owner = FUNCTIONS[name]
        told = described(function, owner)
        for error in raised(function) - {"NotImplementedError"}:
            assert re.search(rf"Raises\b.*\b{error}\b", told, re.S), error

    def test_what_is_told_to_be_raised_is_an_error_of_ours(self, name):
        text = inspect.getdoc(FUNCTIONS[name][0])
        for error in re.findall(r"\b[A-Z]\w*Error\b", text):
            assert error in wb.__all__


@pytest.mark.parametrize("name", CLASSES)
class TestClasses:
    def test_has_a_docstring_of_its_own(self, name):
        text = vars(CLASSES[name]).get("__doc__")
        assert text
        assert not text.startswith(f"{name}("), "made by dataclass"

    def test_every_field_is_described(self, name):
        kind = CLASSES[name]
        if issubclass(kind, BaseModel):
            for field, about in kind.model_fields.items():
                words = about.description or inspect.getdoc(about.annotation) or kind.__doc__
                assert words, field
                assert re.search(r"\w{3}", words), field
        elif is_dataclass(kind):
            public = [field.name for field in fields(kind) if not field.name.startswith("_")]
            missing = [one for one in public if not re.search(rf"\b{one}\b", kind.__doc__)]
            assert missing == []

    def test_every_field_that_a_list_names_exists(self, name):
        kind = CLASSES[name]
        if is_dataclass(kind):
            for one in listed(inspect.getdoc(kind)):
                assert hasattr(kind, one) or one in {field.name for field in fields(kind)}

    def test_every_outcome_has_a_sentence(self, name):
        kind = CLASSES[name]
        if issubclass(kind, Enum):
            for outcome in kind:
                assert re.fullmatch(r"[A-Z].*\.", outcome.sentence, re.S)

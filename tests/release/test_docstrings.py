"""Every public name is documented: functions with their parameters, classes with their fields."""

from __future__ import annotations

import ast
import inspect
import pydoc
import re
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cached_property
from pathlib import Path

import pytest
from pydantic import BaseModel

import wedgebrake as wb

CLASSES = {name: getattr(wb, name) for name in wb.__all__ if inspect.isclass(getattr(wb, name))}


def plain(raw: object) -> Callable | None:
    """The function behind a member of a class, if it is one of ours."""
    raw = raw.__func__ if isinstance(raw, staticmethod | classmethod) else raw
    raw = raw.fget if isinstance(raw, property) else raw
    raw = raw.func if isinstance(raw, cached_property) else raw
    ours = inspect.isfunction(raw) and (raw.__module__ or "").startswith("wedgebrake")
    return raw if ours else None


def public_functions() -> Iterator[tuple[str, Callable, str]]:
    """Name, function, and its docstring with those of the methods that it overrides."""
    for name in wb.__all__:
        if inspect.isfunction(getattr(wb, name)):
            yield name, getattr(wb, name), getattr(wb, name).__doc__
    for name in wb.testing.__all__:
        function = getattr(wb.testing, name)
        yield f"testing.{name}", function, function.__doc__
    yield "paper.system", wb.paper.system, wb.paper.system.__doc__
    for name, kind in CLASSES.items():
        for method, raw in vars(kind).items():
            function = plain(raw)
            if function is not None and not method.startswith("_"):
                family = (plain(vars(base).get(method)) for base in kind.__mro__)
                yield f"{name}.{method}", function, "\n".join(one.__doc__ for one in family if one)


PACKAGE = Path(wb.__file__).parent
FOLDERS = sorted(init.parent for init in PACKAGE.rglob("__init__.py") if init.parent != PACKAGE)
FUNCTIONS = {name: rest for name, *rest in public_functions()}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_parameter_is_described(name):
    function, text = FUNCTIONS[name]
    assert function.__doc__
    names = [one for one in inspect.signature(function).parameters if one not in ("self", "cls")]
    assert [one for one in names if not re.search(rf"\b{one}\b", text)] == []
    for error in re.findall(r"\b[A-Z]\w*Error\b", function.__doc__):
        assert error in {*wb.__all__, "AssertionError"}


@pytest.mark.parametrize("name", CLASSES)
def test_every_field_is_described(name):
    kind = CLASSES[name]
    text = vars(kind).get("__doc__")
    assert text
    assert not text.startswith(f"{name}("), "made by dataclass"
    if issubclass(kind, BaseModel):
        for field, about in kind.model_fields.items():
            assert about.description or inspect.getdoc(about.annotation), field
    elif is_dataclass(kind):
        public = [field.name for field in fields(kind) if not field.name.startswith("_")]
        assert [one for one in public if not re.search(rf"\b{one}\b", text)] == []
    elif issubclass(kind, Enum):
        assert all(outcome.sentence for outcome in kind)


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: str(folder.relative_to(PACKAGE)))
def test_every_file_is_in_the_list_of_its_package(folder):
    """``__init__`` describes the files beside it, or its parent does."""
    lists = (ast.get_docstring(ast.parse((at / "__init__.py").read_text())) or ""
             for at in (folder, folder.parent))  # fmt: skip
    words = set(re.findall(r"\w+", "\n".join(lists)))
    files = {file.stem for file in folder.glob("*.py")} - {"__init__"}
    folders = {inner.parent.name for inner in folder.glob("*/__init__.py")}
    assert (files | folders) - words == set()


def test_help_on_parts_lists_their_values_and_no_methods_of_pydantic() -> None:
    shown = pydoc.render_doc(wb.HarmonicTorque, renderer=pydoc.plaintext)
    assert "HarmonicTorque(amplitude, frequency, orders=())" in shown
    assert "torque frequency f_e [Hz]" in shown
    assert "model_dump" not in shown

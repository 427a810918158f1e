"""Compiled kernels: their cache, and the kernels compiled for this machine."""

from __future__ import annotations

import ast
import os
import pickle
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import wedgebrake

_PACKAGE = Path(wedgebrake.__file__).parent
_DECORATORS = ("compiled", "inlined", "internal", "borrowing")
# "linear_flow.constants-254.py311.nbi": index of the compiled signatures of one function.
_INDEX = re.compile(r"(\w+\.\w+)-\d+\.py\d+\w*\.nbi")


def kernels() -> tuple[dict[str, Any], dict[str, Any]]:
    """Current state of the cache and of the kernels; nothing is compiled.

    Of the cache: folder, None if no folder is writable; problem: why nothing can be kept or
    read there, "" if there is none. Of the kernels: all, their number; and the names
    "package.module.function" of those compiled: that need no compilation on this machine, and
    stale: compiled from other sources, by another Numba or for another processor.
    """
    found = kernels_of_packages()
    fresh, stale = set[str](), set[str]()
    folder = None
    try:
        from numba.core import config

        if vars(config)["DISABLE_JIT"]:  # set when Numba is imported, unknown to type checkers
            problem = "compilation is switched off"
        else:
            folders = {package: _folder(package) for package in found}
            for package, place in folders.items():
                for total, cached in zip((fresh, stale), _cached(place), strict=True):
                    total.update(f"{package}.{name}" for name in cached)
            problem = _unwritable(folders["dynamics"])
            folder = os.path.commonpath(folders.values())
    except Exception as error:  # Numba broken, or no folder for its cache
        problem = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        if "no locator available" in problem:
            problem = "no folder for it can be written"
    names = {f"{package}.{one}" for package, ones in found.items() for one in ones}
    return {"folder": folder, "problem": problem}, {
        "all": len(names),
        "compiled": sorted(names & fresh),
        "stale": sorted(names & stale - fresh),
    }


def _folder(package: str) -> Path:
    """The folder in which Numba keeps the kernels of a package; none of them is imported."""
    from numba.core.caching import CompileResultCacheImpl

    source = _PACKAGE / package.replace(".", "/") / "__init__.py"
    scope: dict[str, Any] = {}
    # Numba uses the path of the source, and some kernels are compiled when they are imported.
    exec(compile("def kernel(): pass", source, "exec"), scope)  # noqa: S102
    cache = CompileResultCacheImpl(scope["kernel"])  # type: ignore[no-untyped-call]
    return Path(cache.locator.get_cache_path())


def kernels_of_packages() -> dict[str, set[str]]:
    """Kernels by package, from the sources: functions decorated with ``compiled``."""
    found: dict[str, set[str]] = {}
    for path in sorted(_PACKAGE.rglob("*.py")):
        names = set() if path.stem == "jit" else set(_names_in(path))
        if names:
            package = ".".join(path.parent.relative_to(_PACKAGE).parts)
            found.setdefault(package, set()).update(names)
    return found


def _names_in(path: Path) -> Iterator[str]:
    text = path.read_text(encoding="utf-8")
    for node in ast.walk(ast.parse(text)) if "dynamics.jit" in text else ():
        if isinstance(node, ast.FunctionDef):
            if any(map(_compiles, node.decorator_list)):
                yield f"{path.stem}.{node.name}"
        elif isinstance(node, ast.Call) and _compiles(node.func):
            for given in node.args:
                if isinstance(given, ast.Attribute) and isinstance(given.value, ast.Name):
                    yield f"{given.value.id}.{given.attr}"
                elif isinstance(given, ast.Name):
                    yield f"{path.stem}.{given.id}"


def _compiles(node: ast.expr) -> bool:
    """Return True for the decorators of kernels and ``compiled_for(signature)``."""
    if isinstance(node, ast.Call):
        return isinstance(node.func, ast.Name) and node.func.id == "compiled_for"
    return isinstance(node, ast.Name) and node.id in _DECORATORS


def _cached(folder: Path) -> tuple[set[str], set[str]]:
    """Names compiled for this machine from these sources, and from other sources."""
    import numba
    from numba.core.registry import cpu_target

    from wedgebrake.dynamics.jit import SOURCE_STAMP

    machine = cpu_target.target_context.codegen().magic_tuple()
    fresh: set[str] = set()
    stale: set[str] = set()
    for path in folder.glob("*.nbi"):
        name = _INDEX.fullmatch(path.name)
        if name is None:
            continue
        try:
            with path.open("rb") as file:
                # Written by numba.core.caching.IndexDataCacheFile; Numba itself trusts it.
                same = pickle.load(file) == numba.__version__  # noqa: S301
                stamp, overloads = pickle.loads(file.read()) if same else (None, {})  # noqa: S301
        except Exception:  # damaged: Numba compiles it again
            stamp, overloads = None, {}
        usable = stamp == SOURCE_STAMP and any(key[1] == machine for key in overloads)
        (fresh if usable else stale).add(name[1])
    return fresh, stale


def _unwritable(folder: Path) -> str:
    try:
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        return f"cannot be written ({error.strerror})"
    wanted = os.environ.get("NUMBA_CACHE_DIR")
    if wanted and not folder.is_relative_to(Path(wanted).resolve()):
        return f"is used because NUMBA_CACHE_DIR = {wanted} cannot be written"
    return ""

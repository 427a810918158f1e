"""Implementation of ``wedgebrake doctor``: installation, problems and remedies."""

from __future__ import annotations

import os
import platform
import re
import sys
import tempfile
import textwrap
import warnings
from importlib import import_module
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Any

import wedgebrake
from wedgebrake.errors import InputError

EXTRAS = {
    "netcdf": "--out in netCDF",
    "app": "the explorer, wedgebrake app",
    "cluster": "client= of sweeps",
    "traces": "fit to TDMS, MF4 and UFF files",
}
"""Extras for users of wedgebrake, and their purpose."""

# Packages that are imported under another name.
_MODULES = {"pillow": "PIL"}
_WIDTH = 96


def examine() -> dict[str, Any]:
    """Return the state of the installation as plain data, with ``healthy`` and ``advice``.

    An extra that is not installed is not a problem; a partly installed extra is.
    """
    needed = packages()
    extras = {name: packages(name) for name in EXTRAS}
    cache = kernel_cache()
    advice = _advice(needed, extras, cache)
    # Like sweeps.executor.processors, whose import would load, and first compile, the kernels.
    affinity = hasattr(os, "sched_getaffinity")
    return {
        "wedgebrake": wedgebrake.__version__,
        "folder": str(Path(wedgebrake.__file__).parent),
        "python": platform.python_version(),
        "executable": sys.executable,
        "platform": platform.platform(),
        "packages": needed,
        "extras": {
            name: {
                "use": EXTRAS[name],
                "complete": bool(parts) and not any(one["problem"] for one in parts),
                "packages": parts,
            }
            for name, parts in extras.items()
        },
        "processors": os.cpu_count(),
        "threads": len(os.sched_getaffinity(0)) if affinity else os.cpu_count() or 1,
        "cache": cache,
        "healthy": not advice,
        "advice": advice,
    }


def packages(extra: str = "") -> list[dict[str, Any]]:
    """The packages of an extra, or those always needed, each tested by import.

    Each has its name for pip; needed: the least version, "" if any is sufficient; installed:
    the version, or None; problem: why it cannot be used, "" if it can.

    Raises ``InputError`` if Python does not know the requirements of wedgebrake.
    """
    try:
        lines = requires("wedgebrake") or []
    except PackageNotFoundError:
        raise InputError(
            "doctor: wedgebrake is imported from a folder, not installed: its requirements are not"
            " known. Install it: pip install wedgebrake, or in a clone pip install -e ."
        ) from None
    found = []
    for line in lines:
        requirement, _, condition = line.partition(";")
        of = re.search(r"extra\s*==\s*['\"]([\w-]+)", condition)
        if (of[1] if of else "") == extra:
            name, least = re.findall(r"^([\w.-]+)(?:.*?>=\s*([\w.]+))?", requirement.strip())[0]
            installed, problem = _tried(name, least)
            found.append(
                {"name": name, "needed": least, "installed": installed, "problem": problem}
            )
    return found


def _tried(name: str, needed: str) -> tuple[str | None, str]:
    try:
        installed = version(name)
    except PackageNotFoundError:
        return None, "is not installed"
    if _numbers(installed) < _numbers(needed):
        return installed, f"is too old: at least {needed} is needed"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import_module(_MODULES.get(name, name.replace("-", "_")))
    except Exception as error:  # a broken package may raise any exception
        why = " ".join(f"{type(error).__name__}: {error}".split())
        return installed, f"cannot be imported ({why[:200]})"
    return installed, ""


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(int(number) for number in re.findall(r"\d+", text.partition("+")[0])[:3])


def kernel_cache() -> dict[str, Any]:
    """The folder in which Numba keeps compiled kernels, None if it has none, and its problem.

    problem : why kernels cannot be stored or read there, "" if there is none. Compiles nothing.
    """
    folder = None
    try:
        from numba.core.caching import CompileResultCacheImpl

        # Numba uses the path of the source, and some kernels are compiled when they are imported.
        source = Path(wedgebrake.__file__).parent / "dynamics" / "__init__.py"
        scope: dict[str, Any] = {}
        exec(compile("def kernel(): pass", source, "exec"), scope)  # noqa: S102
        cache = CompileResultCacheImpl(scope["kernel"])  # type: ignore[no-untyped-call]
        folder = Path(cache.locator.get_cache_path())
        problem = _unwritable(folder)
    except Exception as error:  # Numba does not work, or has no folder for its cache
        problem = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        if "no locator available" in problem:
            problem = "no folder for the cache can be written"
    return {"folder": str(folder) if folder else None, "problem": problem}


def _unwritable(folder: Path) -> str:
    try:
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        return f"cannot be written ({error.strerror})"
    wanted = os.environ.get("NUMBA_CACHE_DIR")
    if wanted and not folder.is_relative_to(Path(wanted).resolve()):
        return f"is used because NUMBA_CACHE_DIR = {wanted} cannot be written"
    return ""


def _advice(
    needed: list[dict[str, Any]], extras: dict[str, list[dict[str, Any]]], cache: dict[str, Any]
) -> list[str]:
    """A sentence for each problem, with a remedy."""
    advice = []
    for one in needed:
        least = f">={one['needed']}" if one["needed"] else ""
        advice += _way_out(one, "", one["name"] + least)
    healthy = not advice
    for name, parts in extras.items():
        if not parts:
            advice.append(
                f"The extra {name} is not in the record of the installation, which is older than"
                " the program. Install wedgebrake again, in a clone with pip install -e ."
            )
        if any(one["installed"] for one in parts):  # otherwise the extra is not used
            for one in parts:
                advice += _way_out(one, f" of the extra {name}", f"wedgebrake[{name}]")
    problem = cache["problem"]
    if healthy and problem:
        folder = f", {cache['folder']}," if cache["folder"] else ":"
        advice.append(
            f"The cache of compiled kernels{folder} {problem}. Set NUMBA_CACHE_DIR to a folder that"
            " can be written."
        )
    return advice


def _way_out(one: dict[str, Any], of: str, wanted: str) -> list[str]:
    if not one["problem"]:
        return []
    again = "--force-reinstall " if one["problem"].startswith("cannot") else ""
    how = f"{sys.executable} -m pip install {again}'{wanted}'"
    return [f"{one['name']}{of} {one['problem']}. Run: {how}"]


def text(report: dict[str, Any]) -> str:
    """The report as text."""
    cache = report["cache"]
    lines = [
        f"wedgebrake {report['wedgebrake']} in {report['folder']}",
        f"Python {report['python']} ({report['executable']}) on {report['platform']}",
        f"{report['processors']} processors; a sweep computes in {report['threads']} threads",
        "",
        *_listed("Needed", report["packages"]),
    ]
    for name, extra in report["extras"].items():
        state = "complete" if extra["complete"] else "not complete"
        lines += ["", *_listed(f"Extra {name}, {state} ({extra['use']})", extra["packages"])]
    lines += ["", f"Cache of compiled kernels: {cache['folder'] or 'no folder'}"]
    if cache["problem"]:
        lines.append(f"  {cache['problem']}")
    wrap = textwrap.TextWrapper(
        _WIDTH, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False
    )
    wrapped = [row for line in report["advice"] for row in wrap.wrap(f"- {line}")]
    return "\n".join([*lines, "", *(wrapped or ["No problems found."])])


def _listed(title: str, parts: list[dict[str, Any]]) -> list[str]:
    return [title] + [
        f"  {one['name']:14}{one['installed'] or '-':14}{one['problem']}".rstrip() for one in parts
    ]

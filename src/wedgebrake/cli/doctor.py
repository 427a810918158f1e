"""The work of ``wedgebrake doctor``: what is there, what is wrong, and what to do."""

from __future__ import annotations

import os
import platform
import sys
import textwrap
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import wedgebrake
from wedgebrake.cli.doctor_kernels import Kernels, kernels
from wedgebrake.cli.doctor_packages import EXTRAS, Package, packages

_WIDTH = 96


def examine() -> dict[str, Any]:
    """Return the state of the installation as plain data, with ``healthy`` and ``advice``.

    An extra of which nothing is installed is no fault; one that is there in part is.
    """
    needed = packages()
    extras = {name: packages(name) for name in EXTRAS}
    compiled = kernels()
    advice = _advice(needed, extras, compiled)
    return {
        "wedgebrake": wedgebrake.__version__,
        "folder": str(Path(wedgebrake.__file__).parent),
        "python": platform.python_version(),
        "executable": sys.executable,
        "platform": platform.platform(),
        "packages": [asdict(one) for one in needed],
        "extras": {
            name: {
                "use": EXTRAS[name],
                "complete": bool(parts) and not any(one.problem for one in parts),
                "packages": [asdict(one) for one in parts],
            }
            for name, parts in extras.items()
        },
        "processors": os.cpu_count(),
        "threads": _threads(),
        "cache": {
            "folder": None if compiled.folder is None else str(compiled.folder),
            "problem": compiled.problem,
        },
        "kernels": {
            "all": len(compiled.names),
            "compiled": list(compiled.compiled),
            "stale": list(compiled.stale),
        },
        "healthy": not advice,
        "advice": advice,
    }


def text(report: dict[str, Any]) -> str:
    """The same for a person."""
    state, cache = report["kernels"], report["cache"]
    lines = [
        f"wedgebrake {report['wedgebrake']} in {report['folder']}",
        f"Python {report['python']} ({report['executable']}) on {report['platform']}",
        f"{report['processors']} processors; a sweep computes in {report['threads']} threads",
        "",
        *_listed("Needed", report["packages"]),
    ]
    for name, extra in report["extras"].items():
        state_of = "complete" if extra["complete"] else "not complete"
        lines += ["", *_listed(f"Extra {name}, {state_of} ({extra['use']})", extra["packages"])]
    lines += ["", f"Compiled kernels: {cache['folder'] or 'no place for them'}"]
    if cache["problem"]:
        lines.append(f"  {cache['problem']}")
    done = len(state["compiled"])
    lines.append(f"  {done} of {state['all']} are compiled for this machine" + _rest(state))
    lines += ["", *(_wrapped(report["advice"]) or ["All is well."])]
    return "\n".join(lines)


def _rest(state: dict[str, Any]) -> str:
    if len(state["compiled"]) == state["all"]:
        return "."
    words = "; the others when they are first called, in seconds, and are then kept."
    if state["stale"]:
        words += f"\n  {len(state['stale'])} of them are there from other sources or versions."
    return words


def _listed(title: str, parts: list[dict[str, Any]]) -> list[str]:
    rows = [title]
    for part in parts:
        seen = part["installed"] or "-"
        rows.append(f"  {part['name']:14}{seen:14}{part['problem']}".rstrip())
    return rows


def _wrapped(advice: list[str]) -> list[str]:
    return [
        row
        for line in advice
        for row in textwrap.wrap(
            f"- {line}",
            _WIDTH,
            subsequent_indent="  ",
            break_long_words=False,
            break_on_hyphens=False,
        )
    ]


def _threads() -> int:
    """How many threads a sweep takes by default: ``sweeps.executor.processors``.

    Not asked there, as that loads, and at first compiles, the kernels.
    """
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _advice(
    needed: Iterable[Package], extras: dict[str, tuple[Package, ...]], compiled: Kernels
) -> list[str]:
    """A sentence for each thing that is wrong: what, and the way out."""
    wrong = [one for one in needed if one.problem]
    advice = [f"{one.name} {one.problem}." + _way_out(one, one.requirement) for one in wrong]
    for name, parts in extras.items():
        if not parts:
            advice.append(
                f"The extra {name} is not in the record of the installation, which is older than"
                " the program. Install wedgebrake again, in a clone with pip install -e ."
            )
        if all(one.installed is None for one in parts):
            continue  # not wanted
        advice += [
            f"{one.name} of the extra {name} {one.problem}." + _way_out(one, f"wedgebrake[{name}]")
            for one in parts
            if one.problem
        ]
    if compiled.problem and not wrong:
        advice.append(_about_cache(compiled))
    return advice


def _about_cache(compiled: Kernels) -> str:
    if compiled.problem.endswith("switched off"):
        return f"Numba: {compiled.problem}. Unset NUMBA_DISABLE_JIT: kernels run compiled only."
    what = "The cache of compiled kernels" + (f", {compiled.folder}," if compiled.folder else ":")
    return f"{what} {compiled.problem}. Set NUMBA_CACHE_DIR to a folder that can be written."


def _way_out(package: Package, wanted: str) -> str:
    again = "--force-reinstall " if package.problem.startswith("cannot") else ""
    return f" Run: {sys.executable} -m pip install {again}'{wanted}'"

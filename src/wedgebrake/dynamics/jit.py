"""Compilation of all kernels: once, cached on disk, strict floating point.

Only contraction (fused multiply-add) is allowed beyond IEEE rules; reassociation and the
assumption of finite values would break the proofs of ``bound`` and the tests for infinity.
Division by zero gives infinity, as in NumPy.

Numba's disk cache checks the time stamp of the file of a function only, and would
serve a stale kernel after a change in another kernel that it calls. Here every cache
carries a common stamp: the contents of all files with kernels and of those that they import.
"""

import re
import warnings
from collections.abc import Callable
from functools import cache, partial, wraps
from hashlib import sha256
from pathlib import Path
from threading import Lock
from typing import Any

from numba import from_dtype, njit, types
from numba.core.errors import NumbaExperimentalFeatureWarning
from numba.extending import overload

from wedgebrake.dynamics.compilation import compile_in_parts, switched_on
from wedgebrake.dynamics.compile_progress import report_in_notebooks

# Function pointers have been "experimental" since 2020; the tests cover our use of them.
warnings.filterwarnings(
    "ignore", message="First-class function type", category=NumbaExperimentalFeatureWarning
)

report_in_notebooks()

_OPTIONS: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract"},
    # Explicit, because a kernel would inherit them from its first caller.
    "forceinline": False,
    "_nrt": True,
}


PACKAGE = Path(__file__).parents[1]
# Folders with kernels.
FOLDERS = ("dynamics", "solvers", "analysis", "orbits")


_KERNELS = "from wedgebrake.dynamics.jit import"
_IMPORTED = re.compile(r"^from wedgebrake\.(\S+) import", re.MULTILINE)


def _stamp() -> str:
    files = (file for folder in FOLDERS for file in (PACKAGE / folder).rglob("*.py"))
    texts = {".".join(f.relative_to(PACKAGE).with_suffix("").parts): f.read_text() for f in files}
    names = {name for name, text in texts.items() if _KERNELS in text}
    ahead = set(names)
    while ahead:
        imported = {name for user in ahead for name in _IMPORTED.findall(texts[user])}
        ahead = (imported & texts.keys()) - names
        names |= ahead
    return sha256("".join(texts[name] for name in sorted(names)).encode()).hexdigest()


SOURCE_STAMP = _stamp()


def compiled(function: Callable[..., Any], **options: Any) -> Any:
    """Compile a kernel at its first call."""
    dispatcher = dispatcher_of(function, **{**_OPTIONS, **options})
    # Private, since Numba has no public interface; test_compiling fails if this stops working.
    index = getattr(dispatcher._cache, "_cache_file", None)
    if index is not None:
        index._source_stamp = SOURCE_STAMP
        index._load_index = partial(_index_or_none, index._load_index)
    compile_in_parts(dispatcher)
    return dispatcher


def dispatcher_of(function: Callable[..., Any], *, kept: bool = True, **options: Any) -> Any:
    """``numba.njit`` within ``switched_on``.

    kept : whether compiled code is kept on disk, if a folder for it can be written
    """
    with switched_on():
        dispatcher = njit(**options)(function)
    try:
        if kept:
            dispatcher.enable_caching()
    except RuntimeError:  # of Numba: no folder can be written
        _warn_of_no_folder()
    return dispatcher


@cache
def _warn_of_no_folder() -> None:
    warnings.warn(
        "wedgebrake cannot keep its compiled kernels: neither the folder of the package nor that"
        " of the user's caches can be written. Each process compiles them again, which takes up to"
        " minutes. Set NUMBA_CACHE_DIR to a folder that can be written.",
        RuntimeWarning,
        stacklevel=2,
    )


def _index_or_none(load: Callable[[], dict[Any, Any]]) -> dict[Any, Any]:
    """The index of a cache; empty if other sources wrote it, with types that no longer exist."""
    try:
        return load()
    except (AttributeError, ImportError):
        return {}


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a part of a kernel into each kernel that calls it.

    For parts that would otherwise be called for every event with arrays or many numbers.
    """
    return compiled(function, forceinline=True)


def borrowing(function: Callable[..., Any]) -> Any:
    """Compile a kernel that allocates nothing, without counting references to arrays.

    Its callers hold all arrays; counting would take a third of the time of a short cell.
    """
    return compiled(function, _nrt=False)


def embedded(function: Callable[..., Any]) -> Any:
    """Compile a part of a ``borrowing`` kernel into each kernel that calls it, like ``inlined``.

    Each array passed to a kernel takes ten words; passing the arrays of a problem costs more time
    than many of the kernels themselves.
    """
    return compiled(function, forceinline=True, _nrt=False)


def compiled_for(signature: Any) -> Callable[[Callable[..., Any]], Any]:
    """Compile a kernel at its first call, for one signature, with laws as function pointers.

    Without a fixed signature, a kernel would be compiled anew
    for every new law. Compiled when it is imported, it would delay commands that do not call it.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher = compiled(function)
        lock = Lock()

        @wraps(function)
        def run(*arguments: Any) -> Any:
            with lock:
                if not dispatcher.overloads:
                    dispatcher.compile(signature)
                    dispatcher.disable_compile()
            return dispatcher(*arguments)

        return run

    return decorate


def chosen_by_class(kernels: dict[type, Callable[..., Any]]) -> Callable[..., Any]:
    """Return a kernel that calls the kernel for the class of its first argument.

    The classes are named tuples. Kernels choose when they are compiled, at no cost at run time.
    """

    def chosen(first: Any, *rest: Any) -> Any:
        return kernels[type(first)](first, *rest)

    def choose(first, *rest):  # noqa: ARG001 - Numba's signature
        kernel = kernels.get(getattr(first, "instance_class", None))
        return None if kernel is None else kernel.py_func

    overload(chosen, jit_options={"forceinline": True}, strict=False)(choose)
    return chosen


def array_of(dtype: Any) -> Any:
    """Type of a contiguous vector of records, for signatures."""
    return types.Array(from_dtype(dtype), 1, "C")

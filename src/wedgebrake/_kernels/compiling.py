"""How every kernel is compiled: once, cached on disk, strict floating point.

Only contraction (fused multiply-add) is allowed beyond IEEE rules; reassociation and the
assumption of finite values would break the proofs of ``bound`` and the tests for infinity.
Division by zero gives infinity, as in NumPy.

Numba's disk cache looks at the time stamp of the one file that holds a function, and would
serve a stale kernel after a change in another kernel that it calls. Here every cache
carries the stamp of all kernel files together.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit

_OPTIONS: dict[str, Any] = {"cache": True, "error_model": "numpy", "fastmath": {"contract"}}


def _stamp() -> tuple[tuple[str, int, int], ...]:
    files = sorted(Path(__file__).parent.glob("*.py"))
    return tuple((file.name, file.stat().st_mtime_ns, file.stat().st_size) for file in files)


SOURCE_STAMP = _stamp()


def compiled(function: Callable[..., Any], signature: Any = None) -> Any:
    """Compile a kernel at its first call, or at once for a given signature."""
    if signature is None:
        dispatcher = njit(**_OPTIONS)(function)
        stamped(dispatcher)
        return dispatcher
    lazy = compiled(function)
    lazy.compile(signature)
    lazy.disable_compile()
    return lazy


def stamped(dispatcher: Any) -> None:
    """Tie the disk cache of a compiled function to all kernel files."""
    # Private, since Numba has no public way; test_compiling fails if this stops working.
    dispatcher._cache._cache_file._source_stamp = SOURCE_STAMP

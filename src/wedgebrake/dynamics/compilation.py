"""Machine code only for the kernels that Python calls.

Numba translates each kernel to machine code together with all kernels that it calls, so that a
kernel ten calls deep is optimised ten times: most of the time of a first run. Here a kernel that is
compiled because another one calls it remains intermediate code, which becomes part of its callers.
If Python calls it, too, it is compiled once more, with machine code. The callers never contain this
optimised code: their rounding would then depend on what Python has called before.

Numba has no public interface for this; tests/unit/test_compiling.py fails if the private one that
is used here changes.
"""

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

from numba.core import config, sigutils
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler_lock import global_compiler_lock

_WITHOUT_WRAPPERS = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


class _Part(JITCodeLibrary):
    """Intermediate code of a kernel, for the kernels that call it."""

    def _optimize_final_module(self) -> None:
        """Leave this to the callers."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:  # noqa: ARG002 - Numba's signature
        """Address 0, since there is no machine code."""
        return 0

    @property
    def codegen(self) -> "_Part":
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Store nothing in machine code."""

    def serialize_using_object_code(self) -> Any:
        return self.serialize_using_bitcode()


# The kernels that are being compiled, each for the one before; guarded by Numba's lock.
_compiling: list[Any] = []
# Compiled kernels that Python calls and that have been replaced as parts of others.
_called: list[Any] = []


@contextmanager
def switched_on() -> Iterator[None]:
    """Inside, Numba compiles although NUMBA_DISABLE_JIT is set: kernels take compiled laws."""
    with global_compiler_lock:
        switches = vars(config)
        before, switches["DISABLE_JIT"] = switches["DISABLE_JIT"], 0
        try:
            yield
        finally:
            switches["DISABLE_JIT"] = before


def compile_in_parts(dispatcher: Any) -> None:
    """Let a kernel be compiled to machine code only where Python calls it."""
    compile_, compiler = dispatcher.compile, dispatcher._compiler
    options = compiler.targetoptions
    insert: Callable[..., None] = dispatcher._insert

    def compile_as(signature: Any) -> Any:
        with switched_on():
            nested = bool(_compiling)
            existing = dispatcher.overloads.get(tuple(sigutils.normalize_signature(signature)[0]))
            if existing is not None and isinstance(existing.library, _Part) != nested:
                _called.append(existing)
                del dispatcher.overloads[tuple(existing.signature.args)]
            codegen = dispatcher.targetctx.codegen()
            library = codegen._library_class
            codegen._library_class = _Part if nested else JITCodeLibrary
            compiler.targetoptions = {**options, **_WITHOUT_WRAPPERS} if nested else options
            # What Python calls is looked up among what has been inserted.
            dispatcher._insert = _ignore if nested else insert
            _compiling.append(dispatcher)
            try:
                with nullcontext() if nested else _without_collections():
                    return compile_(signature)
            finally:
                _compiling.pop()
                codegen._library_class = library

    dispatcher.compile = compile_as
    index_key = getattr(dispatcher._cache, "_index_key", None)
    if index_key is not None:
        dispatcher._cache._index_key = lambda signature, codegen: (
            *index_key(signature, codegen),
            len(_compiling) > 1,
        )


@contextmanager
def _without_collections() -> Iterator[None]:
    """Switch the cyclic garbage collector off: it takes a fifth of the time of a compilation."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()


def _ignore(*_: Any) -> None:
    """Insert nothing."""

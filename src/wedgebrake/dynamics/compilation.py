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
from functools import cache
from typing import Any

from numba.core import config, event, ir, sigutils, types
from numba.core.base import BaseContext
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler_lock import global_compiler_lock
from numba.core.targetconfig import TargetConfig

_WITHOUT_WRAPPERS = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


class _Part(JITCodeLibrary):
    """Intermediate code of a kernel, for the kernels that call it."""

    def _optimize_functions(self, module: Any) -> None:
        """Optimize the functions that the module defines, and not those that it declares, too."""
        module.data_layout = self._codegen._data_layout
        for function in module.functions:
            if not function.is_declaration:
                passes, builder = self._codegen._function_pass_manager()
                passes.run(function, builder)

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
                with nullcontext() if nested else _quickly():
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
def _quickly() -> Iterator[None]:
    """Leave out what takes time in a compilation and has no effect on its result.

    The cyclic garbage collector; timers of every nested compilation, each of which is told of every
    call of LLVM; events that nobody listens to; comparisons of all flags, the size of a type, and
    the search for the meaning of an operator, for the same types again.
    """
    collects = gc.isenabled()
    changes: list[tuple[Any, str, Callable[[Any], Any]]] = [
        (event, "install_timer", lambda _: _no_timer),
        (event, "start_event", _heard),
        (event, "end_event", _heard),
        (ir.Inst, "_rec_list_vars", lambda _: _variables),
        (BaseContext, "get_abi_sizeof", _remembered_sizes),
        (_BUILTIN, "get_call_type", _remembered),
        (TargetConfig, "__hash__", lambda _: _hash),
        (TargetConfig, "__eq__", _compared),
    ]
    gc.disable()
    usual = [(place, name, getattr(place, name)) for place, name, _ in changes]
    try:
        for (place, name, quick), (*_, before) in zip(changes, usual, strict=True):
            setattr(place, name, quick(before))
        yield
    finally:
        for place, name, before in usual:
            setattr(place, name, before)
        if collects:
            gc.enable()


_BUILTIN = types.functions.BaseFunction
# Types whose operators mean the same whenever they are looked up.
_SETTLED = (types.Number, types.Boolean, types.Array, types.Record, types.SliceType)


def _no_timer(*_: Any) -> Any:
    return nullcontext()


def _heard(tell: Callable[..., None]) -> Callable[..., None]:
    """Tell of an event if anybody listens to it."""

    def told(kind: str, *details: Any, **more: Any) -> None:
        if event._registered.get(kind):
            tell(kind, *details, **more)

    return told


def _variables(instruction: Any, value: Any) -> list[Any]:
    """The variables in an operand of an instruction, or in a container of operands."""
    kind = type(value)
    if kind is ir.Var:
        return [value]
    if kind in _WITHOUT_VARIABLES:
        return []
    if isinstance(value, ir.Inst):
        return list(value.list_vars())
    if isinstance(value, dict):
        value = value.values()
    elif not isinstance(value, list | tuple):
        return []
    found = []
    for one in value:
        kind = type(one)
        if kind is ir.Var:
            found.append(one)
        elif kind not in _WITHOUT_VARIABLES:
            found += _variables(instruction, one)
    return found


_WITHOUT_VARIABLES = frozenset({
    str, int, bool, type(None), ir.Loc, ir.Arg, ir.Const, ir.Global, ir.FreeVar,
})  # fmt: skip


def _remembered_sizes(size_of: Callable[..., int]) -> Callable[..., int]:
    """Remember the sizes of types, for each of which LLVM would parse a module."""
    known: dict[Any, int] = {}

    def size(context: Any, kind: Any) -> int:
        key = str(kind)
        if "%" in key:  # a name, which does not say what it contains
            return size_of(context, kind)
        if key not in known:
            known[key] = size_of(context, kind)
        return known[key]

    return size


def _hash(flags: TargetConfig) -> int:
    """Numba's hash of flags, which is that of their names."""
    return _hash_of_names(type(flags))


@cache
def _hash_of_names(kind: type[TargetConfig]) -> int:
    return hash(tuple(sorted(kind.options)))


def _compared(equal: Callable[..., Any]) -> Callable[..., Any]:
    """Compare first which flags are set."""

    def compare(flags: TargetConfig, other: Any) -> Any:
        same = isinstance(other, TargetConfig) and flags._values == other._values
        return same or equal(flags, other)

    return compare


def _remembered(resolve: Callable[..., Any]) -> Callable[..., Any]:
    """Remember the signatures of operators and functions that are built into Numba."""
    known: dict[Any, Any] = {}

    def signature(function: Any, context: Any, arguments: Any, keywords: Any) -> Any:
        if keywords or not all(isinstance(one, _SETTLED) for one in arguments):
            return resolve(function, context, arguments, keywords)
        key = function, context, tuple(arguments)
        found = known.get(key)
        if found is not None:
            function._impl_keys[found.args] = function.typing_key
        else:
            found = resolve(function, context, arguments, keywords)
            # Those that are compiled depend on the flags, too.
            if found is not None and function._impl_keys.get(found.args) is function.typing_key:
                known[key] = found
        return found

    return signature


def _ignore(*_: Any) -> None:
    """Insert nothing."""

"""Named tuples that kernels pass on by reference.

Numba passes a named tuple as all the words of its arrays. A machine and its run have four hundred
of them, and passing these at each call would take most of the time of compilation.
``by_reference`` stores a tuple once, in the function that calls it, and kernels pass its address;
they read its fields in the usual way.

Numba has no public interface for this; tests/unit/test_compiling.py fails if the private one that
is used here changes.
"""

from hashlib import sha256
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.datamodel import models
from numba.core.imputils import impl_ret_borrowed
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    infer_getattr,
    lower_builtin,
    lower_getattr_generic,
    register_model,
    type_callable,
)


class Reference(types.Type):
    """Address of a named tuple; its ``instance_class`` is that of the tuple."""

    def __init__(self, target: Any) -> None:
        self.target, self.instance_class = target, target.instance_class
        # The names of all functions with an argument of this type contain this name: keep it short.
        digest = sha256(target.name.encode()).hexdigest()[:12]
        super().__init__(f"Reference({self.instance_class.__name__}-{digest})")

    def field(self, name: str) -> types.Type:
        """Type of a field; if the field is a named tuple, a reference to it."""
        found = self.target.types[self.target.fields.index(name)]
        return Reference(found) if isinstance(found, types.BaseNamedTuple) else found


class _ReferenceModel(models.PrimitiveModel):
    def __init__(self, manager: Any, of: Reference) -> None:
        super().__init__(manager, of, manager.lookup(of.target).get_value_type().as_pointer())


class _Fields(AttributeTemplate):
    key = Reference

    def generic_resolve(self, of: Any, name: str) -> Any:  # type: ignore[override]
        return of.field(name) if name in of.target.fields else None


def _get_field(context: Any, builder: Any, of: Reference, address: Any, name: str) -> Any:
    place = cgutils.gep_inbounds(builder, address, 0, of.target.fields.index(name))
    if isinstance(found := of.field(name), Reference):
        return place
    return impl_ret_borrowed(context, builder, found, _load(builder, place))


def _load(builder: Any, place: Any) -> Any:
    """The value at an address, word by word, so that only the words that are used are loaded."""
    kind = place.type.pointee
    if not isinstance(kind, ir.LiteralStructType | ir.ArrayType):
        return builder.load(place)
    value = ir.Constant(kind, ir.Undefined)
    for i in range(len(kind)):
        word = _load(builder, cgutils.gep_inbounds(builder, place, 0, i))
        value = builder.insert_value(value, word, i)
    return value


def by_reference(given: Any) -> Any:
    """A reference to a named tuple, valid in the function that calls this one.

    Kernels that run as plain Python pass the tuple itself.
    """
    return given


def _type_of(_context: Any) -> Any:
    return lambda given: Reference(given)


def _store(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
    return cgutils.alloca_once_value(builder, arguments[0])


register_model(Reference)(_ReferenceModel)
infer_getattr(_Fields)
lower_getattr_generic(Reference)(_get_field)
type_callable(by_reference)(_type_of)
lower_builtin(by_reference, types.BaseNamedTuple)(_store)

"""Vector instructions for several lanes at once, from a formula in plain Python.

``traced(formula, rows, width)`` runs ``formula(maths, inputs)`` on symbols and compiles the
operations that it performed, without a loop or a branch: each number is a vector of ``width``
lanes, one for each of several systems side by side. Numba has no vectors of its own, and LLVM
compiles a loop over the lanes of arrays to scalar code. Called with floats and ``Plain``, the
formula is Python.
"""

import math
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

_CONTRACT = ("contract",)


class Plain:
    """Mathematics of floats."""

    sqrt, exp = staticmethod(math.sqrt), staticmethod(math.exp)
    smaller, larger = staticmethod(min), staticmethod(max)

    @staticmethod
    def signed(size: float, by: float) -> float:
        """``size`` with the sign of ``by``."""
        return math.copysign(size, by)


class _Symbol:
    """A vector that is computed when the compiled formula runs."""

    def __init__(self, maths: "_Symbols", value: Any) -> None:
        self.maths, self.value = maths, value

    def _do(self, name: str, other: Any, swapped: bool = False) -> "_Symbol":
        pair = [self.value, self.maths.value(other)]
        if swapped:
            pair.reverse()
        builder = self.maths.builder
        return _Symbol(self.maths, getattr(builder, name)(*pair, flags=_CONTRACT))

    def __add__(self, other: Any) -> "_Symbol":
        return self._do("fadd", other)

    def __sub__(self, other: Any) -> "_Symbol":
        return self._do("fsub", other)

    def __mul__(self, other: Any) -> "_Symbol":
        return self._do("fmul", other)

    def __truediv__(self, other: Any) -> "_Symbol":
        return self._do("fdiv", other)

    def __rsub__(self, other: Any) -> "_Symbol":
        return self._do("fsub", other, swapped=True)

    def __rtruediv__(self, other: Any) -> "_Symbol":
        return self._do("fdiv", other, swapped=True)

    def __abs__(self) -> "_Symbol":
        return self.maths.call("fabs", self)

    def __neg__(self) -> "_Symbol":
        return 0.0 - self

    __radd__, __rmul__ = __add__, __mul__


class _Symbols:
    """Mathematics of symbols."""

    def __init__(self, builder: Any, width: int) -> None:
        self.builder, self.width = builder, width
        self.type = ir.VectorType(ir.DoubleType(), width)

    def value(self, number: Any) -> Any:
        if isinstance(number, _Symbol):
            return number.value
        return ir.Constant(self.type, [float(number)] * self.width)

    def call(self, name: str, *numbers: Any) -> _Symbol:
        values = [self.value(number) for number in numbers]
        module, full = self.builder.module, f"llvm.{name}.v{self.width}f64"
        function = module.globals.get(full)
        if function is None:
            signature = ir.FunctionType(self.type, [self.type] * len(values))
            function = ir.Function(module, signature, name=full)
        return _Symbol(self, self.builder.call(function, values))

    def sqrt(self, number: Any) -> _Symbol:
        return self.call("sqrt", number)

    def exp(self, number: Any) -> _Symbol:
        return self.call("exp", number)

    def signed(self, size: Any, by: Any) -> _Symbol:
        return self.call("copysign", size, by)

    def smaller(self, one: Any, other: Any) -> _Symbol:
        return self.call("minnum", one, other)

    def larger(self, one: Any, other: Any) -> _Symbol:
        return self.call("maxnum", one, other)


def plain(formula: Any, rows: int, width: int) -> Any:
    """Return ``traced(formula, rows, width)`` uncompiled: one lane after the other."""

    def run(inputs: Any, outputs: Any) -> None:
        for lane in range(width):
            outputs[:, lane] = formula(Plain, list(inputs[:rows, lane]))

    return run


def traced(formula: Any, rows: int, width: int) -> Any:
    """Compile ``formula(maths, inputs) -> outputs`` as (inputs, outputs) -> None.

    The formula receives a list of so many ``rows``, one vector for each row of the inputs.

    inputs, outputs : (numbers, width), C-contiguous
    """

    @intrinsic
    def run(typing: Any, inputs: Any, outputs: Any) -> Any:  # noqa: ARG001 - Numba's signature
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            given, made = (
                context.make_array(kind)(context, builder, value)
                for kind, value in zip(signature.args, args, strict=True)
            )
            maths = _Symbols(builder, width)

            def pointer(array: Any, row: int) -> Any:
                place = ir.Constant(ir.IntType(64), row * width)
                return builder.bitcast(builder.gep(array.data, [place]), maths.type.as_pointer())

            vectors = [
                _Symbol(maths, builder.load(pointer(given, row), align=8)) for row in range(rows)
            ]
            for row, number in enumerate(formula(maths, vectors)):
                builder.store(maths.value(number), pointer(made, row), align=8)
            return context.get_dummy_value()

        return types.void(inputs, outputs), generate

    return run

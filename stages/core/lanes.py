"""Sixteen float32 numbers that kernels add, multiply and compare at once.

A compiler makes vector instructions of a loop only where it can prove that its arrays do not overlap and that it is long.
Over the sixteen channels of a light set, or over rays in sixteens, it mostly cannot, and counts them one by one. `Lanes` says
outright what is meant:

    a = load(values, 16 * i)  # 16 elements of a contiguous float32 array of any shape, from that element on
    store(values, 16 * i, larger(a * a + 1.0, b))

It lives within compiled kernels alone, each of whose sums is the same on any machine with fused multiplication: what is wider
than a register LLVM splits, lane by lane.
"""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import extending
from numba.core import cgutils, types
from numba.extending import lower_builtin, models, register_model, type_callable

LANES = 16

_VECTOR = ir.VectorType(ir.FloatType(), LANES)
_INDEX = ir.IntType(32)


def intrinsic(function: Callable[..., Any]) -> Callable[..., Any]:
    """What kernels call; types are checked when one is compiled."""
    return extending.intrinsic(function)  # type: ignore[no-any-return]


class Lanes(types.Type):
    """The type of such sixteen numbers."""

    def __init__(self) -> None:
        super().__init__(name="Lanes")


lanes = Lanes()


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


@intrinsic
def load(typing: Any, array: Any, start: Any) -> Any:
    """Elements start to start + 15 of a contiguous float32 array, counted over all its axes; they must be there."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.load(_address(context, builder, signature, args), align=4)

    return lanes(array, types.intp), code


@intrinsic
def store(typing: Any, array: Any, start: Any, values: Any) -> Any:
    """Write what `load` reads."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        builder.store(args[2], _address(context, builder, signature, args), align=4)
        return context.get_dummy_value()

    return types.void(array, types.intp, lanes), code


@intrinsic
def fill(typing: Any, value: Any) -> Any:
    """The same number sixteen times."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return _sixteen(builder, args[0])

    return lanes(types.float32), code


@intrinsic
def larger(typing: Any, a: Any, b: Any) -> Any:
    """The larger of two, lane by lane."""
    return lanes(lanes, lanes), lambda context, builder, signature, args: _chosen(builder, ">", args)


@intrinsic
def smaller(typing: Any, a: Any, b: Any) -> Any:
    """The smaller of two, lane by lane."""
    return lanes(lanes, lanes), lambda context, builder, signature, args: _chosen(builder, "<", args)


@intrinsic
def where_positive(typing: Any, test: Any, a: Any, b: Any) -> Any:
    """a in the lanes in which test is over 0, b in the others."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        nothing = ir.Constant(_VECTOR, [ir.Constant(ir.FloatType(), 0.0)] * LANES)
        return builder.select(builder.fcmp_ordered(">", args[0], nothing), args[1], args[2])

    return lanes(lanes, lanes, lanes), code


@intrinsic
def root(typing: Any, a: Any) -> Any:
    """Square roots."""
    return lanes(lanes), _called("sqrt")


@intrinsic
def floor(typing: Any, a: Any) -> Any:
    """The largest whole numbers that are not larger."""
    return lanes(lanes), _called("floor")


@intrinsic
def sum_of(typing: Any, a: Any) -> Any:
    """The sum of all sixteen, a float32; halves are added to each other."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        sums, half = args[0], LANES // 2
        while half:
            order = [_INDEX((lane + half) % LANES) for lane in range(LANES)]
            other = builder.shuffle_vector(sums, sums, ir.Constant(ir.VectorType(_INDEX, LANES), order))
            sums, half = builder.fadd(sums, other), half // 2
        return builder.extract_element(sums, _INDEX(0))

    return types.float32(lanes), code


def _address(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    """Where `load` and `store` begin."""
    kind = signature.args[0]
    assert kind.dtype == types.float32 and kind.layout == "C", kind
    data = context.make_array(kind)(context, builder, args[0]).data
    return builder.bitcast(builder.gep(data, [args[1]]), _VECTOR.as_pointer())


def _called(name: str) -> Any:
    """A function of LLVM, lane by lane."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = ir.FunctionType(_VECTOR, [_VECTOR])
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{LANES}f32"), args)

    return code


def _sixteen(builder: Any, value: Any) -> Any:
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), value, _INDEX(0))
    first = ir.Constant(ir.VectorType(_INDEX, LANES), [_INDEX(0)] * LANES)
    return builder.shuffle_vector(one, one, first)


def _chosen(builder: Any, sign: str, args: Any) -> Any:
    return builder.select(builder.fcmp_ordered(sign, *args), *args)


def _arithmetic(sign: Any, instruction: str) -> None:
    """Teach numba `sign` of lanes with lanes, and with one number on either side."""

    @type_callable(sign)  # type: ignore[untyped-decorator]
    def typer(context: Any) -> Any:
        def of(a: Any, b: Any) -> Any:
            known = {lanes: True}
            both = all(kind in known or isinstance(kind, types.Number) for kind in (a, b))
            return lanes if both and lanes in (a, b) else None

        return of

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        vectors = [
            value if kind == lanes else _sixteen(builder, context.cast(builder, value, kind, types.float32))
            for kind, value in zip(signature.args, args, strict=True)
        ]
        return getattr(builder, instruction)(*vectors)

    for kinds in ((Lanes, Lanes), (Lanes, types.Number), (types.Number, Lanes)):
        lower_builtin(sign, *kinds)(lower)


for _sign, _instruction in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
    (operator.iadd, "fadd"),
    (operator.imul, "fmul"),
):
    _arithmetic(_sign, _instruction)

"""Work on a row of lanes as one vector of the processor, in flat arrays.

What the compiler would not see by itself is said here in its own terms: that a row is one vector, that
numbers on the stack overlap nothing (so that they end up in registers), what to fetch ahead, and that whole
vectors of 512 bits are wanted. Each operation stands beside the NumPy expression that means the same; that
one runs where numba is switched off.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from types import SimpleNamespace

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

__all__ = ["all_lanes", "fused", "on_stack", "pointer", "row_operations"]

CACHE_LINE = 8  # numbers

# name: (LLVM, NumPy), of the row written to and the row read
BETWEEN_ROWS: dict[str, tuple[Callable, Callable]] = {
    "copy_row": (lambda builder, _old, new: new, lambda _old, new: new),
    "add_row": (lambda builder, old, new: builder.fadd(old, new), np.add),
    "subtract_row": (lambda builder, old, new: builder.fsub(old, new), np.subtract),
    "square_row": (lambda builder, _old, new: builder.fmul(new, new), lambda _old, new: new * new),
    "add_square_row": (
        lambda builder, old, new: fused(builder, new, new, old),
        lambda old, new: old + new * new,
    ),
}
# name: (LLVM, NumPy), of the row and a number for all lanes
WITH_NUMBER: dict[str, tuple[Callable, Callable]] = {
    "scale_row": (lambda builder, row, number: builder.fmul(row, number), np.multiply),
    "shift_row": (lambda builder, row, number: builder.fadd(row, number), np.add),
    "raise_row": (  # to the number where it is less
        lambda builder, row, number: builder.select(builder.fcmp_ordered(">", row, number), row, number),
        lambda row, number: np.where(row > number, row, number),
    ),
    "replace_positive": (
        lambda builder, row, number: builder.select(builder.fcmp_ordered(">", row, _zero(row)), number, _zero(row)),
        lambda row, number: np.where(row > 0.0, number, 0.0),
    ),
}
# name: (LLVM, NumPy), whether it holds for any lane; what is not a number is not less, but beyond and unequal
ANY: dict[str, tuple[Callable, Callable]] = {
    "any_less": (lambda builder, row, number: builder.fcmp_ordered("<", row, number), np.less),
    "any_beyond": (
        lambda builder, row, number: builder.fcmp_unordered(">", row, number),
        lambda row, number: ~(row <= number),
    ),
    "any_unequal": (lambda builder, row, number: builder.fcmp_unordered("!=", row, number), np.not_equal),
}


@cache
def row_operations(width: int, fetched: int, stacked: int) -> SimpleNamespace:
    """The operations on rows of `width` numbers, to be called in kernels.

    `copy_row(to, at, values, start)` and its like change `to[at : at + width]` by the row of `values` that
    begins at `start`; `scale_row(to, at, number)` and its like by a number; `any_less(values, at, number)` and
    its like tell of a row. `fetch(values, at)` asks for `fetched` rows from `at` on to come closer, and
    `stack_rows()` gives a flat array of `stacked` rows that lives as long as the call, with anything in it.
    Nothing is checked. Arrays are in C order, of any shape, and indices those of their numbers.
    """
    if numba.config.DISABLE_JIT:
        return _plain(width, stacked)
    return SimpleNamespace(
        **{name: _between_rows(width, operation) for name, (operation, _) in BETWEEN_ROWS.items()},
        **{name: _with_number(width, operation) for name, (operation, _) in WITH_NUMBER.items()},
        **{name: _any(width, operation) for name, (operation, _) in ANY.items()},
        fetch=_fetch(width * fetched),
        stack_rows=_stack(width * stacked),
    )


def _plain(width: int, stacked: int) -> SimpleNamespace:
    def row(values, at):
        return values.reshape(-1)[at : at + width]

    def between(operation):
        def change(to, at, values, start):
            row(to, at)[:] = operation(row(to, at), row(values, start))

        return change

    def with_number(operation):
        def change(to, at, number):
            row(to, at)[:] = operation(row(to, at), number)

        return change

    return SimpleNamespace(
        **{name: between(operation) for name, (_, operation) in BETWEEN_ROWS.items()},
        **{name: with_number(operation) for name, (_, operation) in WITH_NUMBER.items()},
        **{
            name: lambda values, at, number, operation=operation: bool(operation(row(values, at), number).any())
            for name, (_, operation) in ANY.items()
        },
        fetch=lambda values, at: None,
        stack_rows=lambda: np.full(width * stacked, np.nan),
    )


def pointer(context, builder, kind, array, at, to: ir.Type):
    data = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [at]), to.as_pointer())


def all_lanes(builder, number, vector: ir.VectorType):
    row = ir.Constant(vector, ir.Undefined)
    for lane in range(vector.count):
        row = builder.insert_element(row, number, ir.Constant(ir.IntType(32), lane))
    return row


def fused(builder, a, b, c):
    kind = ir.FunctionType(a.type, [a.type] * 3)
    function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.fma.v{a.type.count}f64")
    return builder.call(function, [a, b, c])


def _zero(row):
    return ir.Constant(row.type, [0.0] * row.type.count)


def _between_rows(width: int, operation: Callable):
    vector = ir.VectorType(ir.DoubleType(), width)

    @intrinsic
    def change(_context, to, at, values, start):
        signature = types.void(to, types.int64, values, types.int64)

        def generate(context, builder, signature, arguments):
            target = pointer(context, builder, signature.args[0], arguments[0], arguments[1], vector)
            source = pointer(context, builder, signature.args[2], arguments[2], arguments[3], vector)
            new = operation(builder, builder.load(target, align=8), builder.load(source, align=8))
            builder.store(new, target, align=8)
            return context.get_dummy_value()

        return signature, generate

    return change


def _with_number(width: int, operation: Callable):
    vector = ir.VectorType(ir.DoubleType(), width)

    @intrinsic
    def change(_context, to, at, number):
        signature = types.void(to, types.int64, types.float64)

        def generate(context, builder, signature, arguments):
            target = pointer(context, builder, signature.args[0], arguments[0], arguments[1], vector)
            new = operation(builder, builder.load(target, align=8), all_lanes(builder, arguments[2], vector))
            builder.store(new, target, align=8)
            return context.get_dummy_value()

        return signature, generate

    return change


def _any(width: int, compare: Callable):
    vector = ir.VectorType(ir.DoubleType(), width)

    @intrinsic
    def holds(_context, values, at, number):
        signature = types.boolean(values, types.int64, types.float64)

        def generate(context, builder, signature, arguments):
            source = pointer(context, builder, signature.args[0], arguments[0], arguments[1], vector)
            lanes = compare(builder, builder.load(source, align=8), all_lanes(builder, arguments[2], vector))
            bits = builder.bitcast(lanes, ir.IntType(width))
            return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

        return signature, generate

    return holds


def _fetch(numbers: int):
    byte = ir.IntType(8)

    @intrinsic
    def fetch(_context, values, at):
        signature = types.void(values, types.int64)

        def generate(context, builder, signature, arguments):
            flag = ir.IntType(32)
            function = cgutils.get_or_insert_function(
                builder.module,
                ir.FunctionType(ir.VoidType(), [byte.as_pointer(), flag, flag, flag]),
                "llvm.prefetch.p0i8",
            )
            to_read, keep, data = ir.Constant(flag, 0), ir.Constant(flag, 3), ir.Constant(flag, 1)
            for line in range(0, numbers, CACHE_LINE):
                at = builder.add(arguments[1], ir.Constant(arguments[1].type, line))
                place = pointer(context, builder, signature.args[0], arguments[0], at, byte)
                builder.call(function, [place, to_read, keep, data])
            return context.get_dummy_value()

        return signature, generate

    return fetch


def _stack(numbers: int):
    @intrinsic
    def stack_rows(_context):
        signature = types.Array(types.float64, 1, "C")()

        def generate(context, builder, signature, _arguments):
            # whole vectors are a function's wish, which would be lost on the way into its caller. It is none that
            # llvmlite knows by name; past its check it is written out as it stands
            builder.function.attributes.add("noinline")
            set.add(builder.function.attributes, '"prefer-vector-width"="512"')
            return on_stack(context, builder, signature.return_type, numbers)

        return signature, generate

    return stack_rows


def on_stack(context, builder, kind: types.Array, count: int):
    """A flat array of `count` numbers of eight bytes that lives as long as the call, from a cache line on."""
    array = context.make_array(kind)(context, builder)
    room = cgutils.alloca_once(builder, ir.ArrayType(context.get_data_type(kind.dtype), count))
    room.align = 8 * CACHE_LINE
    size, step = context.get_constant(types.intp, count), context.get_constant(types.intp, 8)
    context.populate_array(
        array, data=builder.bitcast(room, array.data.type), shape=[size], strides=[step], itemsize=step, meminfo=None
    )
    return array._getvalue()

"""Moves of a row of lanes, as one vector each: what keeps lane kernels from waiting for loads and stores."""

from __future__ import annotations

from types import SimpleNamespace

import numba
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

__all__ = ["row_moves"]


def row_moves(width: int) -> SimpleNamespace:
    """`copy_row`, `add_row`, `subtract_row(to, at, values, start)` for rows of `width` numbers in flat arrays.

    `to[at : at + width]` becomes, gains or loses `values[start : start + width]`. Nothing is checked.
    """
    if numba.config.DISABLE_JIT:
        return SimpleNamespace(copy_row=_copy(width), add_row=_add(width), subtract_row=_subtract(width))
    return SimpleNamespace(
        copy_row=_move(width, lambda builder, _old, new: new()),
        add_row=_move(width, lambda builder, old, new: builder.fadd(old(), new())),
        subtract_row=_move(width, lambda builder, old, new: builder.fsub(old(), new())),
    )


def _move(width: int, combine):
    vector = ir.VectorType(ir.DoubleType(), width)

    @intrinsic
    def move(_context, to, at, values, start):
        signature = types.void(to, types.int64, values, types.int64)

        def generate(context, builder, signature, arguments):
            def place(k):
                data = context.make_array(signature.args[k])(context, builder, arguments[k]).data
                return builder.bitcast(builder.gep(data, [arguments[k + 1]]), vector.as_pointer())

            target, source = place(0), place(2)
            value = combine(
                builder, lambda: builder.load(target, align=8), lambda: builder.load(source, align=8)
            )  # fmt: skip
            builder.store(value, target, align=8)
            return context.get_dummy_value()

        return signature, generate

    return move


def _copy(width: int):
    def copy_row(to, at, values, start):
        to[at : at + width] = values[start : start + width]

    return copy_row


def _add(width: int):
    def add_row(to, at, values, start):
        to[at : at + width] += values[start : start + width]

    return add_row


def _subtract(width: int):
    def subtract_row(to, at, values, start):
        to[at : at + width] -= values[start : start + width]

    return subtract_row

"""Eight contacts as the lanes of one vector: their numbers gathered from rows of eight, four or two, and put back.

A row in memory belongs to one grain or contact, a row on the stack to one quantity of all eight: the way
between is the transpose of a small matrix, which a processor does in its registers.
"""

from __future__ import annotations

from types import SimpleNamespace

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from rendulic.dem.kernels.layout import N_PAIR, PAIR
from rendulic.dem.kernels.rows import all_lanes, fused, on_stack, pointer

__all__ = ["PACK", "pack_operations"]

PACK = 8  # contacts or grains; also the numbers of a pair, so that they are one vector


def pack_operations() -> SimpleNamespace:
    """What moves packs of contacts, to be called in kernels.

    `gather_n(stack, at, values, places, column)` fills n rows of eight from `at` on with the n numbers that begin
    `column` after each of the eight `places` of `values`; `scatter_n(values, places, stack, at, column)` puts n rows
    there, in the order of places. `add_to_first(rows, at, pairs, start)` and `add_to_second` add a contact's force and torque, as
    `contact_pairs` left them at `start`, to the last six of the eight numbers at `at`. `stack_places()` gives
    eight integers. Nothing is checked; indices are those of flat arrays in C order.
    """
    if numba.config.DISABLE_JIT:
        return _plain()
    return SimpleNamespace(
        gather_8=_gather(8), gather_4=_gather(4), gather_2=_gather(2), scatter_8=_scatter(8), scatter_4=_scatter(4),
        add_to_first=_add(-1.0, PAIR.arm_1), add_to_second=_add(1.0, PAIR.arm_2), stack_places=_stack_places, indexed_places=_indexed_places,
    )  # fmt: skip


def _plain() -> SimpleNamespace:
    def gather(n):
        def fill(stack, at, values, places, column):
            for k, place in enumerate(places + column):
                stack[at + k : at + k + n * PACK : PACK] = values.reshape(-1)[place : place + n]

        return fill

    def scatter(n):
        def put(values, places, stack, at, column):
            for k, place in enumerate(places + column):
                values.reshape(-1)[place : place + n] = stack[at + k : at + k + n * PACK : PACK]

        return put

    def indexed_places(places, index, start, stride):
        places[:] = index[start : start + PACK].astype(np.int64) * stride

    def add(sign, arm):
        def to(rows, at, pairs, start):
            pair = pairs.reshape(-1)[start : start + N_PAIR]
            rows.reshape(-1)[at + PAIR.force : at + PAIR.moment] += sign * pair[PAIR.force : PAIR.moment]
            rows.reshape(-1)[at + PAIR.moment : at + N_PAIR] += -pair[arm] * pair[PAIR.moment :]

        return to

    return SimpleNamespace(
        gather_8=gather(8), gather_4=gather(4), gather_2=gather(2), scatter_8=scatter(8), scatter_4=scatter(4),
        add_to_first=add(-1.0, PAIR.arm_1), add_to_second=add(1.0, PAIR.arm_2), stack_places=lambda: np.zeros(PACK, np.int64), indexed_places=indexed_places,
    )  # fmt: skip


def _indices(values) -> ir.Constant:
    return ir.Constant(ir.VectorType(ir.IntType(32), len(values)), list(values))


def _transpose(builder, rows: list) -> list:
    """Transpose each n x n block of n vectors of eight."""
    step = 1
    while step < len(rows):
        low = _indices([lane if not lane & step else PACK + lane - step for lane in range(PACK)])
        high = _indices([lane + step if not lane & step else PACK + lane for lane in range(PACK)])
        for k in range(len(rows)):
            if not k & step:
                a, b = rows[k], rows[k + step]
                rows[k], rows[k + step] = builder.shuffle_vector(a, b, low), builder.shuffle_vector(a, b, high)
        step *= 2
    return rows


def _side_by_side(builder, parts: list):
    while len(parts) > 1:
        both = _indices(range(2 * parts[0].type.count))
        parts = [builder.shuffle_vector(a, b, both) for a, b in zip(parts[::2], parts[1::2], strict=True)]
    return parts[0]


def _place(builder, places, at: int):
    return builder.load(builder.gep(places, [ir.Constant(ir.IntType(64), at)]))


def _gather(n: int):
    part, whole = ir.VectorType(ir.DoubleType(), n), ir.VectorType(ir.DoubleType(), PACK)

    @intrinsic
    def gather(_context, stack, at, values, places, column):
        signature = types.void(stack, types.int64, values, places, types.int64)

        def generate(context, builder, signature, arguments):
            data = context.make_array(signature.args[3])(context, builder, arguments[3]).data
            parts = []
            for k in range(PACK):
                place = builder.add(_place(builder, data, k), arguments[4])
                parts.append(
                    builder.load(pointer(context, builder, signature.args[2], arguments[2], place, part), align=8)
                )
            rows = [_side_by_side(builder, parts[k::n]) for k in range(n)]
            for k, row in enumerate(_transpose(builder, rows)):
                to = builder.add(arguments[1], ir.Constant(arguments[1].type, k * PACK))
                builder.store(row, pointer(context, builder, signature.args[0], arguments[0], to, whole), align=8)
            return context.get_dummy_value()

        return signature, generate

    return gather


def _scatter(n: int):
    part, whole = ir.VectorType(ir.DoubleType(), n), ir.VectorType(ir.DoubleType(), PACK)

    @intrinsic
    def scatter(_context, values, places, stack, at, column):
        signature = types.void(values, places, stack, types.int64, types.int64)

        def generate(context, builder, signature, arguments):
            data = context.make_array(signature.args[1])(context, builder, arguments[1]).data
            rows = []
            for k in range(n):
                source = builder.add(arguments[3], ir.Constant(arguments[3].type, k * PACK))
                rows.append(
                    builder.load(pointer(context, builder, signature.args[2], arguments[2], source, whole), align=8)
                )
            rows = _transpose(builder, rows)
            for k in range(PACK):
                piece = rows[k % n]
                if n < PACK:
                    piece = builder.shuffle_vector(piece, piece, _indices(range(k // n * n, k // n * n + n)))
                place = builder.add(_place(builder, data, k), arguments[4])
                builder.store(piece, pointer(context, builder, signature.args[0], arguments[0], place, part), align=8)
            return context.get_dummy_value()

        return signature, generate

    return scatter


def _add(sign: float, arm: int):
    whole = ir.VectorType(ir.DoubleType(), N_PAIR)

    @intrinsic
    def add(_context, rows, at, pairs, start):
        signature = types.void(rows, types.int64, pairs, types.int64)

        def generate(context, builder, signature, arguments):
            target = pointer(context, builder, signature.args[0], arguments[0], arguments[1], whole)
            source = pointer(context, builder, signature.args[2], arguments[2], arguments[3], whole)
            pair = builder.load(source, align=8)
            arms = builder.fneg(builder.shuffle_vector(pair, pair, _indices([arm] * N_PAIR)))
            fixed = ir.Constant(whole, [sign if PAIR.force <= k < PAIR.moment else 0.0 for k in range(N_PAIR)])
            # nothing for the arms themselves, the sign for the force, the arm for the moment
            factor = builder.shuffle_vector(
                fixed, arms, _indices([k if k < PAIR.moment else N_PAIR + k for k in range(N_PAIR)])
            )
            builder.store(fused(builder, factor, pair, builder.load(target, align=8)), target, align=8)
            return context.get_dummy_value()

        return signature, generate

    return add


@intrinsic
def _indexed_places(_context, places, index, start, stride):
    signature = types.void(places, index, types.int64, types.int64)

    def generate(context, builder, signature, arguments):
        narrow, wide = ir.VectorType(ir.IntType(32), PACK), ir.VectorType(ir.IntType(64), PACK)
        source = pointer(context, builder, signature.args[1], arguments[1], arguments[2], narrow)
        found = builder.sext(builder.load(source, align=4), wide)
        zero = ir.Constant(arguments[2].type, 0)
        target = pointer(context, builder, signature.args[0], arguments[0], zero, wide)
        builder.store(builder.mul(found, all_lanes(builder, arguments[3], wide)), target, align=8)
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def _stack_places(_context):
    signature = types.Array(types.int64, 1, "C")()

    def generate(context, builder, signature, _arguments):
        return on_stack(context, builder, signature.return_type, PACK)

    return signature, generate

"""Where threads that run the same kernel wait for each other, for microseconds and without the interpreter."""

from __future__ import annotations

import os

import numba
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from rendulic.foundation.compiling import kernel

__all__ = ["wait_for_all"]

SPINS = 2000  # looks at the counter between offers of the core to somebody else
_yield_core = types.ExternalFunction("SwitchToThread" if os.name == "nt" else "sched_yield", types.intc())


@intrinsic
def _arrive(_context, counter):
    """Count one more arrival; what was written before is seen by those who see the count."""

    def generate(context, builder, signature, arguments):
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        return builder.atomic_rmw("add", data, ir.Constant(ir.IntType(64), 1), "seq_cst")

    return types.int64(counter), generate


@intrinsic
def _arrived(_context, counter):
    """Arrivals so far."""

    def generate(context, builder, signature, arguments):
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        return builder.load_atomic(data, "seq_cst", 8)

    return types.int64(counter), generate


def _wait_for_all(counter, expected):
    """Arrive, and wait until `counter` (1,) int64 has seen `expected` arrivals."""
    _arrive(counter)
    spins = 0
    while _arrived(counter) < expected:
        spins += 1
        if spins == SPINS:
            spins = 0
            _yield_core()


def _alone(counter, expected):
    counter[0] += 1  # without the compiler nobody else is there


wait_for_all = kernel(_alone if numba.config.DISABLE_JIT else _wait_for_all)

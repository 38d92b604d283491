"""Products of vectors with fused multiply-adds, written out so that they are taken the same everywhere.

A compiler that is free to fuse does so here and not there, and then the scalar kernel and each lane would
end at numbers of their own. These are fused always, on every machine (in software where the processor has
no such instruction), and nothing else is.
"""

from __future__ import annotations

import numba
from numba import types
from numba.extending import intrinsic

from rendulic.foundation.compiling import kernel

__all__ = ["cross", "dot", "fma", "fma_vector"]


def _plain_fma(a, b, c):
    return a * b + c  # rounds twice: only where numba is switched off


@intrinsic
def _fused(_context, a, b, c):
    def generate(_context, builder, _signature, arguments):
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), generate


fma = _plain_fma if numba.config.DISABLE_JIT else _fused


@kernel(forceinline=True)
def dot(a, b):
    """Scalar product of two vectors, three numbers each."""
    return fma(a[0], b[0], fma(a[1], b[1], a[2] * b[2]))


@kernel(forceinline=True)
def cross(a, b):
    """Vector product."""
    return fma(a[1], b[2], -(a[2] * b[1])), fma(a[2], b[0], -(a[0] * b[2])), fma(a[0], b[1], -(a[1] * b[0]))


@kernel(forceinline=True)
def fma_vector(factor, a, b):
    """The vector `factor a + b`."""
    return fma(factor, a[0], b[0]), fma(factor, a[1], b[1]), fma(factor, a[2], b[2])

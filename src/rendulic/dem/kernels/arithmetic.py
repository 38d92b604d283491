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

__all__ = ["cross", "dot", "fma"]


def _plain_fma(a, b, c):
    return a * b + c  # rounds twice: only where numba is switched off


@intrinsic
def _fused(_context, a, b, c):
    def generate(_context, builder, _signature, arguments):
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), generate


fma = _plain_fma if numba.config.DISABLE_JIT else _fused


@kernel(forceinline=True)
def dot(ax, ay, az, bx, by, bz):
    """Scalar product."""
    return fma(ax, bx, fma(ay, by, az * bz))


@kernel(forceinline=True)
def cross(ax, ay, az, bx, by, bz):
    """Vector product."""
    return fma(ay, bz, -(az * by)), fma(az, bx, -(ax * bz)), fma(ax, by, -(ay * bx))

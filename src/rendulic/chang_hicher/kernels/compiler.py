"""Compilation of the model's kernels, cached on disk under a name that changes with any of their sources.

numba's own cache looks only at the file of the function itself; these kernels call each other across
files and would otherwise run with yesterday's versions of their neighbours.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from types import FunctionType

import numba

__all__ = ["jit", "jit_into_caller"]

# contraction to fused multiply-add is the only liberty taken: NaN is kept, and a machine repeats itself
OPTIONS = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}}

_here = Path(__file__).parent
_sources = sorted([*_here.glob("*.py"), *(_here.parent / "law").glob("*.py")])
DIGEST = hashlib.sha256(b"".join(source.read_bytes() for source in _sources)).hexdigest()[:12]


def jit(function: Callable, inline: str = "never") -> Callable:
    """`function`, compiled on first use; the function itself is left as it is.

    With `inline="always"` it becomes part of its caller: large functions called once compile sooner so,
    because every level of calls is optimised with all that lies below it.
    """
    clone = FunctionType(
        function.__code__, function.__globals__, function.__name__, function.__defaults__, function.__closure__
    )
    clone.__qualname__ = f"{function.__qualname__}_{DIGEST}"
    clone.__module__ = function.__module__
    clone.__doc__ = function.__doc__
    return numba.njit(cache=True, inline=inline, **OPTIONS)(clone)


def jit_into_caller(function: Callable) -> Callable:
    """`function`, compiled as part of the one that calls it."""
    return jit(function, inline="always")

"""Kernels compiled for a contact law, once per law and process; rendulic's own cached on disk."""

from __future__ import annotations

import hashlib
import inspect
import sys
from collections.abc import Callable
from functools import cache
from threading import Lock
from types import FunctionType, ModuleType, SimpleNamespace

import numba

from rendulic.dem.kernels import arithmetic, arrays, lanes, mechanics, packs, rows, step
from rendulic.dem.laws import ContactLaw

__all__ = ["jit", "kernels_for", "lane_kernels_for"]

# no liberties in arithmetic: NaN is kept, and lanes, threads and machines end at the same bits
OPTIONS = {"nogil": True, "error_model": "numpy", "fastmath": False}
jit = numba.njit(cache=True, **OPTIONS)

INLINED = ("damped", "pair_force")  # into every loop: left to itself, the compiler makes calls of them
LAW_NAMES = ("law_stiffness", "law_wall_stiffness", "law_contact_force", "law_elastic_energy")
KERNELS = (
    "pair_force",
    "damped",
    "move_grains",
    "energy_let_go",
    "contact_pairs",
    "contact_forces",
    "wall_forces",
    "solve_3x3",
    "servo_rates",
    "move_walls",
    "finish_step",
    "advance",
    "stiffness_sums",
    "stored_energy",
)
LANE_KERNELS = ("pair_force", "damped", "move_lanes", "contact_lanes", "wall_lanes", "finish_lanes", "advance_lanes")


def kernels_for(law: ContactLaw) -> SimpleNamespace:
    """Return `advance`, `finish_step`, `move_grains`, ... compiled with the functions of `law`."""
    with _lock:
        return _kernels(step, KERNELS, law.stiffness, law.wall_stiffness, law.contact_force, law.elastic_energy)


def lane_kernels_for(law: ContactLaw, width: int) -> SimpleNamespace:
    """Return `advance_lanes` and `finish_lanes` for so many lanes, compiled with the functions of `law`."""
    with _lock:
        return _kernels(
            lanes, LANE_KERNELS, law.stiffness, law.wall_stiffness, law.contact_force, law.elastic_energy, width=width
        )


_lock = Lock()


@cache
def _kernels(source: ModuleType, kernels: tuple[str, ...], *law_functions: Callable, width: int = 0) -> SimpleNamespace:
    # a user's function may use numbers from around it, which its source does not show: it is compiled
    # anew in each process. rendulic's own go to disk under a name that changes with any source.
    own = all(getattr(f, "__module__", "").startswith("rendulic.") for f in law_functions)
    compiler = numba.njit(cache=own, **OPTIONS)
    digest = f"{_digest(law_functions)}_{width}" if own else "user"
    names = vars(mechanics) | vars(source)
    if width:
        names |= {"WIDTH": width, **vars(rows.row_operations(width, lanes.ORIGIN, lanes.STACKED))}
    for name, function in zip(LAW_NAMES, law_functions, strict=True):
        names[name] = function if hasattr(function, "py_func") else compiler(function)
    for name in kernels:
        plain = getattr(source, name)
        clone = FunctionType(plain.__code__, names, name, plain.__defaults__)
        clone.__qualname__ = f"{name}_{digest}"
        clone.__module__ = source.__name__
        names[name] = numba.njit(cache=own, forceinline=name in INLINED, **OPTIONS)(clone)
    return SimpleNamespace(**{name: names[name] for name in kernels})


def _digest(law_functions: tuple[Callable, ...]) -> str:
    parts = (*law_functions, arithmetic, arrays, lanes, mechanics, packs, rows, step, sys.modules[__name__])
    sources = "".join(inspect.getsource(part) for part in parts)
    return hashlib.sha256((sources + numba.__version__).encode()).hexdigest()[:12]

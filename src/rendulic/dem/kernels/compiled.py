"""Kernels compiled for a contact law, once per law and process; rendulic's own cached on disk."""

from __future__ import annotations

import hashlib
import inspect
import sys
from collections.abc import Callable
from functools import cache
from threading import Lock
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any

import numba

from rendulic.dem.kernels import arithmetic, arrays, contacts, lanes, mechanics, packs, rows, step, sums, team, walls
from rendulic.dem.laws import ContactLaw

__all__ = ["jit", "kernels_for", "lane_kernels_for"]

# no liberties in arithmetic: NaN is kept, and lanes, threads and machines end at the same bits
OPTIONS = {"nogil": True, "error_model": "numpy", "fastmath": False}
jit = numba.njit(cache=True, **OPTIONS)

INLINED = ("damped", "pair_force")  # into every loop: left to itself, the compiler makes calls of them
LAW_NAMES = ("law_stiffness", "law_wall_stiffness", "law_contact_force", "law_elastic_energy")
# where kernels are found; later names hide earlier ones
STEP = (mechanics, contacts, walls, step, team, sums)
KERNELS = (
    "pair_force", "damped", "move_grains", "energy_let_go", "contact_pairs", "contact_forces",  "forces_on", "total", "press_walls",
    "push_from_wall", "sum_walls", "wall_forces", "solve_3x3", "servo_rates", "move_walls", "finish_step", "advance",
    "finish_team", "advance_team", "stiffness_sums", "stored_energy",
)  # fmt: skip
LANE_KERNELS = ("pair_force", "damped", "move_lanes", "contact_lanes", "wall_lanes", "finish_lanes", "advance_lanes")


def kernels_for(law: ContactLaw) -> SimpleNamespace:
    """Return `advance`, `finish_step`, `move_grains`, ... compiled with the functions of `law`."""
    with _lock:
        return _kernels(STEP, KERNELS, law.stiffness, law.wall_stiffness, law.contact_force, law.elastic_energy)


def lane_kernels_for(law: ContactLaw, width: int) -> SimpleNamespace:
    """Return `advance_lanes` and `finish_lanes` for so many lanes, compiled with the functions of `law`."""
    with _lock:
        return _kernels(
            (mechanics, lanes),
            LANE_KERNELS,
            law.stiffness,
            law.wall_stiffness,
            law.contact_force,
            law.elastic_energy,
            width=width,
        )


_lock = Lock()


@cache
def _kernels(
    sources: tuple[ModuleType, ...], kernels: tuple[str, ...], *law_functions: Callable, width: int = 0
) -> SimpleNamespace:
    # a user's function may use numbers from around it, which its source does not show: it is compiled
    # anew in each process. rendulic's own go to disk under a name that changes with any source.
    own = all(getattr(f, "__module__", "").startswith("rendulic.") for f in law_functions)
    digest = f"{_digest(law_functions)}_{width}" if own else "user"

    def compiled(plain: FunctionType, around: dict[str, Any]) -> Callable:
        clone = FunctionType(plain.__code__, around, plain.__name__, plain.__defaults__, plain.__closure__)
        clone.__qualname__, clone.__module__ = f"{plain.__name__}_{digest}", plain.__module__
        return numba.njit(cache=own, forceinline=plain.__name__ in INLINED, **OPTIONS)(clone)

    names = {name: thing for source in sources for name, thing in vars(source).items()}
    if width:
        names |= {"WIDTH": width, **vars(rows.row_operations(width, lanes.ORIGIN, lanes.STACKED))}
    for name, function in zip(LAW_NAMES, law_functions, strict=True):
        names[name] = function if hasattr(function, "py_func") else compiled(function, function.__globals__)
    for name in kernels:
        names[name] = compiled(names[name], names)
    return SimpleNamespace(**{name: names[name] for name in kernels})


def _digest(law_functions: tuple[Callable, ...]) -> str:
    parts = (*law_functions, arithmetic, arrays, *STEP, lanes, packs, rows, sys.modules[__name__])
    sources = "".join(inspect.getsource(part) for part in parts)
    return hashlib.sha256((sources + numba.__version__).encode()).hexdigest()[:12]

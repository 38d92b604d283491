"""Kernels compiled for a contact law, once per law and process; rendulic's own cached on disk."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable
from functools import cache
from threading import Lock
from types import FunctionType, ModuleType, SimpleNamespace

import numba

from rendulic.dem.kernels import arrays, lanes, rows, step
from rendulic.dem.kernels.rows import row_moves
from rendulic.dem.laws import ContactLaw

__all__ = ["jit", "kernels_for", "lane_kernels_for"]

# contraction to fused multiply-add is the only liberty taken: NaN is kept, and a machine repeats itself
OPTIONS = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}}
# lanes take none: where the compiler contracts in one lane and not in the next, their results would differ
LANE_OPTIONS = OPTIONS | {"fastmath": False}
jit = numba.njit(cache=True, **OPTIONS)

LAW_NAMES = ("law_stiffness", "law_wall_stiffness", "law_contact_force", "law_elastic_energy")
KERNELS = (
    "damped",
    "move_grains",
    "contact_forces",
    "wall_forces",
    "solve_3x3",
    "servo_rates",
    "finish_step",
    "advance",
    "stiffness_sums",
    "stored_energy",
)
LANE_KERNELS = ("move_lanes", "contact_lanes", "wall_lanes", "finish_lanes", "advance_lanes")


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
    compiler = numba.njit(cache=own, **(LANE_OPTIONS if width else OPTIONS))
    digest = f"{_digest(law_functions)}_{width}" if own else "user"
    names = dict(vars(source))
    if width:
        names |= {"WIDTH": width, **vars(row_moves(width))}
    for name, function in zip(LAW_NAMES, law_functions, strict=True):
        names[name] = function if hasattr(function, "py_func") else compiler(function)
    for name in kernels:
        plain = getattr(source, name)
        clone = FunctionType(plain.__code__, names, name, plain.__defaults__)
        clone.__qualname__ = f"{name}_{digest}"
        clone.__module__ = source.__name__
        names[name] = compiler(clone)
    return SimpleNamespace(**{name: names[name] for name in kernels})


def _digest(law_functions: tuple[Callable, ...]) -> str:
    sources = [inspect.getsource(f) for f in (*law_functions, step, lanes, rows, arrays)]
    return hashlib.sha256(
        "".join([*sources, repr(OPTIONS), repr(LANE_OPTIONS), numba.__version__]).encode()
    ).hexdigest()[:12]

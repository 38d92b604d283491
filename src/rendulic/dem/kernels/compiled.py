"""Kernels compiled for a contact law, once per law and process, cached on disk between processes."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable
from functools import cache
from types import FunctionType, SimpleNamespace

import numba

from rendulic.dem.kernels import step
from rendulic.dem.laws import ContactLaw

__all__ = ["jit", "kernels_for"]

# contraction to fused multiply-add is the only liberty taken: NaN is kept, and a machine repeats itself
jit = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})


def kernels_for(law: ContactLaw) -> SimpleNamespace:
    """Return `advance`, `finish_step`, `move_grains`, ... compiled with the functions of `law`."""
    return _kernels(law.stiffness, law.wall_stiffness, law.contact_force)


@cache
def _kernels(stiffness: Callable, wall_stiffness: Callable, contact_force: Callable) -> SimpleNamespace:
    functions = (stiffness, wall_stiffness, contact_force)
    digest = hashlib.sha256("".join(inspect.getsource(f) for f in functions).encode()).hexdigest()[:12]
    names = dict(vars(step))
    for name, function in zip(("law_stiffness", "law_wall_stiffness", "law_contact_force"), functions, strict=True):
        names[name] = jit(function) if not hasattr(function, "py_func") else function
    kernels = [
        "damped", "move_grains", "contact_forces", "wall_forces", "solve_3x3", "servo_rates", "finish_step", "advance",
    ]  # fmt: skip
    for name in kernels:
        plain = getattr(step, name)
        clone = FunctionType(plain.__code__, names, name, plain.__defaults__)
        # the cache on disk is named after the qualified name: one entry per law
        clone.__qualname__ = f"{name}_{digest}"
        clone.__module__ = step.__name__
        names[name] = jit(clone)
    return SimpleNamespace(**{name: names[name] for name in kernels})

"""Arrays whose columns have names: one list names them, kernels and everything else take the places from it."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Mapping
from itertools import accumulate
from typing import Any

import numpy as np

__all__ = ["named", "places", "width"]


def places(name: str, columns: Mapping[str, int]) -> Any:
    """A named tuple of the first column of everything in a list of names and numbers of columns.

    >>> places("Row", {"position": 3, "radius": 1, "velocity": 3})
    Row(position=0, radius=3, velocity=4)
    """
    starts = [0, *accumulate(columns.values())][:-1]
    return namedtuple(name, columns)(*starts)  # type: ignore[arg-type]


def width(columns: Mapping[str, int]) -> int:
    """How many columns a list has.

    >>> width({"position": 3, "radius": 1})
    4
    """
    return sum(columns.values())


def named(array: np.ndarray, columns: Mapping[str, int]) -> dict[str, np.ndarray]:
    """Views of the last axis of an array by name; what is one number has no axis of its own."""
    starts = places("Starts", columns)
    return {
        name: array[..., start] if count == 1 else array[..., start : start + count]
        for (name, count), start in zip(columns.items(), starts, strict=True)
    }

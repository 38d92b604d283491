"""Checks of input, each with one clear sentence when it fails."""

from __future__ import annotations

from math import isfinite

import numpy as np

from rendulic.foundation.errors import InvalidInput

__all__ = ["finite_array", "increasing_fractions", "positive_number", "whole_number"]


def finite_array(name: str, values, shape: tuple[int | None, ...]) -> np.ndarray:
    """Return `values` as a float64 array of `shape` (None: any length), all numbers finite.

    Raises
    ------
    InvalidInput
        Naming what was expected and what came.
    """
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise InvalidInput(f"{name} must be an array of numbers: {error}") from None
    expected = "(" + ", ".join("n" if s is None else str(s) for s in shape) + ")"
    if array.ndim != len(shape) or any(s is not None and s != a for s, a in zip(shape, array.shape, strict=False)):
        raise InvalidInput(f"{name} must have shape {expected}, got {array.shape}")
    bad = ~np.isfinite(array)
    if bad.any():
        where = tuple(int(index) for index in np.argwhere(bad)[0])
        raise InvalidInput(f"{name} must be finite everywhere; {int(bad.sum())} entries are not, the first at {where}")
    return array


def positive_number(name: str, value, unit: str = "") -> float:
    """Return `value` as a float if it is a positive, finite number.

    >>> positive_number("density", 2600, "kg/m3")
    2600.0
    """
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = float("nan")
    if not (isfinite(number) and number > 0.0):
        raise InvalidInput(f"{name} must be a positive number{' in ' + unit if unit else ''}, got {value!r}")
    return number


def whole_number(name: str, value, lowest: int) -> int:
    """Return `value` as an int if it is a whole number of at least `lowest`."""
    try:
        is_whole = int(value) == value and value >= lowest
    except (TypeError, ValueError, OverflowError):
        is_whole = False
    if not is_whole:
        raise InvalidInput(f"{name} must be a whole number of at least {lowest}, got {value!r}")
    return int(value)


def increasing_fractions(name: str, values) -> tuple[float, ...]:
    """Return `values` as a tuple if they are increasing, above 0, and end with 1.

    >>> increasing_fractions("marks", [0.5, 1.0])
    (0.5, 1.0)
    """
    marks = tuple(values)
    if not marks or marks[-1] != 1.0 or not marks[0] > 0.0 or list(marks) != sorted(set(marks)):
        raise InvalidInput(f"{name} must be increasing fractions of the increment that end with 1, got {values!r}")
    return marks

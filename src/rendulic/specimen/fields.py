"""Fields of a state or a snapshot that may be anyone's, checked one by one before anything is computed from them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import isfinite
from typing import Any

import numpy as np

from rendulic.foundation.errors import CorruptFile

__all__ = ["Fields"]

LARGEST = 2**53  # of whole numbers


class Fields:
    """Arrays and numbers by name, taken out with what is expected of each.

    Parameters
    ----------
    where : str
        What they are of, for messages: a path, or "the state of an assembly".
    arrays : mapping of str to array
    numbers : mapping of str to any

    Notes
    -----
    Every method raises `CorruptFile`, naming the field, the row, and what was expected.
    """

    def __init__(self, where: str, arrays: Mapping[str, Any], numbers: Mapping[str, Any] | None = None) -> None:
        self.where, self.arrays, self.numbers = where, arrays, {} if numbers is None else numbers

    def expect_names(self, arrays: Iterable[str], numbers: Iterable[str], optional: Iterable[str] = ()) -> None:
        """Refuse fields that are not there, and ones that are unknown."""
        kinds = ((self.arrays, {*arrays}, "array"), (self.numbers, {*numbers}, "number"))
        for found, wanted, what in kinds:
            if missing := sorted(wanted - {*found}):
                raise CorruptFile(f"{self.where} lacks the {what} '{missing[0]}'")
            if unknown := sorted({*found} - wanted - {*optional}):
                raise CorruptFile(f"{self.where} has an unknown {what} {unknown[0]!r}")

    def array(self, name: str, dtype: type, shape: tuple[int | None, ...]) -> np.ndarray:
        """The array of this type and shape (None: any length), all numbers finite."""
        found = self.arrays.get(name)
        if not isinstance(found, np.ndarray):
            raise CorruptFile(f"{self.where} lacks the array '{name}'")
        if found.dtype != np.dtype(dtype):
            raise CorruptFile(f"{self.where}: {name} must be of {np.dtype(dtype)}, found {found.dtype.str}")
        if found.ndim != len(shape) or any(b not in (None, a) for a, b in zip(found.shape, shape, strict=True)):
            expected = "(" + ", ".join("n" if length is None else str(length) for length in shape) + ")"
            raise CorruptFile(f"{self.where}: {name} must have the shape {expected}, found {found.shape}")
        if found.dtype.kind == "f":
            self.refuse(name, ~np.isfinite(found), "a finite number")
        return found

    def number(
        self, name: str, *, above: float | None = None, least: float | None = None, below: float | None = None
    ) -> float:
        """The finite number, within these bounds."""
        found: Any = self.numbers.get(name)
        is_number = isinstance(found, int | float | np.number) and not isinstance(found, bool)
        # whole numbers of JSON have any size
        if is_number and abs(found) < LARGEST**5 and isfinite(found):
            number = float(found)
            if (
                (above is None or number > above)
                and (least is None or number >= least)
                and (below is None or number < below)
            ):
                return number
        words = (("above", above), ("at least", least), ("below", below))
        bounds = " and".join(f" {word} {bound:g}" for word, bound in words if bound is not None)
        raise CorruptFile(f"{self.where}: {name} must be a number{bounds}, found {str(found)[:80]!r}")

    def count(self, name: str) -> int:
        """The whole number, zero or more."""
        found = self.numbers.get(name)
        if isinstance(found, bool) or not isinstance(found, int | np.integer) or not 0 <= found < LARGEST:
            raise CorruptFile(f"{self.where}: {name} must be a whole number, zero or more, found {str(found)[:80]!r}")
        return int(found)

    def flag(self, name: str) -> bool:
        """True or false."""
        found = self.numbers.get(name)
        if not isinstance(found, bool):
            raise CorruptFile(f"{self.where}: {name} must be true or false, found {str(found)[:80]!r}")
        return found

    def refuse(self, name: str, wrong: np.ndarray, expected: str) -> None:
        """Name the first row of a field in which anything is `wrong`, if there is one."""
        if not np.any(wrong):
            return
        row = int(np.flatnonzero(wrong.reshape(len(wrong), -1).any(axis=1))[0]) if wrong.ndim else 0
        values = self.arrays.get(name)
        found = f", found {np.asarray(values)[row].tolist()}" if isinstance(values, np.ndarray) and values.ndim else ""
        raise CorruptFile(f"{self.where}: {name}, row {row}: expected {expected}{found[:100]}")

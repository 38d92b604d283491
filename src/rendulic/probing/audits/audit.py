"""One audit, and all of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

__all__ = ["Audit", "Audits", "NotPossible"]


class NotPossible(Exception):  # no error: an answer
    """An audit that the data do not allow; the text says why."""


@dataclass(frozen=True)
class Audit:
    """Two independent numbers held against each other.

    Parameters
    ----------
    compares : str
        What is compared, in words.
    catches : str
        What it could catch.
    residual, limit : float
        How far the numbers differ, and how far they may. Both have no unit.
    where : str
        "before", "after", "before and after", or "increment".
    failure : str
        What is wrong if it fails, in words.
    """

    compares: str
    catches: str
    residual: float
    limit: float
    where: str
    failure: str

    @property
    def passed(self) -> bool:
        """Whether the residual is within the limit; no number is not."""
        return bool(self.residual <= self.limit)

    def __str__(self) -> str:
        if self.passed:
            return f"passed ({self.residual:.2g}, limit {self.limit:.2g}): {self.compares}"
        return f"{self.failure} ({self.where}: {self.residual:.2g}, limit {self.limit:.2g}; compared: {self.compares})"


class Audits(dict[str, Audit]):
    """Audits by name; an audit that the data do not allow is not among them.

    Parameters
    ----------
    done : mapping of str to Audit
        Those that were made.
    not_possible : mapping of str to str
        Those that were not, and why.
    """

    def __init__(self, done: Mapping[str, Audit], not_possible: Mapping[str, str]) -> None:
        super().__init__(done)
        self.not_possible = dict(not_possible)

    @property
    def failed(self) -> dict[str, Audit]:
        """Those that failed."""
        return {name: audit for name, audit in self.items() if not audit.passed}

    @property
    def warnings(self) -> list[str]:
        """What is wrong, a sentence for each audit that failed."""
        return [f"{one.failure[0].upper()}{one.failure[1:]} ({one.where})." for one in self.failed.values()]

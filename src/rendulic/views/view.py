"""What all views have in common, and the table beside them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Mark", "Table", "View", "verdicts"]

Mark = Literal["good", "doubtful", "bad", ""]
MOST_LABELS = 3  # of one verdict


@dataclass(frozen=True)
class Table:
    """Rows of words under headings.

    Parameters
    ----------
    caption : str
        Above.
    heads : sequence of str
        One for each column.
    rows : sequence of sequence of str
        The first cell of each names it.
    goes_to : sequence of str
        For each row the state that figures show when it is chosen; none if empty.
    marks : sequence of {"good", "doubtful", "bad", ""}
        For each row how its cell number
    marked : int
        after the first is to be read; no marks if empty.
    filter_by : str
        A heading: the reader can choose the rows with one value in its column.
    """

    caption: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    goes_to: Sequence[str] = ()
    marks: Sequence[Mark] = ()
    marked: int = 1
    filter_by: str = ""

    def markdown(self) -> str:
        """The table as Markdown.

        >>> print(Table("", ("state", "W2n"), [("loose", "-0.20")]).markdown())
        | state | W2n |
        | --- | --- |
        | loose | -0.20 |
        """
        lines = (self.heads, ["---"] * len(self.heads), *self.rows)
        return "\n".join(f"| {' | '.join(str(cell).replace('|', '&#124;') for cell in line)} |" for line in lines)


@dataclass(frozen=True, kw_only=True, eq=False)
class View:
    """What is to be seen, whoever draws it.

    Parameters
    ----------
    title : str
        Above: what was examined.
    caption : str
        Below: what is shown and how to read it; it also serves those who do not see the picture.
    verdict : str
        The answer in one sentence; empty where there is none.
    tables : tuple of Table
        The numbers in words.
    data : xarray.Dataset, optional
        All numbers, where they are worth a file of their own.
    """

    title: str = ""
    caption: str = ""
    verdict: str = ""
    tables: tuple[Table, ...] = ()
    data: xr.Dataset | None = None


def verdicts(views: Iterable[tuple[str, View]]) -> list[str]:
    """Verdicts of views with their labels: those that are alike as one, without a label if it is that of all.

    >>> stable, unstable = View(verdict="It is stable."), View(verdict="It is not.")
    >>> verdicts([("loose", unstable), ("dense", stable), ("denser", stable)])
    ['loose: It is not.', 'dense; denser: It is stable.']
    >>> verdicts([("dense", stable), ("denser", stable)])
    ['It is stable.']
    """
    together: dict[str, list[str]] = {}
    for label, view in views:
        together.setdefault(view.verdict, []).append(label)
    return [
        verdict if len(together) == 1 else f"{_some(labels)}: {verdict}"
        for verdict, labels in together.items() if verdict
    ]  # fmt: skip


def _some(labels: list[str]) -> str:
    """The first of many labels, and how many more there are."""
    if len(labels) <= MOST_LABELS + 1:
        return "; ".join(labels)
    return f"{'; '.join(labels[:MOST_LABELS])} and {len(labels) - MOST_LABELS} more"

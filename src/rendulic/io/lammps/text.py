"""Text files of LAMMPS as tables: one step of a dump, columns of numbers, and what is wrong with them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rendulic.foundation.errors import CorruptFile, InvalidInput
from rendulic.io.snapshot import LARGEST

__all__ = ["Dump", "TextTable", "numbers_of", "read_dump", "rows_of", "table_of", "text_of", "whole_numbers_of"]


class TextTable(NamedTuple):
    """Rows of words under the names of their columns."""

    columns: list[str]
    rows: list[str]


class Dump(NamedTuple):
    """One step of a dump."""

    step: int
    box: np.ndarray  # (6,)
    periodic: np.ndarray  # (3,)
    table: TextTable


def text_of(path: Path) -> str:
    """The text of a file.

    Raises
    ------
    InvalidInput, CorruptFile
        If there is none, or it is no text, or its last line does not end.
    """
    if not path.is_file():
        raise InvalidInput(f"no file {path}: expected one of LAMMPS")
    try:
        text = path.read_text(encoding="ascii")
    except (UnicodeDecodeError, OSError) as error:
        raise CorruptFile(f"{path} is no text file of LAMMPS: {error}") from None
    if not text.endswith("\n"):
        raise CorruptFile(f"{path} must end with a whole line: truncated?")
    return text


def read_dump(path: Path, kind: str) -> Dump:
    """The only step in a dump."""
    head, *parts = re.split(r"^ITEM: ", text_of(path), flags=re.MULTILINE)
    sections = [part.partition("\n")[::2] for part in parts]
    headings = [heading.split() for heading, _ in sections]
    if head or not headings:
        raise CorruptFile(f"{path} is no dump of LAMMPS in text: it must begin with 'ITEM: '")
    if sum(heading == ["TIMESTEP"] for heading in headings) > 1:
        raise CorruptFile(f"{path} has more than one step: write each to a file of its own, with a * in the name")
    bodies = {heading: body for heading, body in sections}

    def body(begin: str) -> tuple[list[str], str]:
        """The words after `begin` in the heading of a section, and what follows."""
        for heading, text in bodies.items():
            if heading.startswith(begin):
                return heading[len(begin) :].split(), text
        raise CorruptFile(f"{path} lacks the section 'ITEM: {begin}': truncated, or not a dump of {kind.lower()}")

    if "UNITS" in bodies and bodies["UNITS"].strip() != "si":
        raise CorruptFile(f"{path} is in units {bodies['UNITS'].strip()!r}, expected 'si'")
    step, count = (_count(path, name, body(name)[1]) for name in ("TIMESTEP", f"NUMBER OF {kind}"))
    flags, bounds = body("BOX BOUNDS")
    if len(flags) != 3 or not all(flag == "pp" or not set(flag) - set("fsm") for flag in flags):
        raise CorruptFile(f"{path}: section BOX BOUNDS must be of a box along the axes, like 'ff ff pp', found {flags}")
    try:
        box = np.array([[float(word) for word in line.split()] for line in bounds.splitlines()]).reshape(6)
    except ValueError:
        raise CorruptFile(f"{path}: section BOX BOUNDS must have three rows of two numbers") from None
    if not (np.isfinite(box).all() and (box[1::2] > box[0::2]).all()):
        raise CorruptFile(f"{path}: section BOX BOUNDS must have finite rows 'low high', found {box.tolist()}")
    columns, rows = body(f"{kind} ")
    table = table_of(path, columns, rows)
    if len(table.rows) != count:
        raise CorruptFile(f"{path} has {len(table.rows)} rows, its section NUMBER OF {kind} says {count}: truncated?")
    return Dump(step, box, np.array([flag == "pp" for flag in flags]), table)


def _count(path: Path, name: str, text: str) -> int:
    try:
        number = int(text)
    except ValueError:
        number = -1
    if not 0 <= number < 2**53 or (name != "TIMESTEP" and number > LARGEST):
        raise CorruptFile(f"{path}: section {name} must be a whole number, found {text.strip()[:40]!r}")
    return number


def table_of(path: Path, columns: list[str], text: str) -> TextTable:
    """Rows of as many words as there are columns.

    Raises
    ------
    CorruptFile
        If a row has more or fewer, or two columns have one name.
    """
    if len(set(columns)) != len(columns):
        raise CorruptFile(f"{path} has two columns of one name: {' '.join(columns)}")
    rows = [row for row in text.splitlines() if row.strip()]
    for number, row in enumerate(rows):
        if (found := len(row.split())) != len(columns):
            raise CorruptFile(
                f"{path}, row {number + 1} has {found} columns, expected the {len(columns)} of its heading"
            )
    return TextTable(columns, rows)


def numbers_of(path: Path, table: TextTable, names: tuple[str, ...]) -> np.ndarray:
    """(n, len(names)) finite numbers of the columns `names`.

    Raises
    ------
    CorruptFile
        Naming file, column and row.
    """
    missing = [name for name in names if name not in table.columns]
    if missing:
        raise CorruptFile(f"{path} lacks the column(s) {', '.join(missing)}; it has {', '.join(table.columns)}")
    if not table.rows:
        return np.zeros((0, len(names)))
    at = [table.columns.index(name) for name in names]
    try:
        found = np.loadtxt(table.rows, usecols=at, ndmin=2, comments=None)
    except ValueError:
        found = np.array([[_number(row.split()[k]) for k in at] for row in table.rows])
    wrong = np.argwhere(~np.isfinite(found))
    if len(wrong):
        row, k = wrong[0]
        word = table.rows[row].split()[at[k]]
        raise CorruptFile(f"{path}, row {row + 1}, column {names[k]}: expected a number, found {word[:40]!r}")
    return found


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return np.nan


def whole_numbers_of(path: Path, table: TextTable, name: str) -> np.ndarray:
    values = numbers_of(path, table, (name,))[:, 0]
    wrong = (values != np.round(values)) | (np.abs(values) > 2.0**53)
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        raise CorruptFile(f"{path}, row {row + 1}, column {name}: expected a whole number, found {values[row]!r}")
    return values.astype(np.int64)


def rows_of(path: Path, table: TextTable, name: str, ids: np.ndarray) -> np.ndarray:
    """Rows of the grains that a column of ids names."""
    found = whole_numbers_of(path, table, name)
    row = np.minimum(np.searchsorted(ids, found), max(len(ids) - 1, 0))
    absent = ids[row] != found if len(ids) else np.ones(len(found), dtype=bool)
    if absent.any():
        worst = int(np.flatnonzero(absent)[0])
        raise CorruptFile(
            f"{path}, row {worst + 1}, column {name}: there is no grain {found[worst]} in the dump of grains"
        )
    return row

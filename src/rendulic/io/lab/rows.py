"""Rows of a laboratory's file, whatever kind of file it is: text, a sheet of a workbook, an array of NumPy."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from rendulic.foundation.checks import whole_number
from rendulic.foundation.errors import InvalidInput, nearest, one_of

__all__ = ["BLANKS", "LARGEST", "Layout", "Rows", "read_rows"]

BLANKS = "blanks"  # the delimiter that is any run of blanks and tabs
LARGEST = 100_000_000  # bytes of a file that are read
SHOWN = 300  # letters of a file that an error repeats
MARKS = "#*;!%/ \t"  # before headings, in files that mark them as comments
SHEETS, ARRAYS = (".xlsx", ".xlsm"), (".npz", ".npy")


@dataclass(frozen=True)
class Layout:
    """How a file is written.

    Parameters
    ----------
    delimiter : str
        Between columns: one sign, or "blanks", any run of blanks and tabs.
    decimal : {".", ","}
        In numbers.
    comment : str, optional
        What lines begin with that are not read.
    heading_line : int
        Line of the headings, counted from 1; 0: there is none, and columns are numbers from 1 on.
    first_line, last_line : int, optional
        Of readings; by default all after the headings.
    encoding : str
        Of text.
    sheet : str, optional
        Of a workbook; by default the first.
    key : str, optional
        Of an array in an .npz file; by default the only one.
    """

    delimiter: str = ","
    decimal: str = "."
    comment: str | None = None
    heading_line: int = 1
    first_line: int | None = None
    last_line: int | None = None
    encoding: str = "utf-8-sig"
    sheet: str | None = None
    key: str | None = None


@dataclass(frozen=True)
class Rows:
    """Rows of readings, and where in them the columns are.

    Parameters
    ----------
    path : Path
        Of the file.
    lines : list of int
        Line of each row in the file.
    entries : list of list of str
        Of each row, empty rows left out.
    places : dict of str to int
        Position in a row of each column that was asked for.
    empty : list of int
        Lines without an entry between the first and the last reading.
    headings : list of str
        As they stand in the file; empty if there are none.
    """

    path: Path
    lines: list[int]
    entries: list[list[str]]
    places: dict[str, int]
    empty: list[int]
    headings: list[str]


def read_rows(path: str | os.PathLike, columns: Mapping[str, str | int], layout: Layout) -> Rows:
    """The rows of readings in a file.

    Parameters
    ----------
    path : path
        Text, .xlsx, .npz or .npy.
    columns : mapping
        What to find: for each name the heading of its column, or its number, from 1 on.
    layout : Layout
        How the file is written.

    Raises
    ------
    InvalidInput
        If there is no such file, it is of a kind that holds no readings, or a column is missing.
    """
    path = Path(path)
    one_of(layout.decimal, (".", ","), "decimal sign")
    if any(ord(sign) < 32 for sign in str(path)):
        raise InvalidInput(
            f"no test at {str(path)!r}: the name holds a control sign; between double quotes, TOML reads \\t as a tab: write / "
            "between folders, or single quotes"
        )
    if not path.is_file():
        raise InvalidInput(f"no test at {path}: check the path")
    if path.stat().st_size > LARGEST:
        raise InvalidInput(f"{path} has {path.stat().st_size} bytes; a test of more than {LARGEST} is not read")
    heading_line = whole_number("heading_line", layout.heading_line, 0)
    kind = path.suffix.lower()
    table = _sheet(path, layout) if kind in SHEETS else _array(path, layout) if kind in ARRAYS else _text(path, layout)
    numbered = all(str(column).strip().isdigit() for column in columns.values())
    headings = (
        [] if heading_line == 0 or kind in ARRAYS else next((row for line, row in table if line == heading_line), [])
    )
    if numbered and not set(map(str, columns.values())) <= set(headings):
        # no such headings: the numbers are places, and what stands in the headings' line may be a reading
        if headings and any(entry and not _is_number(entry, layout.decimal) for entry in headings):
            heading_line = max(heading_line, 1)
        else:
            headings, heading_line = [], 0
        places = {name: int(column) - 1 for name, column in columns.items()}
    elif kind in ARRAYS or heading_line == 0:
        wrong = next(column for column in columns.values() if not str(column).strip().isdigit())
        raise InvalidInput(f"{path} has no headings: give columns by number, from 1 on, got {wrong!r}")
    else:
        if not any(headings):
            raise InvalidInput(f"{path} has no headings in line {heading_line}; it has {len(table)} lines")
        places, headings = _places(path, columns, headings, table, layout)
    begin = heading_line + 1 if layout.first_line is None else whole_number("first_line", layout.first_line, 1)
    end = (
        table[-1][0] if layout.last_line is None and table else whole_number("last_line", layout.last_line or 1, begin)
    )
    within = [(line, row) for line, row in table if begin <= line <= end]
    filled = [(line, row) for line, row in within if any(row)]
    least = 1 + max(places.values(), default=0)
    if min(places.values(), default=0) < 0 or (filled and least > max(len(row) for _line, row in filled)):
        raise InvalidInput(
            f"{path} has no column {least}: its rows have at most {max(len(row) for _line, row in filled)}"
        )
    last = filled[-1][0] if filled else 0
    empty = [line for line, row in within if not any(row) and filled and filled[0][0] < line < last]
    return Rows(path, [line for line, _row in filled], [row for _line, row in filled], places, empty, headings)


def _text(path: Path, layout: Layout) -> list[tuple[int, list[str]]]:
    """Lines and entries of a text file."""
    data = path.read_bytes()
    if data[:4] in (b"PK\x03\x04", b"\xd0\xcf\x11\xe0"):
        raise InvalidInput(f"{path} is a workbook, not text: save it as .xlsx, with that ending, or as CSV")
    if b"\x00" in data[:4096] and "16" not in layout.encoding and "32" not in layout.encoding:
        raise InvalidInput(
            f"{path} is a binary file, not text: export the readings as CSV, or give encoding = 'utf-16' if it is text of that kind"
        )
    try:
        text = data.decode(layout.encoding)
    except (ValueError, LookupError) as error:
        raise InvalidInput(f"{path} is not text in the encoding '{layout.encoding}': {error}; try 'latin-1'") from None
    if re.match(r'\s*("GROUP"\s*,|"?\*\*PROJ)', text):
        raise InvalidInput(
            f"{path} is an AGS file: it has summary results (groups TREG and TRET in AGS 3 and 4: strengths, strains at failure), "
            "no readings; ask the laboratory for the readings as CSV"
        )
    delimiter, blanks = layout.delimiter, layout.delimiter in (BLANKS, " ")
    if not blanks and (len(delimiter) != 1 or delimiter == layout.decimal or delimiter in "\r\n"):
        raise InvalidInput(
            f"{path}: the delimiter must be one sign other than the decimal sign '{layout.decimal}', or \"{BLANKS}\", got {delimiter!r}"
        )
    lines = text.splitlines()
    skipped = {k for k, line in enumerate(lines) if layout.comment and line.lstrip().startswith(layout.comment)}
    skipped.discard(layout.heading_line - 1)
    if blanks:
        return [(k + 1, line.split()) for k, line in enumerate(lines) if k not in skipped]
    try:
        reader = csv.reader(("" if k in skipped else line for k, line in enumerate(lines)), delimiter=delimiter)
        rows = [(reader.line_num, [field.strip() for field in row]) for row in reader]
    except (csv.Error, TypeError) as error:
        raise InvalidInput(f"{path} is not a CSV file: {error}") from None
    return [(line, row) for line, row in rows if line - 1 not in skipped]


def _sheet(path: Path, layout: Layout) -> list[tuple[int, list[str]]]:
    """Lines and entries of a sheet."""
    import pandas as pd

    try:
        frame = pd.read_excel(path, sheet_name=layout.sheet or 0, header=None, dtype=object)
    except ImportError:
        raise InvalidInput(
            f"{path}: workbooks are read with openpyxl: pip install openpyxl, or save it as CSV"
        ) from None
    except (ValueError, KeyError, OSError, BadZipFile) as error:
        raise InvalidInput(f"{path} cannot be read as a workbook: {' '.join(str(error).split())[:SHOWN]}") from None
    texts = frame.map(lambda cell: "" if pd.isna(cell) else str(cell).strip()).to_numpy().tolist()
    return [
        (k + 1, [entry.replace(".", layout.decimal) if _is_number(entry, ".") else entry for entry in row])
        for k, row in enumerate(texts)
    ]


def _array(path: Path, layout: Layout) -> list[tuple[int, list[str]]]:
    """Rows of a two-dimensional array of numbers."""
    try:
        found = np.load(path, allow_pickle=False)
        if isinstance(found, np.ndarray):
            array = found
        else:
            with found:
                keys = list(found.files)
                key = layout.key or (keys[0] if len(keys) == 1 else None)
                if key is None or key not in keys:
                    near = nearest(key, keys) if key else None
                    raise InvalidInput(
                        f"{path} has {len(keys)} arrays: say which with key{f', did you mean {near!r}?' if near else ''} "
                        f"({', '.join(keys)[:SHOWN]})"
                    )
                array = found[key]
    except (ValueError, OSError, BadZipFile, EOFError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(
            f"{path} cannot be read as arrays of numbers: {' '.join(str(error).split())[:SHOWN]}"
        ) from None
    if array.ndim != 2 or array.dtype.kind not in "fiu":
        raise InvalidInput(
            f"{path}: a test is an array of numbers with a row for each reading, got {array.dtype} {array.shape}"
        )
    return [
        (k + 1, [repr(value).replace(".", layout.decimal) for value in row]) for k, row in enumerate(array.tolist())
    ]


def _is_number(entry: str, decimal: str) -> bool:
    try:
        float(entry.replace(decimal, "."))
    except ValueError:
        return False
    return True


def _places(
    path: Path,
    columns: Mapping[str, str | int],
    headings: list[str],
    table: list[tuple[int, list[str]]],
    layout: Layout,
) -> tuple[dict[str, int], list[str]]:
    """Where the columns are, whose headings may be parted otherwise than the readings or stand behind a mark."""
    wanted = [str(heading).strip() for heading in columns.values()]
    numbers = [row for line, row in table if line > layout.heading_line and row and _is_number(row[0], layout.decimal)]
    width = len(numbers[0]) if numbers else len(headings)
    whole = _line_of(path, layout) if path.suffix.lower() not in SHEETS else ""
    parted = [
        headings,
        [entry.strip() for entry in re.split(r"\t+|\s{2,}", whole.strip(MARKS)) if entry.strip()],
        whole.strip(MARKS).split(),
    ]
    parted += [[entry.strip(MARKS) for entry in headings]]
    fits = [names for names in parted if set(wanted) <= set(names) and (names is headings or len(names) == width)]
    fits.sort(key=lambda names: len(names) != width)
    names = fits[0] if fits else max(parted[:2], key=lambda one: (len(set(wanted) & set(one)), one is headings))
    places = {}
    for name, heading in columns.items():
        heading = str(heading).strip()
        if names.count(heading) != 1:
            near = nearest(heading, names)
            raise InvalidInput(
                f"{path} has {'no' if heading not in names else 'more than one'} column '{heading}' for {name}"
                f"{f'; did you mean {near!r}?' if near and near != heading else ''}: the headings in line {layout.heading_line}, "
                f"parted by {layout.delimiter!r}, are {', '.join(map(repr, names))[:SHOWN]}"
            )
        places[name] = names.index(heading)
    if len(names) != width and names is not headings:
        raise InvalidInput(
            f"{path} has {len(names)} headings over {width} columns: give the columns by number, from 1 on, with heading_line = 0 and "
            "first_line"
        )
    return places, names


def _line_of(path: Path, layout: Layout) -> str:
    """The line of the headings as it stands in the file."""
    lines = path.read_bytes().decode(layout.encoding).splitlines()
    return lines[layout.heading_line - 1] if len(lines) >= layout.heading_line else ""

"""Text files of LAMMPS as tables: one step of a dump, columns of numbers, and what is wrong with them."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rendulic.errors import CorruptFile, InvalidInput
from rendulic.io.snapshot import LARGEST

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Dump", "numbers_of", "read_dump", "rows_of", "table_of", "text_of", "whole_numbers_of"]


class Dump(NamedTuple):
    """One step of a dump."""

    step: int
    box: np.ndarray  # (6,)
    periodic: np.ndarray  # (3,)
    table: pd.DataFrame  # as it is: text, or numbers


def text_of(path: Path) -> str:
    """The text of a file.

    Raises
    ------
    InvalidInput, CorruptFile
        If there is none, or it is no text.
    """
    if not path.is_file():
        raise InvalidInput(f"no file {path}: expected one of LAMMPS")
    try:
        return path.read_text(encoding="ascii")
    except (UnicodeDecodeError, OSError) as error:
        raise CorruptFile(f"{path} is no text file of LAMMPS: {error}") from None


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
    step, count = (_number(path, name, body(name)[1]) for name in ("TIMESTEP", f"NUMBER OF {kind}"))
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
    if len(table) != count:
        raise CorruptFile(f"{path} has {len(table)} rows, its section NUMBER OF {kind} says {count}: truncated?")
    return Dump(step, box, np.array([flag == "pp" for flag in flags]), table)


def _number(path: Path, name: str, text: str) -> int:
    try:
        number = int(text)
    except ValueError:
        number = -1
    if not 0 <= number < 2**53 or (name != "TIMESTEP" and number > LARGEST):
        raise CorruptFile(f"{path}: section {name} must be a whole number, found {text.strip()[:40]!r}")
    return number


def table_of(path: Path, columns: list[str], text: str) -> pd.DataFrame:
    """Rows of as many words as there are columns."""
    import pandas as pd

    if len(set(columns)) != len(columns):
        raise CorruptFile(f"{path} has two columns of one name: {' '.join(columns)}")
    if not text.strip():
        return pd.DataFrame({name: np.zeros(0) for name in columns})
    try:
        frame = pd.read_csv(
            io.StringIO(text), sep=r"\s+", header=None, float_precision="round_trip", quoting=3, nrows=LARGEST + 1
        )
    except (ValueError, OSError) as error:
        raise CorruptFile(f"{path}: rows must have the {len(columns)} columns of the heading: {error}") from None
    if frame.shape[1] != len(columns):
        raise CorruptFile(f"{path}: rows have {frame.shape[1]} columns, the heading names {len(columns)}")
    frame.columns = columns
    short = frame.iloc[:, -1].isna().to_numpy()
    if short.any():
        raise CorruptFile(f"{path}, row {int(np.flatnonzero(short)[0]) + 1} has fewer than {len(columns)} numbers")
    return frame


def numbers_of(path: Path, frame: pd.DataFrame, names: tuple[str, ...]) -> np.ndarray:
    """(n, len(names)) finite numbers of the columns `names`.

    Raises
    ------
    CorruptFile
        Naming file, column and row.
    """
    import pandas as pd

    missing = [name for name in names if name not in frame.columns]
    if missing:
        raise CorruptFile(f"{path} lacks the column(s) {', '.join(missing)}; it has {', '.join(frame.columns)}")
    found = np.empty((len(frame), len(names)))
    for k, name in enumerate(names):
        found[:, k] = pd.to_numeric(frame[name], errors="coerce")
        if not np.isfinite(found[:, k]).all():
            row = int(np.flatnonzero(~np.isfinite(found[:, k]))[0])
            raise CorruptFile(
                f"{path}, row {row + 1}, column {name}: expected a number, found {frame[name].iloc[row]!r}"
            )
    return found


def whole_numbers_of(path: Path, frame: pd.DataFrame, name: str) -> np.ndarray:
    values = numbers_of(path, frame, (name,))[:, 0]
    wrong = (values != np.round(values)) | (np.abs(values) > 2.0**53)
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        raise CorruptFile(f"{path}, row {row + 1}, column {name}: expected a whole number, found {values[row]!r}")
    return values.astype(np.int64)


def rows_of(path: Path, frame: pd.DataFrame, name: str, ids: np.ndarray) -> np.ndarray:
    """Rows of the grains that a column of ids names."""
    found = whole_numbers_of(path, frame, name)
    row = np.minimum(np.searchsorted(ids, found), max(len(ids) - 1, 0))
    absent = ids[row] != found if len(ids) else np.ones(len(found), dtype=bool)
    if absent.any():
        worst = int(np.flatnonzero(absent)[0])
        raise CorruptFile(
            f"{path}, row {worst + 1}, column {name}: there is no grain {found[worst]} in the dump of grains"
        )
    return row

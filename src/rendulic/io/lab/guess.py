"""A description proposed from the first lines of a file, for the user to check."""

from __future__ import annotations

import os
import re
from pathlib import Path

from rendulic.foundation.errors import InvalidInput

__all__ = ["guess_description"]

LOOKED_AT = 200_000  # bytes
# first match wins; of headings in small letters without blanks
NAMES = (
    ("void_ratio", r"^(e|void_?ratio|porenzahl)$"),
    ("eps_v", r"(eps|\u03b5|e)_?(ilon)?_?v(ol)?\b|vol"),
    ("pore_pressure", r"^u\b|^u$|pore|delta_?u|^du"),
    ("cell_pressure", r"cell|confin"),
    ("sigma_3", r"(sig|sigma|\u03c3)_?(ma)?_?(3|r|h)('|$)"),
    ("sigma_1", r"(sig|sigma|\u03c3)_?(ma)?_?(1|v|a)('|$)"),
    ("q", r"^q\b|deviator|sigma_?d"),
    ("p", r"^p'?(\b|$)|mean"),
    ("eps_1", r"(eps|epsilon|\u03b5|e)_?(1|a|axial|z|y)\b|axial|strain"),
)
UNIT = re.compile(r"(%|\bkpa\b|\bmpa\b|\bbar\b|\bpa\b)", re.IGNORECASE)
UNITS = {"%": "%", "kpa": "kPa", "mpa": "MPa", "bar": "bar", "pa": "Pa"}


def guess_description(path: str | os.PathLike) -> str:
    """The text of a description for `rendulic lab`, as far as the first lines of a text file tell it.

    Units that no line gives are written as "?", which is refused until it is replaced.

    Raises
    ------
    InvalidInput
        If there is no such file, or no rows of numbers in it.
    """
    path = Path(path)
    if not path.is_file():
        raise InvalidInput(f"no test at {path}: check the path")
    with path.open("rb") as file:
        data = file.read(LOOKED_AT)
    if b"\x00" in data[:4096]:
        raise InvalidInput(f"{path} is no text: a description is proposed of text files only")
    encoding = "utf-8-sig"
    try:
        lines = data.decode(encoding, errors="strict" if len(data) < LOOKED_AT else "ignore").splitlines()
    except ValueError:
        encoding = "latin-1"
        lines = data.decode(encoding).splitlines()
    delimiter, decimal, first = _parting(path, lines)
    width = len(_split(lines[first], delimiter))
    heading = next(
        (k for k in reversed(range(first)) if re.search("[A-Za-z]", lines[k]) and not _is_units(lines[k])), None
    )
    headings = _headings(lines[heading], delimiter, width) if heading is not None else []
    between = " ".join(lines[(0 if heading is None else heading) : first])
    units_line = next((k for k in range(0 if heading is None else heading + 1, first) if _is_units(lines[k])), None)
    units = _headings(lines[units_line], delimiter, width) if units_line is not None else []
    found = _columns(headings)
    drained = bool({"eps_v", "void_ratio"} & set(found))
    if not drained and len(headings) == 0:
        between = ""
    told = [f'file = "{path.name}"', f'drainage = "{"drained" if drained else "undrained"}"   # check', "", "[columns]"]
    if not found:
        told += ["# no headings were recognised: give the number of each column, from 1 on", "eps_1 = 1", "q = 2"]
        found = {"eps_1": 0, "q": 1}
    else:
        told += [
            f"{name} = '{headings[at]}'" if headings.count(headings[at]) == 1 else f"{name} = {at + 1}"
            for name, at in found.items()
        ]
    told += ["", "[units]"]
    for name, at in found.items():
        text = (units[at] if at < len(units) else "") + " " + (headings[at] if at < len(headings) else "")
        unit = UNIT.search(text)
        default = "1" if name == "void_ratio" else "?"
        told.append(f'{name} = "{UNITS[unit.group(1).lower()] if unit and name != "void_ratio" else default}"')
    told += ["", "[format]", f'delimiter = "{delimiter}"'.replace("\t", "\\t"), f'decimal = "{decimal}"']
    told += [
        f"heading_line = {0 if heading is None else heading + 1}",
        f"first_line = {first + 1}",
        f'encoding = "{encoding}"',
    ]
    told += [
        "# extension = true",
        "# tension_positive = true",
        f"# seen: {between.strip()[:120]}" if between.strip() else "",
    ]
    return "\n".join(told).rstrip() + "\n"


def _split(line: str, delimiter: str) -> list[str]:
    return line.split() if delimiter == "blanks" else [entry.strip() for entry in line.split(delimiter)]


def _parting(path: Path, lines: list[str]) -> tuple[str, str, int]:
    """Delimiter, decimal sign, and the first of three lines alike of numbers: the way that gives most columns."""
    best: tuple[int, str, str, int] | None = None
    for delimiter in ("\t", ";", ",", "blanks"):
        for decimal in (".", ","):
            if delimiter == decimal:
                continue
            counts = [_numbers(_split(line, delimiter), decimal) for line in lines[:400]]
            for k in range(len(counts) - 2):
                if counts[k] >= 2 and counts[k] == counts[k + 1] == counts[k + 2]:
                    if best is None or counts[k] > best[0]:
                        best = (counts[k], delimiter, decimal, k)
                    break
    if best is None:
        raise InvalidInput(f"{path} has no three lines alike of at least two numbers among its first 400")
    return best[1:]


def _numbers(entries: list[str], decimal: str) -> int:
    """How many numbers a line has, if that is most of it, else 0."""
    other = "," if decimal == "." else "."
    count = 0
    for entry in entries:
        try:
            float("x" if other in entry else entry.replace(decimal, "."))
            count += 1
        except ValueError:
            continue
    return count if 2 * count > len(entries) else 0


def _is_units(line: str) -> bool:
    return (
        bool(UNIT.search(line)) and re.sub(r"[\[\]()%\s,;/²-]|kPa|MPa|Pa|bar|kg|mm?|cm\d?|deg|min|s\b", "", line) == ""
    )


def _headings(line: str, delimiter: str, width: int) -> list[str]:
    """Entries of a line over `width` columns, parted as the readings or by runs of blanks."""
    bare = line.strip("#*!/ \t")
    ways = [
        _split(bare, delimiter),
        [part.strip() for part in re.split(r"\t+|\s{2,}", bare) if part.strip()],
        bare.split(),
    ]
    return next((way for way in ways if len(way) == width), ways[0])


def _columns(headings: list[str]) -> dict[str, int]:
    """Place of each quantity whose name a heading looks like; effective stresses are preferred to p and q's other ways."""
    found: dict[str, int] = {}
    for at, heading in enumerate(headings):
        bare = re.sub(r"[\[(].*?[\])]|\s", "", heading).lower()
        name = next((name for name, pattern in NAMES if re.search(pattern, bare)), None)
        if name and name not in found:
            found[name] = at
    if "q" in found:
        found.pop("sigma_1", None)
    if "p" in found:
        for name in ("sigma_3", "cell_pressure", "pore_pressure"):
            found.pop(name, None)
    elif "sigma_3" in found:
        for name in ("cell_pressure", "pore_pressure"):
            found.pop(name, None)
    if "eps_v" in found:
        found.pop("void_ratio", None)
    order = [
        name
        for name in ("eps_1", "eps_v", "void_ratio", "q", "p", "sigma_1", "sigma_3", "cell_pressure", "pore_pressure")
    ]
    return {name: found[name] for name in order if name in found}

"""Tables of named values checked by pydantic, with errors in one sentence."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from rendulic.foundation.errors import InvalidInput, nearest

__all__ = ["Positive", "Section", "Whole", "read_toml", "validated"]

LONGEST = 2**20  # bytes of a TOML file

# strict: text is no number, and true is not 1
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False, strict=True)]
Whole = Annotated[int, Field(strict=True)]


class Section(BaseModel):
    """A table of named values; unknown names are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def read_toml(path: str | os.PathLike, missing: str, hint: str = "") -> dict[str, Any]:
    """The table in a TOML file.

    Parameters
    ----------
    missing : str
        What to say if there is no such file.
    hint : str
        What to add if it is not TOML.

    Raises
    ------
    InvalidInput
        If there is no such file, it cannot be read, is larger than 1 MiB or is not TOML.
    """
    path = Path(path)
    if not path.is_file():
        raise InvalidInput(missing)
    try:
        with path.open("rb") as file:
            data = file.read(LONGEST + 1)
    except OSError as error:
        raise InvalidInput(f"cannot read {path}: {error.strerror or error}") from None
    if len(data) > LONGEST:
        raise InvalidInput(f"{path} is larger than {LONGEST} bytes, which no such file needs: check the path")
    try:
        return tomllib.loads(data.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise InvalidInput(f"{path} is not a TOML file: {' '.join(str(error).split())}{hint}") from None


Model = TypeVar("Model", bound=BaseModel)


def validated(model: type[Model], table: Mapping[str, Any], what: str) -> Model:
    """`table` as a `model`, or `InvalidInput` that names the entry, what came, and the nearest valid name."""
    if not isinstance(table, Mapping):
        raise InvalidInput(f"{what}: expected names with values, got {table!r}")
    try:
        return model.model_validate(dict(table))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        message = first["msg"].removeprefix("Value error, ")
        if first["type"] == "extra_forbidden":
            near = nearest(str(first["loc"][-1]), _names(model, first["loc"]))
            message = "there is no such entry" + (f"; did you mean '{near}'?" if near else "")
        came = f", got {first['input']!r}" if where and isinstance(first["input"], int | float | str) else ""
        if first["type"] == "extra_forbidden":
            came = ""
        raise InvalidInput(f"{what}{': ' + where if where else ''}: {message}{came}") from None


def _names(model: type[BaseModel], where: tuple[int | str, ...]) -> list[str]:
    """Names of the entries beside the one at `where`."""
    current: Any = model
    for part in where[:-1]:
        if isinstance(part, str):
            annotation = current.model_fields[part].annotation
            inner = [a for a in (annotation, *getattr(annotation, "__args__", ())) if isinstance(a, type)]
            current = next((a for a in inner if issubclass(a, BaseModel)), None)
            if current is None:
                return []
    return list(current.model_fields)

"""Tables of named values checked by pydantic, with errors in one sentence."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from rendulic.foundation.errors import InvalidInput, nearest

__all__ = ["Positive", "Section", "Whole", "read_toml", "validated"]

LONGEST = 2**20  # bytes of a TOML file
MOST_TOLD = 5  # errors of one file

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
        return tomllib.loads(data.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise InvalidInput(f"{path} is not a TOML file: {' '.join(str(error).split())}{hint}") from None


Model = TypeVar("Model", bound=BaseModel)


def validated(model: type[Model], table: Mapping[str, Any], what: str) -> Model:
    """`table` as a `model`, or `InvalidInput` that names each wrong entry, what came, and the nearest valid name."""
    if not isinstance(table, Mapping):
        raise InvalidInput(f"{what}: expected names with values, got {table!r}")
    try:
        return model.model_validate(dict(table))
    except ValidationError as error:
        found = error.errors()
        # a list whose entries were refused is not also too short
        inner = {one["loc"][: len(one["loc"]) - 1] for one in found}
        told = [
            _sentence(one, model, table) for one in found if not (one["type"] == "too_short" and one["loc"] in inner)
        ]
        told = list(dict.fromkeys(told))
    more = f"; and {len(told) - MOST_TOLD} more" if len(told) > MOST_TOLD else ""
    raise InvalidInput(f"{what}: {'; '.join(told[:MOST_TOLD])}{more}")


def _sentence(error: Any, model: type[BaseModel], table: Mapping[str, Any]) -> str:
    """One error of pydantic in words."""
    where, loc = _where(error["loc"], table)
    message, kind, came = error["msg"].removeprefix("Value error, "), error["type"], ""
    if kind == "extra_forbidden":
        near = nearest(str(loc[-1]), _names(model, loc, table))
        message = "there is no such entry" + (f"; did you mean '{near}'?" if near else "")
    elif kind in ("tuple_type", "list_type"):
        message = "expected a list in square brackets"
        if len(loc) == 1:
            message = f"expected tables in double brackets, [[{loc[0]}]]"
    elif kind in ("model_type", "model_attributes_type", "dict_type"):
        message = "expected names with values"
    elif kind in ("union_tag_not_found", "union_tag_invalid"):
        kinds = str(error["ctx"].get("expected_tags", "")) or ", ".join(_kinds(model, loc))
        message = f"it needs kind = one of {kinds}"
        came = f", got {error['ctx']['tag']!r}" if "tag" in error["ctx"] else ""
    if not came and kind != "extra_forbidden" and where and isinstance(error["input"], int | float | str):
        came = f", got {error['input']!r}"
    return f"{where}{': ' if where else ''}{message}{came}"


def _where(loc: tuple[int | str, ...], table: Any) -> tuple[str, list[int | str]]:
    """Where an error lies, in words and without the tags of unions: `specimen 'loose', seeds`."""
    words, kept, now = "", [], table
    for part in loc:
        if isinstance(part, str) and isinstance(now, Mapping) and part not in now and part == now.get("kind"):
            continue
        kept.append(part)
        if isinstance(part, int):
            now = now[part] if isinstance(now, list | tuple) and part < len(now) else None
            name = now.get("name") if isinstance(now, Mapping) else None
            plain = isinstance(name, str) and 0 < len(name) <= 40 and name.isprintable()
            words += f" '{name}'" if plain else f" number {part + 1}"
        else:
            now = now.get(part) if isinstance(now, Mapping) else None
            words += f"{', ' if words else ''}{part}"
    return words, kept


def _names(model: type[BaseModel], where: list[int | str], table: Any) -> list[str]:
    """Names of the entries beside the one at `where`."""
    current: list[type[BaseModel]] = [model]
    now = table
    for part in where[:-1]:
        now = now.get(part) if isinstance(part, str) else now[part]
        if isinstance(part, str):
            fields = [one.model_fields[part].annotation for one in current if part in one.model_fields]
            current = [inner for annotation in fields for inner in _models(annotation)]
    if isinstance(now, Mapping) and "kind" in now:
        of_kind = [
            one for one in current if now["kind"] in get_args(getattr(one.model_fields.get("kind"), "annotation", None))
        ]
        current = of_kind or current
    return list(dict.fromkeys(name for one in current for name in one.model_fields))


def _kinds(model: type[BaseModel], where: list[int | str]) -> list[str]:
    return [
        repr(kind)
        for inner in _models(model.model_fields[str(where[0])].annotation)
        for kind in get_args(inner.model_fields["kind"].annotation)
    ]


def _models(annotation: Any) -> list[type[BaseModel]]:
    """All models in an annotation."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [found for inner in get_args(annotation) for found in _models(inner)]

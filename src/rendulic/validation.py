"""Tables of named values checked by pydantic, with errors in one sentence."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from rendulic.errors import InvalidInput, nearest

__all__ = ["Positive", "Section", "Whole", "validated"]

# strict: text is no number, and true is not 1
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False, strict=True)]
Whole = Annotated[int, Field(strict=True)]


class Section(BaseModel):
    """A table of named values; unknown names are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


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

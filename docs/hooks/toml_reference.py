"""The reference of all TOML files, from the pydantic models that check them."""

from __future__ import annotations

from importlib import import_module
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

# every file that a user writes: title, model, and what it is for
FILES = (
    (
        "Studies",
        "rendulic.study.language.config:Study",
        "For `rendulic run`; `rendulic init study.toml` writes a commented file to begin with. See [Studies](../studies.md).",
    ),
    (
        "Element tests",
        "rendulic.study.language.element:ElementStudy",
        "For `rendulic element`; `rendulic element tests.toml --init` writes a commented file to begin with.",
    ),
    (
        "Laboratory tests",
        "rendulic.study.language.lab:LabTest",
        "For `rendulic lab`; `rendulic lab test.toml --init` writes one. See [Laboratory tests](../lab_data.md).",
    ),
    (
        "The box of a snapshot in plain text",
        "rendulic.io.plain_text:Box",
        "`box.toml`, beside `grains.csv` and `contacts.csv`: see [Files](files.md).",
    ),
)
OPENING = """# TOML files

Every key there is. Stresses are in Pa, lengths in m, strains are numbers, angles in degrees: the unit is in the name of a key.
Compression and contraction are positive. An unknown key, a missing one, or a value out of range is an error that names it.

"""
BOUNDS = {Gt: ("gt", "> {}"), Ge: ("ge", "≥ {}"), Lt: ("lt", "< {}"), Le: ("le", "≤ {}")}
PLAIN = {float: "number", int: "whole number", str: "text", bool: "true or false"}


def toml_page() -> str:
    """A table of keys for each section of each file."""
    parts = [OPENING]
    for title, place, about in FILES:
        module, _, name = place.partition(":")
        parts.append(f"## {title}\n\n{about}\n\n")
        parts += sections(getattr(import_module(module), name), "")
    return "".join(parts)


def sections(model: type[BaseModel], path: str) -> list[str]:
    """The table of a model's own keys, then those of the models in it; each model once."""
    own = {name: field for name, field in model.model_fields.items() if not _is_section(field)}
    parts = []
    if path:
        parts.append(f"### `[{path}]`\n\n{(model.__doc__ or '').strip().partition(chr(10) * 2)[0]}\n\n")
    if own:
        parts.append("| key | value | if left out | meaning |\n|---|---|---|---|\n")
        parts += [
            f"| `{name}` | {_values(field)} | {_default(field)} | {_meaning(field)} |\n" for name, field in own.items()
        ]
        parts.append("\n")
    for name, field in model.model_fields.items():
        if _is_section(field):
            inner, many = _inner(field.annotation)
            below = f"{path.strip('[]')}.{name}" if path else name
            parts += sections(inner, f"[{below}]" if many else below)
    return parts


def _inner(annotation: Any) -> tuple[type[BaseModel] | None, bool]:
    """The model in an annotation, if there is one, and whether there may be many."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation, False
    for inner in get_args(annotation):
        model, _ = _inner(inner)
        if model is not None:
            return model, get_origin(annotation) in (tuple, list)
    return None, False


def _is_section(field: FieldInfo) -> bool:
    return _inner(field.annotation)[0] is not None


def _values(field: FieldInfo) -> str:
    words = _words(field.annotation)
    limits = []
    for rule in field.metadata:
        for kind, (name, text) in BOUNDS.items():
            if isinstance(rule, kind):
                limits.append(text.format(f"{getattr(rule, name):g}"))
        if isinstance(rule, MinLen):
            limits.append(f"at least {rule.min_length}")
        if isinstance(rule, MaxLen):
            limits.append(f"at most {rule.max_length} long")
    return ", ".join([words, *limits])


def _words(annotation: Any) -> str:
    origin, inner = get_origin(annotation), get_args(annotation)
    if annotation in PLAIN:
        return PLAIN[annotation]
    if origin is Annotated:
        limits = [
            text.format(f"{getattr(rule, name):g}")
            for rule in inner[1:]
            for kind, (name, text) in BOUNDS.items()
            if isinstance(rule, kind)
        ]
        return " ".join([_words(inner[0]), *limits])
    if origin is Literal:
        return " or ".join(f'`"{one}"`' for one in inner)
    if origin in (Union, UnionType):
        return " or ".join(_words(one) for one in inner if one is not type(None))
    if origin in (tuple, list):
        many = (len(inner) == 2 and inner[1] is Ellipsis) or origin is list
        return f"list of {_words(inner[0])}" if many else f"{len(inner)} of {_words(inner[0])}"
    model, _ = _inner(annotation)
    return f"table, as `{model.__name__}`" if model else "value"


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "**must be given**"
    value = field.get_default(call_default_factory=True)
    if value is None or value is PydanticUndefined:
        return "none"
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, tuple | list):
        return f"`{[*value]}`"
    return (
        f'`"{value}"`' if isinstance(value, str) else f"`{value:g}`" if isinstance(value, int | float) else "as below"
    )


def _meaning(field: FieldInfo) -> str:
    return (field.description or "").replace("|", r"\|")

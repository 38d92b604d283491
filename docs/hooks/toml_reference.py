"""The reference of all TOML files, from the pydantic models that check them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from importlib import import_module
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from rendulic.views.catalogue import catalogue

# every file that a user writes: title, model, and what it is for
FILES = (
    (
        "Studies",
        "rendulic.study.language.study:Study",
        "For `rendulic run`; `rendulic init study.toml` writes a commented file to begin with. `rendulic element` reads the "
        "same files, and `rendulic element tests.toml --init` writes one with tests of a sand. See [Studies](../studies.md).",
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
FIRST = ("name", "kind")  # keys that stand first in every table
PLAIN = {float: "number", int: "whole number", str: "text", bool: "true or false"}


def toml_page() -> str:
    """A table of keys for each section of each file."""
    parts = [OPENING]
    for title, place, about in FILES:
        module, _, name = place.partition(":")
        parts.append(f"## {title}\n\n{about}\n\n")
        parts += sections(getattr(import_module(module), name), "", "", {})
        if title == "Studies":
            parts += figures()
    return "".join(parts)


def figures() -> list[str]:
    """The names of all figures that a study can ask for."""
    heads = "### Names of figures\n\nFor `draw` of `[figures]`.\n\n| name | shows | needs |\n|---|---|---|\n"
    rows = [f"| `{name}` | {figure.shows} | {_code(figure.lacks)} |\n" for name, figure in catalogue().items()]
    return [heads, *rows, "\n"]


def _code(text: str) -> str:
    """Words with the names of tables, and what is set in them, as code."""
    return re.sub(r"\[\[\w+\]\]|\w+ = (?:\"\w+\"|\w+)", r"`\g<0>`", text)


def sections(model: type[BaseModel], path: str, which: str, shown: dict[type[BaseModel], str]) -> list[str]:
    """The table of a model's own keys, then those of the models in it; each model once, `shown` says where."""
    own = {name: field for name, field in model.model_fields.items() if not _models(field.annotation)}
    order = sorted(own, key=lambda name: (name not in FIRST, not own[name].is_required()))
    parts = []
    if path:
        parts.append(f"### `[{path}]`{which}\n\n")
        if model in shown:
            return [*parts, f"The keys are those of `[{shown[model]}]`.\n\n"]
        shown[model] = path
        parts.append(f"{(model.__doc__ or '').strip().partition(chr(10) * 2)[0]}\n\n")
    if own:
        parts.append("| key | value | if left out | meaning |\n|---|---|---|---|\n")
        parts += [
            f"| `{name}` | {_values(own[name])} | {_default(own[name])} | {_meaning(own[name])} |\n" for name in order
        ]
        parts.append("\n")
    for name, field in model.model_fields.items():
        models = _models(field.annotation)
        below = f"{path.strip('[]')}.{name}" if path else name
        for inner in models:
            which = f" with `{_kind(inner)}`" if len(models) > 1 else ""
            parts += sections(inner, f"[{below}]" if _are_many(field.annotation) else below, which, shown)
    return parts


def _models(annotation: Any) -> list[type[BaseModel]]:
    """The models in an annotation: several where a key tells which of them a table is."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for inner in get_args(annotation) for model in _models(inner)]


def _are_many(annotation: Any) -> bool:
    """Whether there may be many tables of it."""
    return get_origin(annotation) in (tuple, list) or any(_are_many(inner) for inner in get_args(annotation))


def _kind(model: type[BaseModel]) -> str:
    """The line by which a table says that it is this model."""
    return f'kind = "{get_args(model.model_fields["kind"].annotation)[0]}"'


def _values(field: FieldInfo) -> str:
    limits = list(_limits(field.metadata))
    for rule in field.metadata:
        if isinstance(rule, MinLen):
            limits.append(f"at least {rule.min_length}")
        if isinstance(rule, MaxLen):
            limits.append(f"at most {rule.max_length} long")
    return ", ".join([_words(field.annotation), *limits])


def _limits(rules: Iterable[Any]) -> Iterator[str]:
    for rule in rules:
        if isinstance(rule, FieldInfo):
            yield from _limits(rule.metadata)
        for kind, (name, text) in BOUNDS.items():
            if isinstance(rule, kind):
                yield text.format(f"{getattr(rule, name):g}")


def _words(annotation: Any) -> str:
    origin, inner = get_origin(annotation), get_args(annotation)
    if annotation in PLAIN:
        return PLAIN[annotation]
    if origin is Annotated:
        return f"{_words(inner[0])} {' and '.join(_limits(inner[1:]))}".strip()
    if origin is Literal:
        return " or ".join(f'`"{one}"`' for one in inner)
    if origin in (Union, UnionType):
        return " or ".join(_words(one) for one in inner if one is not type(None))
    if origin in (tuple, list):
        many = (len(inner) == 2 and inner[1] is Ellipsis) or origin is list
        words = _words(inner[0]).replace("number", "numbers", 1)
        return f"list of {words}" if many else f"{len(inner)} {words}"
    if origin is dict:
        return f"names, each with a {_words(inner[1])}"
    return "value"


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "**must be given**"
    value = field.get_default(call_default_factory=True)
    if value in (None, PydanticUndefined, (), {}):
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

"""Studies as TOML files: reading, the presets that ship with the package, and a commented file to begin with."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from importlib import resources
from itertools import chain
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from rendulic.chang_hicher import Parameters
from rendulic.foundation.errors import InvalidInput, one_of
from rendulic.foundation.validation import read_toml, validated
from rendulic.study.language.config import (
    BurstSet,
    ConeSet,
    Contact,
    Figures,
    Loading,
    Packing,
    ProbeSet,
    Recipe,
    Study,
)
from rendulic.study.language.element import ElementTest, Model, check_states

__all__ = ["PRESETS", "preset", "preset_text", "read_study", "study_from", "template", "with_figures", "with_seed"]

PRESETS = ("quick", "paper")

# what the commented file begins with; all else in it are the defaults, commented out
BEGIN: tuple[tuple[str, type[BaseModel], dict[str, Any]], ...] = (
    ("[specimen]", Recipe, {"n_grains": 1000}),
    ("[contact]", Contact, {}),
    ("[loading]", Loading, {"inertial_number": 5e-5}),
    ("[[packing]]", Packing, {"name": "loose", "seeds": [1], "eta": [0.3, 0.48]}),
    ("[[packing]]", Packing, {"name": "dense", "seeds": [1], "eta": [0.6], "growth_friction": 0.0}),
    ("[[probes]]", ProbeSet, {"name": "circle", "step_deg": 20.0, "norms": [5e-5, 2e-4], "n_steps": 1000}),
    ("[[cones]]", ConeSet, {"name": "cones", "norm": 2e-4, "n_steps": 4000, "step_deg": 20.0}),
    ("[[bursts]]", BurstSet, {"name": "bursts", "cones": "cones", "n_steps": 4000, "step_deg": 60.0}),
    ("[material]", Parameters, {}),
    ("[model]", Model, {}),
    ("[[test]]", ElementTest, {"name": "undrained", "path": "undrained", "pressure_pa": 300e3, "void_ratio": 0.9}),
    ("[figures]", Figures, {"draw": ["fig3", "cones", "elements"]}),
)  # fmt: skip
HEAD = """# A study for rendulic. Run it: rendulic run THIS_FILE -o results
# What is commented out are the defaults; where it says ..., nothing is given. Stresses in Pa, lengths in m, strains as
# numbers; compression positive. [[packing]], [[probes]], [[cones]], [[bursts]] and [[test]] may be repeated or left out.
"""


def read_study(path: str | os.PathLike) -> Study:
    """Read and check a study.

    Raises
    ------
    InvalidInput
        If there is no such file, it is not TOML, or any entry is not admissible: the entry is named.
    """
    table = read_toml(path, f"no study at {path}: check the path, or write one with rendulic init")
    return study_from(table, str(path))


def study_from(table: Mapping[str, Any], what: str) -> Study:
    """A study from its table; `what` begins the message if an entry is not admissible."""
    study = validated(Study, table, what)
    try:
        check_states(study)
    except InvalidInput as error:
        raise InvalidInput(f"{what}: {error}") from None
    return study


def preset(name: str) -> Study:
    """The study that ships under this name.

    Raises
    ------
    InvalidInput
        If there is none.

    Examples
    --------
    >>> preset("paper").specimen.n_grains
    10000
    """
    return study_from(tomllib.loads(preset_text(name)), f"preset '{name}'")


def preset_text(name: str) -> str:
    """The text of its file."""
    one_of(name, PRESETS, "preset")
    return resources.files("rendulic.study").joinpath("presets", f"{name}.toml").read_text(encoding="utf-8")


def with_seed(study: Study, seed: int) -> Study:
    """Other packings of the same recipes: all seeds moved so that the first packing has this one.

    Raises
    ------
    InvalidInput
        If the study has no packings, or a seed would be negative.
    """
    if not study.packing:
        raise InvalidInput("a seed needs a study with packings")
    shift = seed - study.packing[0].seeds[0]
    table = study.model_dump(exclude_unset=True)
    for each in chain.from_iterable(table.get(name, ()) for name in ("packing", "probes", "cones")):
        if "seeds" in each or each in table["packing"]:
            each["seeds"] = [own + shift for own in each.get("seeds", Packing.model_fields["seeds"].default)]
    return study_from(table, f"seed {seed}")


def with_figures(study: Study, wanted: Iterable[str]) -> Study:
    """The study with these figures to draw.

    Raises
    ------
    InvalidInput
        If one is unknown, or the study has not what it needs.
    """
    table = study.model_dump(exclude_unset=True)
    return study_from(table | {"figures": {**table.get("figures", {}), "draw": tuple(wanted)}}, "figures asked for")


def template() -> str:
    """The text of a commented study to begin with: every entry, its default and its meaning."""
    lines = [HEAD, 'title = "A first study"', ""]
    seen: set[type] = set()
    for header, model, given in BEGIN:
        doc = (model.__doc__ or "").strip().splitlines()[0]
        lines += [f"# {doc}" if model not in seen else "", header]
        lines += list(_entries(model, given, model in seen))
        lines.append("")
        seen.add(model)
    return "\n".join(lines)


def _entries(model: type[BaseModel], given: Mapping[str, Any], only_given: bool) -> Iterator[str]:
    if model is Parameters:
        yield '# preset = "hostun_loose"  # or "fig6_base"; single values replace the preset\'s'
    for name, about in model.model_fields.items():
        what = f"  # {about.description}" if about.description and not only_given else ""
        if name in given:
            yield f"{name} = {_toml(given[name])}{what}"
        elif not only_given:
            yield f"# {name} = {_default(about)}{what}"


def _default(about: FieldInfo) -> str:
    return "..." if about.default is None or about.is_required() else _toml(about.default)


def _toml(value: Any) -> str:
    """A value as TOML has it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(_toml, value))}]"
    short = f"{value:g}"
    return short if float(short) == value else repr(value)

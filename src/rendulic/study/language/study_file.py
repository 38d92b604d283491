"""Studies as TOML files: reading, the presets that ship with the package, and a commented file to begin with."""

from __future__ import annotations

import os
import tomllib
import warnings
from collections.abc import Iterator, Mapping
from importlib import resources
from typing import Any

import tomlkit
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from rendulic.foundation.errors import ComingChange, InvalidInput, one_of
from rendulic.foundation.validation import read_toml, validated
from rendulic.study.language.old_form import had_steps, is_old_form, new_form, new_text, with_rates
from rendulic.study.language.study import Figures, Study
from rendulic.study.specimens.chang_hicher import SandSpecimen
from rendulic.study.specimens.grains import Contact, GrainsSpecimen, Loading
from rendulic.study.tasks.measurement import Selected, measurements

__all__ = ["PRESETS", "preset", "preset_text", "read_study", "study_from", "template", "with_seed"]

PRESETS = ("quick", "paper", "element_tests")

# what the commented file begins with; all else in it are the defaults, commented out
BEGIN: tuple[tuple[str, dict[str, Any]], ...] = (
    ("grains", {"name": "loose", "kind": "grains", "n_grains": 1000, "seeds": [1], "eta": [0.3, 0.48]}),
    ("chang_hicher", {
        "name": "hostun", "kind": "chang_hicher", "preset": "hostun_loose", "void_ratios": [0.9], "eta": [0.3, 0.9],
    }),
    ("probes", {"name": "circle", "step_deg": 20.0, "norms": [5e-5, 2e-4]}),
    ("cones", {"name": "cones", "norm": 2e-4, "step_deg": 20.0}),
    ("bursts", {"name": "bursts", "cones": "cones", "step_deg": 60.0}),
    ("path", {"name": "undrained", "specimens": ["hostun"], "path": "undrained"}),
)  # fmt: skip
DRAWN = {"draw": ["fig3", "cones", "elements"]}
SPECIMENS: dict[str, type[BaseModel]] = {"grains": GrainsSpecimen, "chang_hicher": SandSpecimen}
HEAD = """# A study for rendulic. Run it: rendulic run THIS_FILE -o results
# Lines that begin with # and have a value show the default; ... means that nothing is given. Stresses in Pa, lengths in m,
# strains as numbers; compression positive. Every table in double brackets may be repeated or left out.

title = "A first study"
"""
SAME = "name", *Selected.model_fields  # explained once


def read_study(path: str | os.PathLike) -> Study:
    """Read and check a study.

    Raises
    ------
    InvalidInput
        If there is no such file, it is not TOML, or any entry is not admissible: the entry is named.

    Warns
    -----
    ComingChange
        If it is written as for rendulic 0.1; the warning shows it in today's words.
    """
    table = read_toml(path, f"no study at {path}: check the path, or write one with rendulic init")
    return study_from(table, str(path))


def study_from(table: Mapping[str, Any], what: str) -> Study:
    """A study from its table; `what` begins the message if an entry is not admissible."""
    is_old = is_old_form(table)
    if is_old or had_steps(table):
        table = with_rates(new_form(table, what) if is_old else table)
        study = _checked(table, what)
        warnings.warn(
            f"{what} is written as for {'rendulic 0.1' if is_old else 'an earlier version, with n_steps where there is a rate now'}, "
            f"which the next version will not read; write it so:\n\n{new_text(table)}",
            ComingChange,
            stacklevel=3,
        )
        return study
    return _checked(table, what)


def _checked(table: Mapping[str, Any], what: str) -> Study:
    try:
        return validated(Study, table, what)
    except InvalidInput as error:
        text = str(error)
        raise (error if text.startswith(what) else InvalidInput(f"{what}: {text}")) from None


def preset(name: str) -> Study:
    """The study that ships under this name.

    Raises
    ------
    InvalidInput
        If there is none.

    Examples
    --------
    >>> preset("paper").specimen[0].n_grains
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
    first = next((each.seeds[0] for each in study.specimen if each.kind == "grains"), None)
    if first is None:
        raise InvalidInput('a seed needs a study with packings: [[specimen]] of kind "grains"')
    table = study.model_dump(exclude_unset=True)
    for each in table["specimen"]:
        if each["kind"] == "grains":
            each["seeds"] = [
                own + seed - first for own in each.get("seeds", GrainsSpecimen.model_fields["seeds"].default)
            ]
    for name in measurements():
        for each in table.get(name, ()):
            if "seeds" in each:
                each["seeds"] = [own + seed - first for own in each["seeds"]]
    return study_from(table, f"seed {seed}")


def template() -> str:
    """The text of a commented study to begin with: every entry, its default and its meaning."""
    parts = [HEAD]
    for name, given in BEGIN:
        model = SPECIMENS.get(name) or measurements()[name]
        parts.append(_section(f"[[{'specimen' if name in SPECIMENS else name}]]", model, given))
        if name == "grains":
            parts += [_section("[specimen.contact]", Contact, {}), _section("[specimen.loading]", Loading, {})]
    parts.append(_section("[figures]", Figures, DRAWN))
    return "\n".join(parts)


def _section(header: str, model: type[BaseModel], given: Mapping[str, Any]) -> str:
    doc = (model.__doc__ or "").strip().splitlines()[0]
    return "\n".join([f"# {doc}", header, *_entries(model, given), ""])


def _entries(model: type[BaseModel], given: Mapping[str, Any]) -> Iterator[str]:
    for name, value in given.items():
        yield f"{name} = {_toml(value)}{_meaning(model.model_fields[name])}"
    for name, about in model.model_fields.items():
        if name not in given and not (name in SAME and "cones" in model.model_fields):
            if isinstance(about.default, BaseModel):
                continue
            yield f"# {name} = {_default(about)}{_meaning(about)}"


def _meaning(about: FieldInfo) -> str:
    return f"  # {about.description}" if about.description else ""


def _default(about: FieldInfo) -> str:
    return "..." if about.default is None or about.is_required() or about.default == () else _toml(about.default)


def _toml(value: Any) -> str:
    """A value as TOML has it."""
    return tomlkit.item(list(value) if isinstance(value, tuple) else value).as_string()

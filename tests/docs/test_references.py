"""The pages that the site makes of the code name everything that there is."""

from __future__ import annotations

import sys
from importlib import import_module

import pytest
from pages import ROOT
from pydantic import BaseModel

from rendulic.views.catalogue import catalogue

sys.path.insert(0, str(ROOT / "docs" / "hooks"))

from command_line import command_line_page
from toml_reference import FILES, toml_page


def models_in(model):
    """A model and all that its fields are made of."""
    yield model
    for field in model.model_fields.values():
        waiting = [field.annotation]
        while waiting:
            one = waiting.pop()
            if isinstance(one, type) and issubclass(one, BaseModel):
                yield from models_in(one)
            else:
                waiting.extend(getattr(one, "__args__", ()))


@pytest.mark.parametrize(("title", "place"), [(title, place) for title, place, _ in FILES])
def test_every_key_is_in_the_reference(title, place):
    """Each key of each section of a TOML file stands in its part of the page."""
    part = toml_page().split(f"## {title}\n")[1].split("\n## ")[0]
    module, _, name = place.partition(":")
    keys = {key for model in models_in(getattr(import_module(module), name)) for key in model.model_fields}
    assert keys
    assert {key for key in keys if f"`{key}`" not in part and f"{key}]" not in part} == set()


def test_every_figure_is_in_the_reference():
    """Each name that `[figures] draw` takes."""
    part = toml_page().split("### Names of figures\n")[1].split("\n## ")[0]
    assert catalogue()
    assert [name for name in catalogue() if f"| `{name}` |" not in part] == []


def test_every_command_is_in_the_reference():
    """Commands, options and examples, as the program has them."""
    from typer.main import get_command

    from rendulic.cli.main import app

    page = command_line_page()
    for name, command in get_command(app).commands.items():
        part = page.split(f"## `rendulic {name}`\n")[1].split("\n## ")[0]
        assert f"```bash\nrendulic {name}" in part
        for parameter in command.params:
            if parameter.opts[0].startswith("--"):
                assert parameter.opts[0] in part

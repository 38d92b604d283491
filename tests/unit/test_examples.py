"""The examples run, and stay short."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.py"))
# fewer grains and sets than for the pictures
SMALLER = {
    "first_probe": {"n_grains": 80},
    "held_load": {"n_grains": 100},
    "many_parameters": {"n_sets": 50},
    "own_contact_law": {"n_grains": 60},
    "size_of_probes": {"n_grains": 80},
    "two_states": {"n_grains": 100},
}
LONG = {"own_contact_law"}  # a user's law is compiled in every process: a minute


def parameters():
    for path in EXAMPLES:
        yield pytest.param(path, id=path.stem, marks=pytest.mark.long if path.stem in LONG else ())


@pytest.mark.parametrize("path", list(parameters()))
def test_example(path, tmp_path, capsys):
    """Each example's `main` makes its picture and says something; with few grains, where there are grains."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    example.main(str(tmp_path), **SMALLER.get(path.stem, {}))
    assert (tmp_path / f"{path.stem}.png").stat().st_size > 10_000
    assert f"{path.stem}.png" in capsys.readouterr().out


def test_examples_are_many_and_short():
    """Eight at least, each under 80 lines, with a first line that can be its title."""
    assert len(EXAMPLES) >= 8
    for path in EXAMPLES:
        lines = path.read_text(encoding="utf-8").splitlines()
        assert len(lines) < 80, path
        assert lines[0].startswith('"""'), path
        assert len(lines[0]) <= 100, path

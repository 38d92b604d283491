"""The examples run."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


SMALLER = {"first_probe": {"n_grains": 80}}


@pytest.mark.parametrize("name", [path.stem for path in sorted(EXAMPLES.glob("*.py"))])
def test_example(name, tmp_path, capsys):
    """Each example's `main` makes its picture; with few grains, where there are grains."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    example.main(str(tmp_path), **SMALLER.get(name, {}))
    assert (tmp_path / f"{name}.png").stat().st_size > 10_000
    assert "smallest W2n" in capsys.readouterr().out

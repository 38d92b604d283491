"""The shape of the package: its imports, and what no file may do."""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

import rendulic

SOURCE = Path(rendulic.__file__).parent
FILES = sorted(SOURCE.rglob("*.py"))
ROOT = Path(__file__).parents[2]


def imports(path: Path):
    """All modules that a file imports anywhere, also while types are checked, in absolute form."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} imports relatively"
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def name_of(path: Path) -> str:
    return str(path.relative_to(SOURCE))


def contracts_of(folder: Path) -> subprocess.CompletedProcess[str]:
    """What import-linter says of the package in a folder with a `pyproject.toml` and `src/`."""
    code = "from importlinter.cli import lint_imports_command; lint_imports_command()"
    return subprocess.run(
        [sys.executable, "-c", code, "--no-cache"], cwd=folder, env=os.environ | {"PYTHONPATH": str(folder / "src")},
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip


def test_imports_keep_to_the_contracts():
    """Levels, circles and who may use which library: `[tool.importlinter]` in pyproject.toml, `make imports`."""
    done = contracts_of(ROOT)
    assert done.returncode == 0, done.stdout
    assert " 0 broken" in done.stdout


WRONG = {
    "Imports run downward": ("micro/stress.py", "def lazy():\n    from rendulic.probing import probe\n"),
    "No circles, in any folder": (
        "tensors/mandel.py", "if TYPE_CHECKING:\n    from rendulic.tensors.rendulic_plane import increment_along\n"
    ),
    "Probing knows specimens": ("probing/edges.py", "import rendulic.dem.assembly\n"),
    "Figures draw with matplotlib": ("probing/cone.py", "import matplotlib.pyplot\n"),
}  # fmt: skip


def test_wrong_imports_are_noticed(tmp_path):
    """The contracts themselves: imports that are upward and lazy, of a circle for types only, or of a library elsewhere."""
    shutil.copytree(SOURCE, tmp_path / "src" / "rendulic", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    for name, text in WRONG.values():
        with (tmp_path / "src" / "rendulic" / name).open("a", encoding="utf-8") as file:
            file.write("\n\n" + text)
    (circle := tmp_path / "src" / "rendulic" / "tensors" / "rendulic_plane.py").write_text(
        circle.read_text(encoding="utf-8") + "\nimport rendulic.tensors.mandel\n", encoding="utf-8"
    )
    done = contracts_of(tmp_path)
    assert done.returncode == 1
    broken = [line for line in done.stdout.splitlines() if " BROKEN" in line]
    for contract in WRONG:
        assert any(line.startswith(contract) for line in broken), contract


def declared(*extras: str) -> set[str]:
    """Names of the distributions that pyproject.toml declares, without the project's own, in normal form."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    asked = [*project["dependencies"], *(each for extra in extras for each in project["optional-dependencies"][extra])]
    return {normal(re.match(r"[\w.-]+", each).group()) for each in asked}


def normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def test_every_import_is_declared():
    """Nothing is there by luck, as a dependency of a dependency; and nothing is declared that is not used."""
    of_name = packages_distributions()
    # this file runs inside Yade
    files = [path for path in FILES if path != SOURCE / "io" / "yade_exporter.py"]
    used = {module.split(".")[0] for path in files for module in imports(path)}
    foreign = used - sys.stdlib_module_names - {"rendulic"}
    found = {normal(distribution) for name in foreign for distribution in of_name.get(name, [name])}
    assert found == declared("cluster") - {"h5netcdf"}  # which xarray asks for by name


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_no_file_does_what_a_library_must_not(path):
    """No print, no pickle, no eval or exec, and not more than 500 lines."""
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 500
    called = {
        node.func.id
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    }
    assert called & {"print", "eval", "exec", "__import__", "input"} == set()
    assert {module.split(".")[0] for module in imports(path)} & {
        "pickle",
        "marshal",
        "shelve",
        "dill",
        "joblib",
    } == set()


def test_numpy_files_never_unpickle():
    """Every `np.load` says `allow_pickle=False`."""
    loads = [
        (path, node)
        for path in FILES
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and ast.unparse(node.func) in {"np.load", "numpy.load"}
    ]
    assert loads
    for path, node in loads:
        words = {word.arg: ast.unparse(word.value) for word in node.keywords}
        assert words.get("allow_pickle") == "False", path


def loaded_after(code: str) -> set[str]:
    """Top-level names of the modules that are loaded after `code` ran in a fresh interpreter."""
    tail = "\nimport sys; sys.stdout.write(' '.join({name.split('.')[0] for name in sys.modules}))"
    done = subprocess.run([sys.executable, "-c", code + tail], capture_output=True, text=True, check=True, timeout=120)
    return set(done.stdout.split())


def test_importing_is_light():
    """`import rendulic` loads neither compiler nor tables nor drawing; asking for a part does."""
    heavy = {"numba", "xarray", "matplotlib", "h5py", "pydantic", "typer", "pandas", "plotly", "jinja2"}
    assert loaded_after("import rendulic") & heavy == set()
    assert "numba" in loaded_after("import rendulic\nrendulic.dem")


def test_computing_needs_no_drawing():
    """Packing, probing and saving never load matplotlib, typer or pydantic."""
    code = "import rendulic as rd\nrd.dem, rd.probe, rd.State, rd.io, rd.micro, rd.second_order_work, rd.directions, rd.paths"
    assert loaded_after(code) & {"matplotlib", "typer", "pydantic", "rich"} == set()


def test_public_names_exist():
    """Every name in `rd.__all__` is there, and an unknown one lists them."""
    for name in rendulic.__all__:
        assert getattr(rendulic, name) is not None
    assert set(dir(rendulic)) == set(rendulic.__all__)
    with pytest.raises(AttributeError, match=r"public names: ChangHicher, .*, chang_hicher"):
        rendulic.nonsense  # noqa: B018


def test_files_of_others_name_version_and_licence():
    """Minified scripts and styles begin with what they are, and their licence lies beside them."""
    found = []
    for path in sorted((ROOT / "docs" / "assets").rglob("*")):
        if path.suffix not in (".js", ".css"):
            continue
        first, *rest = path.read_text(encoding="utf-8").splitlines()
        if max(map(len, [first, *rest])) < 1000:  # our own
            continue
        said = re.fullmatch(r"/\*! [\w-]+ \d+\.\d+\.\d+, \S+ \| [\w.-]+, (\S+) \| https://\S+ \*/", first)
        assert said, path
        assert "copyright" in (path.parent / said[1]).read_text(encoding="utf-8").lower()
        found.append(path.name)
    assert found == ["iframe-worker.js", "katex.min.css", "katex.min.js"]

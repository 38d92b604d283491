"""The shape of the package: who may import whom and what, and what no file may do."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import rendulic

SOURCE = Path(rendulic.__file__).parent
FILES = sorted(SOURCE.rglob("*.py"))
# level of each part; a part may import parts of a lower level, and itself
LEVELS = {
    "foundation": 0, "tensors": 0, "loading": 0, "specimen": 0,
    "dem": 1, "chang_hicher": 1, "micro": 1,
    "probing": 2,
    "io": 3, "study": 3,
    "figures": 4, "report": 4, "cli": 5,
}  # fmt: skip
# the one exception: a study draws its figures, and reads and writes tables
SIDEWAYS = {("study", "figures"), ("study", "io")}
NEVER = {
    ("probing", "dem"),
    ("micro", "dem"),
    ("dem", "micro"),
    ("probing", "chang_hicher"),
    ("figures", "cli"),
    ("figures", "dem"),
}
ONLY_IN = {
    "matplotlib": {"figures"},
    "plotly": {"report"},
    "jinja2": {"report"},
    "typer": {"cli"},
    "rich": {"cli"},
    "pydantic": {"foundation/validation.py", "study", "io/plain_text.py", "chang_hicher/law/parameters.py"},
    "h5py": {"foundation/hdf5.py", "specimen/state.py", "io", "study/store/unit_file.py"},
    "numba": {"foundation/compiling.py", "dem/kernels"},
    "distributed": {"study/execution/cluster.py"},
    "scipy": {"tensors/sphere_rules.py", "micro/clustering.py", "io/lammps/history.py"},
}


def part_of(path: Path) -> str:
    """Top-level part of the package that a file belongs to; the package's own file has no level."""
    return path.relative_to(SOURCE).parts[0].removesuffix(".py")


def running_nodes(tree: ast.Module):
    """All nodes but those that only type checkers see."""
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        yield node
        only_types = isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        waiting.extend(node.orelse if only_types else ast.iter_child_nodes(node))


def imports(path: Path):
    """All modules that a file imports anywhere when run, in absolute form."""
    for node in running_nodes(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} imports relatively"
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def name_of(path: Path) -> str:
    return str(path.relative_to(SOURCE))


def upward(path: Path):
    """Imports of a file that go up or aside."""
    own = part_of(path)
    for module in imports(path):
        parts = module.split(".")
        if parts[0] != "rendulic" or len(parts) < 2 or parts[1] not in LEVELS or parts[1] == own:
            continue
        pair, step = (own, parts[1]), LEVELS[own] - LEVELS[parts[1]]
        within_base = LEVELS[own] == LEVELS[parts[1]] == 0
        if pair in NEVER or not (step > 0 or within_base or pair in SIDEWAYS):
            yield module


def test_an_upward_import_is_noticed(tmp_path, monkeypatch):
    """The check itself: imports of a made-up file are told upward, aside and lazily."""
    wrong = tmp_path / "micro" / "wrong.py"
    wrong.parent.mkdir()
    wrong.write_text(
        "import rendulic.cli.main\nfrom rendulic import probing\nfrom rendulic.foundation.errors import InvalidInput\n"
        "def lazy():\n    from rendulic.dem.assembly import Assembly\n"
    )
    monkeypatch.setattr(sys.modules[__name__], "SOURCE", tmp_path)
    assert {module.split(".")[1] for module in upward(wrong)} == {"cli", "probing", "dem"}


def test_every_part_has_a_level():
    """A new part of the package must be given its place here."""
    parts = {part_of(path) for path in FILES} - {"__init__"}
    assert parts <= set(LEVELS)


@pytest.mark.parametrize("path", [p for p in FILES if part_of(p) != "__init__"], ids=name_of)
def test_imports_run_downward(path):
    """No file imports from its own level's neighbours or from above, also not lazily."""
    assert list(upward(path)) == []


@pytest.mark.parametrize("library", ONLY_IN)
def test_libraries_stay_where_they_belong(library):
    """Drawing, command line, validation, files and compiler each have one place, and are used there."""
    users = {
        path.relative_to(SOURCE).as_posix() for path in FILES if library in {m.split(".")[0] for m in imports(path)}
    }
    allowed = ONLY_IN[library]
    assert users
    assert {user for user in users if not any(user == a or user.startswith(f"{a}/") for a in allowed)} == set()


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
    with pytest.raises(AttributeError, match="public names: chang_hicher"):
        rendulic.nonsense  # noqa: B018

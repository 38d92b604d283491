"""What comes from files is shown and not obeyed; closed pipes, few handles and little memory end in no traceback."""

from __future__ import annotations

import errno
import os
import pty
import subprocess
import sys

import pytest

import rendulic as rd
from rendulic.cli import terminal
from rendulic.cli.limits import wanting
from rendulic.foundation.errors import CorruptFile, InvalidInput
from rendulic.foundation.hdf5 import readable
from rendulic.foundation.whole_file import whole_file
from rendulic.study.execution.campaign import run_study
from rendulic.study.language.study_file import read_study
from rendulic.study.store.store import Store

COMMAND = [sys.executable, "-c", "from rendulic.cli.main import run; run()"]
STUDY = """
[figures]
tables = false
[[specimen]]
name = "sand"
kind = "chang_hicher"
pressure_pa = 1e5
void_ratios = [0.9]
[[path]]
name = "{name}"
specimens = ["sand"]
path = "undrained"
axial_strain = 0.01
"""
HOSTILE = "boom \x1b]0;title\x07 \x1b[31m[red]x[/red] \u202eback[/foo]"
ESCAPED = r"boom \x1b]0;title\x07 \x1b[31m[red]x[/red] \u202eback[/foo]"


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(STUDY.format(name="test"))
    return path


def run(*arguments, cwd, before="", **options):
    """The command, perhaps after something that a shell does first; without colours."""
    asked = [*COMMAND, *map(str, arguments)]
    if before:
        asked = ["bash", "-c", f'{before}; "$@"', "bash", *asked]
    return subprocess.run(asked, cwd=cwd, capture_output=True, text=True, timeout=120, **options)


def on_a_terminal(*arguments, cwd):
    """All that a terminal gets to see."""
    master, slave = pty.openpty()
    process = subprocess.Popen([*COMMAND, *map(str, arguments)], cwd=cwd, stdout=slave, stderr=slave, stdin=slave)
    os.close(slave)
    said = b""
    while True:
        try:
            piece = os.read(master, 65536)
        except OSError:
            break
        if not piece:
            break
        said += piece
    os.close(master)
    process.wait()
    return said.decode()


def test_notes_of_failures_are_escaped(study, tmp_path):
    """A note with escape sequences, a title for the window and text turned around."""
    folder = tmp_path / "out"
    done = run_study(read_study(study), folder)
    unit = next(unit for unit in done.results.plan.units.values() if unit.kind != "sand")
    Store(folder).remove(unit.key)
    Store(folder).note_failure(unit.key, "label", HOSTILE, True)
    for said in (
        run("info", folder, cwd=tmp_path).stdout,
        run("run", study, "-o", folder, "-q", cwd=tmp_path).stderr,
        on_a_terminal("info", folder, cwd=tmp_path),
        on_a_terminal("run", study, "-o", folder, cwd=tmp_path),
    ):
        assert ESCAPED in " ".join(said.split())
        assert "\x1b]0;" not in said
        assert "\u202e" not in said


def test_bars_and_tables_show_text_as_it_is(capsys):
    """Brackets are no markup, in no column, cell or title."""
    from rich.progress import Progress
    from rich.table import Table

    own = terminal.console()
    table = Table(title=HOSTILE)
    table.add_column(HOSTILE, no_wrap=True)
    table.add_row(HOSTILE)
    own.width = 200
    own.print(table)
    own.print(HOSTILE)
    bars = Progress(terminal.Words("{task.description}"), terminal.Words("{task.fields[note]}", "dim"), console=own)
    bars.add_task(HOSTILE, note=HOSTILE)
    (task,) = bars.tasks
    assert [column.render(task).plain for column in bars.columns] == [ESCAPED] * 2
    said = capsys.readouterr().out
    assert said.count(ESCAPED) == 4
    assert "\x1b]" not in said


@pytest.mark.parametrize("name", ["[red]x[/red].h5", "[", "[/foo].h5", "a\x1b[31mred.h5", "\udc80.h5"])
def test_names_of_files_are_no_markup(snapshot, tmp_path, name):
    rd.io.write_snapshot(snapshot, tmp_path / name)
    done = run("analyze", name, name, cwd=tmp_path, env=os.environ | {"COLUMNS": "300"})
    assert done.returncode == 0, done.stderr
    assert terminal.shown(f"{name} to {name}") in done.stdout
    none = run("analyze", f"no{name}", name, cwd=tmp_path)
    assert none.returncode == 2
    assert terminal.shown(f"no snapshot at no{name}") in none.stderr
    assert "Traceback" not in none.stderr


@pytest.fixture(scope="module")
def snapshot(sheared_state):
    return rd.dem.Assembly.from_state(sheared_state).snapshot()


def test_a_closed_pipe_ends_the_output_and_not_the_work(study, tmp_path):
    """`info DIR | true` ends well, and `run ... | true` does all of it."""
    for arguments in (("run", study, "-o", tmp_path / "out"), ("info", tmp_path / "out")):
        reading, writing = os.pipe()
        os.close(reading)
        done = subprocess.run([*COMMAND, *map(str, arguments)], stdout=writing, stderr=writing, timeout=120)
        os.close(writing)
        assert done.returncode == 0
    assert len(Store(tmp_path / "out").keys()) == 2


@pytest.mark.skipif(sys.platform == "win32", reason="limits of a shell")
@pytest.mark.parametrize(
    ("limit", "words"),
    [("ulimit -n 9", "too few files may be open at once (ulimit -n is 9)"),
     ("ulimit -v 300000", "there is too little memory (ulimit -v is 300000 kB)")],
)  # fmt: skip
def test_what_the_system_does_not_allow_is_a_sentence(study, tmp_path, limit, words):
    done = run("run", study, "-o", "out", "-q", "--workers", "3", cwd=tmp_path, before=limit)
    assert done.returncode == 2
    assert done.stderr.startswith(f"rendulic: {words}")
    assert done.stderr.count("\n") == 1


def test_only_what_is_wanting_is_told_so():
    assert wanting(ValueError("unable to be")) is None
    assert wanting(OSError(errno.ENOENT, "No such file")) is None
    of_a_library = RuntimeError("of a library")
    of_a_library.__context__ = OSError(errno.EMFILE, "Too many open files")
    assert "too few files" in wanting(of_a_library)
    # and a file is not called damaged for it
    with pytest.raises(OSError, match="Too many"), readable("a.h5", "file"):
        raise OSError(errno.EMFILE, "Too many open files")
    with pytest.raises(CorruptFile), readable("a.h5", "file"):
        raise OSError("no HDF5")


@pytest.mark.parametrize("name", ["CON", "nul", "Com1", "LPT9"])
def test_names_of_devices_are_refused(study, tmp_path, name):
    study.write_text(STUDY.format(name=name))
    with pytest.raises(InvalidInput, match=f"{name} is the name of a device on Windows"):
        read_study(study)
    for place in (tmp_path / f"{name}.h5", tmp_path / name / "state.h5"):
        with pytest.raises(InvalidInput, match="is the name of a device on Windows"), whole_file(place):
            pass
    study.write_text(STUDY.format(name=f"{name}x"))
    read_study(study)


def test_nested_json_of_a_folder_is_a_sentence(study, tmp_path):
    """In a note, in the record of the study and of products."""
    folder = tmp_path / "out"
    run_study(read_study(study), folder)
    (folder / "failed").mkdir(exist_ok=True)
    for name in ("failed/0123.json", "products.json", "running.json"):
        (folder / name).write_text("[" * 100_000)
    done = run("info", folder, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    (folder / "study.json").write_text("[" * 100_000)
    done = run("report", folder, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("rendulic: ")
    assert done.stderr.count("\n") == 1
    assert run("run", study, "-o", folder, "-q", cwd=tmp_path).returncode == 0

"""Laboratory tests: names, units and signs of a CSV file, `rendulic lab`, and what is refused."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import rendulic as rd
from rendulic.foundation.errors import InvalidInput, RendulicError
from rendulic.study.language.lab import example, run_lab_test
from rendulic.study.language.study_file import read_study

COLUMNS = {"eps_1": "Axial strain", "q": "q", "pore_pressure": "u"}
UNITS = {"eps_1": "%", "q": "kPa", "pore_pressure": "kPa", "cell_pressure": "kPa"}
EPS_1 = np.linspace(0.0, 8.0, 41)  # %
Q = 200.0 * (1.0 - (EPS_1 / 4.0 - 1.0) ** 2)  # kPa, with its peak at 4 %
U = 100.0 + 10.0 * EPS_1
DRAINED = {"eps_1": "Axial strain", "q": "q", "p": "p", "eps_v": "eps_v"}
DRAINED_UNITS = {"eps_1": "%", "q": "kPa", "p": "kPa", "eps_v": "%"}
EPS_V = 0.3 * EPS_1 - 0.05 * EPS_1**2  # %, contraction, then dilation


def table(*columns, headings=("Axial strain", "q", "u"), delimiter=","):
    rows = [delimiter.join(f"{value:.12g}" for value in row) for row in zip(*columns, strict=True)]
    return "\n".join([delimiter.join(headings), *rows]) + "\n"


UNDRAINED_TEXT = table(EPS_1, Q, U)
DRAINED_TEXT = table(EPS_1, Q, 200.0 + Q / 3.0, EPS_V, headings=("Axial strain", "q", "p", "eps_v"))


def read_undrained(path, text=UNDRAINED_TEXT, **changes):
    path.write_text(text, encoding="utf-8")
    options = {"drainage": "undrained", "constants": {"cell_pressure": 400.0}} | changes
    return rd.io.read_triaxial(path, options.pop("columns", COLUMNS), options.pop("units", UNITS), **options)


def read_drained(path, text=DRAINED_TEXT, **changes):
    path.write_text(text, encoding="utf-8")
    options = {"drainage": "drained"} | changes
    return rd.io.read_triaxial(path, options.pop("columns", DRAINED), options.pop("units", DRAINED_UNITS), **options)


# --- what is read -----------------------------------------------------------------------------------------


def test_undrained(tmp_path):
    """Effective stresses in Pa, logarithmic strains, constant volume; what stood in the file is told."""
    found = read_undrained(tmp_path / "test.csv")
    assert_allclose(found.eps_1, -np.log(1.0 - EPS_1 / 100.0), rtol=1e-10)
    assert_allclose(found.eps_3, -found.eps_1 / 2, rtol=1e-12)
    assert_allclose(found.eps_v, 0.0, atol=1e-15)
    assert_allclose(found.sigma_3, 1e3 * (400.0 - U), rtol=1e-10)
    assert_allclose(found.sigma_1 - found.sigma_3, 1e3 * Q, atol=1e-4)
    assert_allclose(found.p, 1e3 * (400.0 - U + Q / 3.0), rtol=1e-10)
    assert found.q.units == "Pa"
    assert found.attrs["source"] == "test.csv"
    assert found.attrs["path"] == "undrained triaxial compression"


def test_drained(tmp_path):
    """The lateral strain follows from the change of volume, engineering strains each made logarithmic."""
    found = read_drained(tmp_path / "test.csv")
    assert_allclose(found.sigma_3, 200e3, rtol=1e-9)
    assert_allclose(found.eps_v, -np.log(1.0 - EPS_V / 100.0), atol=1e-12)
    assert_allclose(found.eps_1 + 2 * found.eps_3, found.eps_v, atol=1e-15)


@pytest.mark.parametrize(
    ("units", "factors"),
    [
        ({"eps_1": "1", "q": "MPa", "pore_pressure": "bar", "cell_pressure": "Pa"}, (1e-2, 1e-3, 1e-2, 1e3)),
        ({"eps_1": "%", "q": "bar", "pore_pressure": "Pa", "cell_pressure": "MPa"}, (1.0, 1e-2, 1e3, 1e-3)),
    ],
)
def test_units(units, factors, tmp_path):
    """The same test in other units is the same test."""
    expected = read_undrained(tmp_path / "one.csv")
    text = table(*(factor * column for factor, column in zip(factors[:3], (EPS_1, Q, U), strict=True)))
    found = read_undrained(tmp_path / "other.csv", text, units=units, constants={"cell_pressure": 400.0 * factors[3]})
    for name in expected:
        assert_allclose(found[name], expected[name], rtol=1e-9, atol=1e-6 if expected[name].units == "Pa" else 1e-15)


def test_two_ways_to_the_mean_stress(tmp_path):
    """p itself, or cell and pore pressure, both columns."""
    expected = read_undrained(tmp_path / "one.csv")
    with_p = read_undrained(
        tmp_path / "p.csv", table(EPS_1, Q, 400.0 - U + Q / 3.0, headings=("Axial strain", "q", "p")),
        columns={"eps_1": "Axial strain", "q": "q", "p": "p"}, units={"eps_1": "%", "q": "kPa", "p": "kPa"}, constants=None,
    )  # fmt: skip
    with_cell = read_undrained(
        tmp_path / "cell.csv", table(EPS_1, Q, U, 400.0 + 0 * U, headings=("Axial strain", "q", "u", "cell")),
        columns=COLUMNS | {"cell_pressure": "cell"}, constants=None,
    )  # fmt: skip
    for found in (with_p, with_cell):
        assert_allclose(found.sigma_3, expected.sigma_3, rtol=1e-9)
        assert_allclose(found.sigma_1, expected.sigma_1, rtol=1e-9)


def test_signs(tmp_path):
    """Dilation positive in the file turns eps_v; extension lets the axial strain fall and q be negative."""
    turned = table(EPS_1, Q, 200.0 + Q / 3.0, -EPS_V, headings=("Axial strain", "q", "p", "eps_v"))
    found, expected = read_drained(tmp_path / "a.csv", turned, dilation_positive=True), read_drained(tmp_path / "b.csv")
    assert_allclose(found.eps_v, expected.eps_v, atol=1e-14)
    extended = read_undrained(tmp_path / "c.csv", table(-EPS_1, -Q / 4, U), extension=True)
    assert float(extended.eps_1[-1]) == pytest.approx(-np.log(1.08))
    assert float(extended.q.min()) == pytest.approx(-50e3)


def test_other_ways_of_writing(tmp_path):
    """Semicolons and decimal commas, a title above, a line of units and columns that nobody asked for, latin-1."""
    lines = UNDRAINED_TEXT.replace(",", ";").replace(".", ",").splitlines()
    lines = [
        "Versuch 7, geprüft",
        lines[0].replace("u", "Überdruck") + ";note",
        "%;kPa;kPa;",
        *(f"{line};x" for line in lines[1:]),
    ]
    path = tmp_path / "test.csv"
    path.write_text("\r\n".join(lines) + "\r\n\r\n", encoding="latin-1")
    found = rd.io.read_triaxial(
        path, COLUMNS | {"pore_pressure": "Überdruck"}, UNITS, drainage="undrained", constants={"cell_pressure": 400.0},
        delimiter=";", decimal=",", heading_line=2, first_line=4, encoding="latin-1",
    )  # fmt: skip
    assert_array_equal(found.q, read_undrained(tmp_path / "plain.csv").q)


def test_logarithmic_strains_stay(tmp_path):
    found = read_undrained(tmp_path / "test.csv", strain="logarithmic")
    assert_allclose(found.eps_1, EPS_1 / 100.0, rtol=1e-12)


# --- what is refused --------------------------------------------------------------------------------------


def spoilt(line, column, entry, text=UNDRAINED_TEXT):
    lines = [row.split(",") for row in text.splitlines()]
    lines[line - 1][column] = entry
    return "\n".join(",".join(row) for row in lines)


REFUSED = [
    ({"text": UNDRAINED_TEXT.replace("\n4", "\nx4")}, "line 22, column 'Axial strain': expected a finite number, got 'x4'; 5 of 41 rows"),
    ({"text": spoilt(7, 0, "0.1")}, "line 7, column 'Axial strain': axial strain must rise"),
    ({"text": table(-EPS_1, Q, U)}, "extension=True is for extension"),
    ({"text": "\n".join(UNDRAINED_TEXT.splitlines()[:2])}, "has 1 readings; a test has at least 2"),
    ({"text": ""}, "has no headings in line 1"),
    ({"text": UNDRAINED_TEXT.replace("q,", "q,q,", 1)}, "more than one column 'q' for q"),
    ({"text": UNDRAINED_TEXT.replace(",", ";")}, "has no column 'Axial strain' for eps_1"),
    ({"text": UNDRAINED_TEXT.replace(".", ",")}, "entries under 3 headings: with decimal commas"),
    ({"columns": COLUMNS | {"q": "Q"}}, "has no column 'Q' for q; did you mean 'q'"),
    ({"columns": COLUMNS | {"sigma": "q"}}, "unknown quantity of a triaxial test 'sigma'"),
    ({"columns": {"eps_1": "Axial strain", "pore_pressure": "u"}}, "an undrained test needs a column for q"),
    ({"columns": COLUMNS | {"eps_v": "q"}}, "an undrained test has no volumetric strain"),
    ({"columns": COLUMNS | {"p": "u"}}, "needs either p, or cell_pressure and pore_pressure"),
    ({"constants": None}, "got pore_pressure"),
    ({"constants": {"cell_pressure": np.nan}}, "cell_pressure must be finite"),
    ({"constants": {"cell_pressure": 400.0, "q": 1.0}}, "q is given as a column and as a constant"),
    ({"drainage": "drained"}, "a drained test needs a column for eps_v"),
    ({"drainage": "half"}, "unknown drainage 'half'"),
    ({"units": UNITS | {"q": "psi"}}, "unknown unit of q 'psi': valid ones are Pa, kPa, MPa, bar"),
    ({"units": UNITS | {"eps_1": "kPa"}}, "unknown unit of eps_1 'kPa': valid ones are 1, %"),
    ({"units": {"eps_1": "%", "q": "kPa", "pore_pressure": "kPa"}}, "cell_pressure needs a unit"),
    ({"units": UNITS | {"eps_1": "1"}}, "engineering strains must be below 1, got 8; in %?"),
    ({"units": UNITS | {"cell_pressure": "Pa"}}, "effective mean stress must be positive at the first reading, got"),
    ({"delimiter": ",,"}, "the delimiter must be one sign"),
    ({"delimiter": "\n"}, "test.csv"),
    ({"encoding": "no such"}, "is not text in the encoding 'no such'"),
    ({"heading_line": -1}, "heading_line must be a whole number of at least 0"),
    ({"heading_line": 0}, "has no headings: give columns by number"),
    ({"heading_line": 99}, "has no headings in line 99; it has 42 lines"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "words"), REFUSED)
def test_refused_in_one_sentence(changes, words, tmp_path):
    with pytest.raises(InvalidInput) as told:
        read_undrained(tmp_path / "test.csv", **changes)
    assert words in str(told.value)
    assert "\n" not in str(told.value)


def test_what_is_no_file(tmp_path, monkeypatch):
    """Nothing, a folder, bytes, and a file too large are told by name."""
    (tmp_path / "bytes.csv").write_bytes(bytes(range(256)))
    monkeypatch.setattr("rendulic.io.lab.rows.LARGEST", 1000)
    (tmp_path / "large.csv").write_text(UNDRAINED_TEXT * 2)
    for name, words in (
        ("none.csv", "no test at"),
        (".", "no test at"),
        ("bytes.csv", "is a binary file"),
        ("large.csv", "is not read"),
    ):
        with pytest.raises(InvalidInput, match=words):
            rd.io.read_triaxial(
                tmp_path / name, COLUMNS, UNITS, drainage="undrained", constants={"cell_pressure": 400.0}
            )


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_any_change_of_a_file_is_refused_or_harmless(tmp_path, data):
    """Bytes overwritten, or the end cut off: a finite curve whose strain rises, or one line that names the file."""
    raw = bytearray(UNDRAINED_TEXT.encode())
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(raw) - 1))
        raw[at : at + 1] = data.draw(
            st.one_of(st.binary(max_size=2), st.sampled_from([b"\n", b'"', b",", b"-", b"e", b"\x00"]))
        )
    raw = raw[: data.draw(st.one_of(st.just(len(raw)), st.integers(0, len(raw))))]
    path = tmp_path / "bad.csv"
    path.write_bytes(raw)
    found, told = outcome(path)
    if told:
        assert "bad.csv" in told
        assert len(told.splitlines()) == 1
    else:
        assert all(np.isfinite(found[name]).all() for name in ("sigma_1", "sigma_3", "eps_1", "eps_3"))
        assert (np.diff(found.eps_1) >= 0.0).all()


def outcome(path):
    try:
        return rd.io.read_triaxial(path, COLUMNS, UNITS, drainage="undrained", constants={"cell_pressure": 400.0}), ""
    except RendulicError as error:
        return None, str(error)


# --- the command ------------------------------------------------------------------------------------------

TOML = """
file = "test.csv"
drainage = "undrained"
columns = { eps_1 = "Axial strain", q = "q", pore_pressure = "u" }
units = { eps_1 = "%", q = "kPa", pore_pressure = "kPa", cell_pressure = "kPa" }
constants = { cell_pressure = 400 }
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "test.csv").write_text(UNDRAINED_TEXT)
    (tmp_path / "test.toml").write_text(TOML)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def command(monkeypatch, capsys, *arguments):
    from rendulic.cli import main

    monkeypatch.setattr(sys, "argv", ["rendulic", "lab", *arguments])
    with pytest.raises(SystemExit) as left:
        main.run()
    out, err = capsys.readouterr()
    return left.value.code or 0, out, err


def test_the_command(folder, monkeypatch, capsys):
    """It says where W2 turns negative, here at the peak of q, and writes readings, work and figure."""
    code, out, err = command(monkeypatch, capsys, "test.toml", "-o", "found")
    assert (code, err) == (0, "")
    assert "W2 turns negative at eps_1 = 0.0408" in out  # -ln(1 - 0.04)
    assert "q = 200.0" in out
    assert {path.name for path in (folder / "found").iterdir()} == {
        "measured.nc", "measured.csv", "w2.nc", "w2.csv", "w2_values.csv", "w2_fall.csv", "edges.csv", "w2.png", "w2.pdf",
    }  # fmt: skip
    found = rd.io.read_dataset(folder / "found" / "w2.nc")
    assert float(found.instability_q) == pytest.approx(200e3, rel=1e-4)
    headings, edge = (folder / "found" / "edges.csv").read_text().split()
    assert headings == "from_eps_1,to_eps_1,from_error,to_error"
    begin, end, error, end_error = edge.split(",")
    assert float(begin) == pytest.approx(-np.log(0.96), abs=1e-4)
    assert 0.0 < float(error) < 0.005
    assert (end, end_error) == ("", "")


def test_a_drained_test_and_its_figure(folder):
    """Four panels with the change of volume; a test that stays stable has no point."""
    stable = table(EPS_1, 20 * EPS_1, 200.0 + 20 * EPS_1 / 3, EPS_V, headings=("Axial strain", "q", "p", "eps_v"))
    for text, panels in ((DRAINED_TEXT, 4), (stable, 4)):
        measured = read_drained(folder / "drained.csv", text)
        along = rd.w2_along(measured)
        figure = rd.figures.path_work(measured, along, "drained")
        assert len(figure.axes) == panels
        marked = any("turns negative" in label for label in figure.axes[0].get_legend_handles_labels()[1])
        assert marked == (text == DRAINED_TEXT)


def test_the_example_is_a_description_that_works(folder):
    """What --init writes needs but the file it names."""
    (folder / "begin.toml").write_text(example())
    (folder / "test.csv").write_text(table(EPS_1, Q, U, headings=("Axial strain", "Deviator stress", "Pore pressure")))
    found = run_lab_test(folder / "begin.toml", folder / "out")
    assert_array_equal(found.measured.q, read_undrained(folder / "plain.csv").q)


@pytest.mark.parametrize(
    ("change", "arguments", "words"),
    [
        (("constants", "constnts"), ["test.toml"], "constnts: there is no such entry; did you mean 'constants'"),
        (("undrained", "damp"), ["test.toml"], "drainage"),
        (("test.csv", "none.csv"), ["test.toml"], "no test at none.csv"),
        (("400", '"much"'), ["test.toml"], "constants, cell_pressure"),
        (("", ""), ["none.toml"], "no description of a test at none.toml"),
        (("", ""), ["test.csv"], "is not a TOML file"),
        (("", ""), ["test.toml", "--init"], "test.toml exists already"),
        (("", ""), ["test.toml", "-o", "test.csv"], "cannot write to test.csv"),
        (("drainage", "analysis = { window = 0.05 }\ndrainage"), ["test.toml"], "test.csv: the curve must be two windows long"),
    ],
)  # fmt: skip
def test_the_command_refuses_in_one_line(change, arguments, words, folder, monkeypatch, capsys):
    (folder / "test.toml").write_text(TOML.replace(*change, 1))
    before = sorted(folder.rglob("*"))
    code, out, err = command(monkeypatch, capsys, *arguments)
    assert code == 2
    assert words in err
    assert err.startswith("rendulic: ")
    assert len(err.splitlines()) == 1
    assert out == ""
    assert sorted(folder.rglob("*")) == before


def test_both_pressures_may_be_constant(tmp_path):
    """A drained test of constant cell and pore pressure: the lateral stress is their difference all along."""
    path = tmp_path / "drained.csv"
    path.write_text("a,q,v\n0,0,0\n1,100,0.2\n2,150,0.3\n", encoding="utf-8")
    found = rd.io.read_triaxial(
        path, {"eps_1": "a", "q": "q", "eps_v": "v"},
        {"eps_1": "%", "q": "kPa", "eps_v": "%", "cell_pressure": "kPa", "pore_pressure": "kPa"},
        drainage="drained", constants={"cell_pressure": 300.0, "pore_pressure": 100.0},
    )  # fmt: skip
    assert found.sigma_3.values.tolist() == [200e3] * 3
    assert found.sigma_1.values.tolist() == [200e3, 300e3, 350e3]


@pytest.mark.parametrize("read", [rd.io.read_plain_text, run_lab_test, read_study])
@pytest.mark.parametrize("text", [b"a = " + b"[" * 100_000, b"#" * (2**20 + 1), b"\xff\xfe", b"[half"])
def test_no_toml_file_ends_in_a_traceback(tmp_path, snapshot_folder, read, text):
    """Deep, huge, foreign and broken files are told in one sentence by every reader of TOML."""
    place = snapshot_folder if read is rd.io.read_plain_text else tmp_path / "file.toml"
    (place / "box.toml" if place.is_dir() else place).write_bytes(text)
    with pytest.raises(RendulicError, match=r"is not a TOML file|is larger than 1048576 bytes") as told:
        read(place, tmp_path / "out") if read is run_lab_test else read(place)
    assert "\n" not in str(told.value)


@pytest.fixture
def snapshot_folder(packed, tmp_path):
    """A snapshot in plain text."""
    return rd.io.write_plain_text(packed.snapshot(), tmp_path / "text")

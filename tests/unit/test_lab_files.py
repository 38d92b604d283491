"""Files as laboratories deliver them: how they are written, what is dropped and said, many tests, legs, total stresses."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rendulic as rd
from rendulic.foundation.errors import InvalidInput
from rendulic.io.lab.guess import guess_description
from rendulic.io.lab.readings import legs_of, one_way
from rendulic.study.language.lab import run_lab_test

E1 = np.linspace(0.0, 10.0, 61)  # %
Q = 300.0 * (1.0 - (E1 / 5.0 - 1.0) ** 2)  # kPa
EV = 0.3 * E1 - 0.05 * E1**2  # %
P = 100.0 + Q / 3.0
COLUMNS = {"eps_1": "eps1", "eps_v": "epsv", "q": "q", "p": "p"}
UNITS = {"eps_1": "%", "eps_v": "%", "q": "kPa", "p": "kPa"}


def rows(*columns, between=",", digits=6):
    return [between.join(f"{value:.{digits}f}" for value in row) for row in zip(*columns, strict=True)]


def read(path, lines, columns=COLUMNS, units=UNITS, **options):
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return rd.io.read_triaxial(path, columns, units, **({"drainage": "drained"} | options))


@pytest.fixture
def plain(tmp_path):
    """The test in the simplest file."""
    return read(tmp_path / "plain.csv", ["eps1,epsv,q,p", *rows(E1, EV, Q, P)])


WAYS = {
    "several blanks": (["eps1   epsv    q     p", *rows(E1, EV, Q, P, between="   ")], {"delimiter": "blanks"}),
    "one blank is any blanks": (["eps1   epsv    q     p", *rows(E1, EV, Q, P, between="   ")], {"delimiter": " "}),
    "blanks and tabs": (["  eps1\t epsv q p", *rows(E1, EV, Q, P, between=" \t ")], {"delimiter": "blanks"}),
    "headings by blanks, data by tabs": (
        ["eps1      epsv      q          p", "[%]  [%]  [kPa] [kPa]", "", *rows(E1, EV, Q, P, between="\t")],
        {"delimiter": "\t", "first_line": 4},
    ),
    "units and blank line not counted": (
        ["eps1\tepsv\tq\tp", "[%]\t[%]\t[kPa]\t[kPa]", "", *rows(E1, EV, Q, P, between="\t")], {"delimiter": "\t"},
    ),
    "marked headings": (["** eps1  epsv  q  p", "", *rows(E1, EV, Q, P, between="\t")], {"delimiter": "\t"}),
    "marked headings by blanks": (["# eps1  epsv  q  p", *rows(E1, EV, Q, P, between="  ")], {"delimiter": "blanks"}),
    "comments": (["# made by", "# hand", "eps1,epsv,q,p", "#", *rows(E1, EV, Q, P)], {"comment": "#", "heading_line": 3}),
    "a part of the file": (["eps1,epsv,q,p", *rows(E1, EV, Q, P), "end,of,the,test"], {"last_line": 62}),
    "byte-order mark, semicolons, commas": (
        ["\ufeffeps1;epsv;q;p", *(row.replace(",", ";").replace(".", ",") for row in rows(E1, EV, Q, P))],
        {"delimiter": ";", "decimal": ","},
    ),
}  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
def test_however_it_is_written(way, plain, tmp_path):
    """The same numbers."""
    lines, options = WAYS[way]
    found = read(tmp_path / "other.dat", lines, **options)
    for name in ("eps_1", "eps_3", "sigma_1", "sigma_3"):
        assert_allclose(found[name], plain[name], rtol=1e-12, atol=1e-15)


def test_columns_by_number(plain, tmp_path):
    """Without headings, as numbers or as text, said or not; beyond headings that do not fit."""
    numbers = {"eps_1": 1, "eps_v": 2, "q": 3, "p": 4}
    for columns in (numbers, {name: str(at) for name, at in numbers.items()}):
        for options in ({"heading_line": 0}, {}):
            found = read(tmp_path / "bare.csv", rows(E1, EV, Q, P), columns, **options)
            assert_allclose(found.q, plain.q, rtol=1e-12)
    found = read(
        tmp_path / "titled.csv", ["a title, of the test", *rows(E1, EV, Q, P)], numbers, heading_line=0, first_line=2
    )
    assert_allclose(found.q, plain.q, rtol=1e-12)
    with pytest.raises(InvalidInput, match="has no column 9: its rows have at most 4"):
        read(tmp_path / "bare.csv", rows(E1, EV, Q, P), numbers | {"q": 9}, heading_line=0)


@pytest.mark.parametrize("said", [True, False])
def test_tension_positive(said, plain, tmp_path):
    """Strains and stresses negative in compression: told, or seen where there is no doubt; q turned only if it must be."""
    for q in (Q, -Q):
        found = read(tmp_path / "tension.csv", ["eps1,epsv,q,p", *rows(-E1, -EV, q, -P)], tension_positive=said)
        assert_allclose(found.sigma_1, plain.sigma_1, rtol=1e-9)
        # engineering strains are of the other sign: -e is compression by e
        assert_allclose(found.eps_1, plain.eps_1, rtol=1e-12)
        assert ("tension_positive" in found.attrs["notes"]) is not said


def test_void_ratios(plain, tmp_path):
    """eps_v = (e0 - e) / (1 + e0) as an engineering strain, from the first reading or a given one."""
    voids = 0.8 - EV / 100.0 * 1.8
    columns, units = {"eps_1": "eps1", "void_ratio": "e", "q": "q", "p": "p"}, {"eps_1": "%", "q": "kPa", "p": "kPa"}
    lines = ["eps1,e,q,p", *rows(E1, voids, Q, P, digits=9)]
    assert_allclose(read(tmp_path / "e.csv", lines, columns, units).eps_v, plain.eps_v, atol=1e-8)
    found = read(tmp_path / "e.csv", lines, columns, units, initial_void_ratio=0.81)
    assert_allclose(found.eps_v - plain.eps_v, np.log(1.81 / 1.8), atol=1e-8)


def test_other_stresses(plain, tmp_path):
    """Effective sigma_1 and sigma_3, q and sigma_3, sigma_1 and p: the same test."""
    for names, values in (
        (("sigma_1", "sigma_3"), (P + 2 * Q / 3, P - Q / 3)), (("q", "sigma_3"), (Q, P - Q / 3)), (("sigma_1", "p"), (P + 2 * Q / 3, P)),
    ):  # fmt: skip
        columns = {"eps_1": "eps1", "eps_v": "epsv"} | {name: name for name in names}
        units = {"eps_1": "%", "eps_v": "%"} | dict.fromkeys(names, "kPa")
        found = read(tmp_path / "s.csv", [",".join(["eps1", "epsv", *names]), *rows(E1, EV, *values)], columns, units)
        assert_allclose(found.q, plain.q, atol=5.0)
        assert_allclose(found.sigma_3, plain.sigma_3, atol=5.0)


def test_total_stresses(tmp_path, monkeypatch, capsys):
    """Undrained, q and eps_1 are enough; p' and eta are left out, of the tables, the answer and the figure."""
    found = read(
        tmp_path / "uu.csv",
        ["eps1,q", *rows(E1, Q)],
        {"eps_1": "eps1", "q": "q"},
        {"eps_1": "%", "q": "kPa"},
        drainage="undrained",
    )
    assert "p" not in found
    assert found.attrs["stress"] == "total"
    along = rd.w2_along(found)
    assert float(along.from_eps_1[0]) == pytest.approx(-np.log(0.95), abs=1e-3)
    assert "p" not in along
    assert np.isnan(along.instability_p)
    assert len(rd.figures.path_work(found, along).axes) == 3


def test_workbooks_and_arrays(plain, tmp_path, monkeypatch):
    """An array by number of column and key; a workbook without its reader is said to need it."""
    table = np.stack((E1, EV, Q, P), axis=1)
    np.savez(tmp_path / "tests.npz", one=table, two=2 * table)
    numbers = {"eps_1": 1, "eps_v": 2, "q": 3, "p": 4}
    found = rd.io.read_triaxial(tmp_path / "tests.npz", numbers, UNITS, drainage="drained", key="one")
    assert_allclose(found.q, plain.q, rtol=1e-6)
    with pytest.raises(InvalidInput, match=r"has 2 arrays: say which with key \(one, two\)"):
        rd.io.read_triaxial(tmp_path / "tests.npz", numbers, UNITS, drainage="drained")
    (tmp_path / "book.xlsx").write_bytes(b"PK\x03\x04no workbook")
    with pytest.raises(InvalidInput, match=r"openpyxl|cannot be read as a workbook"):
        rd.io.read_triaxial(tmp_path / "book.xlsx", COLUMNS, UNITS, drainage="drained")


def test_what_is_dropped_is_named(plain, tmp_path):
    """A glitch, a repeated strain, a row without an entry, an empty row, remarks: each named, and the rest as it was."""
    lines = ["eps1,epsv,q,p", *rows(E1, EV, Q, P)]
    lines.insert(20, lines[19])  # line 21: repeated
    lines.insert(30, "4.700000,0.3,280,190")  # line 31: back by 0.1 of 10
    lines.insert(40, "6.25,,280,190")  # line 41
    lines.insert(50, ",,,")  # line 51
    lines += ["", "Tested by,N. N.", "Remarks,none"]
    found = read(tmp_path / "messy.csv", lines)
    assert_allclose(found.q, plain.q, rtol=1e-12)
    assert found.attrs["n_dropped"] == 7
    told = found.attrs["dropped"].split("; ")
    assert [part.split(":")[0] for part in told] == [f"line {line}" for line in (21, 31, 41, 51, 67, 68, 69)]
    for words, part in zip(
        ("again", "goes back by", "column 'epsv'", "empty row", "empty row", "Tested by", "Remarks"), told, strict=True
    ):
        assert words in part
    assert found.line.values[[0, -1]].tolist() == [2, 66]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda e1: np.where(np.arange(61) % 6 == 3, e1 - 0.2, e1), "axial strain must rise"),
        (lambda e1: np.where(np.arange(61) == 30, 2.0, e1), "line 32, column 'eps1': axial strain must rise"),
    ],
)
def test_more_is_not_dropped(change, words, tmp_path):
    """One reading of six that goes back, and one that goes back by a third, are no glitches."""
    with pytest.raises(InvalidInput, match=words):
        read(tmp_path / "bad.csv", ["eps1,epsv,q,p", *rows(change(E1), EV, Q, P)])


def test_one_way_keeps_the_most():
    """The longest rising subsequence, against all subsets; what is off by how much."""
    draw = np.random.default_rng(1)
    for _ in range(40):
        strain = draw.integers(0, 8, 9).astype(float)
        keep, off = one_way(strain)
        assert (np.diff(strain[keep]) > 0).all()
        every = (np.array([strain[k] for k in range(9) if pick >> k & 1]) for pick in range(1, 512))
        assert keep.sum() == max(len(one) for one in every if (np.diff(one) > 0).all())
        assert (off[keep] == 0).all()


IMPLAUSIBLE = [
    ("drift", {"p": 100.0 + Q / 2}, {}, "is p the half sum"),
    ("voids", {"epsv": 70.0 - 3 * EV}, {}, "eps_v is 70 % at the first reading: is this the void ratio?"),
    ("unit", {"q": 1e6 * Q, "p": 1e6 * P}, {}, "is its unit right?"),
    ("sign", {"q": -0.3 * Q}, {}, "q is negative in compression"),
    ("late", {"eps1": 20.0 + E1}, {}, "the axial strain is 23.4 % at the first reading".replace("23.4", "22.3")),
    ("extension", {"eps1": -E1, "q": 0.5 * Q}, {"extension": True}, "q is positive in extension"),
]


@pytest.mark.parametrize(("name", "change", "options", "words"), IMPLAUSIBLE)
def test_what_is_implausible_is_said(name, change, options, words, plain, tmp_path):
    """One sentence, and the test is read; a sound test has none."""
    table = {"eps1": E1, "epsv": EV, "q": Q, "p": P} | change
    found = read(tmp_path / f"{name}.csv", [",".join(table), *rows(*table.values())], **options)
    assert words in found.attrs["notes"]
    assert plain.attrs["notes"] == ""


def test_many_tests_in_a_file(plain, tmp_path):
    """One by the entry of a column, or all."""
    path = tmp_path / "many.csv"
    lines = [f"A,{row}" for row in rows(E1, EV, Q, P)] + [f"B,{row}" for row in rows(E1, EV, Q / 2, P)]
    path.write_text("\n".join(["id,eps1,epsv,q,p", *lines]))
    one = rd.io.read_triaxial(path, COLUMNS, UNITS, drainage="drained", where={"id": "B"})
    assert_allclose(one.q, plain.q / 2, atol=1e-2)
    every = rd.io.read_triaxial_tests(path, COLUMNS, UNITS, drainage="drained", where={"id": "all"})
    assert list(every) == ["A", "B"]
    assert_allclose(every["B"].q, one.q, rtol=1e-15)
    with pytest.raises(InvalidInput, match="there are 'A', 'B'"):
        rd.io.read_triaxial(path, COLUMNS, UNITS, drainage="drained", where={"id": "C"})


def cycle():
    """Up to 1 %, back to 0.4 %, up to 5 % and a peak at 3 %."""
    e1 = np.concatenate((np.linspace(0, 1, 41), np.linspace(0.98, 0.4, 30), np.linspace(0.42, 5.0, 150)))
    q = np.concatenate(
        (np.linspace(0, 80, 41), np.linspace(77, 10, 30), 100 - 25 * (np.linspace(0.42, 5.0, 150) - 3) ** 2 / 2)
    )
    return e1, q


def test_legs(tmp_path):
    """Loading, unloading and reloading, each as a test; the strains of all count from the first reading of the file."""
    e1, q = cycle()
    path = tmp_path / "cycle.csv"
    path.write_text("\n".join(["e1,q", *rows(e1, q)]))
    options = {"columns": {"eps_1": "e1", "q": "q"}, "units": {"eps_1": "%", "q": "kPa"}, "drainage": "undrained"}
    legs = rd.io.read_triaxial_tests(path, **options)
    assert list(legs) == ["leg 1", "leg 2", "leg 3"]
    assert [leg.attrs["path"].split()[-1] for leg in legs.values()] == ["compression", "extension", "compression"]
    assert [int(leg.line[0]) for leg in legs.values()] == [2, 42, 72]
    third = rd.io.read_triaxial(path, leg=3, **options)
    assert_allclose(third.q, legs["leg 3"].q)
    assert float(rd.w2_along(third).from_eps_1[0]) == pytest.approx(-np.log(0.97), abs=2e-4)
    with pytest.raises(InvalidInput, match=r"leg = 1, 2, \.\.\. or"):
        rd.io.read_triaxial(path, **options)
    with pytest.raises(InvalidInput, match="has 3 legs, there is no leg 4"):
        rd.io.read_triaxial(path, leg=4, **options)


def test_legs_of_noisy_cycles():
    """Ten cycles of 80 readings, scattered by a hundredth of the amplitude: twenty turns."""
    t = np.arange(801) / 80.0
    strain = np.sin(2 * np.pi * t) + np.random.default_rng(2).normal(0.0, 0.01, len(t))
    legs = legs_of(strain)
    assert len(legs) == 21
    assert_allclose([end for _begin, end in legs[:-1]], 20 + 40 * np.arange(20), atol=6)


def test_legs_of_scattered_readings_are_read(tmp_path):
    """What goes back by too little to end a leg is dropped, however often; the whole test would be refused for it."""
    t = np.arange(801) / 80.0
    e1 = np.sin(2 * np.pi * t) + np.random.default_rng(2).normal(0.0, 0.02, len(t))
    path = tmp_path / "cycles.csv"
    path.write_text("\n".join(["e1,q", *rows(e1, 40.0 * np.sin(2 * np.pi * t + 0.3))]))
    legs = rd.io.read_triaxial_tests(path, {"eps_1": "e1", "q": "q"}, {"eps_1": "%", "q": "kPa"}, drainage="undrained")
    assert len(legs) >= 20
    assert sum(leg.attrs["n_dropped"] for leg in legs.values()) > 0.05 * len(t)


TOML = """
file = "cycle.csv"
drainage = "undrained"
columns = { eps_1 = "e1", q = "q" }
units = { eps_1 = "%", q = "kPa" }
"""


@pytest.mark.parametrize(
    ("entries", "parts"),
    [("", 3), ("leg = 3", 1), ('leg = "all"', 3), ("[format]\nleg = 2", 1), ("[format]\nlast_line = 40", 1)],
)
def test_descriptions_choose_legs(entries, parts, tmp_path):
    """Beside `file` or under [format]; all of them, each in a folder, and one table of edges."""
    (tmp_path / "cycle.csv").write_text("\n".join(["e1,q", *rows(*cycle())]))
    (tmp_path / "test.toml").write_text(TOML + entries)
    found = run_lab_test(tmp_path / "test.toml", tmp_path / "out")
    assert len(found.parts) == parts
    assert all(path.is_file() for path in found.files)
    if parts == 3:
        headings, *edges = (tmp_path / "out" / "edges.csv").read_text().split("\n")
        assert headings == "from_eps_1,to_eps_1,from_error,to_error,test"
        assert edges[0].endswith(",leg 3")


def test_what_is_no_test(tmp_path):
    """AGS, a binary file, a control sign in the name: one sentence each."""
    (tmp_path / "a.ags").write_text('"GROUP","TREG"\n"HEADING","LOCA_ID"\n')
    (tmp_path / "b.csv").write_bytes(b"eps1,q\x00\x01")
    (tmp_path / "c.csv").write_bytes(b"\xd0\xcf\x11\xe0 old workbook")
    for name, words in (
        ("a.ags", "is an AGS file: it has summary results"), ("b.csv", "is a binary file"), ("c.csv", "is a workbook"), ("d\test.csv", "a tab"),
    ):  # fmt: skip
        with pytest.raises(InvalidInput, match=words):
            rd.io.read_triaxial(tmp_path / name, COLUMNS, UNITS, drainage="drained")


def test_the_command_says_what_it_saw(tmp_path, monkeypatch, capsys):
    """Verdicts of all legs, what was dropped, what to look at."""
    from rendulic.cli import main

    e1, q = cycle()
    (tmp_path / "cycle.csv").write_text("\n".join(["e1,q", *rows(e1, q), "End of test,"]))
    (tmp_path / "test.toml").write_text(TOML)
    monkeypatch.setattr(sys, "argv", ["rendulic", "lab", str(tmp_path / "test.toml"), "-o", str(tmp_path / "out")])
    with pytest.raises(SystemExit):
        main.run()
    told = capsys.readouterr().out
    assert "leg 3: W2 turns negative at eps_1 = 0.03" in told
    assert "1 rows of the file dropped: line 223: column 'e1': expected a finite number, got 'End of test'" in told


GUESSED = {
    "tabs and units": ["eps1      epsv      q     p", "[%]  [%]  [kPa]  [kPa]", "", *rows(E1, EV, Q, P, between="\t")],
    "blanks": ["# eps1   epsv    q     p", *rows(E1, EV, Q, P, between="   ")],
    "commas": ["a title", "", "Axial strain [%];Volumetric strain [%];Deviator stress [kPa];Mean effective stress [kPa]",
               *(row.replace(",", ";").replace(".", ",") for row in rows(E1, EV, Q, P))],
    "no headings": rows(Q, EV, E1, P),
}  # fmt: skip


@pytest.mark.parametrize("name", GUESSED)
def test_a_description_is_proposed(name, plain, tmp_path, monkeypatch, capsys):
    """Printed by the command; with the units that no line gives, it reads the file."""
    from rendulic.cli import main

    (tmp_path / "test.dat").write_text("\n".join(GUESSED[name]) + "\n")
    monkeypatch.setattr(sys, "argv", ["rendulic", "lab", str(tmp_path / "test.dat"), "--guess"])
    with pytest.raises(SystemExit):
        main.run()
    text = capsys.readouterr().out
    assert text == guess_description(tmp_path / "test.dat")
    if name == "no headings":
        assert "heading_line = 0" in text
        assert "give the number of each column" in text
        return
    (tmp_path / "test.toml").write_text(text)
    if name == "blanks":
        with pytest.raises(InvalidInput, match=r"unknown unit of eps_1 '\?'"):
            run_lab_test(tmp_path / "test.toml", tmp_path / "out")
        (tmp_path / "test.toml").write_text(
            text.replace('q = "?"', 'q = "kPa"').replace('p = "?"', 'p = "kPa"').replace("?", "%")
        )
    found = run_lab_test(tmp_path / "test.toml", tmp_path / "out")
    assert_allclose(found.measured.q, plain.q, rtol=1e-9)
    assert_allclose(found.measured.eps_3, plain.eps_3, atol=1e-12)


def test_nothing_to_guess_from(tmp_path):
    (tmp_path / "words.txt").write_text("no numbers here\n" * 5)
    for name, words in (("none.dat", "no test at"), ("words.txt", "has no three lines alike")):
        with pytest.raises(InvalidInput, match=words):
            guess_description(tmp_path / name)

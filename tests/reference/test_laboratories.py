"""Real files of laboratories as delivered, read by short descriptions, against edges computed with NumPy alone.

The data lie beside the repository, in `../shared/reference/lab`, or where RENDULIC_REFERENCE says; its README names sources and
licences. `expected.csv`: where W2 changes its sign, from slopes of Gaussian-weighted straight lines, as `range over three widths`.
"""

from __future__ import annotations

import csv
import os
from pathlib import Path

import numpy as np
import pytest

import rendulic as rd

ROOT = Path(os.environ.get("RENDULIC_REFERENCE", Path(__file__).parents[3] / "shared" / "reference")) / "lab"

pytestmark = pytest.mark.skipif(
    not (ROOT / "expected.csv").is_file(),
    reason=f"the files of laboratories are not at {ROOT}: set RENDULIC_REFERENCE to the folder above",
)

UNITS = {"eps_1": "%", "eps_v": "%", "q": "kPa", "p": "kPa"}
LEVEL = ("TMD1", "TMD3", "TMD5")  # q is level to 2 % at the end: the README calls them no place to judge by


def read(test):
    """A Karlsruhe test."""
    if test.startswith("TMD"):
        columns = {"eps_1": "eps1", "eps_v": "epsv", "q": "q", "p": "p"}
        return rd.io.read_triaxial(
            ROOT / "karlsruhe_tmd" / f"{test}.dat", columns, UNITS, drainage="drained", delimiter="\t"
        )
    columns = {"eps_1": "eps1", "q": "q", "p": "p"}
    extension = test.endswith(("tmu/TMU4", "tmu/TMU5", "tmu/TMU6", "tmu2/TMU5", "tmu2/TMU7", "tmu2/TMU8"))
    return rd.io.read_triaxial(
        ROOT / f"{test}.dat", columns, UNITS, drainage="undrained", delimiter="blanks", extension=extension
    )


def expected():
    if not (ROOT / "expected.csv").is_file():
        return []
    with (ROOT / "expected.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("row", expected(), ids=lambda row: row["test"])
def test_edges_of_karlsruhe_tests(row):
    """Each edge lies where NumPy alone puts it, within the error told; tests that only harden have none."""
    along = rd.w2_along(read(row["test"]))
    begins, ends = (100.0 * np.abs(along[name].values) for name in ("from_eps_1", "to_eps_1"))
    if row["test"] in LEVEL or row["w2_negative_from_log_percent"] == "nan":
        assert len(begins) == 0
        return
    assert len(begins) == 1
    assert abs(begins[0] - float(row["w2_negative_from_log_percent"])) <= 100.0 * float(along.from_error[0])
    if row["w2_negative_to_log_percent"] == "end":
        assert np.isnan(ends[0])
    else:
        assert abs(ends[0] - float(row["w2_negative_to_log_percent"])) <= 100.0 * float(along.to_error[0])
    # the error is of use: less than a fifth of the strain
    assert float(along.from_error[0]) < 0.2 * begins[0] / 100.0


@pytest.mark.parametrize("test", [f"TMD{k}" for k in range(1, 26)])
def test_drained_tests_are_read_as_delivered(test):
    """All 25; what is dropped are units, an empty line, and readings that go back: no more than a hundredth of the rows."""
    found = read(test)
    inside = [
        told for told in found.attrs["dropped"].split("; ") if told and not told.startswith(("line 2:", "line 3:"))
    ]
    assert found.sizes["record"] > 390
    assert len(inside) <= 0.01 * found.sizes["record"]


def test_a_half_sum_is_told_from_p():
    """Bio-Bio sand: p is (sigma_1 + sigma_3) / 2, which a drained test shows by its lateral stress."""
    columns = {"eps_1": "eps1", "eps_v": "epsv", "q": "q", "p": "p"}
    for k in range(1, 5):
        found = rd.io.read_triaxial(ROOT / "biobio" / f"DR{k}.dat", columns, UNITS, drainage="drained", delimiter="\t")
        assert "is p the half sum" in found.attrs["notes"]


def test_the_compilation_of_two_tests():
    """4TU.ResearchData, 5 % of its rows: TMD22 turns negative where the whole record does, TMD2 is level."""
    columns = {"eps_1": "eps_a[%]", "eps_v": "eps_v[%]", "sigma_1": "sigma_v[kPa]", "sigma_3": "sigma_r[kPa]"}
    units = {"eps_1": "%", "eps_v": "%", "sigma_1": "kPa", "sigma_3": "kPa"}
    found = rd.io.read_triaxial_tests(
        ROOT / "compilation_4tu" / "TMD2_TMD22_every_0.5_percent.csv",
        columns,
        units,
        drainage="drained",
        where={"test_id": "all"},
    )
    assert list(found) == ["TMD2", "TMD22"]
    whole, part = rd.w2_along(read("TMD22")), rd.w2_along(found["TMD22"])
    off = abs(float(whole.from_eps_1[0] - part.from_eps_1[0]))
    assert off <= float(whole.from_error[0]) + float(part.from_error[0])


def test_void_ratios_and_semicolons():
    """GrainLearning's drained curve (`#` before its headings, MPa, void ratios), and files with a byte-order mark."""
    found = rd.io.read_triaxial(
        ROOT / "grainlearning" / "experimental_test_drained_s3=0.2.dat",
        {"eps_1": "epsilon_axial", "void_ratio": "e", "q": "q", "p": "p"}, {"eps_1": "1", "q": "MPa", "p": "MPa"},
        drainage="drained", delimiter="\t",
    )  # fmt: skip
    assert found.sizes["record"] == 200
    assert float(found.eps_v[0]) == 0.0
    columns = {
        "eps_1": "Deform_axial",
        "q": "Sigma_d_(kPa)",
        "pore_pressure": "Delta_U_(kPa)",
        "cell_pressure": "Sigma_3_(kPa)",
    }
    units = {"eps_1": "1", "q": "kPa", "pore_pressure": "kPa", "cell_pressure": "kPa"}
    found = rd.io.read_triaxial(
        ROOT / "ciu" / "cisalhamento_cp1.csv", columns, units, drainage="undrained", delimiter=";"
    )
    assert found.sizes["record"] == 20

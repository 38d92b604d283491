"""Element studies from TOML: what they accept, refuse, write and say."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from numpy.testing import assert_allclose
from rendulic.study.element_results import run_element_study
from rendulic.study.language.element import example, read_element_study

from rendulic.foundation.errors import InvalidInput
from rendulic.io.tables import read_dataset

TEST = '[[test]]\nname = "a"\npath = "undrained"\npressure_pa = 300e3\nvoid_ratio = 0.9\n'


@pytest.fixture
def study_file(tmp_path):
    """Write a study and return its path."""

    def write(text):
        path = tmp_path / "study.toml"
        path.write_text(text)
        return path

    return write


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "test: Field required"),
        ("test = []", "test: Tuple should have at least 1 item"),
        ("[[test]", "not a TOML file"),
        (TEST.replace("0.9", "-0.9"), "test.0.void_ratio: Input should be greater than 0"),
        (TEST.replace("0.9", "nan"), "test.0.void_ratio"),
        (TEST.replace("300e3", '"high"'), "test.0.pressure_pa: Input should be a valid number"),
        (TEST.replace("undrained", "undrianed"), "test.0.path: Input should be 'drained', 'undrained'"),
        (TEST.replace('"a"', '"../a"'), "test.0.name"),
        (TEST + TEST, "every test needs a name of its own, got a, a"),
        (TEST + "axial_stain = 0.1\n", "there is no such entry; did you mean 'axial_strain'?"),
        (TEST + "ratio = 2\n", "a path 'undrained' has no 'ratio': it takes axial_strain"),
        (TEST.replace("undrained", "proportional"), "a path 'proportional' needs 'ratio'"),
        (TEST + 'then = [{ path = "isotropic" }]\n', "a path 'isotropic' needs 'pressure_pa'"),
        (TEST + '[material]\npreset = "hostun_lose"\n', "unknown material 'hostun_lose': did you mean 'hostun_loose'"),
        (TEST + "[material]\nk_rR = 0.001\n", "k_rR = 0.001 is too small: B > 0"),
        (TEST + '[model]\nsphere_rule = "lebedev_4"\n', "there is no Lebedev rule of degree 4"),
        (TEST + '[model]\nsphere_rule = "gauss"\n', "a sphere rule is 'bazant_oh_37' or 'lebedev_DEGREE'"),
        (TEST + "[model]\ntolerance = 1\n", "model.tolerance: Input should be less than or equal to 0.01"),
    ],
)
def test_bad_studies_are_refused_by_entry(study_file, text, words):
    """The entry, what came or what is nearest, in one sentence that begins with the file."""
    path = study_file(text)
    with pytest.raises(InvalidInput) as error:
        read_element_study(path)
    message = str(error.value)
    assert words in message
    assert message.startswith(str(path))
    assert "\n" not in message


def test_a_state_that_the_material_refuses_names_the_test(study_file, tmp_path):
    """What only the model can judge names the test, and nothing is written."""
    study = read_element_study(study_file(TEST.replace("300e3", "1e12")))
    with pytest.raises(InvalidInput, match="test 'a': at 1e\\+12 Pa the critical void ratio"):
        run_element_study(study, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_the_example_is_a_study(study_file):
    """The file that `--init` writes is accepted, with all its tests."""
    study = read_element_study(study_file(example()))
    assert [test.name for test in study.test] == ["undrained_loose", "drained_loose", "drained_dense", "unload_reload"]


def test_tables_hold_the_curve(study_file, tmp_path):
    """CSV and NetCDF have the same numbers, to the bit; legs follow each other; figures are there."""
    text = TEST + 'axial_strain = 0.01\nthen = [{ path = "undrained", extension = true, axial_strain = 0.004 }]\n'
    (result,) = run_element_study(read_element_study(study_file(text)), tmp_path / "out")
    curve = result.curve
    assert sorted(set(curve.leg.values)) == [1, 2]
    # the second leg starts where the first ended
    ends = np.flatnonzero(np.diff(curve.leg.values))[0]
    for name in ("eps_1", "q", "p"):
        assert float(curve[name][ends]) == float(curve[name][ends + 1])
    assert_allclose(float(curve.eps_1[-1]), 0.006, rtol=1e-9)
    with open(tmp_path / "out" / "a.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["q [Pa]"]) for row in rows] == curve.q.values.tolist()
    stored = read_dataset(tmp_path / "out" / "a.nc")
    assert stored.q.values.tolist() == curve.q.values.tolist()
    assert stored.w2_plane.attrs["units"] == "Pa"
    with open(tmp_path / "out" / "a_planes.csv", newline="") as file:
        assert sum(1 for _ in file) == 1 + curve.sizes["record"] * curve.sizes["plane"]
    assert {path.suffix for path in result.files} == {".csv", ".nc", ".png", ".pdf"}
    assert all(path.stat().st_size > 50 for path in result.files)


def test_a_test_that_cannot_go_on_says_so(study_file, tmp_path):
    """Legs after one without quasi-static continuation are not run, and the curve tells why."""
    text = '[model]\nformulation = "eq32"\n' + TEST.replace("undrained", "drained").replace("0.9", "0.6")
    text += 'axial_strain = 0.5\nthen = [{ path = "drained", axial_strain = 0.1 }]\n'
    (result,) = run_element_study(read_element_study(study_file(text)), tmp_path / "out")
    assert result.curve.attrs["stopped_by"] == "plastic limit"
    assert set(result.curve.leg.values) == {1}

"""Tests of sands in studies: what they accept and refuse, and what they write."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rendulic.figures.of_study import draw_study
from rendulic.foundation.errors import InvalidInput
from rendulic.io.tables import read_dataset
from rendulic.study.execution.campaign import run_study
from rendulic.study.ids import StateId
from rendulic.study.language.study_file import preset_text, read_study

SAND = '[[specimen]]\nname = "sand"\nkind = "chang_hicher"\npressure_pa = 300e3\nvoid_ratios = [0.9]\n'
TEST = SAND + '[[path]]\nname = "a"\npath = "undrained"\n'
AT = StateId("sand", "e", 0.9, None)


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
        ("", "give at least one [[specimen]]"),
        ("[[path]", "not a TOML file"),
        (TEST.replace("0.9", "-0.9"), "specimen 'sand', void_ratios number 1: Input should be greater than 0"),
        (TEST.replace("300e3", '"high"'), "specimen 'sand', pressure_pa: Input should be a valid number"),
        (TEST.replace("undrained", "undrianed"), "path 'a', path: Input should be 'drained', 'undrained'"),
        (TEST.replace('"a"', '"../a"'), "name: String should match pattern"),
        (TEST + '[[path]]\nname = "A"\npath = "drained"\n', "[[path]]: each needs a name of its own, got a, a"),
        (TEST + "axial_stain = 0.1\n", "there is no such entry; did you mean 'axial_strain'?"),
        (TEST + "ratio = 2\n", "a path 'undrained' has no 'ratio': it takes axial_strain"),
        (TEST.replace("undrained", "proportional"), "a path 'proportional' needs 'ratio'"),
        (TEST + 'then = [{ path = "isotropic" }]\n', "a path 'isotropic' needs 'pressure_pa'"),
        (SAND + 'preset = "hostun_lose"\n', "unknown material 'hostun_lose': did you mean 'hostun_loose'"),
        (SAND + "material = { k_rR = 0.001 }\n", "k_rR = 0.001 is too small: B > 0"),
        (SAND + 'sphere_rule = "lebedev_4"\n', "there is no Lebedev rule of degree 4"),
        (SAND + 'sphere_rule = "gauss"\n', "a sphere rule is 'bazant_oh_37' or 'lebedev_DEGREE'"),
        (SAND + "tolerance = 1\n", "tolerance: Input should be less than or equal to 0.01"),
        (TEST.replace("300e3", "1e12"), "specimen 'sand', e = 0.9: at 1e+12 Pa the critical void ratio"),
    ],
)
def test_bad_studies_are_refused_by_entry(study_file, text, words):
    """The entry, what came or what is nearest, in one sentence that begins with the file."""
    path = study_file(text)
    with pytest.raises(InvalidInput) as error:
        read_study(path)
    message = str(error.value)
    assert words in message
    assert message.startswith(str(path))
    assert "\n" not in message


def test_the_example_is_a_study(study_file):
    """The file that `--init` writes is accepted, with all its tests."""
    study = read_study(study_file(preset_text("element_tests")))
    assert list(study.sets("path")) == ["undrained_loose", "drained_loose", "drained_dense", "unload_reload"]


def test_tables_hold_the_curve(study_file, tmp_path):
    """CSV and NetCDF have the same numbers, to the bit; legs follow each other; figures are there."""
    text = TEST + 'axial_strain = 0.01\nthen = [{ path = "undrained", extension = true, axial_strain = 0.004 }]\n'
    results = run_study(read_study(study_file(text)), tmp_path / "out").results
    curve = results.of("path")["a", AT]
    assert sorted(set(curve.leg.values)) == [1, 2]
    # the second leg starts where the first ended
    ends = np.flatnonzero(np.diff(curve.leg.values))[0]
    for name in ("eps_1", "q", "p"):
        assert float(curve[name][ends]) == float(curve[name][ends + 1])
    assert_allclose(float(curve.eps_1[-1]), 0.006, rtol=1e-9)
    stem = tmp_path / "out" / "sand_e_0.9" / "path_a"
    with stem.with_name("path_a.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["q [Pa]"]) for row in rows] == curve.q.values.tolist()
    stored = read_dataset(stem.with_name("path_a.nc"))
    assert stored.q.values.tolist() == curve.q.values.tolist()
    assert stored.w2_plane.attrs["units"] == "Pa"
    with stem.with_name("path_a_planes.csv").open(newline="") as file:
        assert sum(1 for _ in file) == 1 + curve.sizes["record"] * curve.sizes["plane"]
    files = [
        file
        for each in draw_study(results, ["elements", "fig9", "fig10"]).values()
        for one in each
        for file in one.files
    ]
    assert {path.suffix for path in files} == {".md", ".png", ".pdf"}
    assert all(path.stat().st_size > 50 for path in files)


def test_a_test_that_cannot_go_on_says_so(study_file, tmp_path):
    """Legs after one without quasi-static continuation are not run, and the curve tells why."""
    text = TEST.replace('path = "undrained"', 'path = "drained"').replace("0.9", "0.6")
    text = text.replace("[[path]]", 'formulation = "eq32"\n[[path]]')
    text += 'axial_strain = 0.5\nthen = [{ path = "drained", axial_strain = 0.1 }]\n'
    results = run_study(read_study(study_file(text)), tmp_path / "out").results
    curve = results.of("path")["a", StateId("sand", "e", 0.6, None)]
    assert curve.attrs["stopped_by"] == "plastic limit"
    assert set(curve.leg.values) == {1}


OLD = """
[specimen]
n_grains = 100
[loading]
inertial_number = 1e-3
[[packing]]
name = "loose"
eta = [0.1, 0.2]
growth_friction = 0.0
[[probes]]
name = "circle"
packings = ["loose"]
[[cones]]
name = "cones"
norms = [1e-5, 1e-4]
[[cones]]
name = "stress"
answering = "cones"
norm = 1e-5
[material]
preset = "hostun_loose"
k_pR = 0.8
[model]
tolerance = 1e-7
[[test]]
name = "u.1"
path = "undrained"
pressure_pa = 3e5
void_ratio = 0.9
[[test]]
name = "d"
path = "drained"
pressure_pa = 3e5
void_ratio = 0.7
"""


def test_old_files_are_read_with_a_warning_that_shows_the_new_ones(study_file):
    """What the warning shows is a study of its own, and the same one."""
    with pytest.warns(FutureWarning, match=r"is written as for rendulic 0\.1") as warned:
        old = read_study(study_file(OLD))
    shown = str(warned[0].message).split("write it so:\n\n")[1]
    assert read_study(study_file(shown)).model_dump() == old.model_dump()
    grains, sand = old.specimen
    assert (grains.n_grains, grains.growth_friction, grains.loading.inertial_number) == (100, 0.0, 1e-3)
    assert (sand.void_ratios, sand.material.k_pR, sand.tolerance) == ((0.9, 0.7), 0.8, 1e-7)
    assert old.sets("stress_probes")["stress"].cones == "cones"
    assert old.sets("path")["u_1"].void_ratios == (0.9,)
    assert old.sets("probes")["circle"].specimens == ("loose",)


def test_an_old_file_that_cannot_be_translated_is_refused(study_file):
    with pytest.raises(InvalidInput, match=r"written as for rendulic 0\.1"):
        read_study(study_file('[[test]]\nname = "a"\npath = "drained"\n'))

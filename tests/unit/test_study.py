"""Studies: presets, what they refuse, and the whole chain on a tiny specimen."""

from __future__ import annotations

import pytest

import rendulic as rd
from rendulic.errors import DidNotConverge, InvalidInput
from rendulic.io.tables import read_dataset
from rendulic.study.config import PRESETS, GrainStudy, preset
from rendulic.study.reproduce import FIGURES, reproduce


@pytest.mark.parametrize("name", PRESETS)
def test_presets_load(name):
    """Both presets are valid, and say what the paper's protocol says."""
    study = preset(name)
    assert study.loading.eta[-1] == 0.48
    assert study.specimen.pressure_pa == 200e3
    assert (study.specimen.radius_min_m, study.specimen.radius_max_m) == (2e-3, 18e-3)
    assert study.contact.law() == rd.dem.LinearFrictional(356e6, 0.42, 0.7, "mean_diameter")
    assert study.probes.diagram_norm in study.probes.norms


def test_the_paper_preset_is_the_papers():
    """10 000 spheres, 36 directions, norm 5e-5 in 5 000 steps, damping 0.05."""
    study = preset("paper")
    assert study.specimen.n_grains == 10000
    assert len(rd.directions.rendulic(study.probes.step_deg)) == 36
    assert (study.probes.norms[0], study.probes.n_steps, study.probes.damping) == (5e-5, 5000, 0.05)


def test_changes_replace_values():
    """One value is changed, its neighbours stay, and the preset itself too."""
    changed = preset("quick", specimen={"seed": 7})
    assert changed.specimen.seed == 7
    assert changed.specimen.n_grains == preset("quick").specimen.n_grains
    assert preset("quick").specimen.seed == 1


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"specimen": {"seeed": 2}}, "specimen.seeed: there is no such entry; did you mean 'seed'?"),
        ({"specimn": {"seed": 2}}, "specimn: there is no such entry; did you mean 'specimen'?"),
        ({"specimen": {"seed": -2}}, "specimen.seed"),
        ({"specimen": {"n_grains": "many"}}, "specimen.n_grains"),
        ({"specimen": {"density_kg_m3": float("nan")}}, "specimen.density_kg_m3"),
        ({"specimen": {"radius_min_m": 1.0}}, "radius_min_m must not exceed radius_max_m"),
        ({"contact": {"stiffness_rule": "harmonc"}}, "'harmonc': did you mean 'harmonic'"),
        ({"loading": {"eta": []}}, "loading.eta"),
        ({"loading": {"eta": [0.4, 0.3]}}, "must increase by at least 0.01"),
        ({"probes": {"norms": [2e-4, 1e-4]}}, "norms must be increasing"),
        ({"probes": {"diagram_norm": 3e-5}}, "diagram_norm 3e-05 must be one of the norms"),
        pytest.param({"probes": {"step_deg": 7}}, "360"),
    ],
)  # fmt: skip
def test_studies_refuse(changes, words):
    """Unknown keys and values without meaning, before anything is computed."""
    with pytest.raises(InvalidInput, match=words):
        preset("quick", **changes)


def test_unknown_presets_and_figures(tmp_path):
    """The nearest valid name is suggested, and nothing is made."""
    with pytest.raises(InvalidInput, match="unknown preset 'papr': did you mean 'paper'"):
        preset("papr")
    with pytest.raises(InvalidInput, match="unknown figure 'fig33': did you mean 'fig3'"):
        reproduce(preset("quick"), tmp_path / "out", ["fig33"])
    assert not (tmp_path / "out").exists()


def tiny(**changes):
    """A study of 120 grains whose numbers mean nothing and whose files are those of any study."""
    table = {
        "specimen": {"n_grains": 120, "radius_min_m": 6e-3, "radius_max_m": 12e-3, "seed": 2},
        "loading": {"inertial_number": 2e-4, "eta": (0.1,), "axial_strain": 0.01},
        "probes": {"step_deg": 60, "norms": (5e-5, 1e-4), "diagram_norm": 1e-4, "n_steps": 50},
    }
    for section, values in changes.items():
        table[section] = table[section] | values
    return GrainStudy.model_validate(table)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The tiny study, reproduced once, with what its stages reported."""
    told = []

    def stage(name):
        return lambda finished, total, note="": told.append((name, finished, total))

    return reproduce(tiny(), tmp_path_factory.mktemp("study"), stage=stage), told


STAGES = ("specimen.h5", "state_eta_0.100.h5", "curve_eta_0.100.nc", "curve_final.nc", "probes_eta_0.100.nc")


def test_everything_is_made(done):
    """Four figures in two formats, the stages, the record of the study, and the table; no leftovers."""
    result, told = done
    assert set(result.figures) == set(FIGURES)
    drawn = set()
    for name, files in result.figures.items():
        names = [file.name for file in files]
        assert {f"{name}.png", f"{name}.pdf"} <= set(names)
        assert all(each.startswith(name) for each in names)
        for file in files:
            assert file.read_bytes()[:4] == {".png": b"\x89PNG", ".pdf": b"%PDF"}[file.suffix]
            assert file.stat().st_size > 5000
        drawn |= set(names)
    assert {path.name for path in result.folder.iterdir()} == drawn | set(STAGES) | {"study.json", "table.nc"}
    assert {name for name, *_ in told} >= {"specimen", "shear to eta = 0.1", "probes at eta = 0.1"}


def test_the_table_says_what_was_probed(done):
    """The state is where it was asked to be, at rest, and every identity closes to rounding."""
    table = done[0].table
    assert dict(table.sizes) == {"state": 1, "norm": 2}
    assert float(table.eta[0]) == pytest.approx(0.1, abs=0.01)
    assert float(table.unbalanced_force[0]) <= 1e-4
    assert float(table.largest_identity_residual.max()) < 1e-12
    probes = read_dataset(done[0].folder / "probes_eta_0.100.nc")
    assert table.smallest_w2n[0].values.tolist() == probes.w2_normalised.min("alpha").values.tolist()
    assert float(read_dataset(done[0].folder / "table.nc").eta[0]) == float(table.eta[0])


def test_a_second_run_finds_the_stages(done):
    """Nothing is computed again: the files of the stages keep their time and content, the table is equal."""
    result = done[0]
    before = {name: ((result.folder / name).stat().st_mtime_ns, (result.folder / name).read_bytes()) for name in STAGES}
    again = reproduce(tiny(), result.folder, ["fig3"])
    assert set(again.figures) == {"fig3"}
    after = {name: ((result.folder / name).stat().st_mtime_ns, (result.folder / name).read_bytes()) for name in STAGES}
    assert after == before
    assert again.table.equals(result.table)


def test_a_missing_stage_is_made_again_alike(done):
    """A stage lost is computed again from the stage before, to the same result."""
    folder = done[0].folder
    probes = read_dataset(folder / "probes_eta_0.100.nc")
    (folder / "probes_eta_0.100.nc").unlink()
    reproduce(tiny(), folder, ["fig3"], workers=1)
    assert read_dataset(folder / "probes_eta_0.100.nc").equals(probes)


def test_another_study_is_refused(done):
    """A folder holds one study; nothing of it is touched by another."""
    folder = done[0].folder
    before = {path.name: path.stat().st_mtime_ns for path in folder.iterdir()}
    with pytest.raises(InvalidInput, match="holds the results of another study"):
        reproduce(tiny(specimen={"seed": 3}), folder)
    assert {path.name: path.stat().st_mtime_ns for path in folder.iterdir()} == before


def test_a_stress_ratio_out_of_reach_is_told(tmp_path):
    """What spheres do not reach within the strain given is an error with the largest ratio seen."""
    study = tiny(loading={"eta": (2.0,), "axial_strain": 2e-3})
    with pytest.raises(DidNotConverge, match=r"eta = 2 was not reached within 0.002 of axial strain \(the largest was"):
        reproduce(study, tmp_path / "far", ["fig3"])


def test_only_the_figures_asked_for(done, tmp_path):
    """Without Figs. 1 and 2 the compression does not go on to the end."""
    import shutil

    folder = tmp_path / "part"
    folder.mkdir()
    for name in ("study.json", *STAGES):
        shutil.copy(done[0].folder / name, folder)
    (folder / "curve_final.nc").unlink()
    result = reproduce(tiny(), folder, ["fig3", "fig4"])
    assert set(result.figures) == {"fig3", "fig4"}
    assert not (folder / "curve_final.nc").exists()

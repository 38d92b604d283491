"""The study of failure on two tiny packings: its numbers mean nothing, its files are those of any study."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import rendulic as rd
from rendulic.io.tables import read_dataset
from rendulic.probing.burst import VERDICTS
from rendulic.study.draw import needed_by
from rendulic.study.execution.campaign import run_study
from rendulic.study.failure_tables import burst_text
from rendulic.study.language.config import Study
from rendulic.study.plan import plan_of
from rendulic.study.sands import around_and_within

FIGURES = ("cones", "map", "bursts", "anatomy")
TINY = {
    "specimen": {"n_grains": 120, "radius_min_m": 6e-3, "radius_max_m": 12e-3},
    "loading": {"inertial_number": 2e-4},
    "packing": [
        {"name": "loose", "seeds": [2], "eta": (0.1, 0.2), "axial_strain": 0.15},
        {"name": "dense", "seeds": [2], "eta": (0.2,), "axial_strain": 0.15, "growth_friction": 0.0},
    ],
    "probes": [
        {"name": "sphere", "packings": ["loose"], "eta": (0.2,), "sphere_directions": 20, "norms": [1e-4], "n_steps": 100},
        {"name": "anatomy", "packings": ["loose"], "step_deg": 45.0, "norms": [1e-4], "n_steps": 100, "anatomy": True},
    ],
    "cones": [
        {"name": "cones", "norm": 1e-4, "norms": (2e-5, 5e-5, 1e-4), "n_steps": 20, "step_deg": 45.0, "tolerance_deg": 10.0},
        {"name": "stress", "eta": (0.2,), "answering": "cones", "norm": 1e-4, "n_steps": 100, "step_deg": 45.0,
         "tolerance_deg": 10.0},
    ],
    "bursts": [{"name": "bursts", "cones": "cones", "n_steps": 100, "step_deg": 120.0}],
    "figures": {"draw": FIGURES},
}  # fmt: skip


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("failure")
    return folder, run_study(Study.model_validate(TINY), folder).figures


def test_every_figure_and_table_is_made(done):
    folder, files = done
    assert set(files) == set(FIGURES)
    for name, made in files.items():
        assert {file.suffix for file in made} >= {".png", ".pdf"}
        for file in made:
            assert file.parent == folder
            assert file.name.startswith(name)
            assert file.stat().st_size > (4000 if file.suffix in (".png", ".pdf") else 300)
    assert not [path for path in folder.rglob("*") if path.suffix in (".tmp", ".part")]


def test_bursts_are_told_state_by_state(done):
    folder, files = done
    assert {folder / "bursts.csv", folder / "bursts.md"} <= set(files["bursts"])
    rows = pd.read_csv(folder / "bursts.csv").dropna(subset=["w2_normalised"])
    states = [f"loose, seed 2, eta = {eta}" for eta in (0.1, 0.2)] + ["dense, seed 2, eta = 0.2"]
    assert set(states) < set(rows.state)
    assert set(rows.verdict) <= set(VERDICTS)
    text = (folder / "bursts.md").read_text(encoding="utf-8")
    for state in states:
        here = rows[rows.state == state]
        assert set(here["alpha [degree]" if "alpha [degree]" in here else "alpha"]) >= {0.0, 120.0, 240.0}
        assert f"| {state} |" in text
    # the model: whatever is predicted to fail cannot be controlled, and only that
    model = rows[rows.state.str.startswith("Chang-Hicher")]
    assert (model.predicted == model.observed).all()
    assert model.predicted.any()


def test_every_burst_keeps_its_curve(done):
    folder, _ = done
    kept = sorted((folder / "loose_seed_2" / "bursts_bursts_eta_0.100").iterdir())
    table = read_dataset(folder / "loose_seed_2" / "bursts_bursts_eta_0.100.nc")
    assert len(kept) == table.sizes["alpha"]
    for file, alpha in zip(kept, table.alpha.values, strict=True):
        curve = read_dataset(file)
        assert curve.attrs["alpha"] == pytest.approx(float(alpha))
        assert VERDICTS.index(curve.attrs["verdict"]) == int(table.verdict.sel(alpha=alpha))


def test_maps_and_cones_are_those_of_the_states(done):
    folder, _ = done
    table = read_dataset(folder / "map_grains_loose.nc")
    assert table.eta.values.tolist() == [0.1, 0.2]
    cone = rd.cone_of(read_dataset(folder / "loose_seed_2" / "cone_cones_eta_0.200.nc").sel(norm=1e-4))
    assert float(table.smallest_w2n.sel(eta=0.2, specimen=2)) == cone.smallest_w2n
    dense = read_dataset(folder / "map_grains_dense.nc")
    assert dense.sizes["eta"] == 1
    model = read_dataset(folder / "map_chang_hicher_loose_drained.nc")
    assert 0.9 < float(model.first_eta[0]) < 0.95


def test_a_second_run_finds_everything(done):
    folder, _ = done
    stages = [path for path in folder.rglob("*") if path.suffix in (".h5", ".nc") and not path.name.startswith("map_")]
    before = {path: path.stat().st_mtime_ns for path in stages}
    assert len(before) > 40
    assert run_study(Study.model_validate(TINY), folder, figures=["map", "anatomy"]).outcome.made == 0
    assert {path: path.stat().st_mtime_ns for path in stages} == before


def test_an_anatomy_needs_no_other_packing():
    study = Study.model_validate(TINY | {"figures": {"draw": ["anatomy"]}})
    plan = plan_of(study)
    needed = plan.needed_for(needed_by(plan, "anatomy"))
    assert sum(unit.kind == "packing" for unit in needed.values()) == 1
    assert {unit.kind for unit in needed.values()} == {"packing", "state", "probes", "dissection"}


def test_directions_lie_all_around_and_within_every_sector():
    state = rd.ChangHicher.preset("hostun_loose").at(300e3, 0.9)
    state.load(rd.paths.drained_triaxial(0.5, until_eta=1.0))
    cone = rd.instability_cone(state, norm=1e-7, n_steps=1)
    ((first, last),) = cone.sectors
    alpha = np.array(around_and_within(cone, 60.0).alpha)
    assert set(np.arange(0.0, 360.0, 60.0)) < set(alpha)
    inside = alpha[(alpha > first) & (alpha < last)]
    assert np.allclose((inside[inside % 60.0 > 0.0] - first) / (last - first), [0.25, 0.5, 0.75])


def test_disagreements_are_listed():
    """Four directions, of which one settles against its prediction and one is undecided."""
    import xarray as xr

    table = xr.Dataset(
        {
            "w2_normalised": ("alpha", [0.9, -0.4, -0.5, 0.1]), "predicted": ("alpha", [False, True, True, False]),
            "observed": ("alpha", [False, True, False, False]), "verdict": ("alpha", [0, 1, 0, 3]),
            "to_edge": ("alpha", [90.0, 20.0, 20.0, 4.0]), "ratio": ("alpha", [0.0, 1.0, 0.5, 0.2]),
            "w2_normalised_opposite": ("alpha", [-0.1, 0.9, 0.9, 0.9]),
            "w2_normalised_lasting": ("alpha", [0.9, -0.3, -0.2, 0.1]),
        },
        {"alpha": [0.0, 120.0, 140.0, 160.0]},
    )  # fmt: skip
    text = burst_text({"a state": table})
    # the first direction is stable and its opposite is not, the last is near an edge
    assert "| a state | 2 | 1 | 0 | 0 | 0 | 0 | 1 of 2 |  |" in text
    assert "| a state | 140 | 0.50 | -0.50 | -0.20 | +0.90 | settles |  |  |  |" in text
    assert "| a state | 160 | 0.20 | +0.10 | +0.10 | +0.90 | undecided |  |  | edge |" in text
    assert "| 120 | 1.00 | -0.40 **fails** |" in text

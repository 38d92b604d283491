"""The study of failure on two tiny packings and a sand: its numbers mean nothing, its files are those of any study."""

from __future__ import annotations

import numpy as np
import pytest

import rendulic as rd
from rendulic.figures.of_study import draw_study
from rendulic.io.tables import read_dataset
from rendulic.probing.burst import VERDICTS
from rendulic.study.execution.campaign import results_in, run_study
from rendulic.study.ids import StateId
from rendulic.study.language.study import Study
from rendulic.study.plan import plan_of
from rendulic.study.tasks.bursts import around_and_within
from rendulic.views.catalogue import catalogue, check_figures

FIGURES = ("cones", "amplitude", "map", "bursts")
pytestmark = pytest.mark.long
GRAINS = {
    "kind": "grains", "n_grains": 120, "radius_min_m": 6e-3, "radius_max_m": 12e-3, "axial_strain": 0.15,
    "loading": {"inertial_number": 2e-4},
}  # fmt: skip
TINY = {
    "specimen": [
        {"name": "loose", "seeds": [2], "eta": (0.1, 0.2), **GRAINS},
        {"name": "dense", "seeds": [2, 3], "eta": (0.2,), "growth_friction": 0.0, **GRAINS},
        {"name": "sand", "kind": "chang_hicher", "preset": "hostun_loose", "void_ratios": [0.9], "eta": (0.8, 1.0)},
    ],
    "cones": [
        {"name": "cones", "specimens": ["loose", "dense"], "seeds": [2], "norm": 1e-4, "norms": (2e-5, 5e-5, 1e-4),
         "rate": 1e-06, "settle": False, "step_deg": 45.0, "tolerance_deg": 10.0},
        {"name": "sand", "specimens": ["sand"], "norm": 1e-6, "step_deg": 10.0},
    ],
    "bursts": [
        {"name": "bursts", "cones": "cones", "rate": 1e-6, "hold_steps": 5000, "step_deg": 120.0},
        {"name": "sand", "cones": "sand", "norm": 1e-9, "step_deg": 60.0},
    ],
    "figures": {"draw": FIGURES},
}  # fmt: skip


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("failure")
    run = run_study(Study.model_validate(TINY), folder)
    return folder, draw_study(run.results, FIGURES)


@pytest.fixture
def results(done):
    """Read anew."""
    return results_in(done[0])


def test_every_figure_and_table_is_made(done):
    folder, drawn = done
    made = {name: {file.name for one in each for file in one.files} for name, each in drawn.items()}
    assert {"cones.png", "cones.md", "cones_diagrams.pdf", "cones_amplitude_dense_seed_2.png"} < made["cones"]
    assert {"amplitude_loose_seed_2.png", "amplitude_dense_seed_2.md"} < made["amplitude"]
    assert made["map"] == {"map.png", "map.pdf", "map.md", "map.nc"}
    assert {"bursts.png", "bursts.md", "bursts.nc", "bursts_curves.png", "bursts_equation_1.png"} < made["bursts"]
    for name in set().union(*made.values()):
        assert (folder / name).stat().st_size > (4000 if name.endswith((".png", ".pdf")) else 100)


def test_bursts_are_told_state_by_state(done):
    folder, _ = done
    rows = read_dataset(folder / "bursts.nc")
    states = ["loose, seed 2, eta = 0.1", "loose, seed 2, eta = 0.2", "dense, seed 2, eta = 0.2"]
    sands = ["sand, e = 0.9, eta = 0.8", "sand, e = 0.9, eta = 1"]
    assert list(dict.fromkeys(rows.state.values)) == [*states, *sands]
    assert set(rows.verdict.values) <= set(VERDICTS)
    text = (folder / "bursts.md").read_text(encoding="utf-8")
    for state in states:
        assert set(rows.alpha.values[rows.state.values == state]) >= {0.0, 120.0, 240.0}
        assert f"| {state} |" in text
    # the model: whatever is predicted to fail cannot be controlled, and only that
    model = rows.isel(burst=np.isin(rows.state.values, sands))
    assert (model.predicted.values == model.observed.values).all()
    assert model.predicted.any()
    assert text.index(states[-1]) < text.index("a test of the code and no evidence") < text.index(sands[0])


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
    """Grains and sand in one table, each at its own stress ratios; a panel for each specimen."""
    folder, drawn = done
    table = read_dataset(folder / "map.nc")
    assert table.eta.values.tolist() == [0.1, 0.2, 0.8, 1.0]
    cone = rd.cone_of(read_dataset(folder / "loose_seed_2" / "cones_cones_eta_0.200.nc").sel(norm=1e-4))
    assert float(table.smallest_w2n.sel(eta=0.2, specimen="loose, seed 2")) == cone.smallest_w2n
    assert np.isnan(table.smallest_w2n.sel(eta=0.8, specimen="dense, seed 2"))
    assert table.n_present.sel(name="loose").values.tolist() == [1, 1, 0, 0]
    (view,) = (one.view for one in drawn["map"])
    assert [panel.label for panel in view.panels] == ["loose", "dense", "sand"]
    assert [panel.samples[0].track.at.tolist() for panel in view.panels] == [[0.1, 0.2], [0.2], [0.8, 1.0]]
    assert 0.8 < float(table.first_eta.sel(specimen="sand, e = 0.9")) < 1.0


def test_what_is_missing_leaves_a_gap(done, results):
    """Without one cone and the bursts of grains, all else is shown as before."""
    gone = StateId("loose", "seed", 2, 0.2)
    taken = [unit for (_, state), units in results.plan.of("cones").items() if state == gone for unit in units]
    taken += [unit for (name, _), units in results.plan.of("bursts").items() if name == "bursts" for unit in units]
    results.done -= {unit.key for unit in taken}
    views = {name: dict(catalogue()[name].views(results)) for name in FIGURES}
    track = views["map"]["map"].panels[0].samples[0].track
    assert np.isfinite(track.smallest).tolist() == [True, False]
    assert str(gone) not in [row.label for row in views["cones"]["cones"].rows]
    assert set(views["bursts"]) == {"bursts"}
    assert [one.is_watched for one in views["bursts"]["bursts"].panels] == [False, False]
    assert set(views["amplitude"]) == {"amplitude_loose_seed_2", "amplitude_dense_seed_2"}


def test_nothing_finished_shows_nothing(results):
    results.done -= results.done
    for name in FIGURES:
        assert catalogue()[name].views(results) == {}


def test_figures_say_what_they_lack():
    plan = plan_of(Study.model_validate(TINY | {"cones": TINY["cones"][1:], "bursts": []}))
    with pytest.raises(rd.RendulicError, match=r"bursts needs a \[\[bursts\]\] set, and the study has none"):
        check_figures(plan, ["bursts"])
    with pytest.raises(rd.RendulicError, match=r"amplitude needs a \[\[cones\]\] set with several norms"):
        check_figures(plan, ["map", "amplitude"])


def test_a_second_run_finds_everything(done):
    folder, _ = done
    stages = [path for path in folder.rglob("*") if path.suffix in (".h5", ".nc") and path.parent != folder]
    before = {path: path.stat().st_mtime_ns for path in stages}
    assert len(before) > 40
    assert run_study(Study.model_validate(TINY), folder).outcome.made == 0
    assert {path: path.stat().st_mtime_ns for path in stages} == before


def test_directions_lie_all_around_and_within_every_sector():
    state = rd.ChangHicher.preset("hostun_loose").at(300e3, 0.9)
    state.load(rd.paths.drained_triaxial(0.5, until_eta=1.0))
    cone = rd.instability_cone(state, norm=1e-7)
    ((first, last),) = cone.sectors
    alpha = np.array(around_and_within(cone, 60.0).alpha)
    assert set(np.arange(0.0, 360.0, 60.0)) < set(alpha)
    inside = alpha[(alpha > first) & (alpha < last)]
    assert np.allclose((inside[inside % 60.0 > 0.0] - first) / (last - first), [0.25, 0.5, 0.75])


def test_sets_that_have_the_same_state_are_all_shown(done):
    """The first in the figures; the others in the report, by their name."""
    folder, _ = done
    again = [
        {"name": "finer", "specimens": ["sand"], "eta": [1.0], "norm": 1e-7, "step_deg": 10.0},
        {"name": "finer", "cones": "finer", "norm": 1e-9, "step_deg": 120.0},
    ]
    two = TINY | {"cones": [*TINY["cones"], again[0]], "bursts": [*TINY["bursts"], again[1]]}
    run_study(Study.model_validate(two), folder)
    results = results_in(folder)
    families = catalogue()["cones"].shown(results)
    assert [row.label for row in families["cones 'finer'"].rows] == ["sand, e = 0.9, eta = 1"]
    assert "cones 'sand'" not in families
    last = catalogue()["bursts"].shown(results)["all states"].panels[-1]
    assert (last.label, last.state) == ("sand, e = 0.9, eta = 1, bursts 'finer'", "sand, e = 0.9, eta = 1")

"""Studies: presets, the file to begin with, and the whole chain on a tiny specimen."""

from __future__ import annotations

import json
import re

import pytest

import rendulic as rd
from rendulic.figures.of_study import draw_study
from rendulic.foundation.errors import InvalidInput
from rendulic.io.tables import read_dataset
from rendulic.loading.rate import STRAIN_PER_STEP, steps_to
from rendulic.study.execution.campaign import results_in, run_study
from rendulic.study.ids import SampleId
from rendulic.study.language.study import Study
from rendulic.study.language.study_file import preset, preset_text, read_study, template, with_seed
from rendulic.study.plan import plan_of
from rendulic.views.catalogue import check_figures, units_for

pytestmark = [pytest.mark.long, pytest.mark.versions]  # whole studies, with processes of their own

FIGURES = ("fig1", "fig2", "fig3", "fig4")


PAPER = ("quick", "paper")  # presets of the paper's study


def sets(study, table):
    return list(study.sets(table).values())


@pytest.mark.parametrize("name", PAPER)
def test_presets_load(name):
    """Both presets are valid, and say what the paper's protocol says."""
    study = preset(name)
    first = study.specimen[0]
    assert (first.name, first.kind, first.eta[-1], first.to_the_end) == ("paper", "grains", 0.48, True)
    assert first.pressure_pa == 200e3
    assert (first.radius_min_m, first.radius_max_m) == (2e-3, 18e-3)
    assert first.contact.law() == rd.dem.LinearFrictional(356e6, 0.42, 0.7, "mean_diameter")
    assert study.figures.diagram_norm in study.probes[0].norms


def test_the_paper_preset_is_the_papers():
    """10 000 spheres, 36 directions, norm 5e-5 in 5 000 steps (the default rate), damping 0.05."""
    study = preset("paper")
    around = study.sets("probes")["circle"]
    assert study.specimen[0].n_grains == 10000
    assert len(around.directions()) == 36
    assert (around.norms[0], around.rate, around.damping) == (5e-5, None, 0.05)
    assert steps_to(5e-5, STRAIN_PER_STEP) == 5000


@pytest.mark.parametrize("name", PAPER)
def test_probes_of_a_preset_have_the_default_rate(name):
    """Wherever grains are probed or pushed; but for the large probes of the quick preset, at twice that."""
    study = preset(name)
    grains = {each.name for each in study.specimen if each.kind == "grains"}
    named = study.sets("cones")

    def of_grains(table):
        chosen = [each if hasattr(each, "specimens") else named[each.cones] for each in sets(study, table)]
        return [each for each, where in zip(sets(study, table), chosen, strict=True) if set(where.specimens) <= grains]

    found = [each.rate for table in ("probes", "cones", "bursts") for each in of_grains(table)]
    assert len(found) >= 5
    assert found[0] == (2 * STRAIN_PER_STEP if name == "quick" else None)
    assert set(found[1:]) == {None}


def test_another_seed_is_another_packing_of_the_same_recipe():
    """All seeds move together, and nothing else changes."""
    moved = with_seed(preset("quick"), 21)
    expected = [tuple(range(21, 37)), (21, 22), (21, 22)]
    assert [each.seeds for each in moved.specimen if each.kind == "grains"] == expected
    assert [each.seeds for each in moved.cones if each.seeds] == [(21,), (22,)]
    assert with_seed(moved, 1) == with_seed(preset("quick"), 1)
    before = {unit.key for unit in plan_of(preset("quick")).units.values() if unit.kind in ("packing", "state")}
    assert not set(plan_of(moved).units) & before
    with pytest.raises(InvalidInput, match="seeds"):
        with_seed(preset("quick"), -3)


def test_the_file_to_begin_with_shows_the_defaults(tmp_path):
    """It is a study; with the defaults it shows uncommented, it is the same study, entry by entry."""
    text = template()
    (tmp_path / "as_written.toml").write_text(text)
    shown = re.sub(r"^# (\w+ = (?!\.\.\.))", r"\1", text, flags=re.MULTILINE)
    (tmp_path / "shown.toml").write_text(shown)
    written, full = (read_study(tmp_path / name) for name in ("as_written.toml", "shown.toml"))
    assert full.model_dump() == written.model_dump()
    assert shown.count("\n# ") <= text.count("\n# ") - 30
    for name in ("title", "specimen", "probes", "cones", "bursts", "path", "figures"):
        assert f"[{name}]" in text or f"{name} = " in text
    assert len(plan_of(written).units) > 10


def test_a_preset_can_be_written_down(tmp_path):
    """The file that ships is the preset."""
    (tmp_path / "own.toml").write_text(preset_text("paper"))
    assert read_study(tmp_path / "own.toml") == preset("paper")


def test_unknown_presets_and_figures():
    """The nearest valid name is suggested."""
    with pytest.raises(InvalidInput, match="unknown preset 'papr': did you mean 'paper'"):
        preset("papr")
    with pytest.raises(InvalidInput, match="unknown figure 'fig33': did you mean 'fig3'"):
        check_figures(plan_of(tiny()), ["fig33"])
    with pytest.raises(InvalidInput, match="trust is shown by rendulic report only: leave it out"):
        check_figures(plan_of(tiny()), ["trust"])


GRAINS = {
    "name": "paper", "kind": "grains", "n_grains": 120, "radius_min_m": 6e-3, "radius_max_m": 12e-3, "to_the_end": True,
    "loading": {"inertial_number": 2e-4},
}  # fmt: skip


def tiny(seed=2, eta=(0.1,), axial_strain=0.01, contact=None, **others):
    """A study of 120 grains whose numbers mean nothing and whose files are those of any study."""
    grains = GRAINS | {"seeds": [seed], "eta": eta, "axial_strain": axial_strain, "contact": contact or {}}
    return Study.model_validate(
        {
            "specimen": [grains],
            "probes": [{"name": "circle", "step_deg": 30.0, "norms": (5e-5, 1e-4), "rate": 1e-06, "settle": False}],
            "figures": {"draw": FIGURES, "diagram_norm": 1e-4},
        }
        | others
    )


def of_figures(*names):
    """What a run is told to do only."""
    return lambda plan: units_for(plan, names)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The tiny study, run once by two processes."""
    return run_study(tiny(), tmp_path_factory.mktemp("study"))


PRODUCTS = {"specimen.h5", "state_eta_0.100.h5", "curve_eta_0.100.nc", "curve_end.nc", "probes_circle_eta_0.100.nc"}


def test_everything_is_made(done):
    """Four figures in two formats, states and tables, the record of the study; no leftovers."""
    assert (done.outcome.failed, done.outcome.blocked) == ({}, [])
    folder = done.results.store.folder
    for name, views in draw_study(done.results, FIGURES).items():
        files = [file for one in views for file in one.files]
        assert {f"{name}.png", f"{name}.pdf"} <= {file.name for file in files}
        for file in files:
            if file.suffix in (".png", ".pdf"):
                assert file.read_bytes()[:4] == {".png": b"\x89PNG", ".pdf": b"%PDF"}[file.suffix]
                assert file.stat().st_size > 5000
    assert {path.name for path in (folder / "paper_seed_2").iterdir()} == PRODUCTS
    own = {path.name for path in folder.iterdir() if not path.name.startswith("fig")}
    assert own == {
        "units", "logs", "lock", "study.json", "running.json", "products.json", "paper_seed_2"
    }  # fmt: skip
    assert not list(folder.rglob("*.part*"))


def test_units_are_the_work_done_at_once(done):
    """Packing, state, the curve after it, and two batches of the twelve directions, one log for each."""
    kinds = [unit.kind for unit in done.results.plan.units.values()]
    assert sorted(kinds) == ["packing", "probes", "probes", "state", "state"]
    assert done.outcome.made == 5
    for key, unit in done.results.plan.units.items():
        log = (done.results.store.folder / "logs" / f"{key}.log").read_text()
        assert unit.label in log
        assert log.rstrip().endswith("done")


def test_batches_are_the_directions_together(done):
    """Probes of several units are those that one call gives, to the bit, labels and all."""
    ((_, at),) = done.results.of("probes")
    sample = done.results.state(at)
    whole = rd.probe(sample, rd.directions.rendulic(30.0), [5e-5, 1e-4], rate=1e-6, settle=False)
    assert done.results.of("probes")["circle", at].identical(whole)


def test_a_unit_is_what_the_library_gives(done):
    """The state in the store is that of the same calls in one process, to the bit."""
    (recipe,) = done.results.study.specimen
    speed = recipe.loading.speed()
    radii = (recipe.radius_min_m, recipe.radius_max_m)
    sample = rd.dem.pack(120, radii, 200e3, seed=2, law=recipe.contact.law(), speed=speed)
    assert sample.save().checksum == done.results.sample(SampleId("paper", "seed", 2)).save().checksum
    sample.load(rd.paths.drained_triaxial(0.01, until_eta=0.1, lateral_stress=200e3), speed=speed)
    rd.dem.bring_to_rest(sample, "stress", speed)
    assert sample.save().checksum == done.results.state(next(iter(done.results.plan.states))).save().checksum


def kept(folder):
    return {path: path.stat().st_mtime_ns for path in (folder / "units").rglob("*.h5")}


def test_a_second_run_finds_everything(done):
    """No unit and no table is written again."""
    folder = done.results.store.folder
    before = kept(folder) | {path: path.stat().st_mtime_ns for path in (folder / "paper_seed_2").iterdir()}
    assert run_study(tiny(), folder, only=of_figures("fig3")).outcome.made == 0
    after = kept(folder) | {path: path.stat().st_mtime_ns for path in (folder / "paper_seed_2").iterdir()}
    assert after == before


def test_a_lost_product_is_written_again_from_its_units(done):
    """Tables are copies of what the units hold."""
    path = done.results.store.folder / "paper_seed_2" / "probes_circle_eta_0.100.nc"
    before = read_dataset(path)
    path.unlink()
    assert run_study(tiny(), done.results.store.folder, only=of_figures("fig3")).outcome.made == 0
    assert read_dataset(path).identical(before)


def test_only_what_the_figures_need(tmp_path, done):
    """Without Figs. 1 and 2 the compression does not go on to the end."""
    plan = plan_of(tiny())
    for key in plan.units:
        if key not in {end.key for end in plan.ends.values()}:
            target = tmp_path / "units" / key[:2] / f"{key}.h5"
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(done.results.store.file(key).read_bytes())
    report = run_study(tiny(), tmp_path, only=of_figures("fig3", "fig4"))
    assert report.outcome.made == 0
    assert not (tmp_path / "paper_seed_2" / "curve_end.nc").exists()
    wanted = results_in(tmp_path).wanted
    assert not {end.key for end in plan.ends.values()} & set(wanted)
    assert {unit.kind for unit in wanted.values()} == {"packing", "state", "probes"}


@pytest.mark.parametrize(
    ("changes", "anew"),
    [
        (
            {
                "probes": [
                    {
                        "name": "circle",
                        "step_deg": 30.0,
                        "norms": (5e-5, 1e-4),
                        "rate": 9.803921569e-07,
                        "settle": False,
                    }
                ]
            },
            {"probes"},
        ),
        (
            {
                "probes": [
                    {"name": "other_name", "step_deg": 30.0, "norms": (5e-5, 1e-4), "rate": 1e-06, "settle": False}
                ]
            },
            set(),
        ),
        ({"axial_strain": 0.011}, {"state", "probes"}),
        ({"seed": 3}, {"packing", "state", "probes"}),
        ({"contact": {"friction": 0.6}}, {"packing", "state", "probes"}),
        ({"title": "another"}, set()),
        ({"eta": (0.1, 0.2)}, {"state", "probes"}),
    ],
)
def test_a_change_reaches_what_depends_on_it(changes, anew):
    """Only the units that a changed input leads to have other hashes; a longer path keeps its beginning."""
    before, after = plan_of(tiny()).units, plan_of(tiny(**changes)).units
    assert {unit.kind for key, unit in after.items() if key not in before} == anew
    if "eta" in changes:
        assert sum(unit.kind == "state" for key, unit in after.items() if key in before) == 1


def test_hashes_do_not_depend_on_the_process(done):
    """They are of the inputs alone: the same here and where the units were made."""
    for key in plan_of(tiny()).units:
        head = json.loads(done.results.store.file(key).read_bytes().split(b'"parts"')[0].rstrip(b", ") + b"}")
        assert head["key"] == key


def test_a_stress_ratio_out_of_reach_is_told(tmp_path):
    """What spheres do not reach within the strain given fails with the largest ratio seen; the rest is done."""
    study = tiny(eta=(0.05, 2.0), axial_strain=2e-3)
    report = run_study(study, tmp_path)
    ((unit, error),) = report.outcome.failed.items()
    assert unit.kind == "state"
    assert re.search(r"eta = 2 was not reached within 0.002 of axial strain \(the largest was", error)
    assert {each.kind for each in report.outcome.blocked} == {"probes", "state"}
    assert (tmp_path / "paper_seed_2" / "state_eta_0.050.h5").exists()

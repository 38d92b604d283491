"""What is left of clustering after three controls, and how often something is left by chance."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import rendulic as rd
from rendulic.foundation.errors import InvalidInput
from rendulic.probing.anatomy_controls import CONTROLS

TRIALS = 400
ERROR = 3.0 * np.sqrt(0.05 * 0.95 / TRIALS)  # three standard deviations


def probes(random, *, studied=0.0, everywhere=0.05, spread=0.02, w2n=-0.3, directions=24):
    """Probes of one packing whose index is normal about `everywhere`, and larger by `studied` at 120 degrees."""
    alpha = np.arange(directions) * 360.0 / directions
    at = directions // 3
    index = everywhere + spread * random.normal(size=(directions, 2))
    index[at, 0] += studied
    values = np.linspace(0.5, 1.0, directions)
    values[at] = w2n
    chance = np.array([-1.65, 0.0, 1.65]) * spread
    return xr.Dataset(
        {
            "w2_normalised": ("alpha", values),
            "is_significant": ("alpha", np.ones(directions, dtype=bool)),
            "carriers": ("alpha", np.full(directions, 0.03)),
            "beyond_index": (("alpha", "sign"), index),
            "beyond_kept": (("alpha", "bound"), np.tile(everywhere + chance, (directions, 1))),
            "beyond_signs": (("alpha", "bound"), np.tile(np.sqrt(2.0) * chance, (directions, 1))),
        },
        {"alpha": alpha},
    )


@pytest.mark.parametrize("packings", [1, 4])
def test_each_control_is_passed_by_chance_in_one_of_twenty(packings):
    """Carriers cluster everywhere alike, at 120 degrees too: nothing is left."""
    random = np.random.default_rng(packings)
    found = [rd.cluster_controls([probes(random) for _ in range(packings)]) for _ in range(TRIALS)]
    passed = np.mean([one.low > 0.0 for one in found], axis=0)
    assert np.abs(passed - 0.05).max() < ERROR
    assert np.mean([one.is_clustered for one in found]) <= 0.05


def test_several_packings_show_what_one_does_not():
    random = np.random.default_rng(9)
    one, eight = (
        np.mean(
            [rd.cluster_controls([probes(random, studied=0.04) for _ in range(n)]).is_clustered for _ in range(100)]
        )
        for n in (1, 8)
    )
    assert one < 0.5
    assert eight > 0.85


def test_what_is_left_is_what_the_strongest_control_leaves():
    data = probes(np.random.default_rng(0), studied=0.2, spread=1e-3)
    found = rd.cluster_controls(data)
    assert found.is_clustered
    assert found.left == (found.difference[found.least], found.low[found.least], found.high[found.least])
    assert found.left[0] == pytest.approx(0.2, abs=0.01)
    assert "cluster more than all three controls" in found.verdict
    # positive carriers that cluster as much leave nothing, whatever the other controls say
    index = data.beyond_index.values.copy()
    index[8, 1] = index[8, 0]
    other = rd.cluster_controls(data.assign(beyond_index=(("alpha", "sign"), index)))
    assert not other.is_clustered
    assert CONTROLS[other.least] == "positive carriers"
    assert "No clustering of negative work is shown beyond the control by positive carriers" in other.verdict
    assert "at most 5 % of cases" in other.verdict


def test_a_stable_direction_with_few_carriers_is_no_control():
    data = probes(np.random.default_rng(0), studied=0.0)
    few = np.where(np.arange(24) % 2 == 1, 0.01, 0.03)
    assert rd.cluster_controls(data.assign(carriers=("alpha", few))).n_stable.tolist() == [11]
    unsure = np.arange(24) % 3 == 2
    unsure[8] = True
    for name in ("is_significant", "is_settled"):
        assert rd.cluster_controls(data.assign({name: ("alpha", unsure)})).n_stable.tolist() == [7]


def test_packings_without_an_unstable_direction_are_left_out_unless_none_has_one():
    random = np.random.default_rng(3)
    stable, unstable = probes(random, w2n=0.2), probes(random)
    assert len(rd.cluster_controls([stable, unstable, unstable]).alpha) == 2
    of_all = rd.cluster_controls([stable, stable])
    assert len(of_all.alpha) == 2
    assert not of_all.is_unstable
    assert "no direction is unstable" in of_all.verdict
    assert rd.cluster_controls(stable, alpha=480.0).alpha.tolist() == [120.0]


def test_a_missing_control_is_named():
    alone = probes(np.random.default_rng(1)).isel(alpha=[8])
    found = rd.cluster_controls(alone)
    assert found.least is None
    assert np.isnan(found.left).all()
    assert not found.is_clustered
    assert (
        found.verdict == "Whether carriers of negative work cluster is undetermined: no control by stable directions."
    )


def test_what_is_no_anatomy_is_refused(sheared):
    data = probes(np.random.default_rng(1))
    with pytest.raises(InvalidInput, match="at one norm"):
        rd.cluster_controls(data.drop_vars("beyond_index"))
    with pytest.raises(InvalidInput, match="at one norm"):
        rd.cluster_controls(data.expand_dims("norm"))
    with pytest.raises(InvalidInput, match="no probes"):
        rd.cluster_controls([])
    with pytest.raises(InvalidInput, match="alpha = 7 was not probed"):
        rd.cluster_controls(data, alpha=7.0)


def test_probes_of_grains_have_all_that_is_needed(sheared):
    found = rd.cluster_controls(
        rd.probe(sheared, rd.directions.rendulic(60), 2e-4, rate=1e-6, settle=False, anatomy=True)
    )
    assert len(found.difference) == 3
    on_sphere = rd.cluster_controls(
        rd.probe(sheared, rd.directions.sphere(12), 2e-4, rate=1e-6, settle=False, anatomy=True)
    )
    assert np.isnan(on_sphere.alpha).all()
    assert "verdict" in found._repr_html_()


def test_a_study_says_what_is_left_over_all_packings_of_a_specimen(reported_study):
    """Its probes were too fast for any sign: then there is no stable direction, and the view says so."""
    from rendulic.figures.draw import draw
    from rendulic.report.draw import drawn
    from rendulic.study.execution.campaign import results_in
    from rendulic.views.catalogue import catalogue

    views = catalogue()["anatomy"].views(results_in(reported_study))
    view = views["anatomy_controls"]
    assert [row[:2] for row in view.tables[0].rows] == [("η = 0.1", "1"), ("η = 0.25", "1")]
    assert [row[-1] for row in view.tables[0].rows] == ["undetermined"] * 2
    assert (
        "η = 0.25: Whether carriers of negative work cluster is undetermined: no control by stable directions."
        in view.verdict
    )
    assert len(draw(view).axes) == 2
    (figure, _) = drawn("anatomy", {"": view})
    assert {trace["name"] for trace in figure.data()["families"][0]["frames"][0]["data"]} >= {
        "direction studied",
        *CONTROLS,
    }


def test_a_probe_says_in_a_sentence_what_it_can(sheared):
    from rendulic.tensors.rendulic_plane import increment_along
    from rendulic.views.anatomy import anatomy

    before = sheared.snapshot()
    sheared.probe(increment_along(120.0, 2e-4), 500)
    found = rd.anatomy(before, sheared.snapshot())
    apart = found.assign(
        beyond_index=("sign", [0.5, 0.0]),
        beyond_kept=("bound", [-0.1, 0.0, 0.1]),
        beyond_signs=("bound", [-0.1, 0.0, 0.1]),
    )
    assert anatomy(apart).verdict.endswith(
        "they cluster, if stable directions of the same state do not as much (rd.cluster_controls)."
    )
    alike = apart.assign(beyond_index=("sign", [0.5, 0.5]))
    assert anatomy(alike).verdict.endswith("no clustering is shown beyond positive work.")
    neither = apart.assign(beyond_index=("sign", [0.05, 0.05]))
    assert anatomy(neither).verdict.endswith("no clustering is shown beyond shared displacements and positive work.")
    assert anatomy(rd.anatomy(before, before)).verdict.endswith("Whether these cluster is undetermined.")

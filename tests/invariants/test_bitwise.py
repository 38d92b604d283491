"""Reproducible to the bit: restoring, chunking, threads; probing leaves no trace."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import rendulic as rd
from naive import different_arrays

LIVELY = (30.0, -20.0, 0.0)  # strain rates in 1/s that move grains far enough for new neighbour lists


@pytest.mark.parametrize("through", ["memory", "file"])
@pytest.mark.parametrize("steps_before", [0, 37])
def test_a_restored_state_continues_bitwise(sheared, straining, tmp_path, through, steps_before):
    """From memory and from a file, in the middle of a list's life, across several rebuilds."""
    sheared.advance(steps_before, straining(LIVELY))
    state = sheared.save()
    kept = state if through == "memory" else rd.State.from_file(state.to_file(tmp_path / "state.h5"))
    sheared.advance(400, straining(LIVELY))
    assert sheared.n_rebuilds >= state.attributes["n_rebuilds"] + 2
    twin = rd.dem.Assembly.from_state(kept)
    twin.advance(400, straining(LIVELY))
    assert different_arrays(sheared.save(), twin.save()) == []
    assert sheared.save().attributes == twin.save().attributes


def test_restoring_in_place_forgets_what_came_after(sheared, straining):
    """An assembly that went on and came back is the one that never left."""
    state = sheared.save()
    sheared.advance(300, straining(LIVELY))
    assert "grains/row" in different_arrays(state, sheared.save())
    sheared.restore(state)
    assert sheared.save().checksum == state.checksum


def test_loading_repeats_itself_bitwise(sheared, fast):
    """The servo and the adaptive rate depend on the state alone."""
    ends = []
    for _ in range(2):
        twin = sheared.clone()
        curve = twin.load(rd.paths.drained_triaxial(until_strain=5e-4), speed=fast)
        ends.append((twin.save().checksum, curve))
    assert ends[0][0] == ends[1][0]
    xr.testing.assert_identical(ends[0][1], ends[1][1])


def test_chunks_do_not_matter(sheared, straining):
    """50 steps and 50 steps are 100 steps, to the bit, with a rebuild on the way."""
    twin = sheared.clone()
    drive = straining(LIVELY)
    twin.advance(100, drive)
    for part in (50, 1, 49):
        sheared.advance(part, drive)
    assert twin.n_rebuilds > 0
    assert different_arrays(sheared.save(), twin.save()) == []


def test_a_clone_shares_nothing(sheared, straining):
    """Stepping a clone leaves the original as it was."""
    before = sheared.save().checksum
    sheared.clone().advance(50, straining(LIVELY))
    assert sheared.save().checksum == before


def test_saved_arrays_are_copies(sheared, straining):
    """A state does not change when its specimen goes on."""
    state = sheared.save()
    before = state.checksum
    sheared.advance(50, straining(LIVELY))
    assert state.checksum == before


@pytest.mark.parametrize("kind", ["strain", "stress"])
def test_threads_do_not_matter(sheared, kind):
    """One, two and three workers give the same data set, to the bit and to the attribute."""
    norm = [2e-5, 1e-4] if kind == "strain" else [1e3, 5e3]
    results = [
        rd.probe(
            sheared,
            rd.directions.rendulic(step=72),
            norm=norm,
            rate=norm[0] / 60,
            settle=False,
            kind=kind,
            workers=workers,
        )
        for workers in (1, 2, 3)
    ]
    assert float(np.abs(results[0].w2_macro).max()) > 0
    xr.testing.assert_identical(results[0], results[1])
    xr.testing.assert_identical(results[0], results[2])


def test_probing_leaves_the_specimen_untouched(sheared):
    """Not a bit of the specimen changes, whatever the kind of probe."""
    before = sheared.save().checksum
    for kind, norm in (("strain", 1e-4), ("stress", 1e3)):
        rd.probe(sheared, rd.directions.rendulic(step=120), norm=norm, rate=norm / 50, settle=False, kind=kind)
        sheared.snapshot()
        sheared.energies()
        sheared.equilibrium()
    assert sheared.save().checksum == before


def test_a_sweep_passes_the_smaller_norm_as_a_probe_of_its_own(sheared):
    """Reading a long probe on its way equals the short probe at the same rate, to the bit."""
    alone = rd.probe(sheared, rd.directions.rendulic(step=120), norm=5e-5, rate=5e-07, settle=False)
    sweep = rd.probe(sheared, rd.directions.rendulic(step=120), norm=[5e-5, 1e-4], rate=5e-07, settle=False)
    np.testing.assert_array_equal(sweep.d_eps.sel(norm=5e-5), alone.d_eps)
    np.testing.assert_array_equal(sweep.d_sigma.sel(norm=5e-5), alone.d_sigma)

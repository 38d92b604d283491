"""States exported from a running Yade: what is read, what it weighs, and that it steps on (peer: the Yade on this machine)."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rendulic as rd
from rendulic.foundation.errors import InvalidInput

YADE = shutil.which("yade") or shutil.which("yade-batch")
SCRIPT = Path(__file__).with_name("yade_states.py")

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(YADE is None, reason="there is no Yade on this machine: apt-get install yade"),
]


@pytest.fixture(scope="module")
def states(tmp_path_factory):
    """Folder with the states that the script exports inside Yade."""
    folder = tmp_path_factory.mktemp("yade")
    rd.io.yade.exporter(folder / "yade_exporter.py")
    # Yade is a program of the system's Python and must not see the environment of the tests
    bare = {
        name: value for name, value in os.environ.items() if name not in ("VIRTUAL_ENV", "PYTHONPATH", "PYTHONHOME")
    }
    bare["PATH"] = os.defpath + ":" + str(Path(YADE).parent)
    done = subprocess.run(
        [YADE, "-x", "-n", "-j1", str(SCRIPT), str(folder)], capture_output=True, text=True, timeout=300, env=bare
    )
    assert (folder / "cell_after.npz").is_file(), done.stdout[-2000:] + done.stderr[-2000:]
    return folder


@pytest.mark.parametrize("name", ["walls", "cell"])
def test_identity_on_exported_states(states, name):
    """Boundary work equals contact and inertial work, to the rounding of some hundred terms, also of clumps in a cell."""
    before, after = (rd.io.read(states / f"{name}_{when}.npz") for when in ("before", "after"))
    work = rd.second_order_work(before, after)
    assert work.identity_residual < 1e-12
    # strained along rendulic's axis 1, which is z between the walls and y in the cell
    assert_allclose(work.d_eps, [5e-5, 0.0, 0.0], rtol=0, atol=5e-8)
    assert work.d_sigma[0] > 2.0 * abs(work.d_sigma[1]) > 0.0
    # Cauchy stress and logarithmic strain differ from forces and walls by sigma times strain over d_sigma: 1e-3 here
    assert work.boundary == pytest.approx(work.eulerian, rel=2e-3)


def test_stress_of_a_cell_is_that_of_yade(states):
    """What crosses the faces of the cell gives the stress that Yade sums over its contacts, branches of clumps included.

    Yade's sum holds the moments of grains out of balance, ours does not: 1e-4 of the stress at an unbalanced force of 1e-4.
    """
    after = rd.io.read(states / "cell_after.npz")
    assert_allclose(np.diag(after.wall_stress), np.loadtxt(states / "cell_stress.txt"), rtol=1e-4)
    assert after.is_periodic


@pytest.mark.parametrize(
    ("name", "of_the_engine"),
    [("walls", ("engine_walls", "balance_of_grains", "balance_of_moments", "law")), ("cell", ("engine_stress",))],
)
def test_audits_of_exported_states_pass(states, name, of_the_engine):
    """Forces on walls, resultants, moments and springs are Yade's own; in the cell, of clumps, its stress, to rounding."""
    found = rd.second_order_work(*(rd.io.read(states / f"{name}_{when}.npz") for when in ("before", "after"))).audits
    assert found.failed == {}
    for audit in of_the_engine:
        assert found[audit].residual < 1e-6, audit


def test_clumps_touch_once(states):
    """Clumps that touch at several points have one contact with the summed force; they are as many as Yade has."""
    with np.load(states / "cell_before.npz") as archive:
        pairs = np.sort(archive["contacts"][:, :2], axis=1)
        listed, n_clumps = len(pairs), len(archive["ids"])
    read = rd.io.read(states / "cell_before.npz")
    assert read.n_grains == n_clumps == 125
    assert len(np.unique(pairs, axis=0)) <= len(read.first) < listed


def test_an_exported_state_steps_on(states, say):
    """The same strain in as many steps: stress within 0.5 % of Yade's largest increment, grains within 1 %.

    The tolerance of the reference runs of 2 000 grains; law, friction and time step are the file's.
    """
    before, after = (rd.io.yade.read_snapshot(states / f"walls_{when}.npz") for when in ("before", "after"))
    sample = rd.io.yade.read(states / "walls_before.npz")
    assert_allclose(
        [sample.law.modulus, sample.law.tangential_ratio, sample.law.friction], [356e6, 0.42, 0.5], rtol=1e-9
    )
    start, stress = sample.grains.position.copy(), np.diag(sample.stress).copy()
    sample.probe(np.log(before.lengths / after.lengths), 3000)
    of_yade = np.diag(after.wall_stress) - np.diag(before.wall_stress)
    own = np.diag(sample.stress) - stress
    assert_allclose(own, of_yade, rtol=0, atol=5e-3 * np.abs(of_yade).max())
    moved = after.position - before.position
    apart = np.linalg.norm(sample.grains.position - start - moved, axis=1)
    error, size = np.abs(own - of_yade).max() / np.abs(of_yade).max(), np.median(np.linalg.norm(moved, axis=1))
    say(
        f"Yade, an exported state steps on: stress off by {error:.1e}, median displacement by {np.median(apart) / size:.1e}"
    )
    assert np.median(apart) < 1e-2 * np.median(np.linalg.norm(moved, axis=1))


def test_only_spheres_between_walls_step_on(states):
    """A periodic state is for analysis, and the refusal says so."""
    with pytest.raises(InvalidInput, match="is periodic, and only specimens between walls step on: read_snapshot"):
        rd.io.yade.read(states / "cell_before.npz")

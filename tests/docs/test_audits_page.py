"""The tables of the page on audits are what is computed: which faults are noticed, in which form of data, how small."""

from __future__ import annotations

import pytest

import corruptions
import rendulic as rd

pytestmark = pytest.mark.skipif(
    not corruptions.REFERENCE.is_dir(), reason="the tables have columns of Yade's reference files, and there are none"
)
RENEW = "the page is not what is computed: run python tests/corruptions.py, and read what has changed"
# nothing in these data can tell: see the page
HIDDEN = {
    (what, form, True)
    for what in ("forces ten times as large", "forces in kilonewtons")
    for form in ("plain text, least", "LAMMPS", "any shape", "Yade, by hand")
} | {
    ("a wall moved by 1e-4 of the box", "any shape", True),
    ("contacts of the other state (step)", "any shape", True),
}  # fmt: skip


@pytest.fixture(scope="module")
def found(sheared_state, tmp_path_factory):
    states = corruptions.states_of(rd.dem.Assembly.from_state(sheared_state))
    return corruptions.outcomes(states, tmp_path_factory.mktemp("corruptions"))


def test_all_but_the_hidden_faults_are_noticed(found):
    """Thirteen faults in nine forms of data, of one state and of both: noticed, but where the data have no means."""
    assert {key for key, one in found.items() if not corruptions.is_caught(one)} == HIDDEN
    assert len(found) == 13 * 9 * 2


def test_each_form_passes_when_nothing_is_wrong(sheared_state, tmp_path):
    states = corruptions.states_of(rd.dem.Assembly.from_state(sheared_state))
    for k, (form, (pair, write)) in enumerate(corruptions.sources(states).items()):
        clean = corruptions.outcome(pair, write, lambda one, other: one, True, tmp_path / str(k))
        assert clean != "refused", form
        assert clean.failed == {}, form


def test_the_table_of_corruptions_is_on_the_page(found):
    assert corruptions.on_page("corruptions") == corruptions.table(found), RENEW


def test_the_table_of_power_is_on_the_page():
    assert corruptions.on_page("power") == corruptions.power(), RENEW


def test_the_list_of_audits_is_on_the_page():
    assert corruptions.on_page("audits") == corruptions.listed(), RENEW

"""Periodic boxes: the identity, the stress, and positions that jump across a face."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import rendulic as rd
from rendulic.foundation.errors import InvalidInput
from rendulic.micro import contact_work, love_weber_stress


def made_up(seed=0, n=40, n_contacts=120, periodic=(True, True, True)):
    """Two snapshots of one specimen with random forces: the identity is algebra, no mechanics is needed."""
    random = np.random.default_rng(seed)
    box = np.array([-0.1, 1.0, 0.2, 1.1, 0.0, 0.8])
    snapshots = []
    position = box[0::2] + random.random((n, 3)) * (box[1::2] - box[0::2])
    radius = random.uniform(0.05, 0.1, n)
    for step in range(2):
        wall_position = box + step * 1e-3 * random.standard_normal(6)
        first, second = random.integers(0, n, (2, n_contacts))
        image = random.integers(-1, 2, (n_contacts, 3)) * np.array(periodic)
        walls = [2 * axis + side for axis in range(3) if not periodic[axis] for side in range(2)]
        on_wall = np.arange(n_contacts) < 10 * bool(walls)
        second = np.where(on_wall, n + random.choice(walls or [0], n_contacts), second)
        image[on_wall] = 0
        kept = (first != second) | image.any(axis=1)
        pairs = np.column_stack((np.minimum(first, second), np.maximum(first, second)))
        kept &= np.isin(np.arange(n_contacts), np.unique(pairs, axis=0, return_index=True)[1])
        first, second, image = first[kept], second[kept], image[kept]
        normal = random.standard_normal((len(first), 3))
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        snapshots.append(
            rd.Snapshot(
                position + step * 1e-3 * random.standard_normal((n, 3)), radius, wall_position, first, second, normal,
                random.random(len(first)), 0.2 * random.standard_normal((len(first), 3)), 0.5, image,
            )
        )  # fmt: skip
    return snapshots


@pytest.mark.parametrize("periodic", [(True, True, True), (True, False, True), (False, False, False)])
def test_the_identity_holds_for_any_box(periodic):
    work = rd.second_order_work(*made_up(periodic=periodic))
    assert work.identity_residual < 1e-15
    assert abs(work.contacts) > 1e-9


def test_a_jump_across_a_face_changes_nothing():
    before, after = made_up(3)
    cells = np.random.default_rng(1).integers(-1, 2, (after.n_grains, 3))
    jumped = replace(
        after,
        position=after.position + cells * after.lengths,
        image=after.image - cells[after.second] + cells[after.first],
    )
    assert np.allclose(jumped.branch, after.branch, rtol=0, atol=1e-14)
    one, other = rd.second_order_work(before, after), rd.second_order_work(before, jumped)
    for name in ("boundary", "contacts", "grains", "paper"):
        assert getattr(other, name) == pytest.approx(getattr(one, name), rel=1e-12), name
    assert other.identity_residual < 1e-15


def test_pairs_across_different_faces_are_different_contacts():
    before, after = made_up(4)
    twice = replace(
        before, first=np.array([0, 0, 1, 1]), second=np.array([1, 1, 0, 1]), normal=before.normal[:4],
        force_n=before.force_n[:4], force_t=before.force_t[:4],
        image=np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]),
    )  # fmt: skip
    assert len(contact_work(twice, after).work) >= 4
    # the same contact from its other end: 1 to 0, one cell the other way
    again = replace(twice, image=np.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 0, 1]]))
    with pytest.raises(InvalidInput, match="twice"):
        contact_work(again, after)


def test_stress_of_a_column_through_a_periodic_face():
    """Two grains that touch each other and, across the face, their images: a closed column under 3 N."""
    force = 3.0
    column = rd.Snapshot(
        position=np.array([[0.25, 0.5, 0.5], [0.75, 0.5, 0.5]]), radius=np.array([0.25, 0.25]),
        wall_position=np.array([0.0, 1.0, 0.0, 2.0, 0.0, 1.0]), first=np.array([0, 1]), second=np.array([1, 0]),
        normal=np.array([[1.0, 0, 0], [1.0, 0, 0]]), force_n=np.array([force, force]), force_t=np.zeros((2, 3)),
        image=np.array([[0, 0, 0], [1, 0, 0]]),
    )  # fmt: skip
    assert np.array_equal(column.wall_stress, np.diag([force / 2.0, 0.0, 0.0]))
    assert np.allclose(love_weber_stress(column), column.wall_stress, rtol=1e-15, atol=0)
    assert not column.resultant.any()


def test_boxes_of_different_kinds_are_refused():
    before, after = made_up(5)
    with pytest.raises(InvalidInput, match="same kind of box"):
        rd.second_order_work(before, replace(after, image=None))

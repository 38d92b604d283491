"""Specimens without mechanics: they answer increments as a test tells them to.

Whoever probes needs nothing of a specimen but the protocol; what it finds can then be held against what was put in.
"""

from __future__ import annotations

import numpy as np

import rendulic as rd
from rendulic.tensors.rendulic_plane import direction_of, increment_along

FRAME = increment_along(np.array([0.0, 90.0]))  # unit increments along the two axes of the Rendulic plane


class Answering:
    """A specimen that answers increments as it is told, drifts in what is not imposed, and counts its probes.

    Parameters
    ----------
    answer, inverse : callables
        From an increment of strain to that of stress, and the other way round; the same one if there is no `inverse`.
    drift : (3,) array
        Added to every answer, also to that of nothing.
    eps, sigma : (3,) arrays
        Principal strains and stresses at the beginning.
    """

    def __init__(self, answer, inverse=None, drift=(0.0, 0.0, 0.0), eps=(0.0, 0.0, 0.0), sigma=(0.0, 0.0, 0.0)):
        self.answers = {"strain": answer, "stress": inverse or answer}
        self.drift = np.array(drift)
        self.eps, self.sigma = np.array(eps, dtype=float), np.array(sigma, dtype=float)
        self.count = [0]  # of its own probes and of those of its clones

    @property
    def stress(self):
        return np.diag(self.sigma)

    @property
    def strain(self):
        return np.diag(self.eps)

    def load(self, path, **options):
        raise AssertionError("a probe never follows a path")

    def probe(self, increment, n_steps, *, kind="strain", marks=(1.0,), on_mark=None):
        self.count[0] += 1
        imposed, answered = (self.eps, self.sigma) if kind == "strain" else (self.sigma, self.eps)
        whole, answer = np.array(increment), self.answers[kind](increment) + self.drift
        start, before = imposed.copy(), answered.copy()
        for mark in marks:
            imposed[:], answered[:] = start + mark * whole, before + mark * answer
            on_mark(mark)

    def save(self):
        return rd.State("Answering", {"eps": self.eps.copy(), "sigma": self.sigma.copy()}, {})

    def restore(self, state):
        raise AssertionError("the specimen itself is never changed")

    def clone(self):
        other = Answering(self.answers["strain"], self.answers["stress"], self.drift, self.eps, self.sigma)
        other.count = self.count
        return other


def working(work, **options):
    """A specimen whose answer to direction alpha has `work(alpha)` along it and as much as 1 across.

    Its normalised second-order work is `w / sqrt(w^2 + 1)`: negative where w is.
    """

    def answer(increment):
        alpha = float(direction_of(increment))
        return np.linalg.norm(increment) * (work(alpha) * increment_along(alpha) + increment_along(alpha + 90.0))

    return Answering(answer, **options)


def constant(along, **options):
    """The same W2n in all directions."""
    return working(lambda _alpha: along, **options)


def single(middle=130.0, half=30.0, **options):
    """Unstable less than `half` degrees from `middle` only: `cos(half) - cos(alpha - middle)` along, 1 across."""
    return working(lambda alpha: np.cos(np.radians(half)) - np.cos(np.radians(alpha - middle)), **options)


def linear(middle, half, twist=0.0, **options):
    """Unstable less than `half` degrees from `middle` and from its opposite.

    In the plane `W2 = cos(2 half) - cos(2 (alpha - middle))` of the symmetric part of the matrix; `twist` is its
    antisymmetric part. With less than 1 or so of it the determinant is negative: answers turn clockwise.
    """
    turn, mean = np.radians(2.0 * middle), np.cos(np.radians(2.0 * half))
    plane = [[mean - np.cos(turn), -np.sin(turn) - twist], [-np.sin(turn) + twist, mean + np.cos(turn)]]
    return of_matrix(FRAME.T @ plane @ FRAME + np.eye(3) - FRAME.T @ FRAME, **options)


def of_matrix(matrix, **options):
    """A material with this (3, 3) stiffness."""
    return Answering(lambda d: matrix @ d, lambda d: np.linalg.solve(matrix, d), **options)

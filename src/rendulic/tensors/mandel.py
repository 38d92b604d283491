"""Symmetric tensors as vectors: 11, 22, 33, then 23, 13, 12 times sqrt(2).

The product of two such vectors is the double contraction of the tensors.
"""

from __future__ import annotations

import numpy as np

__all__ = ["ROOT2", "to_mandel", "to_tensor"]

ROOT2 = float(np.sqrt(2.0))
PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))


def to_mandel(tensor: np.ndarray) -> np.ndarray:
    """Mandel vector (..., 6) of symmetric tensors (..., 3, 3).

    >>> to_mandel(np.diag([3.0, 1.0, 1.0])).tolist()
    [3.0, 1.0, 1.0, 0.0, 0.0, 0.0]
    """
    return np.stack([tensor[..., i, j] * (1.0 if i == j else ROOT2) for i, j in PAIRS], axis=-1)


def to_tensor(vector: np.ndarray) -> np.ndarray:
    """Symmetric tensors (..., 3, 3) of Mandel vectors (..., 6)."""
    vector = np.asarray(vector)
    tensor = np.empty((*vector.shape[:-1], 3, 3))
    for k, (i, j) in enumerate(PAIRS):
        tensor[..., i, j] = tensor[..., j, i] = vector[..., k] / (1.0 if i == j else ROOT2)
    return tensor

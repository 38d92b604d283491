"""Invariants, and the Rendulic plane."""

from rendulic.tensors import invariants, rendulic_plane

__all__ = ["invariants", "rendulic_plane"]

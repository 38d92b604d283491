"""Invariants, the Rendulic plane, and quadrature over the sphere."""

from rendulic.tensors import invariants, rendulic_plane, sphere_rules

__all__ = ["invariants", "rendulic_plane", "sphere_rules"]

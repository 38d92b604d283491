"""How fast probes and pushes are made: a rate that belongs to the material, the same for every size of increment."""

from __future__ import annotations

__all__ = ["STRAIN_PER_STEP"]

# of grains, per time step; the paper's: 5e-5 in 5 000 steps
STRAIN_PER_STEP = 1e-8

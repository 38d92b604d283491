"""The contact law as kernels know it: names that `compiled.kernels_for` binds to the functions of a law.

`law_stiffness` stands for the law's `stiffness`, and so on. Without a law they refuse.
"""

from __future__ import annotations

from rendulic.foundation.compiling import unbound

__all__ = ["law_contact_force", "law_elastic_energy", "law_stiffness", "law_wall_stiffness"]

law_stiffness = law_wall_stiffness = law_contact_force = law_elastic_energy = unbound(
    "take the kernel from `kernels_for(law)` or `lane_kernels_for(law, width)`, which bind it to a contact law"
)

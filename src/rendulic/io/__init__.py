"""Other engines' files in, rendulic's results out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submodules={"lammps", "yade"},
    submod_attrs={
        "lab": ["read_triaxial", "read_triaxial_tests"],
        "plain_text": ["read_plain_text", "write_plain_text"],
        "reading": ["read", "read_assembly"],
        "snapshot": ["read_about", "read_snapshot", "write_snapshot"],
        "tables": ["read_dataset", "write_csv", "write_dataset"],
        "vtkhdf": ["write_vtkhdf"],
    },
)

if TYPE_CHECKING:
    from rendulic.io import lammps, yade
    from rendulic.io.lab import read_triaxial, read_triaxial_tests
    from rendulic.io.plain_text import read_plain_text, write_plain_text
    from rendulic.io.reading import read, read_assembly
    from rendulic.io.snapshot import read_about, read_snapshot, write_snapshot
    from rendulic.io.tables import read_dataset, write_csv, write_dataset
    from rendulic.io.vtkhdf import write_vtkhdf

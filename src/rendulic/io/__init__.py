"""Other engines' files in, rendulic's results out."""

from rendulic.io import lammps, yade
from rendulic.io.plain_text import read_plain_text, write_plain_text
from rendulic.io.read import read
from rendulic.io.snapshot import read_about, read_snapshot, write_snapshot

__all__ = [
    "lammps",
    "read",
    "read_about",
    "read_plain_text",
    "read_snapshot",
    "write_plain_text",
    "write_snapshot",
    "yade",
]

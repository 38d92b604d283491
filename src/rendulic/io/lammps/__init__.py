"""LAMMPS: dumps and data files in, and out as a data file with an input deck that continues the packing."""

from rendulic.io.lammps.data import read_data
from rendulic.io.lammps.deck import Continuation, write_deck
from rendulic.io.lammps.dump import read_snapshot

__all__ = ["Continuation", "read_data", "read_snapshot", "write_deck"]

"""LAMMPS: its dumps and data files in, and out as a data file with an input deck that continues the packing."""

from rendulic.io.lammps.dump import read_snapshot

__all__ = ["read_snapshot"]

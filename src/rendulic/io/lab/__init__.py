"""Triaxial tests of laboratories, as their files are: rows of a file, columns of quantities, legs, and what is implausible."""

from rendulic.io.lab.triaxial import read_triaxial, read_triaxial_tests

__all__ = ["read_triaxial", "read_triaxial_tests"]

"""Compiled kernels of the Chang-Hicher model (numba)."""

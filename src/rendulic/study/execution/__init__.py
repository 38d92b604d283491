"""Carrying out units: here, in processes, on a cluster."""

"""Probing a specimen, and the second-order work of an increment."""

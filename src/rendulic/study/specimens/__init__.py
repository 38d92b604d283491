"""Kinds of specimen in a study: one kind, one file; `union.py` lists them."""

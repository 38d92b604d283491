"""Kinds of work at the states of a study: one kind, one file, one class with its inputs, needs and run."""

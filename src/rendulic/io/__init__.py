"""Other engines' files in, rendulic's results out."""

from rendulic.io import yade

__all__ = ["yade"]

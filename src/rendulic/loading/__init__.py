"""What is controlled, along which path, in which directions."""

from rendulic.loading import directions, paths

__all__ = ["directions", "paths"]

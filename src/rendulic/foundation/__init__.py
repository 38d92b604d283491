"""What everything stands on: errors, checks, files, progress."""

from rendulic.foundation import errors

__all__ = ["errors"]

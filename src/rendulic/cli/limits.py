"""What the system does not allow, in a sentence that names the limit."""

from __future__ import annotations

import errno
from contextlib import suppress

__all__ = ["wanting"]

HANDLES, NO_PROCESS = (errno.EMFILE, errno.ENFILE), (errno.EAGAIN,)
# what the system's loader says of a library, and Python of a thread
NO_ROOM = ("failed to map segment", "cannot allocate memory", "can't start new thread", "unable to allocate")


def wanting(error: BaseException) -> str | None:
    """What there was too little of, if that is why an error came; None for any other.

    >>> wanting(MemoryError()).partition(":")[0].partition(" (")[0]
    'there is too little memory'
    >>> wanting(ValueError("no number")) is None
    True
    """
    met: BaseException | None = error
    while met is not None:
        number, said = getattr(met, "errno", None), str(met).lower()
        if isinstance(met, OSError) and number in HANDLES:
            return f"too few files may be open at once{_limit('RLIMIT_NOFILE', 'ulimit -n', 1)}: allow more"
        if isinstance(met, OSError) and number in NO_PROCESS:
            return f"no more processes may be started{_limit('RLIMIT_NPROC', 'ulimit -u', 1)}: allow more, or take fewer workers"
        if isinstance(met, MemoryError) or number == errno.ENOMEM or any(words in said for words in NO_ROOM):
            return (
                f"there is too little memory{_limit('RLIMIT_AS', 'ulimit -v', 1024, ' kB')}: allow more, or take fewer workers "
                "(--workers 1)"
            )
        met = met.__cause__ or met.__context__
    return None


def _limit(name: str, command: str, unit: int, of: str = "") -> str:
    """A limit of this process, in brackets; nothing where there is none."""
    with suppress(ImportError, AttributeError):
        import resource

        allowed = resource.getrlimit(getattr(resource, name))[0]
        if allowed not in (resource.RLIM_INFINITY, -1):
            return f" ({command} is {allowed // unit}{of})"
    return ""

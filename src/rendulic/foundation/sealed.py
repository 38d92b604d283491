"""Files that say by themselves whether they are whole: a block at the front holds a checksum of all other bytes.

HDF5 leaves a block free at the front of a file, 512 bytes or a power of two times that. Ours is JSON that begins with
the format, blanks, and the SHA-256 of all other bytes of the file. `head` shows it, any HDF5 tool opens what follows,
and a damaged file is noticed before the HDF5 library sees a byte of it.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from typing import Any

__all__ = ["SIGNATURE", "front_block", "is_sealed", "is_whole", "sealed", "text_of"]

SIGNATURE = b"\x89HDF\r\n\x1a\n"
SMALLEST_BLOCK, LARGEST_BLOCK = 512, 2**26
OURS = b'{"format": "rendulic'
DIGEST = 65  # characters at the end of the block: 64 hexadecimal digits and a line feed


def sealed(about: Mapping[str, Any], body: bytes, default: Callable[[Any], Any] | None = None) -> bytes:
    """The file of an HDF5 `body`, with a front block that says what it is; `about` begins with its `format`.

    Parameters
    ----------
    default : callable, optional
        Of `json.dumps`.
    """
    text = json.dumps(dict(about), default=default).encode()
    block = SMALLEST_BLOCK
    while block < len(text) + DIGEST:
        block *= 2
    text = text.ljust(block - DIGEST)
    return text + _digest(text, body) + body


def is_sealed(start: bytes) -> bool:
    """Whether a file that starts so has a front block of ours."""
    return start.startswith(OURS)


def front_block(data: bytes) -> int | None:
    """Where the HDF5 file in `data` begins; None if there is none."""
    block = 0
    while block < min(len(data), LARGEST_BLOCK):
        if data[block : block + len(SIGNATURE)] == SIGNATURE:
            return block
        block = 2 * block or SMALLEST_BLOCK
    return None


def is_whole(data: bytes, block: int) -> bool:
    """Whether the checksum in the front block is that of all other bytes."""
    end = block - DIGEST
    return end > 0 and data[end:block] == _digest(data[:end], memoryview(data)[block:])


def text_of(data: bytes, block: int) -> bytes:
    """The JSON in the front block."""
    return data[: block - DIGEST]


def _digest(text: bytes, body: bytes | memoryview) -> bytes:
    digest = hashlib.sha256(text)
    digest.update(body)
    return digest.hexdigest().encode() + b"\n"

"""A digest of what a message says, whatever bytes stand between its fields.

CDR aligns fields; serialisers leave what was in memory in the gaps, so that equal messages may differ as bytes.
"""

from __future__ import annotations

import hashlib
import struct
from typing import Any, Protocol


class _Digest(Protocol):
    def update(self, data: bytes | memoryview, /) -> None: ...


def message_digest(message: Any) -> str:
    """Return the SHA-256 of a message's fields in their order, in hexadecimal."""
    digest = hashlib.sha256()
    _add(digest, message)
    return digest.hexdigest()


def _add(digest: _Digest, value: Any) -> None:
    """Add a value: its kind and length, then its content, so that no two messages give the same stream."""
    if hasattr(value, "get_fields_and_field_types"):
        for name in value.get_fields_and_field_types():
            _add(digest, getattr(value, name))
    elif isinstance(value, str):
        data = value.encode()
        digest.update(b"s" + struct.pack("<Q", len(data)) + data)
    elif isinstance(value, bool):
        digest.update(b"1" if value else b"0")
    elif isinstance(value, int):
        digest.update(b"i" + value.to_bytes(9, "little", signed=True))
    elif isinstance(value, float):
        digest.update(b"f" + struct.pack("<d", value))
    elif isinstance(value, bytes):
        digest.update(b"b" + struct.pack("<Q", len(value)) + value)
    elif hasattr(value, "tobytes"):  # array.array and numpy arrays
        data = memoryview(value).cast("B")
        digest.update(b"a" + struct.pack("<Q", len(data)))
        digest.update(data)
    else:
        digest.update(b"l" + struct.pack("<Q", len(value)))
        for item in value:
            _add(digest, item)

"""What a bag's file says of its own content: SHA-256 by topic, to tell later whether a message was changed, lost or added.

The digest of a topic runs over its messages as they stand in the file: for each, log time and length as little-endian 64-bit integers,
then the CDR bytes.
"""

import hashlib
import json
import struct
from collections.abc import Mapping
from typing import NamedTuple

from scene_description import SceneSynthError

MANIFEST_NAME = "manifest.json"
SCHEMA = "scene_synth/manifest/1"

_MESSAGE = struct.Struct("<QQ")
_MAX_TOPICS = 10_000


class ManifestError(SceneSynthError):
    """A manifest that cannot be read; one line."""


class TopicDigest(NamedTuple):
    """How many messages a topic has in a file, and their SHA-256 in hexadecimal."""

    messages: int
    sha256: str


class ManifestBuilder:
    """Takes the messages of a file in their order; memory does not grow with them."""

    def __init__(self) -> None:
        self._digests: dict[str, hashlib._Hash] = {}
        self._counts: dict[str, int] = {}

    def add(self, topic: str, log_ns: int, data: bytes) -> None:
        """Take a message."""
        digest = self._digests.get(topic)
        if digest is None:
            digest = self._digests[topic] = hashlib.sha256()
            self._counts[topic] = 0
        digest.update(_MESSAGE.pack(log_ns, len(data)))
        digest.update(data)
        self._counts[topic] += 1

    def digests(self) -> dict[str, TopicDigest]:
        """Return topic -> digest of what was taken so far."""
        return {topic: TopicDigest(self._counts[topic], digest.hexdigest()) for topic, digest in sorted(self._digests.items())}

    def to_json(self) -> bytes:
        """Return the manifest as it is attached to a file."""
        topics = {topic: digest._asdict() for topic, digest in self.digests().items()}
        return json.dumps({"schema": SCHEMA, "topics": topics}, indent=1).encode()


def read_manifest(data: bytes) -> dict[str, TopicDigest]:
    """Read a manifest.

    Raises:
        ManifestError: it does not fit.
    """
    try:
        document = json.loads(data)
        topics = document["topics"]
        if document["schema"] != SCHEMA or not isinstance(topics, Mapping) or len(topics) > _MAX_TOPICS:
            raise ManifestError(f"{MANIFEST_NAME}: expected {SCHEMA}")
        return {str(topic): TopicDigest(int(entry["messages"]), str(entry["sha256"])) for topic, entry in topics.items()}
    except (ValueError, TypeError, LookupError, ArithmeticError, RecursionError) as error:
        raise ManifestError(f"{MANIFEST_NAME}: cannot be read ({' '.join(str(error).split())[:100]})") from None

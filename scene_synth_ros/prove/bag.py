"""A bag on disk, and whether its files hold what they say they hold: SHA-256 of each topic, as ``manifest.json`` in a file has it."""

import hashlib
import json
import struct
from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path

from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.indexed_bag import open_files
from scene_synth_ros.prove.verdict import Verdict, at_most

_SMALL = 4096
"""Bytes below which a copy takes less time than one more call."""


class ReadBag:
    """The messages of a bag; all of them are digested as they are read in one go.

    Raises:
        SceneSynthError: it cannot be read.
    """

    def __init__(self, path: Path, report: Callable[[str], None]) -> None:
        self._reader = BagReader(path)
        self._index = open_files(self._reader, report)
        self._digests: dict[Path, dict[str, tuple[int, hashlib._Hash]]] = {}

    @property
    def types(self) -> Mapping[str, str]:
        """Topic -> type."""
        return self._index.types

    def messages(self, topic: str, wanted: Collection[int] | None = None) -> Iterator[tuple[int, memoryview]]:
        """Yield log time and bytes of each message of a topic, or of those log times that are wanted."""
        return self._index.messages(topic, wanted)

    def all(self) -> Iterator[tuple[str, int, memoryview]]:
        """Yield topic, log time and bytes of every message, as they stand in the files.

        The digest runs over log time and length of each message, little-endian and 64 bits wide, and its bytes.
        """
        for path, messages in self._reader.messages_by_file():
            found = self._digests.setdefault(path, {})
            for message in messages:
                count, digest = found.get(message.topic) or (0, hashlib.sha256())
                head = struct.pack("<QQ", message.log_ns, len(message.data))
                if len(message.data) < _SMALL:
                    digest.update(head + message.data)
                else:
                    digest.update(head)
                    digest.update(message.data)
                found[message.topic] = count + 1, digest
                yield message.topic, message.log_ns, memoryview(message.data)

    def digests(self) -> Iterator[Verdict]:
        """Yield whether what was read of each file is what its manifest tells; nothing of files without one."""
        for path, manifest in self._reader.manifests():
            found = self._digests.get(path, {})
            said = {topic: (entry["messages"], entry["sha256"]) for topic, entry in json.loads(manifest)["topics"].items()}
            for topic in sorted({*said, *found}):
                count, digest = found.get(topic, (0, hashlib.sha256()))
                differs = said.get(topic) != (count, digest.hexdigest())
                yield at_most("digests", topic, f"whether it differs from the manifest of {path.name}", [float(differs)], 0.0)
        for fault in self._reader.faults:
            yield Verdict("digests", str(self._reader.path), False, 1.0, 0.0, "", 1, fault)

    def close(self) -> None:
        """Close its files."""
        self._reader.close()

"""Check that files hold what they say they hold: SHA-256 of each topic, as ``manifest.json`` in the file has it."""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Iterator
from pathlib import Path

from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.prove.verdict import Verdict, at_most


def digests(bag: Path) -> Iterator[Verdict]:
    """Yield whether the messages of each file are those that its manifest tells; nothing of files without one.

    The digest runs over log time and length of each message, little-endian and 64 bits wide, and its bytes.
    """
    with BagReader(bag) as reader:
        told = {path: json.loads(data) for path, data in reader.manifests()}
        for path, messages in reader.messages_by_file() if told else ():
            if path not in told:
                continue
            found: dict[str, tuple[int, hashlib._Hash]] = {}
            for message in messages:
                count, digest = found.get(message.topic) or (0, hashlib.sha256())
                digest.update(struct.pack("<QQ", message.log_ns, len(message.data)))
                digest.update(message.data)
                found[message.topic] = count + 1, digest
            said = {topic: (entry["messages"], entry["sha256"]) for topic, entry in told[path]["topics"].items()}
            for topic in sorted({*said, *found}):
                count, digest = found.get(topic, (0, hashlib.sha256()))
                differs = said.get(topic) != (count, digest.hexdigest())
                yield at_most("digests", topic, f"whether it differs from the manifest of {path.name}", [float(differs)], 0.0)
        for fault in reader.faults:
            yield Verdict("digests", str(bag), False, 1.0, 0.0, "", 1, fault)

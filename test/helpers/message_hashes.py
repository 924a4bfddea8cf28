"""Prints topic, stamp and SHA-256 of every message of a bag, but of those that tell of the machine; two bags of one seed print the same.

python test/helpers/message_hashes.py BAG
"""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path

from scene_synth_ros.bags.bag_reader import BagReader

OF_THE_MACHINE = ("/diagnostics", "/rosout", "/parameter_events")


def message_hashes(bag: Path) -> list[str]:
    """Return a line for each message, sorted."""
    with BagReader(bag) as reader:
        messages = [m for m in reader.messages() if not m.topic.endswith(OF_THE_MACHINE)]
        return sorted(f"{m.topic} {m.log_ns} {hashlib.sha256(m.data).hexdigest()}" for m in messages)


if __name__ == "__main__":
    sys.stdout.writelines(f"{line}\n" for line in message_hashes(Path(sys.argv[1])))

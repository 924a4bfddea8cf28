"""The manifest of a file that is being written, summed up beside the writing: hashing costs as much time as compressing."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

from scene_synth_ros.bags.bag_manifest import ManifestBuilder

_MAX_WAITING = 64


class BackgroundManifest:
    """A :class:`~scene_synth_ros.bags.bag_manifest.ManifestBuilder` with a thread of its own; ``add`` waits while that is behind."""

    def __init__(self) -> None:
        self._builder = ManifestBuilder()
        self._pool = ThreadPoolExecutor(1, "manifest")
        self._room = threading.BoundedSemaphore(_MAX_WAITING)

    def add(self, topic: str, log_ns: int, data: bytes) -> None:
        """Take a message."""
        self._room.acquire()
        self._pool.submit(self._take, topic, log_ns, data)

    def _take(self, topic: str, log_ns: int, data: bytes) -> None:
        try:
            self._builder.add(topic, log_ns, data)
        finally:
            self._room.release()

    def to_json(self) -> bytes:
        """Return the manifest of all messages taken so far, as it is attached to a file."""
        return self._pool.submit(self._builder.to_json).result()

    def close(self) -> None:
        """End the thread; harmless when repeated."""
        self._pool.shutdown(cancel_futures=True)

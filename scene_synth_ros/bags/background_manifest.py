"""The manifest of a file that is being written, summed up beside the writing: hashing costs as much time as compressing."""

from __future__ import annotations

from collections.abc import Sequence

from scene_synth_ros.bags.bag_manifest import ManifestBuilder
from scene_synth_ros.bags.bounded_thread import BoundedThread

_MAX_WAITING = 16
_JOB_BYTES, _JOB_MESSAGES = 2**20, 64
"""Messages are handed over so many bytes, or so many of them, at a time: a thread that is woken for each costs as much as a small hash."""


class BackgroundManifest:
    """A :class:`~scene_synth_ros.bags.bag_manifest.ManifestBuilder` with a thread of its own; ``add`` waits while that is behind.

    Threads: the thread that writes the file calls every method; the builder is used by the thread of this object only, whose first
    exception the next call raises again.
    """

    def __init__(self) -> None:
        self._builder = ManifestBuilder()
        self._pool = BoundedThread("manifest", _MAX_WAITING)
        self._fault: Exception | None = None
        self._job: list[tuple[str, int, bytes]] = []
        self._job_bytes = 0

    def add(self, topic: str, log_ns: int, data: bytes) -> None:
        """Take a message."""
        self._refuse_fault()
        self._job.append((topic, log_ns, data))
        self._job_bytes += len(data)
        if self._job_bytes >= _JOB_BYTES or len(self._job) >= _JOB_MESSAGES:
            self._hand_over()

    def _hand_over(self) -> None:
        job, self._job, self._job_bytes = self._job, [], 0
        self._pool.submit(self._take, job)

    def _take(self, messages: Sequence[tuple[str, int, bytes]]) -> None:
        try:
            for topic, log_ns, data in messages:
                self._builder.add(topic, log_ns, data)
        except Exception as error:  # kept for whoever writes the file
            self._fault = self._fault or error

    def to_json(self) -> bytes:
        """Return the manifest of all messages taken so far, as it is attached to a file."""
        self._hand_over()
        text = self._pool.submit(self._builder.to_json).result()
        self._refuse_fault()
        return text

    def close(self) -> None:
        """End the thread; harmless when repeated."""
        self._pool.shutdown(cancel_futures=True)

    def _refuse_fault(self) -> None:
        if self._fault is not None:
            raise self._fault

"""One MCAP file of a bag while it is written; it is called ``<name>.active`` until it is whole."""

import contextlib
import errno
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from scene_synth_ros.bags.bag_manifest import MANIFEST_NAME, ManifestBuilder
from scene_synth_ros.bags.bag_metadata import NO_TIME_NS, BagMetadata, FileInfo, TopicInfo, metadata_record
from scene_synth_ros.bags.bounded_thread import BoundedThread
from scene_synth_ros.bags.qos_metadata import qos_text
from scene_synth_ros.mcap.file import McapFile
from scene_synth_ros.messages.message_definitions import MessageDefinition

_UNSUPPORTED = (errno.EOPNOTSUPP, errno.EINVAL, errno.ENOSYS)


class DiskReserve:
    """A file without a name on the disk of a folder; releasing it, or the death of the process, frees its blocks.

    Args:
        name: what the file is called for the moment between its making and its unlinking; it must not exist.

    Raises:
        OSError: the space is not there.
    """

    def __init__(self, folder_fd: int, name: str, size: int) -> None:
        self._fd: int | None = os.open(name, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o600, dir_fd=folder_fd)
        self.size = 0
        try:
            os.unlink(name, dir_fd=folder_fd)
            self.grow(size)
        except OSError:
            self.release()
            raise

    def grow(self, size: int) -> None:
        """Enlarge the reserve to ``size`` bytes; on file systems that cannot reserve, nothing is held back.

        Raises:
            OSError: the space is not there; the reserve keeps its size.
        """
        if self._fd is None or size <= self.size:
            return
        try:
            os.posix_fallocate(self._fd, 0, size)
        except OSError as error:
            if error.errno not in _UNSUPPORTED:
                raise
        self.size = size

    def release(self) -> None:
        """Free the space; harmless if it is free already."""
        if self._fd is not None:
            os.close(self._fd)
            self._fd = None


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


ACTIVE_SUFFIX = ".active"

_MIN_RESERVE = 2**20
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


@dataclass(frozen=True, slots=True, kw_only=True)
class FileFormat:
    """How the files of a bag are written; the fields are the arguments of :class:`~scene_synth_ros.bags.bag_writer.BagWriter`."""

    metadata_version: int
    compression: str
    compression_level: int
    chunk_size: int


class BagFile:
    """One file of a bag: its ``.active`` name, its manifest, the disk space kept for its ending, which channel a topic has.

    Args:
        folder_fd: descriptor of the bag's folder; must stay open.
        name: final name of the file; neither it nor its active name may exist.

    Raises:
        OSError: from every method that writes; the file then ends after its last whole chunk and can be finished.
    """

    def __init__(self, folder_fd: int, name: str, form: FileFormat) -> None:
        self.name, self._folder_fd, self._form = name, folder_fd, form
        self._topics: dict[str, TopicInfo] = {}
        self._channel_ids: dict[str, int] = {}
        self._schema_ids: dict[str, int] = {}
        self._manifest: BackgroundManifest | None = BackgroundManifest()
        with contextlib.ExitStack() as undo:
            undo.callback(self.forget_manifest)
            self._reserve = DiskReserve(folder_fd, f".{name}.reserve", _MIN_RESERVE)
            undo.callback(self._reserve.release)
            self._file = open(self.active_name, "xb", buffering=0, opener=self._open_in_folder)
            undo.callback(self._remove)
            self._mcap = McapFile(self._file, chunk_size=form.chunk_size, compression=form.compression, level=form.compression_level)
            undo.pop_all()

    def _open_in_folder(self, name: str, flags: int) -> int:
        return os.open(name, flags, 0o644, dir_fd=self._folder_fd)

    @property
    def active_name(self) -> str:
        """Name of the file while it is unfinished."""
        return self.name + ACTIVE_SUFFIX

    @property
    def size(self) -> int:
        """Bytes on disk."""
        return self._mcap.size

    def discard(self) -> None:
        """Remove the unfinished file."""
        self.close()
        self._remove()

    def _remove(self) -> None:
        self._file.close()
        with contextlib.suppress(OSError):
            os.unlink(self.active_name, dir_fd=self._folder_fd)

    def add_topic(self, topic: TopicInfo, definition: MessageDefinition) -> None:
        """Add a channel, and the schema of its type where it is new."""
        if topic.type_name not in self._schema_ids:
            self._schema_ids[topic.type_name] = self._mcap.add_schema(topic.type_name, "ros2msg", definition.text.encode())
        qos = qos_text(topic.qos, self._form.metadata_version)
        metadata = {"offered_qos_profiles": qos, "topic_type_hash": topic.type_hash}
        self._channel_ids[topic.name] = self._mcap.add_channel(topic.name, self._schema_ids[topic.type_name], metadata)
        self._topics[topic.name] = topic

    def add_record(self, name: str, data: Mapping[str, str]) -> None:
        """Write the chunk in progress, then a metadata record."""
        self._mcap.add_metadata(name, data)

    def add_attachment(self, name: str, data: bytes) -> None:
        """Write the chunk in progress, then an attached file."""
        self._mcap.add_attachment(name, data)

    def write(self, topic: str, log_ns: int, publish_ns: int, data: bytes) -> None:
        """Add a message to the chunk in progress, which is written when it is full."""
        if self._manifest is not None:
            try:
                self._manifest.add(topic, log_ns, data)
            except Exception:  # of its thread; the file goes without a manifest, and whoever writes it hears why
                self.forget_manifest()
                raise
        self._mcap.add_message(self._channel_ids[topic], log_ns, publish_ns, data)
        if not self._mcap.waiting_messages:
            self._after_chunk()

    def flush(self) -> None:
        """Write and sync the chunk in progress."""
        self._mcap.write_chunk()
        self._mcap.sync()
        self._after_chunk()

    def counts(self) -> dict[str, int]:
        """Return topic -> messages on disk."""
        counts = self._mcap.counts()
        return {topic: counts[channel_id] for topic, channel_id in self._channel_ids.items()}

    def info(self) -> FileInfo:
        """Return what ``metadata.yaml`` says of the file."""
        start_ns, end_ns = self._mcap.time_range_ns() or (NO_TIME_NS, NO_TIME_NS)
        return FileInfo(name=self.name, start_ns=start_ns, duration_ns=end_ns - start_ns, message_count=sum(self.counts().values()))

    def metadata_record(self, custom_data: Mapping[str, str]) -> str:
        """Return the text of the metadata record ``rosbag2`` of this file alone."""
        counts = self.counts()
        topics = tuple(replace(topic, message_count=counts[topic.name]) for topic in self._topics.values())
        return metadata_record(
            BagMetadata(version=self._form.metadata_version, topics=topics, files=(self.info(),), custom_data=dict(custom_data))
        )

    def forget_manifest(self) -> None:
        """Leave the manifest out: what was taken is not what is in the file."""
        if self._manifest is not None:
            self._manifest.close()
        self._manifest = None

    def release_reserve(self) -> None:
        """Free the space that was kept for the ending."""
        self._reserve.release()

    def drop_last_chunk(self, error: OSError) -> bool:
        """Make room for the ending after a write was refused; return whether it is worth another try."""
        if error.errno not in _NO_SPACE or not self._mcap.time_range_ns():
            return False
        self.forget_manifest()
        self._mcap.drop_last_chunk()
        return True

    def finish(self, records: Mapping[str, Mapping[str, str]], attachments: Mapping[str, bytes], custom_data: Mapping[str, str]) -> None:
        """Write the ending; after an error it may be called again."""
        self.refuse_removed()

        def all_records() -> dict[str, Mapping[str, str]]:
            return {**records, "rosbag2": {"serialized_metadata": self.metadata_record(custom_data)}}

        def all_attachments() -> dict[str, bytes]:
            return {**attachments, **({MANIFEST_NAME: self._manifest.to_json()} if self._manifest is not None else {})}

        self._mcap.finish(all_records, all_attachments)

    def give_name(self) -> None:
        """Give the finished file its name."""
        os.rename(self.active_name, self.name, src_dir_fd=self._folder_fd, dst_dir_fd=self._folder_fd)

    def close(self) -> None:
        """Close the file, finished or not."""
        self.forget_manifest()
        self._reserve.release()
        if not self._file.closed:
            self._mcap.close()
        self._file.close()

    def refuse_removed(self) -> None:
        """Raise FileNotFoundError if somebody has removed the file."""
        if os.fstat(self._file.fileno()).st_nlink == 0:
            raise FileNotFoundError(None, "the file was removed while it was written")

    def _after_chunk(self) -> None:
        self.refuse_removed()
        needed = 2 * (self._mcap.tail_size + 4096 * len(self._topics))
        if needed > self._reserve.size:
            self._reserve.grow(2 * needed)

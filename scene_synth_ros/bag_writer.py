"""Writes a rosbag2 bag: a folder with one MCAP file and ``metadata.yaml``, as the recorder of ROS 2 Jazzy leaves it.

While it is written, the file is called ``<name>_0.mcap.active``; its real name means that it is whole.
"""

from __future__ import annotations

import contextlib
import errno
import os
import threading
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType

from scene_synth_ros.bag_metadata import (
    METADATA_NAME,
    NO_TIME_NS,
    WRITABLE_VERSIONS,
    BagMetadata,
    FileInfo,
    TopicInfo,
    metadata_file,
    metadata_record,
)
from scene_synth_ros.disk_reserve import DiskReserve
from scene_synth_ros.mcap_file import COMPRESSIONS, MAX_TIME_NS, McapFile
from scene_synth_ros.message_definitions import message_definition
from scene_synth_ros.qos_metadata import OfferedQos, RosQosProfile, offered_qos, qos_text

ACTIVE_SUFFIX = ".active"
DEFAULT_CHUNK_SIZE = 4 * 2**20

_MIN_RESERVE = 2**20
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class BagWriteError(RuntimeError):
    """A bag that cannot be begun, written or finished; one line: where, why, and what is safe."""


class BagWriter:
    """Writes messages that are already serialised.  Threads may share it; memory is bounded by one chunk and one message.

    Every chunk is synced to disk, so a killed process loses at most the chunk in progress.  When a chunk cannot be written (full disk,
    quota, failing device), it is cut off and the bag is finished at once with everything before it, from space reserved at the start;
    should even that not suffice, further chunks are given up until the ending fits.

    Args:
        directory: folder of the bag; must not exist, its parents are made.
        metadata_version: 9 (Jazzy) or 5 (Humble).
        compression: of chunks, ``zstd`` or ``none``.
        compression_level: zstd level.
        chunk_size: a chunk is written when its uncompressed records exceed this many bytes.
        custom_data: what ``custom_data`` of the metadata shall hold; may be extended until ``close``.

    Raises:
        BagWriteError: the folder exists or cannot be made.
        ValueError: an argument is out of range.
    """

    def __init__(
        self,
        directory: str | Path,
        *,
        metadata_version: int = 9,
        compression: str = "zstd",
        compression_level: int = 1,
        chunk_size: int = DEFAULT_CHUNK_SIZE,
        custom_data: Mapping[str, str] | None = None,
    ) -> None:
        if metadata_version not in WRITABLE_VERSIONS:
            raise ValueError(f"metadata_version: expected one of {WRITABLE_VERSIONS}, got {metadata_version}")
        if compression not in COMPRESSIONS:
            raise ValueError(f"compression: expected one of {COMPRESSIONS}, got '{compression}'")
        self.directory = Path(directory).absolute()
        self.custom_data: dict[str, str] = dict(custom_data or {})
        self._version = metadata_version
        self._topics: dict[str, TopicInfo] = {}
        self._channel_ids: dict[str, int] = {}
        self._schema_ids: dict[str, int] = {}
        self._accepted: dict[str, int] = {}
        self._lock = threading.Lock()
        self._closed = False
        self._failure = ""
        self._file_name = f"{self.directory.name}_0.mcap"
        self._make_folder()
        with contextlib.ExitStack() as undo:
            undo.callback(self._remove_folder)
            try:
                self._open_files(undo, chunk_size=chunk_size, compression=compression, level=compression_level)
            except OSError as error:
                raise BagWriteError(f"cannot begin bag {self.directory}: {error.strerror or error}") from None
            undo.pop_all()

    def _make_folder(self) -> None:
        try:
            self.directory.parent.mkdir(parents=True, exist_ok=True)
            self.directory.mkdir()
        except FileExistsError as error:
            raise BagWriteError(f"{error.filename or self.directory} exists; choose another name or remove it") from None
        except OSError as error:
            raise BagWriteError(f"cannot make bag folder {self.directory}: {error.strerror or error}") from None

    def _remove_folder(self) -> None:
        for name in (self._active_name, self._reserve_name):
            (self.directory / name).unlink(missing_ok=True)
        self.directory.rmdir()

    def _open_files(self, undo: contextlib.ExitStack, *, chunk_size: int, compression: str, level: int) -> None:
        self._folder_fd = os.open(self.directory, os.O_RDONLY | os.O_DIRECTORY)
        undo.callback(os.close, self._folder_fd)
        self._reserve = DiskReserve(self._folder_fd, self._reserve_name, _MIN_RESERVE)
        undo.callback(self._reserve.release)
        self._file = open(self._active_name, "xb", buffering=0, opener=self._open_in_folder)
        undo.callback(self._file.close)
        self._mcap = McapFile(self._file, chunk_size=chunk_size, compression=compression, level=level)
        for name, data in self._metadata_records().items():
            self._mcap.add_metadata(name, data)

    def _open_in_folder(self, name: str, flags: int) -> int:
        return os.open(name, flags, 0o644, dir_fd=self._folder_fd)

    @property
    def _active_name(self) -> str:
        return self._file_name + ACTIVE_SUFFIX

    @property
    def _reserve_name(self) -> str:
        return f".{self._file_name}.reserve"

    @property
    def closed(self) -> bool:
        """Whether the bag takes no more messages."""
        return self._closed

    @property
    def counts(self) -> dict[str, int]:
        """Topic -> messages taken so far; once closed, messages in the bag."""
        return self._saved_counts() if self._closed else dict(self._accepted)

    @property
    def size(self) -> int:
        """Bytes on disk."""
        return self._mcap.size

    def add_topic(self, name: str, type_name: str, qos_profiles: Sequence[OfferedQos | RosQosProfile] = ()) -> None:
        """Add a topic; adding it again with the same type changes nothing.

        Args:
            name: fully qualified topic.
            type_name: ``package/msg/Type``.
            qos_profiles: what its publishers offer, as :class:`OfferedQos` or ``rclpy.qos.QoSProfile``.

        Raises:
            MessageDefinitionError: the type is not installed.
            BagWriteError: the bag is closed.
            ValueError: the topic is known with another type.
        """
        known = self._topics.get(name)
        if known is not None and known.type_name != type_name:
            raise ValueError(f"topic {name}: expected type {known.type_name} as before, got {type_name}")
        definition = message_definition(type_name)
        offered = tuple(qos if isinstance(qos, OfferedQos) else offered_qos(qos) for qos in qos_profiles)
        metadata = {"offered_qos_profiles": qos_text(offered, self._version), "topic_type_hash": definition.type_hash}
        with self._lock:
            self._refuse_closed()
            if name in self._topics:
                return
            if type_name not in self._schema_ids:
                self._schema_ids[type_name] = self._mcap.add_schema(type_name, "ros2msg", definition.text.encode())
            self._channel_ids[name] = self._mcap.add_channel(name, self._schema_ids[type_name], metadata)
            self._accepted[name] = 0
            self._topics[name] = TopicInfo(name=name, type_name=type_name, type_hash=definition.type_hash, qos=offered)

    def write(self, topic: str, cdr: bytes | bytearray | memoryview, log_ns: int, publish_ns: int) -> None:
        """Take a serialised message.

        Args:
            topic: one that was added.
            cdr: the message with its encapsulation header; copied unless it is ``bytes``.
            log_ns: time of receipt; bags should have it never decrease.
            publish_ns: time of sending.

        Raises:
            BagWriteError: the disk refused a chunk (the bag is then closed and whole), or the bag is closed.
            ValueError: the topic was not added, or a time is out of range.
        """
        channel_id = self._channel_ids.get(topic)
        if channel_id is None:
            raise ValueError(f"topic {topic}: expected a topic that was added before, got one of {len(self._channel_ids)} others")
        if not (0 <= log_ns < MAX_TIME_NS and 0 <= publish_ns < MAX_TIME_NS):
            raise ValueError(f"topic {topic}: expected times from 0 to {MAX_TIME_NS} ns, got {log_ns} and {publish_ns}")
        data = cdr if isinstance(cdr, bytes) else bytes(cdr)
        with self._lock:
            self._refuse_closed()
            self._accepted[topic] += 1
            try:
                self._mcap.add_message(channel_id, log_ns, publish_ns, data)
                if not self._mcap.waiting_messages:
                    self._after_chunk()
            except OSError as error:
                self._give_up(error)

    def flush(self) -> None:
        """Write and sync the chunk in progress.

        Raises:
            BagWriteError: the disk refused it; the bag is then closed and whole.
        """
        with self._lock:
            self._refuse_closed()
            try:
                self._mcap.write_chunk()
                self._after_chunk()
            except OSError as error:
                self._give_up(error)

    def close(self) -> None:
        """Finish the bag; once it is closed, harmless.

        Raises:
            BagWriteError: the disk refused the ending; the message says what is saved.
        """
        with self._lock:
            if self._closed:
                return
            try:
                self._mcap.write_chunk()
            except OSError as error:
                self._give_up(error)
            self._closed = True
            self._finish("")
            if self._failure:
                raise BagWriteError(self._failure)

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _refuse_closed(self) -> None:
        if self._closed:
            raise BagWriteError(self._failure or f"bag {self.directory} is closed")

    def _refuse_removed(self) -> None:
        if os.fstat(self._file.fileno()).st_nlink == 0:
            raise FileNotFoundError(None, "the file was removed while it was written")

    def _after_chunk(self) -> None:
        self._refuse_removed()
        needed = 2 * (self._mcap.tail_size + 4096 * len(self._topics))
        if needed > self._reserve.size:
            self._reserve.grow(2 * needed)

    def _saved_counts(self) -> dict[str, int]:
        counts = self._mcap.counts()
        return {topic: counts[channel_id] for topic, channel_id in self._channel_ids.items()}

    def _metadata(self) -> BagMetadata:
        saved = self._saved_counts()
        start_ns, end_ns = self._mcap.time_range_ns() or (NO_TIME_NS, NO_TIME_NS)
        file = FileInfo(name=self._file_name, start_ns=start_ns, duration_ns=end_ns - start_ns, message_count=sum(saved.values()))
        topics = tuple(replace(topic, message_count=saved[topic.name]) for topic in self._topics.values())
        return BagMetadata(version=self._version, topics=topics, files=(file,), custom_data=dict(self.custom_data))

    def _metadata_records(self) -> dict[str, dict[str, str]]:
        return {"rosbag2": {"serialized_metadata": metadata_record(self._metadata())}}

    def _give_up(self, error: OSError) -> None:
        """Finish the bag after a chunk was refused, and say so.

        Raises:
            BagWriteError: always.
        """
        self._closed = True
        self._finish(f"cannot write {self.directory / self._active_name}: {error.strerror or error}")
        raise BagWriteError(self._failure) from None

    def _finish(self, failure: str) -> None:
        """Write the ending, giving up chunks while there is no room for it; ``_failure`` then says what is saved."""
        self._reserve.release()
        ending = ""
        try:
            while not ending:
                try:
                    self._write_ending()
                    ending = "the bag is whole"
                except OSError as error:
                    failure = failure or f"cannot finish {self.directory / self._active_name}: {error.strerror or error}"
                    if error.errno in _NO_SPACE and self._mcap.time_range_ns():
                        self._mcap.drop_last_chunk()
                    else:
                        ending = "the file stays unfinished, readable up to its last chunk,"
        finally:
            self._file.close()
            os.close(self._folder_fd)
        if failure:
            saved, taken = sum(self._saved_counts().values()), sum(self._accepted.values())
            self._failure = f"{failure}; {ending} with {saved} of {taken} messages ({self._mcap.size / 1e6:.1f} MB)"

    def _write_ending(self) -> None:
        self._refuse_removed()
        self._mcap.finish(self._metadata_records)
        self._write_metadata_file()
        os.rename(self._active_name, self._file_name, src_dir_fd=self._folder_fd, dst_dir_fd=self._folder_fd)
        os.fsync(self._folder_fd)

    def _write_metadata_file(self) -> None:
        text = metadata_file(self._metadata()).encode()
        name = METADATA_NAME + ACTIVE_SUFFIX
        flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC
        with open(name, "wb", opener=lambda path, _: self._open_in_folder(path, flags)) as file:
            file.write(text)
            file.flush()
            os.fdatasync(file.fileno())
        os.rename(name, METADATA_NAME, src_dir_fd=self._folder_fd, dst_dir_fd=self._folder_fd)

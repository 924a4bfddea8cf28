"""Writes a rosbag2 bag: a folder of MCAP files and ``metadata.yaml``, as the recorder of ROS 2 Jazzy leaves it.

While a file is written, it is called ``<name>_<n>.mcap.active``; its real name means that it is whole.
"""

import contextlib
import os
from collections import Counter, deque
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any

from scene_description import SceneSynthError
from scene_synth_ros.bags.bag_file import ACTIVE_SUFFIX, BagFile, FileFormat
from scene_synth_ros.bags.bag_metadata import METADATA_NAME, WRITABLE_VERSIONS, BagMetadata, FileInfo, TopicInfo, metadata_file
from scene_synth_ros.bags.qos_metadata import OfferedQos, RosQosProfile, offered_qos
from scene_synth_ros.mcap.file import COMPRESSIONS, MAX_LEVEL, MAX_TIME_NS
from scene_synth_ros.messages.message_definitions import MessageDefinition, message_definition

__all__ = ["ACTIVE_SUFFIX", "MAX_TIME_NS", "BagWriteError", "BagWriter"]

DEFAULT_CHUNK_SIZE = 4 * 2**20
_MAX_KEPT = 100


class BagWriteError(SceneSynthError):
    """A bag that cannot be begun, written or finished; one line: where, why, and what is safe."""


class BagWriter:
    """The folder of a bag: ``metadata.yaml``, what every file begins with, what is saved when the disk refuses.

    Messages come serialised; memory is bounded by one chunk and one message.

    Threads: one thread calls every method.  A file sums up its manifest and syncs its last chunk in threads of its own, which end with it.

    Every chunk is synced to disk, so a killed process loses at most the chunk in progress.  When a chunk cannot be written (full disk,
    quota, failing device), it is cut off and the bag is finished at once with everything before it, from space reserved at the start;
    should even that not suffice, further chunks are given up until the ending fits.

    Every file stands alone: it has all schemas and channels, the last messages of latched topics, the records and attachments that the bag
    was given, and a manifest (:mod:`scene_synth_ros.bags.bag_manifest`).  ``metadata.yaml`` lists all finished files.

    Args:
        directory: folder of the bag; must not exist, its parents are made.
        metadata_version: 9 (Jazzy) or 5 (Humble).
        compression: of chunks, ``zstd``, ``lz4`` or ``none``.
        compression_level: 1 to 22.
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
        if not 1 <= compression_level <= MAX_LEVEL:
            raise ValueError(f"compression_level: expected 1 to {MAX_LEVEL}, got {compression_level}")
        self.directory = Path(directory).absolute()
        self.custom_data: dict[str, str] = dict(custom_data or {})
        self._form = FileFormat(
            metadata_version=metadata_version, compression=compression, compression_level=compression_level, chunk_size=chunk_size
        )
        self._topics: dict[str, TopicInfo] = {}
        self._definitions: dict[str, MessageDefinition] = {}
        self._latched: dict[str, deque[tuple[int, bytes]]] = {}  # publish times (ns) and messages, for the files to come
        self._records: dict[str, Mapping[str, str]] = {}
        self._attachments: dict[str, bytes] = {}
        self._accepted: Counter[str] = Counter()
        self._repeated = 0
        self._done: list[tuple[FileInfo, dict[str, int]]] = []
        self._done_size = 0
        self._closed = False
        self._failure = ""
        self._make_folder()
        with contextlib.ExitStack() as undo:
            undo.callback(self.directory.rmdir)
            try:
                self._folder_fd = os.open(self.directory, os.O_RDONLY | os.O_DIRECTORY)
                undo.callback(os.close, self._folder_fd)
                self._file = self._open_file()
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

    def _open_file(self) -> BagFile:
        """Begin the next file with what is known: topics, records, attachments.

        Raises:
            OSError: it cannot be written; nothing of it is left.
        """
        file = BagFile(self._folder_fd, f"{self.directory.name}_{len(self._done)}.mcap", self._form)
        try:
            for name, topic in self._topics.items():
                file.add_topic(topic, self._definitions[name])
            file.add_record("rosbag2", {"serialized_metadata": file.metadata_record(self.custom_data)})
            for name, record in self._records.items():
                file.add_record(name, record)
            for name, data in self._attachments.items():
                file.add_attachment(name, data)
        except BaseException:
            file.discard()
            raise
        return file

    @property
    def closed(self) -> bool:
        """Whether the bag takes no more messages."""
        return self._closed

    @property
    def counts(self) -> dict[str, int]:
        """Topic -> messages taken so far; once closed, messages in the bag, repeated latched ones included."""
        return self._saved_counts() if self._closed else {name: self._accepted[name] for name in self._topics}

    @property
    def file_size(self) -> int:
        """Bytes on disk of the file in progress."""
        return self._file.size

    def add_topic(
        self,
        name: str,
        type_name: str,
        qos_profiles: Sequence[OfferedQos | RosQosProfile] = (),
        definition: MessageDefinition | None = None,
    ) -> None:
        """Add a topic; adding it again with the same type changes nothing.

        Args:
            name: fully qualified topic.
            type_name: ``package/msg/Type``.
            qos_profiles: what its publishers offer, as :class:`OfferedQos` or ``rclpy.qos.QoSProfile``.
            definition: of the type; None looks it up among the installed packages.

        Raises:
            MessageDefinitionError: the type is not installed.
            BagWriteError: the bag is closed.
            ValueError: the topic is known with another type.
        """
        known = self._topics.get(name)
        if known is not None and known.type_name != type_name:
            raise ValueError(f"topic {name}: expected type {known.type_name} as before, got {type_name}")
        definition = definition or message_definition(type_name)
        offered = tuple(qos if isinstance(qos, OfferedQos) else offered_qos(qos) for qos in qos_profiles)
        self._refuse_closed()
        if name in self._topics:
            return
        topic = TopicInfo(name=name, type_name=type_name, type_hash=definition.type_hash, qos=offered)
        self._file.add_topic(topic, definition)
        self._topics[name], self._definitions[name] = topic, definition
        if offered and all(qos.durability == "transient_local" for qos in offered):
            self._latched[name] = deque(maxlen=min(max(1, *(qos.depth for qos in offered)), _MAX_KEPT))

    def set_record(self, name: str, data: Mapping[str, str]) -> None:
        """Put a metadata record into this file, now and at its end, and into every later one; it replaces one of the same name.

        Raises:
            BagWriteError: the disk refused it, or the bag is closed.
        """
        self._keep(self._records, name, dict(data), self._file.add_record)

    def set_attachment(self, name: str, data: bytes) -> None:
        """Attach a file to this file of the bag, now, so that it is there should nobody close the bag, and to every later one.

        Raises:
            BagWriteError: the disk refused it, or the bag is closed.
        """
        self._keep(self._attachments, name, data, self._file.add_attachment)

    def _keep(self, kept: dict[str, Any], name: str, content: Any, add: Callable[[str, Any], None]) -> None:
        self._refuse_closed()
        if kept.get(name) != content:
            kept[name] = content
            with self._or_give_up():
                add(name, content)

    def write(self, topic: str, cdr: bytes | bytearray | memoryview, log_ns: int, publish_ns: int) -> None:
        """Write a serialised message.

        Args:
            topic: one that was added.
            cdr: the message with its encapsulation header; copied unless it is ``bytes``.
            log_ns: time of receipt; bags should have it never decrease.
            publish_ns: time of sending.

        Raises:
            BagWriteError: the disk refused a chunk (the bag is then closed and whole), or the bag is closed.
            ValueError: the topic was not added, or a time is out of range.
        """
        if topic not in self._topics:
            raise ValueError(f"topic {topic}: expected a topic that was added before, got one of {len(self._topics)} others")
        if not (0 <= log_ns < MAX_TIME_NS and 0 <= publish_ns < MAX_TIME_NS):
            raise ValueError(f"topic {topic}: expected times from 0 to {MAX_TIME_NS} ns, got {log_ns} and {publish_ns}")
        data = cdr if isinstance(cdr, bytes) else bytes(cdr)
        self._refuse_closed()
        self._accepted[topic] += 1
        if topic in self._latched:
            self._latched[topic].append((publish_ns, data))
        try:
            self._file.write(topic, log_ns, publish_ns, data)
        except OSError as error:
            self._give_up(error)

    @contextlib.contextmanager
    def _or_give_up(self) -> Iterator[None]:
        """Finish the bag where the disk refuses what is done meanwhile."""
        try:
            yield
        except OSError as error:
            self._give_up(error)

    def flush(self) -> None:
        """Write and sync the chunk in progress.

        Raises:
            BagWriteError: the disk refused it; the bag is then closed and whole.
        """
        self._refuse_closed()
        with self._or_give_up():
            self._file.flush()

    def split(self, log_ns: int, without: Collection[str] = ()) -> None:
        """Finish the file in progress and go on in a new one, which begins with the last messages of the latched topics.

        Args:
            log_ns: log time that the repeated messages get, that of the next message.
            without: topics that are not repeated, because their next message follows at once.

        Raises:
            BagWriteError: the disk refused it; the bag is then closed and whole.
        """
        self.flush()
        try:
            self._end_file()
        except OSError as error:
            self._file.drop_last_chunk(error)
            self._give_up(error)
        self._next_file()
        with self._or_give_up():
            for topic, messages in self._latched.items():
                for publish_ns, data in () if topic in without else messages:
                    self._file.write(topic, log_ns, publish_ns, data)
                    self._repeated += 1

    def _next_file(self) -> None:
        size = self._file.size
        try:
            self._file = self._open_file()
        except BaseException as error:
            self._closed = True
            os.close(self._folder_fd)
            reason = error.strerror if isinstance(error, OSError) else None
            self._failure = self._describe(f"cannot split bag {self.directory}: {reason or error}", "the bag is whole")
            if isinstance(error, OSError):
                raise BagWriteError(self._failure) from None
            raise
        self._done_size += size

    def close(self) -> None:
        """Finish the bag; once it is closed, harmless.

        Raises:
            BagWriteError: the disk refused the ending; the message says what is saved.
        """
        if self._closed:
            return
        self.flush()
        self._closed = True
        self._finish("")
        if self._failure:
            raise BagWriteError(self._failure)

    def discard(self) -> None:
        """Remove the bag instead of finishing it, for one that holds nothing: the file in progress, then the folder, if that is empty.

        Raises:
            BagWriteError: the bag is closed.
        """
        self._refuse_closed()
        self._closed = True
        try:
            self._file.discard()
        finally:
            os.close(self._folder_fd)
        with contextlib.suppress(OSError):  # files that were finished, or that somebody else has put there, stay
            self.directory.rmdir()

    def __enter__(self) -> "BagWriter":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _refuse_closed(self) -> None:
        if self._closed:
            raise BagWriteError(self._failure or f"bag {self.directory} is closed")

    def _saved_counts(self) -> dict[str, int]:
        total = Counter(dict.fromkeys(self._topics, 0))
        for _, counts in self._done:
            total.update(counts)
        return dict(total)

    def _metadata(self) -> BagMetadata:
        """Return what is to be said of the finished files."""
        saved = self._saved_counts()
        topics = tuple(replace(topic, message_count=saved[topic.name]) for topic in self._topics.values())
        files = tuple(info for info, _ in self._done)
        return BagMetadata(version=self._form.metadata_version, topics=topics, files=files, custom_data=dict(self.custom_data))

    def _end_file(self) -> None:
        """Write the ending of the file in progress and the metadata of the bag, and give the file its name.

        Raises:
            OSError: it could not be done; it may be tried again.
        """
        self._file.release_reserve()
        self._file.finish(self._records, self._attachments, self.custom_data)
        self._done.append((self._file.info(), self._file.counts()))
        try:
            self._write_metadata_file()
            self._file.give_name()
        except OSError:
            self._done.pop()
            raise
        os.fsync(self._folder_fd)
        self._file.close()

    def _give_up(self, error: OSError) -> None:
        """Finish the bag after a chunk was refused, and say so.

        Raises:
            BagWriteError: always.
        """
        self._closed = True
        self._file.forget_manifest()
        self._finish(f"cannot write {self.directory / self._file.active_name}: {error.strerror or error}")
        raise BagWriteError(self._failure) from None

    def _finish(self, failure: str) -> None:
        """Write the ending, giving up chunks while there is no room for it; ``_failure`` then says what is saved."""
        ending = ""
        try:
            while not ending:
                try:
                    self._end_file()
                    ending = "the bag is whole"
                except OSError as error:
                    failure = failure or f"cannot finish {self.directory / self._file.active_name}: {error.strerror or error}"
                    if not self._file.drop_last_chunk(error):
                        ending = "the file stays unfinished, readable up to its last chunk,"
                        self._done.append((self._file.info(), self._file.counts()))
        finally:
            self._file.close()
            os.close(self._folder_fd)
        if failure:
            self._failure = self._describe(failure, ending)

    def _describe(self, failure: str, ending: str) -> str:
        saved, taken = sum(self._saved_counts().values()), sum(self._accepted.values()) + self._repeated
        return f"{failure}; {ending} with {saved} of {taken} messages ({(self._done_size + self._file.size) / 1e6:.1f} MB)"

    def _write_metadata_file(self) -> None:
        text = metadata_file(self._metadata()).encode()
        name = METADATA_NAME + ACTIVE_SUFFIX
        flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC
        with open(name, "wb", opener=lambda path, _: os.open(path, flags, 0o644, dir_fd=self._folder_fd)) as file:
            file.write(text)
            file.flush()
            os.fdatasync(file.fileno())
        os.rename(name, METADATA_NAME, src_dir_fd=self._folder_fd, dst_dir_fd=self._folder_fd)

"""Reads rosbag2 bags of MCAP files, whole, unfinished or damaged: a folder or a single ``.mcap`` or ``.mcap.active`` file."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import TracebackType
from typing import NamedTuple

from scene_description import SceneSynthError
from scene_synth_ros.bags.bag_manifest import MANIFEST_NAME
from scene_synth_ros.bags.bag_metadata import METADATA_NAME, BagMetadata, BagMetadataError, TopicInfo, read_metadata
from scene_synth_ros.bags.bag_writer import ACTIVE_SUFFIX
from scene_synth_ros.bags.qos_metadata import QosMetadataError, read_qos
from scene_synth_ros.mcap.contents import ChannelInfo, McapContents, McapReadError
from scene_synth_ros.messages.message_definitions import MessageDefinition

MAX_FAULTS = 200


class BagReadError(SceneSynthError):
    """A bag that cannot be read at all; one line."""


class BagMessage(NamedTuple):
    """A serialised message with log and publish time."""

    topic: str
    type_name: str
    log_ns: int
    publish_ns: int
    data: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class BagSummary:
    """What a bag says of itself when it is opened.

    ``topics`` have the counts of the files' own statistics, ``definitions`` are the message definitions in the files by type;
    ``records`` and ``attachments`` are those of the files by name, the last of each; ``metadata`` is what ``metadata.yaml`` says, None
    without one; ``start_ns`` and ``end_ns`` are None without messages; ``faults`` are lines for people.
    """

    path: Path
    files: tuple[Path, ...]
    size: int
    topics: tuple[TopicInfo, ...]
    start_ns: int | None
    end_ns: int | None
    finished: bool
    metadata: BagMetadata | None = None
    custom_data: Mapping[str, str] = field(default_factory=dict)
    faults: tuple[str, ...] = ()
    definitions: Mapping[str, MessageDefinition] = field(default_factory=dict)
    records: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    attachments: Mapping[str, bytes] = field(default_factory=dict)

    @property
    def message_count(self) -> int:
        """How many messages all topics have."""
        return sum(topic.message_count for topic in self.topics)


class BagReader:
    """An open bag.  Damaged parts are passed over and listed in ``faults``; messages of one chunk at a time are in memory.

    ``files`` are read one after the other in place of what lies at ``path``: those of several shards of a dataset, say.

    Attributes:
        types: topic -> type of its messages.

    Raises:
        BagReadError: there is nothing to read, with the reason.
    """

    def __init__(self, path: str | Path, files: Sequence[Path] = ()) -> None:
        self.path = Path(path)
        self.faults: list[str] = []
        self._seen: set[str] = set()
        self._metadata: BagMetadata | None = None
        with ExitStack() as stack:
            self._contents: list[McapContents] = []
            readable: list[Path] = []
            for file in files or self._find_files():
                try:
                    self._contents.append(stack.enter_context(McapContents(file, self._report)))
                    readable.append(file)
                except McapReadError as error:
                    self._report(str(error))
            if not self._contents:
                raise BagReadError(self.faults[-1])
            self.summary = self._summarize(readable)
            self.types = {topic.name: topic.type_name for topic in self.summary.topics}
            self._stack = stack.pop_all()

    def __enter__(self) -> "BagReader":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Close the files."""
        self._stack.close()

    def manifests(self) -> list[tuple[Path, bytes]]:
        """Return the manifests of the files that have one, as they were attached."""
        return [
            (path, contents.attachments[MANIFEST_NAME])
            for path, contents in zip(self.summary.files, self._contents, strict=True)
            if MANIFEST_NAME in contents.attachments
        ]

    def messages_by_file(self) -> Iterator[tuple[Path, Iterator[BagMessage]]]:
        """Yield every file with its messages as they stand in it."""
        for path, contents in zip(self.summary.files, self._contents, strict=True):
            yield path, self._messages_of(contents, None, 0, True)

    def messages(self, topics: Collection[str] | None = None, start_ns: int = 0, *, file_order: bool = False) -> Iterator[BagMessage]:
        """Yield messages, file by file, in the order of their log times as far as chunks allow, or as they stand in the files.

        ``topics``: only these, None for all; ``start_ns``: only log times from here on; ``file_order``: as they were written.
        """
        for contents in self._contents:
            yield from self._messages_of(contents, topics, start_ns, file_order)

    def _messages_of(self, contents: McapContents, topics: Collection[str] | None, start_ns: int, file_order: bool) -> Iterator[BagMessage]:
        try:
            for message in contents.messages(start_ns, file_order=file_order):
                channel = contents.channels[message.channel_id]
                if topics is None or channel.topic in topics:
                    yield BagMessage(channel.topic, channel.type_name, message.log_ns, message.publish_ns, bytes(message.data))
        except OSError as error:
            self._report(f"{contents.path.name}: {error.strerror or error}")

    def _report(self, fault: str) -> None:
        """Note a fault once."""
        if fault not in self._seen and len(self.faults) < MAX_FAULTS:
            self._seen.add(fault)
            self.faults.append(fault)

    def _find_files(self) -> list[Path]:
        try:
            if self.path.is_dir():
                return self._files_of_folder()
            if not self.path.exists():
                raise BagReadError(f"{self.path}: not found; give the folder of a bag or an .mcap file")
        except OSError as error:
            raise BagReadError(f"{self.path}: {error.strerror or error}") from None
        if self.path.name.endswith(ACTIVE_SUFFIX):
            self._report(f"{self.path.name}: unfinished, its recorder was not closed")
        return [self.path]

    def _files_of_folder(self) -> list[Path]:
        found = sorted(
            (file for pattern in ("*.mcap", f"*.mcap{ACTIVE_SUFFIX}") for file in self.path.glob(pattern)),
            key=lambda file: (len(file.name), file.name),
        )
        if (self.path / METADATA_NAME).exists():
            try:
                self._metadata = read_metadata(self.path / METADATA_NAME)
            except BagMetadataError as error:
                self._report(str(error))
        elif found:
            self._report(f"{METADATA_NAME} is missing")
        if self._metadata is not None:
            if self._metadata.storage != "mcap":
                storage = self._metadata.storage[:40]
                raise BagReadError(f"{self.path}: expected MCAP storage, got {storage!r}; convert the bag with ros2 bag convert")
            found = self._files_of_metadata(self._metadata, found)
        for file in found:
            if file.name.endswith(ACTIVE_SUFFIX):
                self._report(f"{file.name}: unfinished, its recorder was not closed")
        if not found:
            raise BagReadError(f"{self.path}: the folder holds no .mcap file")
        return found

    def _files_of_metadata(self, metadata: BagMetadata, found: list[Path]) -> list[Path]:
        """Return the files in the order of the metadata, then those that it does not know."""
        names = [Path(file.name).name for file in metadata.files]
        by_name = {file.name: file for file in found}
        for name in names:
            if name not in by_name:
                self._report(f"{METADATA_NAME}: file {name[:100]} is missing")
        for name in by_name:
            if name not in names:
                self._report(f"{METADATA_NAME}: file {name[:100]} is not mentioned")
        known = [by_name[name] for name in dict.fromkeys(names) if name in by_name]
        return known + [file for file in found if file not in known]

    def _summarize(self, files: list[Path]) -> BagSummary:
        topics: dict[str, TopicInfo] = {}
        definitions: dict[str, MessageDefinition] = {}
        for contents in self._contents:
            for channel_id, channel in contents.channels.items():
                self._take_channel(topics, channel, contents.counts.get(channel_id, 0))
                type_hash = channel.metadata.get("topic_type_hash", "")
                definition = MessageDefinition(type_name=channel.type_name, text=channel.schema_text, type_hash=type_hash)
                definitions.setdefault(channel.type_name, definition)
        ranges = [contents.time_range_ns for contents in self._contents if contents.time_range_ns]
        return BagSummary(
            path=self.path,
            files=tuple(files),
            size=sum(contents.size for contents in self._contents),
            topics=tuple(topics.values()),
            start_ns=min((start for start, _ in ranges), default=None),
            end_ns=max((end for _, end in ranges), default=None),
            finished=all(contents.finished for contents in self._contents),
            metadata=self._metadata,
            custom_data=self._metadata.custom_data if self._metadata else {},
            faults=tuple(self.faults),
            definitions=definitions,
            records={name: record for contents in self._contents for name, record in contents.metadata.items()},
            attachments={name: data for contents in self._contents for name, data in contents.attachments.items()},
        )

    def _take_channel(self, topics: dict[str, TopicInfo], channel: ChannelInfo, count: int) -> None:
        known = topics.get(channel.topic)
        if known is not None:
            if known.type_name != channel.type_name:
                self._report(f"topic {channel.topic[:100]} has two types, {known.type_name[:100]} and {channel.type_name[:100]}")
            topics[channel.topic] = replace(known, message_count=known.message_count + count)
            return
        try:
            qos = read_qos(channel.metadata.get("offered_qos_profiles", ""))
        except QosMetadataError as error:
            self._report(f"topic {channel.topic[:100]}: {error}")
            qos = ()
        topics[channel.topic] = TopicInfo(
            name=channel.topic,
            type_name=channel.type_name,
            type_hash=channel.metadata.get("topic_type_hash", ""),
            qos=qos,
            message_count=count,
            serialization_format=channel.encoding,
        )

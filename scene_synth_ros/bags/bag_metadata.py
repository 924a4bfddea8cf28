"""``metadata.yaml`` of a rosbag2 bag, written as versions 9 (Jazzy) or 5 (Humble) and read in any version."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from scene_description import SceneSynthError
from scene_description.strict import shorten
from scene_description.yaml_text import dump_yaml, read_yaml
from scene_synth_ros.bags.qos_metadata import NAMED_QOS_VERSION, OfferedQos, QosMetadataError, qos_items, qos_text, read_qos

METADATA_NAME = "metadata.yaml"
WRITABLE_VERSIONS = (5, 9)
NO_TIME_NS = 2**63 - 1

_WRAPPER = "rosbag2_bagfile_information"


class BagMetadataError(SceneSynthError):
    """A ``metadata.yaml`` that cannot be read; one line."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TopicInfo:
    """A topic of a bag: its type, what its publishers offered and how many messages it has."""

    name: str
    type_name: str
    type_hash: str = ""
    qos: tuple[OfferedQos, ...] = ()
    message_count: int = 0
    serialization_format: str = "cdr"


@dataclass(frozen=True, slots=True, kw_only=True)
class FileInfo:
    """One file of a bag; times in nanoseconds, ``start_ns`` is ``NO_TIME_NS`` without messages."""

    name: str
    start_ns: int
    duration_ns: int
    message_count: int


@dataclass(frozen=True, slots=True, kw_only=True)
class BagMetadata:
    """What ``metadata.yaml`` says of a bag."""

    version: int
    topics: tuple[TopicInfo, ...]
    files: tuple[FileInfo, ...]
    custom_data: Mapping[str, str] = field(default_factory=dict)
    storage: str = "mcap"
    ros_distro: str = "jazzy"

    @property
    def message_count(self) -> int:
        """How many messages all files have."""
        return sum(file.message_count for file in self.files)

    @property
    def start_ns(self) -> int:
        """Log time of the first message, ``NO_TIME_NS`` without messages."""
        return min((file.start_ns for file in self.files), default=NO_TIME_NS)

    @property
    def duration_ns(self) -> int:
        """Log time from the first to the last message."""
        ends = [file.start_ns + file.duration_ns for file in self.files if file.message_count]
        return max(ends) - self.start_ns if ends else 0


def metadata_mapping(metadata: BagMetadata) -> dict[str, Any]:
    """Return the mapping that rosbag2 stores, with the fields of its version in the order in which rosbag2 writes them."""
    version = metadata.version
    mapping: dict[str, Any] = {
        "version": version,
        "storage_identifier": metadata.storage,
        "duration": {"nanoseconds": metadata.duration_ns},
        "starting_time": {"nanoseconds_since_epoch": metadata.start_ns},
        "message_count": metadata.message_count,
        "topics_with_message_count": [_topic_item(topic, version) for topic in metadata.topics],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file.name for file in metadata.files],
        "files": [_file_item(file) for file in metadata.files],
    }
    if version >= 6:
        mapping["custom_data"] = dict(metadata.custom_data) or None
    if version >= 8:
        mapping["ros_distro"] = metadata.ros_distro
    return mapping


def metadata_record(metadata: BagMetadata) -> str:
    """Return the text of the MCAP metadata record ``rosbag2``, key ``serialized_metadata``."""
    return dump_yaml(metadata_mapping(metadata))


def metadata_file(metadata: BagMetadata) -> str:
    """Return the text of ``metadata.yaml``."""
    return dump_yaml({_WRAPPER: metadata_mapping(metadata)})


def _topic_item(topic: TopicInfo, version: int) -> dict[str, Any]:
    item: dict[str, Any] = {"name": topic.name, "type": topic.type_name, "serialization_format": topic.serialization_format}
    item["offered_qos_profiles"] = qos_items(topic.qos, version) if version >= NAMED_QOS_VERSION else qos_text(topic.qos, version)
    if version >= 7:
        item["type_description_hash"] = topic.type_hash
    return {"topic_metadata": item, "message_count": topic.message_count}


def _file_item(file: FileInfo) -> dict[str, Any]:
    return {
        "path": file.name,
        "starting_time": {"nanoseconds_since_epoch": file.start_ns},
        "duration": {"nanoseconds": file.duration_ns},
        "message_count": file.message_count,
    }


def read_metadata(path: Path) -> BagMetadata:
    """Read a ``metadata.yaml`` of any version.

    Raises:
        BagMetadataError: the file cannot be read, or is no metadata of a bag.
    """
    document = read_yaml(path, BagMetadataError)
    try:
        return _read_mapping(_mapping(_mapping(document, "document").get(_WRAPPER), _WRAPPER))
    except KeyError as error:
        raise BagMetadataError(f"{path}: key {error} is missing") from None
    except BagMetadataError as error:
        raise BagMetadataError(f"{path}: {error}") from None


def _read_mapping(data: Mapping[str, Any]) -> BagMetadata:
    names = [_text(name, "relative_file_paths") for name in _items(data["relative_file_paths"], "relative_file_paths")]
    files = [_read_file(item) for item in _items(data.get("files", []), "files")]
    if not files:
        files = [_whole_bag(names[0], data)] if len(names) == 1 else []
    known = {file.name: file for file in files}
    missing = [FileInfo(name=name, start_ns=NO_TIME_NS, duration_ns=0, message_count=0) for name in names if name not in known]
    return BagMetadata(
        version=_count(data["version"], "version"),
        storage=_text(data["storage_identifier"], "storage_identifier"),
        topics=tuple(_read_topic(item) for item in _items(data["topics_with_message_count"], "topics_with_message_count")),
        files=tuple([*files, *missing]),
        custom_data={str(key): str(value) for key, value in _mapping(data.get("custom_data") or {}, "custom_data").items()},
        ros_distro=str(data.get("ros_distro", "")),
    )


def _read_topic(item: object) -> TopicInfo:
    entry = _mapping(item, "topics_with_message_count")
    topic = _mapping(entry["topic_metadata"], "topic_metadata")
    try:
        qos = read_qos(topic.get("offered_qos_profiles"))
    except QosMetadataError:
        qos = ()
    return TopicInfo(
        name=_text(topic["name"], "name"),
        type_name=_text(topic["type"], "type"),
        type_hash=str(topic.get("type_description_hash") or ""),
        qos=qos,
        message_count=_count(entry["message_count"], "message_count"),
        serialization_format=_text(topic["serialization_format"], "serialization_format"),
    )


def _read_file(item: object) -> FileInfo:
    entry = _mapping(item, "files")
    return FileInfo(
        name=_text(entry["path"], "path"),
        start_ns=_count(_mapping(entry["starting_time"], "starting_time")["nanoseconds_since_epoch"], "nanoseconds_since_epoch"),
        duration_ns=_count(_mapping(entry["duration"], "duration")["nanoseconds"], "nanoseconds"),
        message_count=_count(entry["message_count"], "message_count"),
    )


def _whole_bag(name: str, data: Mapping[str, Any]) -> FileInfo:
    """Return the only file of a bag that has no list of files (before version 5)."""
    return _read_file({"path": name, **{key: data[key] for key in ("starting_time", "duration", "message_count")}})


def _mapping(value: object, what: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise BagMetadataError(f"{what}: expected a mapping, got {type(value).__name__}")
    return value


def _items(value: object, what: str) -> Sequence[Any]:
    if not isinstance(value, list):
        raise BagMetadataError(f"{what}: expected a list, got {type(value).__name__}")
    return value


def _text(value: object, what: str) -> str:
    if not isinstance(value, str):
        raise BagMetadataError(f"{what}: expected text, got {type(value).__name__}")
    return value


def _count(value: object, what: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**64:
        raise BagMetadataError(f"{what}: expected a whole number, got {shorten(value)}")
    return value

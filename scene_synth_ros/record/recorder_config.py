"""Parameters of the recorder node beside those of splitting and image compression."""

from dataclasses import dataclass
from typing import Annotated, Literal

from scene_description import Limits
from scene_synth_ros.bags.bag_writer import DEFAULT_CHUNK_SIZE
from scene_synth_ros.messages.image_codec import ImageCompression
from scene_synth_ros.messages.stamps import NANOSECONDS
from scene_synth_ros.messages.streams import FRAME_PREFIX
from scene_synth_ros.suite.parameters import ParameterError

_FIXED = "a bag is split in one way"


@dataclass(frozen=True, slots=True, kw_only=True)
class SplitPolicy:
    """A file ends before the first frame that finds it too large, too long, or at the end of its rooms; 0 sets no bound."""

    size_mb: Annotated[float, Limits(ge=0.0, le=1e9, unit="MB", description="Size on disk of a file", fixed=_FIXED)] = 0.0
    duration_s: Annotated[float, Limits(ge=0.0, le=1e9, unit="s", description="Simulated time in a file", fixed=_FIXED)] = 0.0
    rooms: Annotated[int, Limits(ge=0, le=10**9, description="Rooms in a file", fixed=_FIXED)] = 0

    def is_due(self, size: int, start_ns: int | None, log_ns: int, rooms: int, new_room: bool) -> bool:
        """Return whether the file ends here.

        Args:
            size: bytes of the file on disk.
            start_ns: log time of its first frame; None while it has none.
            log_ns: log time of the next frame.
            rooms: rooms that have begun in the file.
            new_room: whether the next frame begins a room.
        """
        if start_ns is None:
            return False
        too_large = 0.0 < self.size_mb * 1e6 <= size
        too_long = 0.0 < self.duration_s * NANOSECONDS <= log_ns - start_ns
        return too_large or too_long or (new_room and 0 < self.rooms <= rooms)


_BAG_FIXED = "a bag is opened once"


@dataclass(frozen=True, slots=True, kw_only=True)
class RecorderConfig:
    """What is recorded, and where to."""

    bag: Annotated[str, Limits(max_length=1000, description="Folder of the bag; must not exist", fixed=_BAG_FIXED)] = ""
    topics: Annotated[
        tuple[Annotated[str, Limits(max_length=300)], ...],
        Limits(
            max_length=100,
            description="Patterns of the topics to record; empty: all of the namespace, /clock, /diagnostics",
            fixed=_BAG_FIXED,
        ),
    ] = ()
    extra_topics: Annotated[
        tuple[Annotated[str, Limits(max_length=300)], ...],
        Limits(max_length=100, description="Patterns of topics to record besides, of whatever node and type", fixed=_BAG_FIXED),
    ] = ()
    exclude: Annotated[
        tuple[Annotated[str, Limits(max_length=300)], ...],
        Limits(max_length=100, description="Patterns of topics to leave out", fixed=_BAG_FIXED),
    ] = ()
    compression: Annotated[Literal["zstd", "lz4", "none"], Limits(description="Compression of the chunks", fixed=_BAG_FIXED)] = "zstd"
    compression_level: Annotated[int, Limits(ge=1, le=22, description="Level of zstd or lz4; higher is smaller", fixed=_BAG_FIXED)] = 1
    chunk_size: Annotated[
        int,
        Limits(ge=1024, le=2**26, unit="B", description="A chunk is written when it is larger; small: faster at random", fixed=_BAG_FIXED),
    ] = DEFAULT_CHUNK_SIZE
    metadata_version: Annotated[
        Literal[9, 5], Limits(description="Version of metadata.yaml: 9 for Jazzy, 5 for Humble", fixed=_BAG_FIXED)
    ] = 9
    custom_data: Annotated[
        tuple[Annotated[str, Limits(max_length=20_000)], ...],
        Limits(max_length=100, description="KEY=VALUE notes kept with the bag", fixed=_BAG_FIXED),
    ] = ()
    frame_prefix: Annotated[
        str,
        Limits(
            max_length=100,
            pattern=FRAME_PREFIX,
            description="Stands before the cameras' frames in /tf and /tf_static; as streams.frame_prefix of the renderer",
            fixed=_BAG_FIXED,
        ),
    ] = ""
    loss_timeout_s: Annotated[
        float, Limits(ge=0.1, le=1e6, unit="s", description="What was published is lost when none of it has come for so long")
    ] = 10.0
    start_recording: Annotated[bool, Limits(description="Open the bag at the start, not at ~/start", fixed=_BAG_FIXED)] = True
    snapshot_s: Annotated[
        float, Limits(ge=0.0, le=3600.0, unit="s", description="Simulated time that ~/snapshot writes; 0 keeps none", fixed=_BAG_FIXED)
    ] = 0.0
    snapshot_mb: Annotated[
        float, Limits(ge=1.0, le=1e6, unit="MB", description="Memory for snapshots; the oldest frames go first", fixed=_BAG_FIXED)
    ] = 256.0
    autostart: Annotated[bool, Limits(description="Configure and activate at the start", fixed="it is used at the start only")] = True
    exit_when_done: Annotated[bool, Limits(description="Close the bag and end the process when the grammar node has finished")] = False


RECORDER_GROUPS: dict[str, type] = {"": RecorderConfig, "split": SplitPolicy, "images": ImageCompression}
"""Prefix of a recorder's parameters -> dataclass that defines them."""


def read_pairs(items: tuple[str, ...]) -> dict[str, str]:
    """Return the notes of ``custom_data``.

    Raises:
        ParameterError: one is not KEY=VALUE.
    """
    pairs = {}
    for item in items:
        key, equals, value = item.partition("=")
        if not equals:
            raise ParameterError(f"recorder_node: parameter custom_data: expected KEY=VALUE, got '{item}'")
        pairs[key] = value
    return pairs

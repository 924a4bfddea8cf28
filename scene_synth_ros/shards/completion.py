"""The completion file of a shard, ``shards/00000.json``: written last, so that a shard is done when it is there.

Nothing in it depends on when, by whom or on what machine the shard was made.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO, TypedDict

from scene_description import SceneSynthError
from scene_synth_ros.bags.bag_manifest import MANIFEST_NAME, read_manifest
from scene_synth_ros.dataset.file_names import SHARD_SCHEMA, SHARDS_NAME
from scene_synth_ros.mcap.contents import McapContents
from scene_synth_ros.shards.plan import DatasetPlan
from scene_synth_ros.shards.store import Store

FOLDER = SHARDS_NAME
_PIECE = 2**20


class ShardError(SceneSynthError):
    """A shard that cannot be made, or whose files are not what was made; one line."""


class RoomRow(TypedDict):
    """A room that is in a shard; ``scene_sha256`` is of its description's JSON, ``objects`` counts them by category."""

    index: int
    seed: int
    room_type: str
    scene_id: str
    scene_sha256: str
    frames: int
    floor_area_m2: float
    objects: dict[str, int]


class FailedRow(TypedDict):
    """A room that could not be made: how often it was tried, and its last error in one line."""

    index: int
    attempts: int
    error: str


class FileRow(TypedDict):
    """A file of a shard, by its name below ``shards``."""

    name: str
    bytes: int
    sha256: str


class Completion(TypedDict):
    """A completion file.

    ``layers`` is topic -> SHA-256 of its messages as the manifest attached to the bag has it: for each message log time and length as
    little-endian 64-bit integers, then the CDR bytes (:mod:`scene_synth_ros.bags.bag_manifest`).
    """

    schema: str
    shard: int
    first_room: int
    rooms: list[RoomRow]
    failed: list[FailedRow]
    files: list[FileRow]
    layers: dict[str, str]
    messages: int


def shard_name(shard: int) -> str:
    """Return the name of a shard's folder, and of its completion file without its ending."""
    return f"{shard:05d}"


def completion_name(shard: int) -> str:
    """Return the name of a completion file in the folder of its dataset."""
    return f"{FOLDER}/{shard_name(shard)}.json"


def describe_shard(plan: DatasetPlan, shard: int, rooms: Sequence[RoomRow], failed: Sequence[FailedRow], bag: Path | None) -> Completion:
    """Return what a completion file says.

    Args:
        plan: of the dataset.
        shard: its number.
        rooms: that are in it.
        failed: that are not.
        bag: its folder; None where it has no room.
    """
    layers, messages, files = {}, 0, []
    if bag is not None:
        (file,) = bag.glob("*.mcap")
        with McapContents(file, _refuse) as contents:
            digests = read_manifest(contents.attachments[MANIFEST_NAME])
        layers = {topic: digest.sha256 for topic, digest in digests.items()}
        messages = sum(digest.messages for digest in digests.values())
        for path in sorted(bag.iterdir()):
            with path.open("rb") as written:
                sha256 = _sha256(written)
            files.append(FileRow(name=f"{bag.name}/{path.name}", bytes=path.stat().st_size, sha256=sha256))
    return Completion(
        schema=SHARD_SCHEMA,
        shard=shard,
        first_room=plan.rooms_of(shard).start,
        rooms=list(rooms),
        failed=list(failed),
        files=files,
        layers=layers,
        messages=messages,
    )


def completion_json(completion: Completion) -> bytes:
    """Return the file's bytes."""
    return (json.dumps(completion, indent=1) + "\n").encode()


def read_completion(store: Store, plan: DatasetPlan, shard: int) -> Completion | None:
    """Return the completion file of a shard; None if there is none, or one that does not fit the plan.

    Such a file is of a run that another plan or a damaged disk has left: the shard is then made again.
    """
    data = store.read(completion_name(shard))
    try:
        document: Any = json.loads(data) if data is not None else None
        rooms = plan.rooms_of(shard)
        indices = [row["index"] for row in (*document["rooms"], *document["failed"])]
        fits = document["schema"] == SHARD_SCHEMA and document["shard"] == shard and sorted(indices) == list(rooms)
        complete = isinstance(document["files"], list) and isinstance(document["layers"], dict) and document["messages"] >= 0
    except (ValueError, TypeError, LookupError, RecursionError):
        return None
    return document if fits and complete else None


def faults_of(store: Store, completion: Completion) -> Iterator[str]:
    """Yield a line for every file of a shard that is missing or not what its completion file says; reads them whole."""
    for row in completion["files"]:
        name = f"{FOLDER}/{row['name']}"
        try:
            with store.open(name) as file:
                found = _sha256(file)
        except FileNotFoundError:
            yield f"{name}: expected a file, got none"
            continue
        if found != row["sha256"]:
            yield f"{name}: expected SHA-256 {row['sha256'][:16]}..., got {found[:16]}..."


def _refuse(fault: str) -> None:
    raise ShardError(f"a bag that was just written cannot be read: {fault}")


def _sha256(file: BinaryIO) -> str:
    digest, piece = hashlib.sha256(), memoryview(bytearray(_PIECE))
    while size := file.readinto(piece):  # type: ignore[attr-defined]
        digest.update(piece[:size])
    return digest.hexdigest()

"""What a dataset says of its shards: a completion file each, ``shards/00000.json``, and all of them in order, ``manifest.json``.

A completion file is written last, so that a shard is done when it is there; the manifest when every shard is complete.  Both are the same
bytes whoever has made the shards, when, on what machine, in whatever order and however often interrupted.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypedDict

from scene_description import FieldError, SceneSynthError
from scene_synth_ros.bags.bag_manifest import MANIFEST_NAME, read_manifest
from scene_synth_ros.bags.dataset_files import (
    DATASET_MANIFEST_SCHEMA,
    SHARD_SCHEMA,
    SHARDS_NAME,
    completion_name,
    is_shard_file,
    shard_name,
)
from scene_synth_ros.mcap.contents import McapContents
from scene_synth_ros.shards.plan import DatasetPlan
from scene_synth_ros.shards.provenance import Provenance, read_provenance
from scene_synth_ros.shards.store import Store, sha256_of

_READERS = 16


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
    little-endian 64-bit integers, then the CDR bytes (:mod:`scene_synth_ros.bags.bag_manifest`).  ``provenance`` tells what made the shard,
    as in the plan; ``sha256`` is that of this document as compact JSON without it, its keys in order, by which an edited one is known.
    """

    schema: Literal["scene_synth_shard/1"]
    shard: int
    first_room: int
    rooms: list[RoomRow]
    failed: list[FailedRow]
    files: list[FileRow]
    layers: dict[str, str]
    messages: int
    provenance: dict[str, dict[str, str]]
    sha256: str


class Manifest(TypedDict):
    """A manifest; ``rooms`` and ``frames`` count what is there, ``failed`` lists what is not."""

    schema: Literal["scene_synth_manifest/1"]
    plan_sha256: str
    rooms: int
    frames: int
    failed: list[FailedRow]
    shards: list[Completion]


def describe_shard(plan: DatasetPlan, shard: int, rooms: Sequence[RoomRow], failed: Sequence[FailedRow], bag: Path | None) -> Completion:
    """Return what a completion file says.

    ``bag``: its folder; None where it has no room.
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
                sha256 = sha256_of(written)
            files.append(FileRow(name=f"{bag.name}/{path.name}", bytes=path.stat().st_size, sha256=sha256))
    completion = Completion(
        schema=SHARD_SCHEMA,
        shard=shard,
        first_room=plan.rooms_of(shard).start,
        rooms=list(rooms),
        failed=list(failed),
        files=files,
        layers=layers,
        messages=messages,
        provenance=plan.own_provenance().to_mapping(),
        sha256="",
    )
    return sealed(completion)


def sealed(completion: Completion) -> Completion:
    """Return a completion file with the digest of what it says."""
    return {**completion, "sha256": _digest(completion)}


def _digest(completion: Mapping[str, Any]) -> str:
    said = {name: value for name, value in completion.items() if name != "sha256"}
    return hashlib.sha256(json.dumps(said, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def document_bytes(document: Completion | Manifest) -> bytes:
    """Return the bytes of a completion file or a manifest."""
    return (json.dumps(document, indent=1) + "\n").encode()


def read_completion(store: Store, plan: DatasetPlan, shard: int) -> Completion | None:
    """Return the completion file of a shard; None if there is none, or one that does not fit the plan or is not as it was written.

    Such a file is of a run that another plan or a damaged disk has left, or was edited: the shard is then made again.
    """
    data = store.read(completion_name(shard))
    try:
        document: Any = json.loads(data) if data is not None else None
        indices = [row["index"] for row in (*document["rooms"], *document["failed"])]
        fits = document["schema"] == SHARD_SCHEMA and document["shard"] == shard and sorted(indices) == list(plan.rooms_of(shard))
        files = [is_shard_file(row["name"], shard) and isinstance(row["sha256"], str) for row in document["files"]]
        read_provenance(document["provenance"])
        return document if fits and all(files) and document["sha256"] == _digest(document) else None
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError, FieldError):
        return None


def faults_of(store: Store, completion: Completion) -> Iterator[str]:
    """Yield a line for every file of a shard that is missing or not what its completion file says; reads them whole."""
    for row in completion["files"]:
        name = f"{SHARDS_NAME}/{row['name']}"
        sha256 = store.sha256(name)
        if sha256 is None:
            yield f"{name}: expected a file, got none"
        elif sha256 != row["sha256"]:
            yield f"{name}: expected SHA-256 {row['sha256'][:16]}..., got {sha256[:16]}..."


def _refuse(fault: str) -> None:
    raise ShardError(f"a bag that was just written cannot be read: {fault}")


class Survey(NamedTuple):
    """What there is of some shards.

    Attributes:
        missing: those that are not complete.
        faults: a line for each of them of which there is something that does not count.
        made_by: what made the others.
    """

    missing: list[int]
    faults: list[str]
    made_by: list[Provenance]


def survey(plan: DatasetPlan, store: Store, shards: Sequence[int] | None = None) -> Survey:
    """Look at the completion files of shards, of some or of all, and at the sizes of the files that they name, whose bytes are not read."""
    sizes = store.sizes(SHARDS_NAME)
    asked = range(plan.shards) if shards is None else shards
    there = [shard for shard in asked if f"{shard_name(shard)}.json" in sizes]
    found = Survey([], [], [])
    for shard, completion in zip(there, read_completions(store, plan, there), strict=True):
        fault = _fault(completion, sizes)
        if completion is None or fault:
            found.faults.append(f"{completion_name(shard) if completion is None else SHARDS_NAME}{fault}")
            found.missing.append(shard)
        elif (made_by := read_provenance(completion["provenance"])) not in found.made_by:
            found.made_by.append(made_by)
    missing = sorted({*asked} - {*there} | {*found.missing})
    return found._replace(missing=missing)


def _fault(completion: Completion | None, sizes: Mapping[str, int]) -> str:
    """Return what is wrong with a shard, after the name of its completion file or of the folder of shards; empty if nothing is."""
    if completion is None:
        return ": expected a completion file as it was written, got an edited or damaged one, or one of another plan"
    for row in completion["files"]:
        if (size := sizes.get(row["name"])) != row["bytes"]:
            return f"/{row['name']}: expected {row['bytes']} bytes, got {'no file' if size is None else size}"
    return ""


def read_completions(store: Store, plan: DatasetPlan, shards: Sequence[int]) -> Iterator[Completion | None]:
    """Yield the completion files of shards in their order, several read at once: an object store takes its time for each."""
    with ThreadPoolExecutor(_READERS, "completion") as readers:
        yield from readers.map(lambda shard: read_completion(store, plan, shard), shards)


def make_manifest(plan: DatasetPlan, store: Store) -> Manifest | None:
    """Return the manifest of a dataset; None while a shard is missing."""
    complete = [completion for completion in read_completions(store, plan, range(plan.shards)) if completion is not None]
    if len(complete) < plan.shards:
        return None
    return Manifest(
        schema=DATASET_MANIFEST_SCHEMA,
        plan_sha256=plan.sha256,
        rooms=sum(len(completion["rooms"]) for completion in complete),
        frames=sum(row["frames"] for completion in complete for row in completion["rooms"]),
        failed=[row for completion in complete for row in completion["failed"]],
        shards=complete,
    )

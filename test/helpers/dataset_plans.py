"""A tiny dataset for tests: hallways, 32x24 pixels, one sample, two frames."""

from __future__ import annotations

import hashlib
from pathlib import Path

from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.cli.parameters.run_parameters import RunWords, run_parameters
from scene_synth_ros.cli.parameters.run_profile import NodeParameters
from scene_synth_ros.shards.plan import DatasetPlan, make_plan

SEED, FRAMES = 7, 2
TINY = tuple(f"renderer_node.{word}" for word in ("camera.width:=32", "camera.height:=24", "render.samples_per_pixel:=1"))
HALLWAY = "grammar_node.scene.room_type:=hallway"


def tiny_parameters(rooms: int, *own: str) -> NodeParameters:
    """Return the parameters of a run of tiny rooms that records."""
    words = RunWords(rooms=rooms, frames=FRAMES, seed=SEED, record=Path("bag"), overrides=(*TINY, HALLWAY, *own))
    return run_parameters(words)


def tiny_plan(rooms: int, rooms_per_shard: int, *own: str) -> DatasetPlan:
    """Return the plan of a dataset of tiny rooms."""
    return make_plan(tiny_parameters(rooms, *own), rooms_per_shard=rooms_per_shard)


def messages_of(bag: Path, without: str = "") -> list[tuple[str, int, bytes]]:
    """Return topic, log time and bytes of every message of a bag as they stand in it, but for those of a topic."""
    with BagReader(bag) as reader:
        assert not reader.faults
        return [(m.topic, m.log_ns, bytes(m.data)) for m in reader.messages(file_order=True) if m.topic != without]


def digests(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of every file below a folder, but for temporary ones."""
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != ".lock")
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}

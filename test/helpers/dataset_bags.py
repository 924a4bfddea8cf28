"""Datasets of shards with known pixels, for tests of what reads them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from room_bag import RoomBag, write_room_bag

OURS = {"scene_synth": {"seed": "7"}}
"""Metadata record of bags whose log times are stamps, as the recorder's are."""
FRAMES = 3
LAYERS = ("color", "depth", "semantic")


def write_dataset(
    folder: Path, shards: int = 2, rooms: int = 2, complete: int | None = None, **bag: Any
) -> dict[int, dict[str, np.ndarray]]:
    """Write a dataset as ``scene_synth generate`` does: shards, completion files, the plan.

    Args:
        folder: new.
        shards: how many.
        rooms: of each shard.
        complete: how many shards have completion files; None for all.
        bag: arguments of ``write_room_bag``.

    Returns:
        stamp -> layer -> pixels.
    """
    images: dict[int, dict[str, np.ndarray]] = {}
    folder.mkdir(parents=True)
    (folder / "dataset.json").write_text(json.dumps({"schema": "scene_synth_dataset/1", "shards": shards}))
    for shard in range(shards):
        first = shard * rooms
        made = write_room_bag(folder / "shards" / f"{shard:05d}", rooms=rooms, frames=FRAMES, first_room=first, records=OURS, **bag)
        images |= made.images
        if complete is None or shard < complete:
            (folder / "shards" / f"{shard:05d}.json").write_text(json.dumps(completion(made, shard, first)))
    return images


def completion(bag: RoomBag, shard: int, first: int) -> Mapping[str, Any]:
    """Return the completion file of a shard, those of its fields that readers take."""
    rooms = [
        {
            "index": scene.index,
            "seed": scene.seed,
            "room_type": scene.category,
            "scene_id": scene.id,
            "frames": FRAMES,
            "floor_area_m2": 9.0,
        }
        for scene in bag.scenes
    ]
    files = [{"name": f"{bag.path.name}/{file.name}", "bytes": file.stat().st_size} for file in sorted(bag.path.iterdir())]
    return {"schema": "scene_synth_shard/1", "shard": shard, "first_room": first, "rooms": rooms, "failed": [], "files": files}

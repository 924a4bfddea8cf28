"""Names and schemas of the files that datasets have beside their bags, for those who write them and those who read them."""

import re
from typing import Final

PLAN_NAME = "dataset.json"
DATASET_MANIFEST_NAME = "manifest.json"
"""Of a dataset; the manifest that is attached to a bag is :mod:`scene_synth_ros.bags.bag_manifest`'s."""
SHARDS_NAME = "shards"
SPLITS_NAME = "splits.json"

PLAN_SCHEMA: Final = "scene_synth_dataset/1"
DATASET_MANIFEST_SCHEMA: Final = "scene_synth_manifest/1"
SHARD_SCHEMA: Final = "scene_synth_shard/1"
SPLITS_SCHEMA: Final = "scene_synth_splits/1"


_FILE_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,199}")


def shard_name(shard: int) -> str:
    """Return the name of a shard's folder, and of its completion file without its ending."""
    return f"{shard:05d}"


def shard_folder(shard: int) -> str:
    """Return the name of a shard's folder in the folder of its dataset."""
    return f"{SHARDS_NAME}/{shard_name(shard)}"


def completion_name(shard: int) -> str:
    """Return the name of a shard's completion file in the folder of its dataset."""
    return f"{shard_folder(shard)}.json"


def is_shard_file(name: object, shard: int) -> bool:
    """Return whether a name is that of a file in a shard's folder, as ``00000/00000_0.mcap``; completion files tell such names."""
    folder, _, file = name.partition("/") if isinstance(name, str) else ("", "", "")
    return folder == shard_name(shard) and _FILE_NAME.fullmatch(file) is not None

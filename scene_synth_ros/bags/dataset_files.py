"""Names and schemas of the files that datasets and sweeps have beside their bags, for those who write them and those who read them."""

PLAN_NAME, PLAN_SCHEMA = "dataset.json", "scene_synth_dataset/1"
DATASET_MANIFEST_NAME, DATASET_MANIFEST_SCHEMA = "manifest.json", "scene_synth_manifest/1"
"""Of a dataset; the manifest that is attached to a bag is :mod:`scene_synth_ros.bags.bag_manifest`'s."""
SHARDS_NAME, SHARD_SCHEMA = "shards", "scene_synth_shard/1"
SPLITS_NAME, SPLITS_SCHEMA = "splits.json", "scene_synth_splits/1"
SWEEP_NAME, SWEEP_SCHEMA = "sweep.json", "scene_synth_sweep/1"
VARIANTS_NAME = "variants"


def shard_name(shard: int) -> str:
    """Return the name of a shard's folder, and of its completion file without its ending."""
    return f"{shard:05d}"


def shard_folder(shard: int) -> str:
    """Return the name of a shard's folder in the folder of its dataset."""
    return f"{SHARDS_NAME}/{shard_name(shard)}"


def completion_name(shard: int) -> str:
    """Return the name of a shard's completion file in the folder of its dataset."""
    return f"{shard_folder(shard)}.json"

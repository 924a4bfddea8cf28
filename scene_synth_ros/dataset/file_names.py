"""Names and schemas of the files beside bags, by which datasets are written, found and read."""

PLAN_NAME, PLAN_SCHEMA = "dataset.json", "scene_synth_dataset/1"
MANIFEST_NAME, MANIFEST_SCHEMA = "manifest.json", "scene_synth_manifest/1"
SHARDS_NAME, SHARD_SCHEMA = "shards", "scene_synth_shard/1"
SPLITS_NAME, SPLITS_SCHEMA = "splits.json", "scene_synth_splits/1"

"""What completion files of strangers may say of paths."""

import json
from pathlib import Path

import pytest
from dataset_bags import write_dataset
from dataset_plans import tiny_plan

from scene_synth_ros.dataset import DatasetError, open_dataset
from scene_synth_ros.shards.completion import read_completion, sealed
from scene_synth_ros.shards.store import LocalStore

NAMES = ["00000/00000_0.mcap", "00000/../../secret", "../secret", "/etc/passwd", "00001/00001_0.mcap", "00000/", "00000/.x", "00000/a/b", 7]


@pytest.mark.parametrize("name", NAMES)
def test_only_plain_names_in_the_folder_of_the_shard_become_paths(name: object, tmp_path: Path) -> None:
    write_dataset(tmp_path / "set", shards=1, rooms=2)
    file = tmp_path / "set" / "shards" / "00000.json"
    plan, files = tiny_plan(2, 2), [{"name": name, "bytes": 1, "sha256": "0"}]
    told = {"files": files, "layers": {}, "messages": 0, "provenance": plan.provenance[0].to_mapping()}
    file.write_text(json.dumps(sealed(json.loads(file.read_text()) | told)))
    completion = read_completion(LocalStore(tmp_path / "set"), plan, 0)
    assert (completion is not None) == (name == NAMES[0])
    if completion is None:
        with pytest.raises(DatasetError, match="expected rooms and files of a shard, got name: expected a file of the shard"):
            open_dataset(tmp_path / "set")

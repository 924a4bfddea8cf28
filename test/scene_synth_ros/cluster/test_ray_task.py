"""What a Ray task refuses."""

import os
from pathlib import Path

import pytest

from scene_synth_ros.bags.run_info import versions
from scene_synth_ros.cluster.ray_task import make_on_node
from scene_synth_ros.shards.completion import ShardError
from scene_synth_ros.shards.plan import DatasetPlan


def test_a_node_that_does_not_see_the_dataset_makes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_setaffinity", lambda *_: None)  # of the process that tests
    monkeypatch.setattr("scene_synth_ros.cluster.ray_task.pin", lambda _: None)
    node = {"grammar_node": {}, "renderer_node": {}, "recorder_node": {}}
    for version, says in (("0.0.0", "expected scene_synth_ros 0.0.0"), ("", "take a URL or a shared folder")):
        plan = DatasetPlan(rooms=1, frames=1, seed=1, rooms_per_shard=1, parameters=node, version=version or versions()["scene_synth_ros"])
        with pytest.raises(ShardError, match=says):
            make_on_node(plan.to_json().decode(), str(tmp_path / "elsewhere"), 0, 1)
    assert not (tmp_path / "elsewhere").exists()

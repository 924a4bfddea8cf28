"""Progress of a dataset where no terminal is: what the plain lines count, and when they come."""

import pytest

from scene_synth_ros.cli.processes import dataset_progress
from scene_synth_ros.cli.processes.dataset_progress import DatasetProgress
from scene_synth_ros.shards.plan import DatasetPlan

PLAN = DatasetPlan(rooms=8, frames=4, seed=1, rooms_per_shard=2, parameters={})


def test_a_share_counts_its_own_shards_and_frames() -> None:
    with DatasetProgress(PLAN, range(1, 4, 2), [3]) as progress:
        assert progress.line(1.0) == "shard 1 of 2: 8 of 16 frames, 0.00 frames/s, no frame yet"
        progress.take({"what": "done", "shard": 3})
        assert progress.line(2.0) == "shard 2 of 2: 16 of 16 frames, 4.00 frames/s, 00:00 left"


def test_plain_lines_come_in_the_middle_of_a_long_shard(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    clock = [0.0]
    monkeypatch.setattr(dataset_progress, "monotonic", lambda: clock[0])
    with DatasetProgress(PLAN, range(4), range(4)) as progress:
        for seconds in (4.0, 8.0, 12.0, 16.0):
            clock[0] = seconds
            progress.take({"what": "frame", "room": 0})
    assert capsys.readouterr().err.splitlines() == ["shard 0 of 4: 3 of 32 frames, 0.25 frames/s, 01:56 left"]

"""What a Ray task refuses."""

import os
from dataclasses import replace
from pathlib import Path

import pytest
from dataset_plans import tiny_plan

from scene_description import SceneSynthError
from scene_synth_ros.cluster.ray_task import make_on_node


def test_a_node_that_does_not_see_the_dataset_makes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_setaffinity", lambda *_: None)  # of the process that tests
    monkeypatch.setattr("scene_synth_ros.cluster.ray_task.pin", lambda _: None)
    plan = tiny_plan(1, 1)
    older = replace(plan.provenance[0], versions={**plan.provenance[0].versions, "numba": "0.1.0"})
    for provenance, says in ((older, f"node {os.uname().nodename}: .*: numba .* here, 0.1.0 there"), (plan.provenance[0], "take a URL")):
        text = replace(plan, provenance=(provenance,)).to_json().decode()
        with pytest.raises(SceneSynthError, match=says):
            make_on_node(text, str(tmp_path / "elsewhere"), 0, 1)
    assert not (tmp_path / "elsewhere").exists()

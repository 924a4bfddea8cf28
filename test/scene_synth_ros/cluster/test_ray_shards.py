"""Shards as Ray tasks: on a cluster of two nodes of which one is killed at work, and on a Ray of the run's own."""

import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from ray_cluster import NODE, ray_cluster

from scene_synth_ros.bags.dataset_files import DATASET_MANIFEST_NAME, PLAN_NAME
from scene_synth_ros.cli.command_line import main
from scene_synth_ros.cluster.ray_shards import LOCAL, make_on_ray
from scene_synth_ros.shards.completion import ShardError, survey
from scene_synth_ros.shards.make_shard import make_shard
from scene_synth_ros.shards.plan import DatasetPlan, read_plan
from scene_synth_ros.shards.run_shards import finish_dataset
from scene_synth_ros.shards.store import LocalStore

pytestmark = pytest.mark.slow

ROOMS = 5
WORDS = ["--rooms", str(ROOMS), "--frames", "2", "--seed", "3", "--shard-rooms", "1", "--params", "ground_truth"]
WORDS += ["-p", "renderer_node.camera.width:=48", "-p", "renderer_node.camera.height:=36"]


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """Two nodes with a processor each, one of them the head."""
    with ray_cluster() as cluster:
        cluster.add_node(**NODE)
        yield cluster


def parent_of(process: int) -> int:
    """Return the parent of a process, 0 if it is gone."""
    try:
        return int(Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[1])
    except OSError:
        return 0


def kill_a_node_at_work(cluster: Any, shards: Path) -> Callable[[dict[str, Any]], None]:
    """Return what kills the raylet of the second node in the middle of a shard; it is called when shards are done."""
    (node,) = cluster.worker_nodes
    raylet = node.all_processes["raylet"][0].process.pid
    killed: list[int] = []

    def take(event: dict[str, Any]) -> None:
        end = time.monotonic() + 60.0
        while not killed:
            assert time.monotonic() < end, "the node is never at work"
            at_work = (int(path.name.split(".")[-2]) for path in shards.glob(".*.partial"))
            if any(parent_of(process) == raylet for process in at_work):
                node.kill_raylet(check_alive=False)
                killed.append(raylet)
            else:
                time.sleep(0.01)

    return take


def test_a_node_that_is_killed_at_work_changes_nothing_of_the_dataset(
    cluster: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken: list[str] = []

    class Progress:
        """In place of the line of progress: kills a node."""

        def __init__(self, plan: DatasetPlan, shards: range, missing: list[int]) -> None:
            self._kill = kill_a_node_at_work(cluster, tmp_path / "ray" / "shards")

        def take(self, event: dict[str, Any]) -> None:
            taken.append(event["what"])
            self._kill(event)

        def __enter__(self) -> "Progress":
            return self

        def __exit__(self, *_: object) -> None:
            pass

    monkeypatch.setattr("scene_synth_ros.cli.commands.generate_command.DatasetProgress", Progress)
    with pytest.raises(SystemExit) as ended:
        main(["generate", *WORDS, "--out", str(tmp_path / "ray"), "--ray", cluster.address])
    assert ended.value.code == 0
    assert taken == ["done"] * ROOMS

    alone = LocalStore(tmp_path / "alone")
    plan = read_plan((tmp_path / "ray" / PLAN_NAME).read_bytes(), PLAN_NAME)
    for shard in range(ROOMS):
        make_shard(plan, shard, alone)
    assert finish_dataset(plan, alone, survey(plan, alone))
    assert alone.read(DATASET_MANIFEST_NAME) == (tmp_path / "ray" / DATASET_MANIFEST_NAME).read_bytes()
    assert not list((tmp_path / "ray" / "shards").glob(".*"))


def test_a_ray_of_the_runs_own_begins_and_ends_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = DatasetPlan(rooms=1, frames=1, seed=1, rooms_per_shard=1, parameters={})
    with tempfile.TemporaryDirectory(dir="/tmp") as folder:  # the paths of sockets must be short
        monkeypatch.setattr("scene_synth_ros.cluster.ray_shards._temporary", lambda: folder)
        make_on_ray(plan, folder, [], address=LOCAL, workers=1)
        assert not list(Path(folder).iterdir())


def test_a_run_that_is_terminated_has_the_status_of_one_that_is(cluster: Any, tmp_path: Path) -> None:
    words = [sys.executable, "-m", "scene_synth_ros", "generate", *WORDS, "--out", str(tmp_path / "ended"), "--ray", cluster.address]
    run = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    while run.poll() is None and not list(tmp_path.glob("ended/shards/*.json")):
        time.sleep(0.1)
    run.terminate()
    output, _ = run.communicate(timeout=60.0)
    assert run.returncode == 128 + signal.SIGTERM, output
    assert output.splitlines()[-1].startswith("interrupted; what is complete stays"), output


@pytest.mark.parametrize("address", ["127.0.0.1:9", "ray://somewhere:10001", "nowhere"])
def test_an_address_where_no_ray_is_is_refused_in_one_line(address: str, tmp_path: Path) -> None:
    plan = DatasetPlan(rooms=1, frames=1, seed=1, rooms_per_shard=1, parameters={})
    with pytest.raises(ShardError, match=f"--ray {address}: ") as raised:
        make_on_ray(plan, str(tmp_path), [0], address=address, workers=1)
    assert "\n" not in str(raised.value)

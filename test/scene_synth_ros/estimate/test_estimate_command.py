"""``scene_synth estimate`` against the dataset itself, which is small enough to be made."""

import json
from pathlib import Path

import pytest

from scene_synth_ros.cli.command_line import main
from scene_synth_ros.cli.parameters.run_parameters import RunWords, run_parameters
from scene_synth_ros.estimate.estimate import Estimate, size, span
from scene_synth_ros.estimate.room_costs import Clocks, Measured, RoomCost
from scene_synth_ros.shards.make_shard import make_shard
from scene_synth_ros.shards.plan import make_plan
from scene_synth_ros.shards.store import LocalStore

SMALL = ("renderer_node.camera.width:=64", "renderer_node.camera.height:=48", "renderer_node.render.samples_per_pixel:=1")
TYPES = "grammar_node.scene.room_type:=bathroom,hallway"
ROOMS, FRAMES = 2, 3


@pytest.mark.slow
def test_bytes_are_those_of_the_dataset_where_all_rooms_are_measured(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = [word for override in (*SMALL, TYPES) for word in ("-p", override)]
    with pytest.raises(SystemExit) as ended:
        main(["estimate", "--rooms", str(ROOMS), "--frames", str(FRAMES), "--shard-rooms", str(ROOMS), "--workers", "1", "--json", *words])
    assert ended.value.code == 0
    document = json.loads(capsys.readouterr().out)
    made = run_parameters(RunWords(rooms=ROOMS, frames=FRAMES, overrides=(*SMALL, TYPES), record=Path("bag")))
    completion = make_shard(make_plan(made, rooms_per_shard=ROOMS), 0, LocalStore(tmp_path))
    assert [(room["index"], room["room_type"], room["frames"]) for room in document["sample"]] == [(0, "bathroom", 3), (1, "hallway", 3)]
    assert document["bytes"]["mean"] == pytest.approx(
        sum(file["bytes"] for file in completion["files"]), rel=0.07
    )  # small rooms share a chunk
    assert document["processor_s"]["mean"] == pytest.approx(sum(room["total"]["processor_s"] for room in document["sample"]))
    assert document["shards"] == 1


def room(index: int, processor_s: float) -> RoomCost:
    """Return a room of which 2 frames were rendered: 1 s to sample, 10 s a frame, the rest its own; a frame has 100 bytes."""
    return RoomCost(
        index=index,
        room_type="study",
        frames=2,
        synthesis=Clocks(1.0, 1.0),
        total=Clocks(processor_s, processor_s),
        frame=Clocks(10.0, 10.0),
        bytes_frames=200,
        bytes_room=50,
        bytes_bag=1000,
    )


def test_the_table_says_what_follows_from_the_rooms() -> None:
    measured = Measured(rooms=(room(0, 30.0), room(500, 30.0)), start_s=4.0, memory_bytes=10**9)
    estimate = Estimate(rooms=1000, frames=10, rooms_per_shard=10, workers=2, machines=5, measured=measured)
    assert estimate.processor_s.mean == 1000 * (30.0 + 8 * 10.0)
    assert estimate.bytes.mean == 1000 * (50 + 10 * 100) + 100 * 1000
    assert estimate.seconds(5).mean == 4.0 + 10 * 110_000.0 / 100  # 100 shards, 10 workers
    text = estimate.text()
    for words in (
        "processor hours                           30.6",
        "time here, 2 workers",
        "time on 5 such machines",
        "1.15 MB",
        "9 s to prepare",
    ):
        assert words in text, text
    assert room(3, 31.5) == RoomCost.from_mapping(json.loads(json.dumps(room(3, 31.5).to_mapping())))


def test_sizes_and_spans_read_as_people_say_them() -> None:
    assert [size(value) for value in (12, 1500, 2.5e12, 4e15, float("inf"))] == ["12 B", "1.5 kB", "2.5 TB", "4e+03 TB", "?"]
    assert [span(value) for value in (3.0, 90.0, 7200.0, 1.728e8)] == ["3 s", "1.5 min", "2 h", "2,000 days"]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--rooms", "0"], "rooms"),
        (["--rooms", "9", "--sample", "0"], "--sample: expected 1 to"),
        (["--rooms", "9", "--machines", "0"], "--mac"),
        (["--rooms", "9", "--shard-rooms", "0"], "--shard-rooms: expected 1 to"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(words: list[str], says: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["estimate", *words])
    assert ended.value.code == 2
    line = capsys.readouterr().err
    assert says in line
    assert line.count("\n") == 1

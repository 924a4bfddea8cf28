"""``scene_synth split`` on a bag: what it writes, what it tells, and that datasets and conversions read it."""

import json
from pathlib import Path

import numpy as np
import pytest
from room_bag import RoomBag, write_room_bag

from scene_synth_ros.cli.command_line import main
from scene_synth_ros.dataset import DatasetError, open_dataset

ROOMS, FRAMES = 5, 3


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> RoomBag:
    return write_room_bag(tmp_path_factory.mktemp("split") / "bag", rooms=ROOMS, frames=FRAMES, layers=("color", "instance", "semantic"))


def split(*words: object) -> int:
    with pytest.raises(SystemExit) as ended:
        main(["split", *map(str, words)])
    return int(ended.value.code or 0)


def test_every_room_is_in_one_split_and_datasets_read_it(bag: RoomBag, capsys: pytest.CaptureFixture[str]) -> None:
    assert split(bag.path, "--shares", "train=0.6,test=0.4") == 0
    told = capsys.readouterr().out
    found = {name: open_dataset(bag.path, layers=("color",), split=name) for name in ("train", "test")}
    rooms = {name: [data.frame(index).room for index in range(len(data))] for name, data in found.items()}
    assert sorted(rooms["train"] + rooms["test"]) == sorted(FRAMES * list(range(ROOMS)))
    assert not set(rooms["train"]) & set(rooms["test"])
    assert f"train: {len(set(rooms['train']))} rooms, {len(rooms['train'])} frames (bedroom {len(set(rooms['train']))})" in told
    first = (bag.path / "splits.json").read_bytes()
    assert split(bag.path, "--shares", "train=0.6,test=0.4", "--threads", 1) == 0
    assert (bag.path / "splits.json").read_bytes() == first
    with pytest.raises(DatasetError, match=r"expected split 'val', got train, test"):
        open_dataset(bag.path, layers=("color",), split="val")


def test_filters_and_what_they_leave_out(bag: RoomBag, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    brightness = {
        stamp: float(layers["color"].astype(float).mean(axis=(0, 1)) @ (0.2126, 0.7152, 0.0722)) / 255.0
        for stamp, layers in bag.images.items()
    }
    low = float(np.median(list(brightness.values()))) - 0.001
    stays = [brightness[stamp] >= low for stamp in sorted(bag.images)]
    out = tmp_path / "splits.json"
    assert split(bag.path, "--out", out, "--ranges", "train=0:3,val=3:4", "--brightness", f"{low}:") == 0
    document = json.loads(out.read_text())
    kept = {row["room"]: row["frames"] for rows in document["splits"].values() for row in rows}
    for room in range(4):
        own = [number for number in range(FRAMES) if stays[FRAMES * room + number]]
        assert kept.get(room, []) == (None if len(own) == FRAMES else own)
    refused = 4 * FRAMES - sum(stays[: 4 * FRAMES])
    assert document["left_out"] == {
        "ranges": {"rooms": 1, "frames": FRAMES, "alone": FRAMES},
        "brightness": {"rooms": 0, "frames": refused, "alone": refused},
    }
    assert document["filters"] == {"brightness": [low, 1.0]}
    assert f"left out by brightness: {refused} frames, {refused} of them by it alone" in capsys.readouterr().out


def test_a_balance_is_written_beside_the_same_rooms(bag: RoomBag, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plain, out = tmp_path / "plain.json", tmp_path / "splits.json"
    assert split(bag.path, "--out", plain, "--shares", "train=0.6,test=0.4") == 0
    capsys.readouterr()
    assert split(bag.path, "--out", out, "--shares", "train=0.6,test=0.4", "--balance", 0.5) == 0
    document, before = json.loads(out.read_text()), json.loads(plain.read_text())
    names = {row.pop("room"): row for row in document["splits"]["train"]}
    assert list(names) == [row["room"] for row in before["splits"]["train"]]
    assert all(len(row["weights"]) == FRAMES and min(row["weights"]) >= 1.0 for row in names.values())
    data = open_dataset(bag.path, layers=("semantic",), split="train")
    seen = sum(bool((frame["semantic"] > 0).any()) for frame in data)
    assert seen and max(row["frames"] for row in document["classes"]["train"].values()) <= seen
    assert sum(row["pixels"] for row in document["classes"]["train"].values()) == pytest.approx(1.0, abs=1e-4)
    assert "train: rarest class " in capsys.readouterr().out


def test_near_views_of_a_room_that_differ_in_colour_stay(bag: RoomBag, tmp_path: Path) -> None:
    out = tmp_path / "splits.json"
    assert split(bag.path, "--out", out, "--shares", "all=1", "--near", "0.1:5:0:0.01") == 0
    assert all(row["frames"] is None for row in json.loads(out.read_text())["splits"]["all"])
    assert split(bag.path, "--out", out, "--shares", "all=1", "--near", "0.1:5:0:1") == 0
    document = json.loads(out.read_text())
    assert [row["frames"] for row in document["splits"]["all"]] == ROOMS * [[0]]
    assert document["left_out"]["near"]["frames"] == ROOMS * (FRAMES - 1)


def test_categories_that_no_frame_sees_are_told(bag: RoomBag, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert split(bag.path, "--out", tmp_path / "splits.json", "--sees", "beds,bed", "--shares", "all=1") == 0
    told = capsys.readouterr()
    assert told.err.startswith("scene_synth split: --sees beds: no frame sees one; frames see bed,")
    seen = [
        stamp
        for stamp, layers in bag.images.items()
        if np.isin(layers["instance"], [item.id for item in bag.scenes[0].objects if item.category == "bed"]).any()
    ]
    assert f"all: {ROOMS} rooms, {len(seen)} frames" in told.out


def test_rooms_of_one_index_in_two_bags_are_told_apart(tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_room_bag(tmp_path / "bags" / name, rooms=2, frames=1, size=(8, 8), layers=("color",))
    out = tmp_path / "bags" / "splits.json"
    rows = [{"room": 1, "scene": "sample-1", "copy": 1, "frames": None}, {"room": 0, "frames": [0]}]
    assert split(tmp_path / "bags", "--out", out, "--shares", "all=1") == 0
    assert rows[0] in json.loads(out.read_text())["splits"]["all"]
    out.write_text(json.dumps({"schema": "scene_synth_splits/1", "splits": {"all": rows}}))
    data = open_dataset(tmp_path / "bags", layers=("color",), split="all")
    whole = open_dataset(tmp_path / "bags", layers=("color",))
    assert [np.array_equal(data[0]["color"], whole[3]["color"]), np.array_equal(data[1]["color"], whole[0]["color"])] == [True, True]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--ev100", "5:9"), "--ev100 needs the exposure in the renderer's settings, got none"),
        (("--sees", "bed", "--visible-fraction", "0.5"), "--visible-fraction needs annotations, got none"),
        (("--ranges", "a=0:1", "--shares", "a=1"), "expected either ranges or shares"),
        (("--room-types", "kitchens,bedroom"), "--room-types kitchens: expected types that the source has: bedroom"),
        (("--sees", "unicorn"), "expected frames that stay, got none of 15: sees leaves out 15; --sees unicorn: no frame sees one"),
        (("--ranges", "a=50:60"), "expected frames that stay, got none of 15: ranges leaves out 15"),
        (("--out", "."), "--out .: expected a file, got a folder"),
        (("--threads", "0"), "--threads: expected 1 to 64, got 0"),
        (("--image-share", "0.5"), "expected --sees or --objects"),
        (("--image-share", "2", "--sees", "bed"), "--image-share: expected 0 to 1"),
        (("--out", "nowhere/here/splits.json"), "expected a file in a folder that exists"),
    ],
)
def test_what_cannot_be_done_is_one_line(
    bag: RoomBag, tmp_path: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, ...], told: str
) -> None:
    assert split(bag.path, *(() if "--out" in words else ("--out", tmp_path / "s.json")), *words) == 2
    line = capsys.readouterr().err.strip()
    assert told in line
    assert "\n" not in line
    assert not list(tmp_path.iterdir())

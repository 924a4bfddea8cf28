"""Shards, folders of bags and URLs are one dataset; what is not whole is told, what is wrong is one line."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fsspec
import numpy as np
import pytest
from dataset_bags import FRAMES, LAYERS, OURS, write_dataset
from room_bag import write_room_bag

from scene_synth_ros.dataset import Dataset, DatasetError, open_dataset, without_damaged


def pixels_of(data: Dataset) -> dict[int, dict[str, bytes]]:
    return {frame.stamp_ns: {layer: pixels.tobytes() for layer, pixels in frame.items()} for frame in data}


def bytes_of(images: dict[int, dict[str, np.ndarray]]) -> dict[int, dict[str, bytes]]:
    return {stamp: {layer: pixels.tobytes() for layer, pixels in of_frame.items()} for stamp, of_frame in images.items()}


def test_shards_are_one_dataset_whose_bags_are_opened_when_they_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    images = write_dataset(tmp_path / "rooms", shards=3, layers=LAYERS)
    data = open_dataset(tmp_path / "rooms")
    assert len(data) == 18 and [room.index for room in data.rooms] == [0, 1, 2, 3, 4, 5] and data.notes == []
    assert list(data._open) == [0]
    assert data[17].room == 5 and list(data._open) == [0, 2]
    files = os.listdir("/proc/self/fd")
    assert pixels_of(data) == bytes_of(images) and os.listdir("/proc/self/fd") == files
    assert [frame.room for frame in data] == [index // FRAMES for index in range(18)]
    monkeypatch.setattr("scene_synth_ros.dataset.dataset.OPEN_BAGS", 1)
    again = open_dataset(tmp_path / "rooms")
    for index in (17, 0, 8):
        np.testing.assert_array_equal(again[index]["depth"], images[data[index].stamp_ns]["depth"])
    assert len(again._open) == 1


def test_shards_without_completion_file_are_left_out_and_told(tmp_path: Path) -> None:
    write_dataset(tmp_path / "rooms", complete=1, layers=LAYERS)
    data = open_dataset(tmp_path / "rooms")
    assert len(data) == 6
    assert data.notes == [
        f"{tmp_path / 'rooms'}: 1 of 2 shards are complete; the others are left out, scene_synth generate --resume makes them"
    ]


def test_a_manifest_that_is_too_large_is_passed_over_for_completion_files_which_have_the_same_bound(tmp_path: Path) -> None:
    write_dataset(tmp_path / "rooms", layers=LAYERS)
    for name in ("manifest.json", "shards/00000.json"):
        with (tmp_path / "rooms" / name).open("ab") as file:
            file.truncate(40 * 2**20 + 1)  # of zeros
        if name == "manifest.json":
            assert len(open_dataset(tmp_path / "rooms")) == 12
    with pytest.raises(DatasetError, match=r"00000\.json: expected at most 41943040 bytes of JSON, got 41943041; "):
        open_dataset(tmp_path / "rooms")


def test_a_folder_of_bags_is_a_dataset(tmp_path: Path) -> None:
    images = {}
    for number in range(2):
        images |= write_room_bag(tmp_path / f"bag{number}", rooms=1, first_room=number, layers=LAYERS).images
    data = open_dataset(tmp_path)
    assert pixels_of(data) == bytes_of(images) and [room.index for room in data.rooms] == [0, 1]
    assert len(open_dataset(next((tmp_path / "bag1").glob("*.mcap")))) == 3


def test_a_split_has_its_rooms_and_frames_in_their_order(tmp_path: Path) -> None:
    folder = tmp_path / "rooms"
    write_dataset(folder, layers=LAYERS)
    splits = {"train": [{"room": 3, "frames": None}, {"room": 0, "frames": [2, 0]}], "test": [{"room": 1, "frames": [3]}]}
    (folder / "splits.json").write_text(json.dumps({"schema": "scene_synth_splits/1", "splits": splits}))
    data = open_dataset(folder, split="train")
    assert [(frame.room, frame.number) for frame in data] == [(3, 0), (3, 1), (3, 2), (0, 2), (0, 0)]
    assert [frame.index for frame in data] == [0, 1, 2, 3, 4] and list(data.frames_of(0)) == [3, 4]
    with pytest.raises(DatasetError, match="expected split 'val', got train, test"):
        open_dataset(folder, split="val")
    with pytest.raises(DatasetError, match=r"splits.test\[0\]: expected frames of room 1 from 0 to 2, got 3"):
        open_dataset(folder, split="test")


def test_a_shuffled_dataset_has_every_frame_once_and_goes_from_bag_to_bag(tmp_path: Path) -> None:
    write_dataset(tmp_path / "rooms", shards=4, rooms=1, layers=LAYERS)
    data = open_dataset(tmp_path / "rooms")
    mixed = data.shuffled(seed=1, bags=2)
    rooms = [frame.room for frame in mixed]
    stamps = [frame.stamp_ns for frame in mixed]
    assert sorted(stamps) == [frame.stamp_ns for frame in data] and stamps != sorted(stamps)
    assert len({*rooms[:6]}) == len({*rooms[6:]}) == 2
    assert [frame.stamp_ns for frame in data.shuffled(seed=1, bags=2)] == stamps != [frame.stamp_ns for frame in data.shuffled(2, bags=2)]


def test_an_unfinished_bag_is_read_as_far_as_it_goes(tmp_path: Path) -> None:
    bag = write_room_bag(tmp_path / "bag", chunk_size=9000, records=OURS, layers=LAYERS)
    file = next(bag.path.glob("*.mcap"))
    file.with_name(f"{file.name}.active").write_bytes(file.read_bytes()[: file.stat().st_size * 2 // 3])
    file.unlink()
    data = open_dataset(bag.path)
    assert 0 < len(data) < 6 and any("unfinished" in note for note in data.notes)
    assert pixels_of(data).items() <= bytes_of(bag.images).items()


def test_damage_is_told_with_file_and_frame(tmp_path: Path) -> None:
    bag = write_room_bag(tmp_path / "bag", chunk_size=9000, records=OURS, layers=LAYERS)
    file = next(bag.path.glob("*.mcap"))
    octets = bytearray(file.read_bytes())
    octets[len(octets) // 2] ^= 0xFF
    file.write_bytes(octets)
    data, told = open_dataset(bag.path), []
    for frame in data:
        try:
            assert dict(frame)["depth"].tobytes() == bag.images[frame.stamp_ns]["depth"].tobytes()
        except DatasetError as error:
            told.append(str(error))
    assert told and len(told) < 4 and all("\n" not in line and str(file) in line and "frame " in line for line in told)


def write_train(folder: Path, rows: str) -> None:
    (folder / "splits.json").write_text(f'{{"schema": "scene_synth_splits/1", "splits": {{"train": {rows}}}}}')


@pytest.mark.parametrize(
    ("change", "options", "line"),
    [
        (lambda folder: None, {"layers": ("color", "flow")}, r"expected layers flow, got none; /synth/camera has color, depth, semantic"),
        (lambda folder: None, {"camera": "left"}, "expected camera 'left', got /synth/camera"),
        (lambda folder: None, {"split": "train"}, "expected splits.json for the split 'train', got none"),
        (lambda folder: write_train(folder, "5"), {"split": "train"}, "expected split 'train', got train"),
        (lambda folder: write_train(folder, f'[{{"room": 0, "frames": [{2**63}]}}]'), {"split": "train"}, "expected a room and its frames"),
        (lambda folder: (folder / "shards" / "00000.json").write_text("{"), {}, r"00000.json: expected JSON, got"),
        (
            lambda folder: (folder / "shards" / "00000.json").write_text('{"schema": "x"}'),
            {},
            "expected schema scene_synth_shard/1, got 'x'",
        ),
        (lambda folder: (folder / "shards" / "00000.json").unlink(), {}, "expected complete shards, got none"),
        (lambda folder: next(folder.glob("shards/*/*.mcap")).unlink(), {}, "00000_0.mcap: No such file or directory"),
        (lambda folder: next(folder.glob("shards/*/*.mcap")).write_bytes(b"no"), {}, "no MCAP file"),
        (
            lambda folder: edit(folder, '"frames": 3', '"frames": 4'),
            {},
            "expected 4 frames with color, depth, semantic, got 3; make it again",
        ),
        (lambda folder: edit(folder, "00000/00000_0.mcap", "../../etc/passwd"), {}, "expected rooms and files of a shard"),
    ],
)
def test_faults_are_one_line(tmp_path: Path, change: Callable[[Path], Any], options: dict[str, Any], line: str) -> None:
    folder = tmp_path / "rooms"
    write_dataset(folder, shards=1, rooms=1, layers=LAYERS)
    change(folder)
    with pytest.raises(DatasetError, match=line) as raised:
        open_dataset(folder, **options)
    assert "\n" not in str(raised.value)


def edit(folder: Path, old: str, new: str) -> None:
    file = folder / "shards" / "00000.json"
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new))


def test_what_is_not_there_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match=r"expected a bag, .*, got nothing there"):
        open_dataset(tmp_path / "nothing")
    with pytest.raises(DatasetError, match="expected a bag, bags in folders, or a dataset, got an empty folder"):
        open_dataset(tmp_path)
    with pytest.raises(DatasetError, match=r"nosuch://x: .*not known"):
        open_dataset("nosuch://x")
    with pytest.raises(DatasetError, match=r"memory://nothing: expected a bag, .*, got nothing there"):
        open_dataset("memory://nothing")
    write_room_bag(tmp_path / "bag", rooms=1, layers=LAYERS)
    with pytest.raises(KeyError, match="expected one of color, depth, semantic, got layer 'flow'"):
        open_dataset(tmp_path / "bag")[0]["flow"]


def test_a_url_is_read_in_pieces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    images = write_dataset(tmp_path / "rooms", shards=2, rooms=1, size=(480, 640), compression="none", layers=LAYERS)
    memory = fsspec.filesystem("memory")
    memory.put(str(tmp_path / "rooms"), "/rooms", recursive=True)
    try:
        data = open_dataset("memory://rooms")
        read: list[int] = []
        cat_file = type(memory).cat_file

        def counted(*args: Any, **options: Any) -> bytes:
            read.append(len(piece := cat_file(*args, **options)))
            return piece

        monkeypatch.setattr(type(memory), "cat_file", counted)
        frame = data[1]
        own = {layer: pixels.tobytes() for layer, pixels in frame.items()}
        assert own == bytes_of(images)[frame.stamp_ns]
        assert sum(map(len, own.values())) <= sum(read) < sum(file.stat().st_size for file in tmp_path.glob("rooms/shards/*/*.mcap")) / 2
        assert pixels_of(data) == bytes_of(images)
    finally:
        memory.rm("/rooms", recursive=True)


@pytest.mark.parametrize(
    ("layers", "error"),
    [
        ("color", "expected names of layers, got the single text 'color'; write it as ('color',)"),
        ((), "expected a layer at least, got none"),
    ],
)
def test_layers_that_are_no_names_are_one_line(layers: Any, error: str, tmp_path: Path) -> None:
    write_room_bag(tmp_path / "bag", rooms=1, layers=LAYERS)
    with pytest.raises(DatasetError) as raised:
        open_dataset(tmp_path / "bag", layers=layers)
    assert str(raised.value) == f"{tmp_path / 'bag'}: layers: {error}"


def test_what_is_no_bag_and_a_bag_without_images_are_told_apart(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("none")
    with pytest.raises(DatasetError, match=r"notes.txt: expected a bag, .*got a file of another kind"):
        open_dataset(tmp_path / "notes.txt")
    write_dataset(tmp_path / "rooms", layers=LAYERS)
    (file,) = (tmp_path / "rooms" / "shards" / "00000").glob("*.mcap")
    os.truncate(file, 2000)
    with pytest.raises(DatasetError, match=r"shards/00000: expected images of a camera, got no camera with images; .*00000.*mcap: "):
        open_dataset(tmp_path / "rooms")


def test_a_bag_without_colour_opens_by_default(tmp_path: Path) -> None:
    write_room_bag(tmp_path / "bag", rooms=1, layers=("depth", "semantic", "normals"))
    data = open_dataset(tmp_path / "bag")
    assert (len(data), data.layers) == (3, ("depth", "semantic"))
    assert data.notes == [f"{tmp_path / 'bag'}: color of /synth/camera not recorded; frames have depth, semantic"]
    write_room_bag(tmp_path / "other", rooms=1, layers=("normals",))
    assert open_dataset(tmp_path / "other").layers == ("normals",)
    with pytest.raises(DatasetError, match="expected layers color, got none"):
        open_dataset(tmp_path / "bag", layers=("color", "depth"))


def test_a_damaged_frame_is_skipped_on_request_and_counted(tmp_path: Path) -> None:
    images = write_room_bag(tmp_path / "bag", rooms=2, layers=("depth",), records=OURS, chunk_size=100, compression="none").images
    (file,) = (tmp_path / "bag").glob("*.mcap")
    stamps = sorted(images)
    data, place = file.read_bytes(), file.read_bytes().index(images[stamps[2]]["depth"].tobytes())
    file.write_bytes(data[:place] + b"\xff" * 8 + data[place + 8 :])
    with pytest.raises(DatasetError):
        list(open_dataset(tmp_path / "bag", transform=dict))
    for transform in (None, dict):
        found = open_dataset(tmp_path / "bag", transform=transform, damaged="skip")
        with pytest.warns(UserWarning, match="skipped a damaged frame: .*frame 2 "):
            items = list(found)
        assert (len(found), len(items), found.damaged) == (6, 5, {2})
        with pytest.warns(UserWarning):
            assert found[2:3][0] is None and found.damaged == {2}
        with pytest.warns(UserWarning):
            assert without_damaged(len)([found[index] for index in range(6)]) == 5
    assert without_damaged(len)([None]) is None
    with pytest.raises(DatasetError, match="damaged: expected refuse or skip, got 'no'"):
        open_dataset(tmp_path / "bag", damaged="no")  # type: ignore[arg-type]

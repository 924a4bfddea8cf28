"""A damaged or huge picture in a message is one line of error, wherever it is read, and costs no more memory than its camera's size."""

import io
import json
import struct
import tracemalloc
import zlib
from pathlib import Path

import numpy as np
import pytest
from dataset_bags import OURS
from PIL import Image as Picture
from report_bag import write_sweep
from room_bag import CAMERA, write_room_bag

from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.cli.command_line import main
from scene_synth_ros.cli.page.page_file import write_page
from scene_synth_ros.dataset import DatasetError, open_dataset
from scene_synth_ros.messages.cdr import CdrReader, CdrWriter
from scene_synth_ros.messages.streams import COMPRESSED_TYPE
from scene_synth_ros.report.report_file import write_report

SIZE = (48, 64)


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(height: int, width: int, kind: bytes = b"IDAT", channels: int = 1) -> bytes:
    """Return a black PNG, half of its pixels in a chunk of some kind."""
    packer = zlib.compressobj(9)
    row, color = bytes(1 + width * channels), 0 if channels == 1 else 2
    data = b"".join([*(packer.compress(row) for _ in range(height)), packer.flush()])
    head = struct.pack(">IIBBBBB", width, height, 8, color, 0, 0, 0)
    half = len(data) // 2
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data[:half]) + chunk(kind, data[half:]) + chunk(b"IEND", b"")


def jpeg() -> bytes:
    file = io.BytesIO()
    Picture.fromarray(np.zeros((*SIZE, 3), np.uint8)).save(file, "JPEG")
    return file.getvalue()


HUGE = png(13000, 13000)
PICTURES = {
    "wrong chunk": png(*SIZE, b"ID\x01\xff", 3),
    "critical chunk": png(*SIZE, b"IDAX", 3),
    "no pixels": png(*SIZE, channels=3)[:40],
    "too few pixels": png(4, 64, channels=3).replace(struct.pack(">II", 64, 4), struct.pack(">II", 64, 48)),
    "no size": png(*SIZE, channels=3).replace(struct.pack(">II", 64, 48), bytes(8)),
    "another size": png(49, 64, channels=3),
    "huge": HUGE,
    "cut JPEG": jpeg()[:200],
    "JPEG of another size": jpeg().replace(struct.pack(">HH", 48, 64), struct.pack(">HH", 6000, 6000)),
    "neither": b"GIF89a" + bytes(40),
    "nothing": b"",
}


def with_picture(folder: Path, picture: bytes, layer: str = "color", transport: str = "compressed") -> Path:
    """Write a bag of one room whose images of a layer are compressed, that of the second frame is a picture."""
    whole = write_room_bag(folder / "whole", rooms=1, size=SIZE, records=OURS, layers=("color", "depth", "semantic"))
    source = f"{CAMERA}/{layer}/image_raw"
    with BagReader(whole.path) as reader, BagWriter(folder / "bag") as writer:
        writer.set_record("scene_synth", OURS["scene_synth"])
        stamps = sorted({message.log_ns for message in reader.messages()})
        for message in reader.messages():
            topic, kind, data = message.topic, message.type_name, message.data
            if topic == source:
                packed = CdrWriter()
                packed.header(message.log_ns, CdrReader(data).header().frame_id)
                packed.text("png")
                file = io.BytesIO()
                Picture.fromarray(whole.images[message.log_ns]["color"]).save(file, "PNG")
                octets = picture if message.log_ns == stamps[1] else file.getvalue() if layer == "color" else bytes(12) + png(*SIZE)
                packed.numbers("I", len(octets))
                topic, kind, data = f"{source}/{transport}", COMPRESSED_TYPE, packed.message() + octets
            writer.add_topic(topic, kind)
            writer.write(topic, data, message.log_ns, message.publish_ns)
    return folder / "bag"


@pytest.mark.parametrize("name", PICTURES)
def test_a_damaged_picture_is_one_line_and_the_others_are_read(name: str, tmp_path: Path) -> None:
    data = open_dataset(with_picture(tmp_path, PICTURES[name]))
    assert [data[index]["color"].shape for index in (0, 2)] == [(*SIZE, 3)] * 2
    tracemalloc.start()
    with pytest.raises(DatasetError) as raised:
        data[1]["color"]
    assert tracemalloc.get_traced_memory()[1] < 5 * 2**20
    tracemalloc.stop()
    line = str(raised.value)
    assert "\n" not in line and "frame 1 (room 0, stamp 1200000000 ns), layer color: " in line
    assert ("expected 64x48 pixels, as camera_info says, got " in line) == (name in ("another size", "huge", "JPEG of another size"))


@pytest.mark.parametrize(
    "picture", [b"", b"\1" * 11, bytes(12), bytes(12) + png(*SIZE, channels=3), bytes(12) + HUGE, bytes(12) + png(*SIZE, b"ID\1\xff")]
)
def test_a_damaged_compressed_depth_is_one_line(picture: bytes, tmp_path: Path) -> None:
    data = open_dataset(with_picture(tmp_path, picture, "depth", "compressedDepth"))
    assert data[0]["depth"].shape == SIZE
    with pytest.raises(DatasetError, match="layer depth: ") as raised:
        data[1]["depth"]
    assert "\n" not in str(raised.value)


def test_a_raw_image_of_another_size_or_of_none_is_one_line(tmp_path: Path) -> None:
    bag = write_room_bag(tmp_path / "bag", rooms=1, size=SIZE, layers=("color",))
    with BagReader(bag.path) as reader, BagWriter(tmp_path / "other") as writer:
        for message in reader.messages():
            data = message.data
            if message.topic.endswith("image_raw"):
                data = data.replace(struct.pack("<II", *SIZE), struct.pack("<II", 2**32 - 1, 0))
            writer.add_topic(message.topic, message.type_name)
            writer.write(message.topic, data, message.log_ns, message.publish_ns)
    with pytest.raises(DatasetError, match=r"layer color: expected 64x48 pixels, as camera_info says, got 0x4294967295$"):
        open_dataset(tmp_path / "other", layers=("color",))[0]["color"]


@pytest.mark.parametrize("name", ["wrong chunk", "huge", "cut JPEG", "another size"])
def test_every_reader_of_bags_says_one_line(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = with_picture(tmp_path, PICTURES[name])
    page = write_page(bag, tmp_path / "page.html", rooms=1, frames=3, max_size=64)
    assert [note for note in page.notes if "a message cannot be shown" in note] and all("\n" not in note for note in page.notes)
    evaluation = write_sweep(tmp_path / "sweep")
    told = json.loads(evaluation.read_text())
    for frame in told["frames"]:
        frame["bag"] = "../bag"
    evaluation.write_text(json.dumps(told))
    report = write_report(
        [evaluation], tmp_path / "report.html", worst=9, bag_root=None, estimates=None, max_size=64, progress=lambda _: None
    )
    assert [note for note in report.notes if "cannot be shown" in note] and all("\n" not in note for note in report.notes)
    if name in ("huge", "another size"):
        for notes in (page.notes, report.notes):
            assert [note for note in notes if "expected 64x48 pixels, as camera_info says" in note], notes
    for words in (["convert", bag, "--to", "euroc"], ["convert", bag, "--to", "nerfstudio"]):
        with pytest.raises(SystemExit) as status:
            main([*map(str, words), "--out", str(tmp_path / f"out_{words[-1]}")])
        line = capsys.readouterr().err.strip().splitlines()[-1]
        assert status.value.code == 2 and "frame 1" in line and "layer color" in line and "Traceback" not in line, line
        assert not (tmp_path / f"out_{words[-1]}").exists()


def test_the_truth_of_an_evaluation_may_be_damaged(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = with_picture(tmp_path, bytes(12) + PICTURES["wrong chunk"], "depth", "compressedDepth")
    words = ["evaluate", str(bag), "--task", "depth", "--topic", f"depth:={CAMERA}/depth/image_raw/compressedDepth"]
    with pytest.raises(SystemExit) as status:
        main(words)
    told = "".join(capsys.readouterr())
    assert status.value.code == 0 and "Traceback" not in told, told
    assert [line for line in told.splitlines() if "cannot be read" in line and "expected PNG or JPEG" in line], told

"""A page holds what the bag holds, to the pixel; what a bag says cannot act in it; what a bag lacks is said."""

import argparse
import base64
import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_samples import write_bag as write_small_bag
from geometry_msgs.msg import PoseStamped
from html_page import parse
from nav_msgs.msg import OccupancyGrid
from PIL import Image as Picture
from room_bag import CAMERA, RoomBag, write, write_room_bag
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import String

from renderer import LAYERS
from scene_description import SceneSynthError
from scene_description.labels import NYU40
from scene_synth_ros.bags.bag_reader import BagReader, BagReadError
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.bags.run_info import PARAMETERS_NAME, parameters_file
from scene_synth_ros.cli.commands import demo_command, run_command, show_command
from scene_synth_ros.cli.page import page_file
from scene_synth_ros.cli.page.bag_index import OTHERS, find_layers
from scene_synth_ros.cli.page.page_file import PageReport, write_page
from scene_synth_ros.cli.page.page_images import MOST_MM, NO_HIT_MM, PageImageError, distance_codes, form_of, page_image
from scene_synth_ros.messages.streams import COMPRESSED_TYPE, IMAGE_TYPE

EVIL = "</script><script>window.owned = 1</script><img src=x onerror='window.owned = 2'>\u2028&amp;{{data}}"


def page_of(bag: Path, page: Path, rooms: int = 8, frames: int = 8, max_size: int = 640) -> tuple[PageReport, dict[str, Any]]:
    report = write_page(bag, page, rooms=rooms, frames=frames, max_size=max_size)
    return report, json.loads(parse(page).scripts[0])


def decoded(entry: dict[str, Any]) -> np.ndarray:
    return np.asarray(Picture.open(io.BytesIO(base64.b64decode(entry["data"]))))


def numbers(entry: dict[str, Any]) -> np.ndarray:
    """Return the 16-bit numbers of an image of a page, as its script reads them."""
    pixels = decoded(entry).astype(np.int64)
    assert entry["sum"] == pixels.sum()
    return pixels[..., 0] * 256 + pixels[..., 1]


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> RoomBag:
    parameters = {"/synth/grammar_node": {"seed": 7, "rooms": 0, "scene.beta": 0.0, "scene.room_type": "kitchen", "odd": True}}
    attachments = {PARAMETERS_NAME: parameters_file(parameters)}
    return write_room_bag(tmp_path_factory.mktemp("bags") / "bag", attachments=attachments)


def test_the_page_has_the_pixels_of_the_bag(bag: RoomBag, tmp_path: Path) -> None:
    report, data = page_of(bag.path, tmp_path / "page.html")
    assert report == PageReport(2, 2, 6, 6, (tmp_path / "page.html").stat().st_size, ())
    assert [len(room["frames"]) for room in data["rooms"]] == [3, 3]
    for frame in (frame for room in data["rooms"] for frame in room["frames"]):
        found, true = frame["cameras"][CAMERA]["images"], bag.images[int(frame["stamp"])]
        assert list(found) == ["color", "depth", "normals", "semantic", "instance"]
        assert all((image["width"], image["height"], image["shown"]) == (64, 48, [64, 48]) for image in found.values())
        for layer in ("semantic", "instance"):
            np.testing.assert_array_equal(numbers(found[layer]), true[layer])
            ids, counts = np.unique(true[layer], return_counts=True)
            assert found[layer]["counts"] == {str(key): int(count) for key, count in zip(ids, counts, strict=True)}
        codes = numbers(found["depth"])
        assert codes[0, :3].tolist() == [NO_HIT_MM, 0, MOST_MM]
        rest = np.isfinite(true["depth"]) & (true["depth"] < 60.0)
        assert np.abs(codes[rest] / 1000.0 - true["depth"][rest]).max() <= 0.000501
        normals = decoded(found["normals"])
        assert not normals[0, 0].any()
        assert np.abs(normals / 127.5 - 1.0 - true["normals"])[1:].max() <= 0.5 / 127.5 + 1e-6
        assert np.abs(decoded(found["color"]).astype(int) - true["color"]).mean() < 4.0, "JPEG is near the bag's colour"


def test_a_smaller_page_keeps_rows_and_columns_as_they_are(bag: RoomBag, tmp_path: Path) -> None:
    _, data = page_of(bag.path, tmp_path / "page.html", max_size=16)
    frame = data["rooms"][0]["frames"][1]
    entry, true = frame["cameras"][CAMERA]["images"]["instance"], bag.images[int(frame["stamp"])]["instance"]
    assert entry["shown"] == [16, 12] and (entry["width"], entry["height"]) == (64, 48)
    np.testing.assert_array_equal(numbers(entry), true[2::4, 2::4])
    assert sum(entry["counts"].values()) == 48 * 64, "pixels are counted in the bag's image"


def test_rooms_and_frames_are_spread_over_the_bag(tmp_path: Path) -> None:
    bag = write_room_bag(tmp_path / "bag", rooms=6, frames=9, size=(6, 8), layers=("color",))
    report, data = page_of(bag.path, tmp_path / "page.html", rooms=2, frames=3)
    assert report[:4] == (2, 6, 6, 54) and (data["rooms_found"], data["frames_found"]) == (6, 54)
    assert [dict(room["facts"])["index"] for room in data["rooms"]] == ["1", "4"]
    stamps = [pose.stamp_ns for pose in bag.scenes[1].camera_path]
    assert [int(frame["stamp"]) for frame in data["rooms"][0]["frames"]] == [stamps[1], stamps[4], stamps[7]]
    assert data["rooms"][0]["found"] == 9


def test_the_page_tells_objects_topics_and_the_run(bag: RoomBag, tmp_path: Path) -> None:
    _, data = page_of(bag.path, tmp_path / "page.html")
    room = data["rooms"][1]
    assert [(row["id"], row["category"], row["on"]) for row in room["objects"]] == [
        (1, "door", "wall 0"),
        (2, "window", "wall 2"),
        (3, "bed", "floor"),
        (4, "nightstand", "floor"),
        (5, "table_lamp", "nightstand 4"),
        (6, "ceiling_lamp", "ceiling"),
    ]
    assert room["objects"][2]["size"] == [2.1, 1.6, 1.0] and room["objects"][2]["position"] == [1.1, 1.8, 0.0]
    assert room["plan"]["floor"] == [[0, 0], [4, 0], [4, 3.5], [0, 3.5]] and room["map"]["rectangle"] == [0, 0, 4, 3.5]
    assert dict(room["facts"]) | {"layout energy": "1.000", "type": "bedroom", "floor": "14.0 m², 2.60 m high"} == dict(room["facts"])
    assert room["labels"]["semantic"]["4"] == {"name": "bed", "color": list(NYU40[4].color)}
    assert room["labels"]["instance"]["3"]["name"] == "bed"
    assert [(name, text) for name, text in data["run"] if name in ("frames", "rate", "duration")] == [
        ("frames", "6 in 2 rooms"),
        ("rate", "5 Hz"),
        ("duration", "1.000 s"),
    ]
    topics = {name: (kind, messages) for name, kind, messages, _ in data["topics"]}
    assert topics[f"{CAMERA}/depth/image_raw"] == ("sensor_msgs/msg/Image", 6) and topics["/synth/scene"] == ("std_msgs/msg/String", 2)
    assert data["parameters"] == [
        ["/synth/grammar_node", "odd", "true", "?"],
        ["/synth/grammar_node", "scene.room_type", "kitchen", "bedroom"],
        ["/synth/grammar_node", "seed", "7", "1"],
    ]


def test_nothing_that_a_bag_says_is_markup_and_nothing_is_loaded(tmp_path: Path) -> None:
    labels = {str(key): {"name": EVIL, "color": ["red", 1, 2]} for key in range(41)}
    bag = write_room_bag(
        tmp_path / "<b>&", rooms=1, frames=1, labels=labels, attachments={PARAMETERS_NAME: parameters_file({EVIL: {EVIL: EVIL}})}
    )
    report, data = page_of(bag.path, tmp_path / "page.html")
    assert data["rooms"][0]["labels"]["semantic"]["5"]["name"] == EVIL[:120] and data["title"] == "<b>&"
    assert all(isinstance(value, int) for value in data["rooms"][0]["labels"]["semantic"]["5"]["color"])
    plain = parse(page_of(write_room_bag(tmp_path / "plain", rooms=1, frames=1).path, tmp_path / "plain.html") and tmp_path / "plain.html")
    page = parse(tmp_path / "page.html")
    assert page.tags == plain.tags and page.scripts[1] == plain.scripts[1]
    assert not report.notes
    assert not [attributes for _, attributes in page.tags if "src" in attributes or attributes.get("href", "data:,") != "data:,"]
    policy = next(attributes["content"] for _, attributes in page.tags if attributes.get("http-equiv") == "Content-Security-Policy")
    assert policy.startswith("default-src 'none'; img-src data:; style-src 'sha256-") and "unsafe" not in policy


@pytest.mark.parametrize(
    ("layers", "note"), [(("depth",), "the bag holds no colour"), ((), "the bag holds no images that have a stamp"), (("color",), None)]
)
def test_what_a_bag_lacks_is_said(tmp_path: Path, layers: tuple[str, ...], note: str | None) -> None:
    bag = write_room_bag(tmp_path / "bag", rooms=1, frames=1, layers=layers)
    report, data = page_of(bag.path, tmp_path / "page.html")
    assert report.notes == ((note,) if note else ())
    assert data["rooms"][0]["plan"] and [layer["name"] for camera in data["cameras"] for layer in camera["layers"]] == list(layers)


def test_streams_that_are_not_shown_and_images_that_are_missing_are_said(tmp_path: Path) -> None:
    """A laser, its empty topic, two forms of one layer for people, and depth at one of two stamps."""
    source = write_room_bag(tmp_path / "source", rooms=1, frames=2, size=(6, 8), layers=("color", "depth"))
    depth = f"{CAMERA}/depth/image_raw"
    with BagWriter(tmp_path / "bag") as writer, BagReader(source.path) as reader:
        for message in reader.messages():
            if message.topic != depth or message.log_ns == max(source.images):
                writer.add_topic(message.topic, message.type_name)
                writer.write(message.topic, message.data, message.log_ns, message.log_ns)
            if message.topic == depth:
                for topic in (f"{CAMERA}/depth/image_color", f"{CAMERA}/depth/image_raw/compressedDepth", f"{CAMERA}/normals/image_color"):
                    kind = IMAGE_TYPE if "color" in topic else COMPRESSED_TYPE
                    writer.add_topic(topic, kind)
                    writer.write(topic, message.data, message.log_ns, message.log_ns)
        write(writer, "/synth/imu/data", String(), 0)
        writer.add_topic(f"{CAMERA}/scan", "sensor_msgs/msg/LaserScan")
    report, _ = page_of(tmp_path / "bag", tmp_path / "page.html")
    assert report.notes == (
        f"no messages: {CAMERA}/scan",
        f"not at every stamp: {depth} 1 of 2",
        f"in the bag, but not shown: {CAMERA}/normals/image_color, /synth/imu/data",
    )


def test_a_bag_without_messages_and_one_that_others_made(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "empty"):
        pass
    report, data = page_of(tmp_path / "empty", tmp_path / "page.html")
    assert report.notes[0] == "the bag holds no messages" and data["rooms"] == data["cameras"] == []
    pixels = np.arange(4 * 6 * 3, dtype=np.uint8).reshape(4, 6, 3)
    with BagWriter(tmp_path / "foreign") as writer:
        for encoding in ("bgr8", "bayer_rggb8"):
            image = Image(height=4, width=6, encoding=encoding, step=18)
            image.header.stamp.sec = 5
            image.data.frombytes(pixels.tobytes())
            write(writer, f"/front/{encoding}", image, 5 * 10**9)
    report, data = page_of(tmp_path / "foreign", tmp_path / "page.html")
    assert report[:4] == (1, 1, 1, 1)
    assert report.notes == (
        "the bag holds no colour",
        "the bag holds no scene description: no plan of the room, no objects",
        "the bag holds no camera poses: the camera is not on the plan",
        "/front/bayer_rggb8: a message cannot be shown (expected an image encoded as one of mono8, 8UC1, mono16, 16UC1, 16SC1, 32SC1,"
        " 32FC1, 64FC1, 32FC2, 64FC2, 32FC3, 64FC3, rgb8, bgr8, 8UC3, got 'bayer_rggb8')",
    )
    (entry,) = data["rooms"][0]["frames"][0]["cameras"]["other images"]["images"].values()
    assert np.abs(decoded(entry).astype(int) - pixels[..., ::-1]).mean() < 8.0


def test_damaged_bags_give_a_page_or_one_line(tmp_path: Path) -> None:
    write_small_bag(tmp_path / "bag", frames=12, chunk_size=3000)
    whole = (tmp_path / "bag" / "bag_0.mcap").read_bytes()
    rng = np.random.default_rng(0)
    shown = 0
    for case in range(60):
        data = bytearray(whole[: int(rng.integers(0, len(whole)))] if case % 2 else whole)
        for place in rng.integers(0, max(len(data), 1), 20) if data and case % 2 == 0 else ():
            data[place] ^= int(rng.integers(1, 256))
        (tmp_path / "cut.mcap").write_bytes(data)
        try:
            report, page = page_of(tmp_path / "cut.mcap", tmp_path / "page.html")
        except BagReadError as error:
            assert "\n" not in str(error)
        else:
            assert report.notes and len(page["rooms"]) == report.rooms
            shown += 1
    assert shown > 30


def hostile_bag(folder: Path) -> None:
    """Write a bag whose every message is made to do harm: numbers that do not agree, are not finite, or are huge."""
    info = CameraInfo(height=2**32 - 1, width=2**32 - 1, k=[float("nan")] * 9)
    grid = OccupancyGrid()
    grid.info.width, grid.info.height, grid.info.resolution = 2**31, 2**31, 0.05
    pose = PoseStamped()
    pose.pose.position.x, pose.pose.orientation.w = float("inf"), 1.0
    huge = Image(height=2**32 - 1, width=2**32 - 1, encoding="32FC1", data=b"abcd")
    none = Image(height=0, width=5, encoding="mono8")
    with BagWriter(folder) as writer:
        for topic, message in (
            ("/s/scene", String(data='{"schema": "scene_synth/1", "camera_path": [{"stamp_ns": 0}]}')),
            ("/s/map", grid),
            (f"{CAMERA}/depth/image_raw", huge),
            (f"{CAMERA}/semantic/image_raw", none),
            (f"{CAMERA}/depth/camera_info", info),
            (f"{CAMERA}/pose", pose),
            (f"{CAMERA}/semantic/labels", String(data='{"labels": {"x": 1}}')),
            (f"{CAMERA}/instance/labels", String(data="[" * 100_000)),
        ):
            write(writer, topic, message, 0)
        writer.add_topic(f"{CAMERA}/color/image_raw", "sensor_msgs/msg/Image")
        writer.write(f"{CAMERA}/color/image_raw", struct.pack("<4BiII", 0, 1, 0, 0, 0, 0, 2**31), 0, 0)
        writer.set_attachment(PARAMETERS_NAME, b"/n: {ros__parameters: [1, 2]}\nx: *y")


def test_hostile_messages_are_told_and_left_out(tmp_path: Path) -> None:
    hostile_bag(tmp_path / "bag")
    report, data = page_of(tmp_path / "bag", tmp_path / "page.html")
    frame = data["rooms"][0]["frames"][0]["cameras"][CAMERA]
    assert frame == {"pose": None, "lens": None, "images": {}}
    assert (data["rooms"][0]["plan"], data["rooms"][0]["map"], data["parameters"]) == (None, None, [])
    told = "\n".join(report.notes)
    for piece in (
        "room 1 of this page has no plan and no objects, its description is refused:",
        "/s/map: a message cannot be shown (map: expected 2147483648 x 2147483648 cells",
        "/synth/camera/depth/image_raw: a message cannot be shown (",
        "/synth/camera/semantic/image_raw: a message cannot be shown (",
        "/synth/camera/color/image_raw: a message cannot be shown (",
        "/synth/camera/semantic/labels: a message cannot be shown (",
        "/synth/camera/instance/labels: a message cannot be shown (",
    ):
        assert piece in told
    assert all(len(note) < 500 and "\n" not in note for note in report.notes)


def test_a_page_has_a_largest_size(bag: RoomBag, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page_file, "MAX_BYTES", 20_000)
    report, data = page_of(bag.path, tmp_path / "page.html")
    assert report.size < 150_000 and report.notes == (
        "the page has its largest size; frames from here on have no images: give --frames, --rooms or --max-size a smaller number",
    )
    assert data["rooms"][0]["frames"][0]["cameras"][CAMERA]["images"] and not data["rooms"][1]["frames"][2]["cameras"][CAMERA]["images"]


def test_streams_are_found_by_camera_and_layer() -> None:
    names = ("/s/a/color/image_raw", "/s/a/semantic/image_color", "/x/view")
    packed = ("/s/a/color/image_raw/compressed", "/s/b/depth/image_raw/compressedDepth")
    found = find_layers(
        dict.fromkeys(names, IMAGE_TYPE) | dict.fromkeys(packed, COMPRESSED_TYPE) | {"/s/a/pose": "geometry_msgs/msg/PoseStamped"}
    )
    assert found == {names[0]: ("/s/a", "color"), packed[1]: ("/s/b", "depth"), names[2]: (OTHERS, names[2])}


def test_codes_of_distances() -> None:
    metres = np.array([[np.inf, np.nan, -1.0, 0.0, 0.0001, 1.2344, 65.5339, 100.0]], np.float32)
    assert distance_codes(metres).tolist() == [[NO_HIT_MM, 0, 0, 0, 1, 1234, MOST_MM, MOST_MM]]
    assert distance_codes(np.array([[0, 1, 65534, 65535]], np.uint16)).tolist() == [[0, 1, MOST_MM, MOST_MM]]
    with pytest.raises(PageImageError, match=r"expected pixels of 1 channels, got uint8 2 x 2 x 3"):
        page_image(np.zeros((2, 2, 3), np.uint8), "ids", None, 16)


@pytest.mark.parametrize("name", LAYERS)
def test_every_layer_can_be_shown(name: str) -> None:
    layer = LAYERS[name]
    image = page_image(np.ones(layer.shape(12, 16), layer.dtype), form_of(layer), layer, 16)
    assert image["shown"] == (16, 12) and image["data"]


def arguments(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    show_command.add_arguments(parser)
    return parser.parse_args(list(words))


def test_the_command_says_what_it_wrote(bag: RoomBag, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert show_command.run(arguments(str(bag.path), "--frames", "2")) == 0
    page = bag.path.with_name("bag.html")
    assert capsys.readouterr().out == f"page: {page} (2 rooms, 4 of 6 frames, {page.stat().st_size / 1e6:.1f} MB)\n"
    page.unlink()
    with BagWriter(tmp_path / "empty"):
        pass
    assert show_command.run(arguments(str(tmp_path / "empty"), "--out", str(tmp_path / "out.html"))) == 0
    assert capsys.readouterr().out.splitlines()[1] == "note: the bag holds no messages"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("bag", "--rooms", "0"), "--rooms: expected 1 to 1000, got 0"),
        (("bag", "--max-size", "9999"), "--max-size: expected 16 to 4096, got 9999"),
        (("bag", "--out", "nowhere/page.html"), "--out nowhere/page.html: expected a file in a folder that exists"),
        (("nowhere",), "nowhere: not found; give the folder of a bag or an .mcap file"),
    ],
)
def test_bad_options_are_told_in_one_line(words: tuple[str, ...], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SceneSynthError) as error:
        show_command.run(arguments(*words))
    assert str(error.value) == message and not list(tmp_path.iterdir())


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the addresses that a browser is asked for; there is a display, and no browser that takes them."""
    addresses: list[str] = []
    monkeypatch.setattr("webbrowser.open", lambda address: bool(addresses.append(address)))
    monkeypatch.setenv("DISPLAY", ":7")
    return addresses


def test_the_browser_is_asked_for_the_page_where_there_is_a_display(
    bag: RoomBag, tmp_path: Path, opened: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "page.html"
    words = (str(bag.path), "--out", str(page), "--open")
    show_command.run(arguments(*words))
    assert opened == [page.as_uri()]
    assert capsys.readouterr().out.endswith(f"no browser found; open {page} in a browser\n")
    monkeypatch.delenv("DISPLAY")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    show_command.run(arguments(*words))
    assert len(opened) == 1 and capsys.readouterr().out.endswith(f"no display found; open {page} in a browser\n")


def test_the_demo_is_a_run_in_one_folder(
    tmp_path: Path, opened: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    runs: list[argparse.Namespace] = []

    def run(asked: argparse.Namespace) -> int:
        runs.append(asked)
        asked.show.touch()
        return 0

    monkeypatch.setattr(run_command, "run", run)
    parser = argparse.ArgumentParser()
    demo_command.add_arguments(parser)
    words = ["--rooms", "2", "--out", str(tmp_path / "new" / "demo")]
    assert demo_command.run(parser.parse_args(words)) == 0
    folder = tmp_path / "new" / "demo"
    (asked,) = runs
    assert (asked.rooms, asked.frames, asked.seed, asked.params, asked.overrides) == (2, 8, 1, Path("demo"), [])
    assert (asked.record, asked.contact_sheet, asked.show) == (folder / "bag", folder / "contact_sheet.png", folder / "page.html")
    assert opened == [(folder / "page.html").as_uri()]
    with pytest.raises(SceneSynthError, match="exists already; choose another folder or remove it"):
        demo_command.run(parser.parse_args(words))
    assert demo_command.run(parser.parse_args(["--out", str(tmp_path / "quiet"), "--no-open"])) == 0 and len(opened) == 1


def test_a_demo_that_did_not_begin_leaves_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def run(_asked: argparse.Namespace) -> int:
        raise SceneSynthError("no renderer")

    monkeypatch.setattr(run_command, "run", run)
    parser = argparse.ArgumentParser()
    demo_command.add_arguments(parser)
    with pytest.raises(SceneSynthError, match="no renderer"):
        demo_command.run(parser.parse_args(["--out", str(tmp_path / "demo")]))
    assert not (tmp_path / "demo").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--show", "page.html"), "--show: expected together with --record"),
        (("--record", "bag", "--show", "no/page.html"), "--show no/page.html: the folder does not exist"),
    ],
)
def test_a_run_refuses_a_page_that_it_cannot_write(
    words: tuple[str, ...], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    parser = argparse.ArgumentParser()
    run_command.add_arguments(parser)
    with pytest.raises(SceneSynthError, match=message):
        run_command.run(parser.parse_args(words))

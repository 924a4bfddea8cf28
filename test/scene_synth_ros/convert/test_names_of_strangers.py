"""Names that come from a file are parts of paths only where they can be no other path, whatever writes the files."""

import dataclasses
import json
from pathlib import Path

import pytest
from convert_bag import PINHOLE, convert_bag

from scene_description import SceneSynthError, scene_from_json, scene_to_json
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.cli.commands.truth_command import write_bag_truth
from scene_synth_ros.cli.page.page_file import write_page
from scene_synth_ros.convert.formats import FORMATS, writer_of
from scene_synth_ros.convert.source import Choice, open_source
from scene_synth_ros.convert.writer import ConvertError, convert
from scene_synth_ros.dataset import DatasetError, open_dataset
from scene_synth_ros.messages.cdr import CdrWriter, read_text

NAMES = ("", ".", "..", "../../x", "a b", "a\0b", "a\nb", "~", "-rf", "ü", "C:", "x" * 101)
"""In place of the name of a layer or a camera."""


@pytest.fixture(scope="module")
def strange(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a bag with a camera, whose messages came on topics of strange names, too, and whose scene has a strange id."""
    folder = tmp_path_factory.mktemp("strange") / "bag"
    with BagReader(convert_bag(camera=PINHOLE).path) as reader, BagWriter(folder) as writer:
        for message in reader.messages():
            data = message.data
            if message.topic == "/synth/scene":
                text = CdrWriter()
                text.text(scene_to_json(dataclasses.replace(scene_from_json(read_text(data)), id="..")))
                data = text.message()
            topics = {message.topic}
            for name in NAMES:
                topics |= {message.topic.replace("color", name), message.topic.replace("camera", name, 1)}
            for topic in topics:
                writer.add_topic(topic, message.type_name)
                writer.write(topic, data, message.log_ns, message.publish_ns)
    return folder


def files_below(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*")}


@pytest.mark.parametrize("name", FORMATS)
def test_no_converter_writes_outside_its_folder_or_under_a_strange_name(name: str, strange: Path, tmp_path: Path) -> None:
    out = tmp_path / "a" / "b" / "out"
    out.mkdir(parents=True)
    source = open_source(str(strange), name, FORMATS[name], Choice())
    assert list(source.data) == ["/synth/camera"]
    convert(out, source, writer_of(name))
    plain = tmp_path / "plain"
    plain.mkdir()
    convert(plain, open_source(str(convert_bag(camera=PINHOLE).path), name, FORMATS[name], Choice()), writer_of(name))
    assert files_below(out) == files_below(plain) != set()
    assert files_below(tmp_path / "a") == {"b", "b/out", *(f"b/out/{file}" for file in files_below(out))}


def test_truth_and_pages_have_no_other_names(strange: Path, tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    write_bag_truth(strange, tmp_path / "a" / "truth")
    assert {path.name for path in (tmp_path / "a").glob("truth/*")} == {"room_0000", "room_0001"}
    assert {path.name for path in (tmp_path / "a").glob("truth/*/trajectory_*")} == {"trajectory_camera.txt"}
    write_page(strange, tmp_path / "a" / "page.html", rooms=1, frames=1, max_size=40)
    assert {path.name for path in tmp_path.iterdir()} == {"a"} and {path.name for path in (tmp_path / "a").iterdir()} == {
        "truth",
        "page.html",
    }


@pytest.mark.parametrize("split", ["../../x", "..", "/tmp/x", "a b", ""])
def test_a_split_of_a_strange_name_is_refused(split: str, tmp_path: Path) -> None:
    bag = convert_bag(camera=PINHOLE)
    (tmp_path / "bag").symlink_to(bag.path)
    splits = {"schema": "scene_synth_splits/1", "splits": {split: [{"room": 0, "frames": None}]}}
    (tmp_path / "splits.json").write_text(json.dumps(splits))
    with pytest.raises(DatasetError, match="expected the name of a split of letters, digits, - and _, got"):
        open_dataset(tmp_path, split=split)


def test_cameras_whose_names_make_one_word_have_folders_of_their_own(tmp_path: Path) -> None:
    with BagReader(convert_bag(camera=PINHOLE).path) as reader, BagWriter(tmp_path / "bag") as writer:
        for message in reader.messages():
            for base in ("/a/b_c/camera/", "/a_b/c/camera/"):
                topic = message.topic.replace("/synth/camera/", base)
                writer.add_topic(topic, message.type_name)
                writer.write(topic, message.data, message.log_ns, message.publish_ns)
    source = open_source(str(tmp_path / "bag"), "tum", FORMATS["tum"], Choice())
    assert [sequence.name for sequence in source.sequences[:2]] == ["room_0000_a_b_c_camera_0", "room_0000_a_b_c_camera_1"]
    assert len({sequence.name for sequence in source.sequences}) == 4


@pytest.mark.parametrize("layer", ["labels", "scene", "K", "stamp_ns"])
def test_a_layer_that_is_called_like_what_hdf5_has_beside_it_is_refused(layer: str, tmp_path: Path) -> None:
    with BagReader(convert_bag(camera=PINHOLE).path) as reader, BagWriter(tmp_path / "bag") as writer:
        for message in reader.messages():
            for topic in {message.topic, message.topic.replace("color", layer)}:
                writer.add_topic(topic, message.type_name)
                writer.write(topic, message.data, message.log_ns, message.publish_ns)
    source = open_source(str(tmp_path / "bag"), "hdf5", FORMATS["hdf5"], Choice())
    (tmp_path / "out").mkdir()
    with pytest.raises(ConvertError, match=f"hdf5: layer {layer}: the name is taken; "):
        convert(tmp_path / "out", source, writer_of("hdf5"))
    assert issubclass(ConvertError, SceneSynthError)

"""What is chosen of a source: layers, cameras, rooms, frames."""

import json

import numpy as np
import pytest
from convert_bag import PINHOLE, convert_bag

from scene_synth_ros.convert.formats import FORMATS, Format, writer_of
from scene_synth_ros.convert.source import Choice, choose_cameras, choose_layers, open_source
from scene_synth_ros.convert.writer import ConvertError, convert

ANY = Format("anything", "nothing", (), any_layer=True)
RECORDED = ("color", "color_sensed", "depth", "flow")


@pytest.mark.parametrize(
    ("asked", "roles"),
    [
        ((), {"picture": "color", "depth": "depth"}),
        (("color_sensed",), {"picture": "color_sensed", "depth": "depth"}),
        (("depth", "color"), {"picture": "color", "depth": "depth"}),
    ],
)
def test_a_layer_that_is_asked_for_takes_the_place_of_the_usual_one(asked, roles):
    assert choose_layers("tum", FORMATS["tum"], RECORDED, asked, "bag") == (roles, ())


def test_formats_of_any_layer_take_all_or_those_that_are_asked_for():
    assert choose_layers("hdf5", ANY, RECORDED, (), "bag") == ({}, RECORDED)
    assert choose_layers("hdf5", ANY, RECORDED, ("flow",), "bag") == ({}, ("flow",))


@pytest.mark.parametrize(
    ("form", "asked", "told"),
    [
        (FORMATS["tum"], ("flow",), r"^--layers flow: x has no place for it; expected some of color, .*, one for each role$"),
        (FORMATS["tum"], ("depth_sensed",), r"^bag: x needs depth_sensed, which is not recorded; record it: .*streams.depth_sensed:=true$"),
        (ANY, ("normals",), r"^bag: x needs normals, which is not recorded; record it: -p renderer_node.streams.normals:=true$"),
        (ANY, ("nonsense",), r"^--layers nonsense: expected layers as scene_synth layers lists them$"),
    ],
)
def test_what_cannot_be_had_is_refused_in_one_line(form, asked, told):
    with pytest.raises(ConvertError, match=told):
        choose_layers("x", form, RECORDED, asked, "bag")


def test_a_panorama_is_told_that_it_has_no_depth():
    with pytest.raises(ConvertError, match=r"^bag: colmap needs depth, got range alone, as of a panorama; choose --to nerfstudio or coco$"):
        choose_layers("colmap", FORMATS["colmap"], ("color", "range"), (), "bag")


def test_cameras_that_lack_something_are_left_out_and_told():
    found, notes = choose_cameras("tum", FORMATS["tum"], {"/left": ("color", "depth"), "/right": ("color",)}, (), "bag")
    assert list(found) == ["/left"] and len(notes) == 1
    assert notes[0].startswith("camera /right is left out: bag: tum needs depth or depth_sensed, which is not recorded")


def test_sequences_are_rooms_and_cameras_in_order():
    bag = convert_bag(left=PINHOLE, right=PINHOLE)
    source = open_source(str(bag.path), "euroc", FORMATS["euroc"], Choice(every=2))
    told = [(it.name, it.folder, it.room, it.camera, it.place, it.cameras, len(it.frames)) for it in source.sequences]
    assert told == [
        ("room_0000_left", "room_0000", 0, "/synth/left", 0, 2, 2),
        ("room_0000_right", "room_0000", 0, "/synth/right", 1, 2, 2),
        ("room_0001_left", "room_0001", 1, "/synth/left", 0, 2, 2),
        ("room_0001_right", "room_0001", 1, "/synth/right", 1, 2, 2),
    ]
    assert source.frames == 8
    frame = source.frame(source.sequences[3], 1)
    np.testing.assert_array_equal(frame["color"], bag.frames["right"][5].layers["color"])
    one = open_source(str(bag.path), "euroc", FORMATS["euroc"], Choice(camera="right", rooms=(1, 9)))
    assert [it.name for it in one.sequences] == ["room_0001"] and one.sequences[0].camera == "/synth/right"


def test_no_frame_is_refused():
    with pytest.raises(ConvertError, match=r"bag: expected frames with all layers of the format, got none in rooms 7 to 8; see"):
        open_source(str(convert_bag().path), "tum", FORMATS["tum"], Choice(rooms=(7, 9)))


def test_a_split_chooses_rooms_and_frames(tmp_path):
    (tmp_path / "bag").symlink_to(convert_bag().path)
    rows = {"val": [{"room": 1, "frames": [0, 2]}], "train": [{"room": 0, "frames": None}]}
    (tmp_path / "splits.json").write_text(json.dumps({"schema": "scene_synth_splits/1", "splits": rows}))
    chosen = {name: open_source(str(tmp_path), "coco", FORMATS["coco"], Choice(split=name)) for name in rows}
    assert {name: [(it.name, len(it.frames)) for it in source.sequences] for name, source in chosen.items()} == {
        "val": [("room_0001", 2)],
        "train": [("room_0000", 3)],
    }
    convert(tmp_path, chosen["val"], writer_of("coco"))
    images = json.loads((tmp_path / "annotations/instances_val.json").read_text())["images"]
    assert [image["stamp_ns"] for image in images] == [convert_bag().frames["camera"][number].pose.stamp_ns for number in (3, 5)]

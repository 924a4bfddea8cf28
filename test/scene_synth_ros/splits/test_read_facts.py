"""What is read of a frame is what was recorded of it, by its own renderer."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from room_bag import CAMERA, START_NS, frame_images, room_scene, write
from std_msgs.msg import String

from renderer import LAYERS
from scene_description import scene_to_json
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.dataset import DatasetError, open_dataset
from scene_synth_ros.messages.conversions import image_to_msg, layer_encoding, pose_to_msg
from scene_synth_ros.splits.frame_facts import facts_of, small_ids, small_luma


def write_bag(folder: Path, *settings: str) -> dict[str, np.ndarray]:
    """Write a bag of one frame, with settings of some renderers; return its images."""
    scene, images = room_scene(0, 1), frame_images(3, 48, 64)
    with BagWriter(folder) as writer:
        write(writer, "/synth/scene", String(data=scene_to_json(scene)), START_NS)
        for layer in ("color", "instance"):
            message = image_to_msg(images[layer], layer_encoding(LAYERS[layer]), START_NS, "eye")
            write(writer, f"{CAMERA}/{layer}/image_raw", message, START_NS)
        write(writer, f"{CAMERA}/pose", pose_to_msg(scene.camera_path[0], "map"), START_NS)
        for number, text in enumerate(settings):
            write(writer, f"/synth/renderer_node_{number}/settings", String(data=text), START_NS)
    return images


def told(camera: str, ev100: float) -> str:
    return json.dumps({"streams": {"camera": camera}, "exposure_ev100": ev100})


def test_facts_of_a_frame(tmp_path: Path) -> None:
    images = write_bag(tmp_path / "bag", told("right", 3.0), told("camera", 6.5))
    frame = open_dataset(tmp_path / "bag", layers=("color", "instance"))[0]
    facts = facts_of(frame, {"color", "instance", "settings", "pose", "ids", "thumbnail"})
    pose = room_scene(0, 1).camera_path[0]
    luma = small_luma(images["color"])
    assert (facts.number, facts.exposure_ev100, facts.brightness) == (0, 6.5, luma.mean() / 255.0)
    np.testing.assert_allclose(facts.position_m, pose.position_m)
    np.testing.assert_array_equal(facts.thumbnail, luma)
    np.testing.assert_array_equal(facts.ids, small_ids(images["instance"]))
    things = [*room_scene(0, 1).room.openings, *room_scene(0, 1).objects]
    shares = {thing.id: float(np.mean(images["instance"] == thing.id)) for thing in things}
    expected = [(thing.category, shares[thing.id]) for thing in sorted(things, key=lambda thing: thing.id) if shares[thing.id]]
    assert facts.objects is not None
    assert [(item.category, item.image_share) for item in facts.objects] == expected


class Annotated(dict[str, np.ndarray]):
    """A frame with annotations of two objects."""

    number, scene = 4, room_scene(0, 1)
    detections = SimpleNamespace(objects=[SimpleNamespace(id=thing.id, visible_fraction=thing.id / 16.0) for thing in scene.objects[:2]])


def test_visible_fractions_come_from_annotations() -> None:
    ids = np.zeros((8, 8), np.uint16)
    ids[0, :2] = [thing.id for thing in Annotated.scene.objects[:2]]
    facts = facts_of(Annotated(instance=ids), {"instance", "annotations"})  # type: ignore[arg-type]
    assert facts.objects is not None
    assert [item.visible_fraction for item in facts.objects] == [
        thing.id / 16.0 for thing in sorted(Annotated.scene.objects[:2], key=lambda it: it.id)
    ]


def test_settings_of_another_camera_are_none_and_other_text_is_refused(tmp_path: Path) -> None:
    write_bag(tmp_path / "right", told("right", 3.0))
    assert open_dataset(tmp_path / "right", layers=("color",))[0].settings is None
    write_bag(tmp_path / "odd", "[1, 2]")
    with pytest.raises(DatasetError, match=r"expected JSON of settings on /synth/renderer_node_0/settings, got other text"):
        assert open_dataset(tmp_path / "odd", layers=("color",))[0].settings

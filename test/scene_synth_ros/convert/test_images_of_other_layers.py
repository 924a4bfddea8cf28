"""An image that is none of its layer, by its channels or its numbers, is one line of error in every format that takes the layer."""

from pathlib import Path

import numpy as np
import pytest
from dataset_bags import OURS
from rclpy.serialization import serialize_message
from room_bag import CAMERA, write_room_bag

from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.cli.command_line import main
from scene_synth_ros.convert.formats import FORMATS
from scene_synth_ros.messages.conversions import image_to_msg

SIZE = (48, 64)
OTHERS = {
    "color": (np.zeros(SIZE, np.uint8), "mono8", "3 channels of uint8"),
    "depth": (np.zeros((*SIZE, 3), np.uint8), "rgb8", "1 channel of float32"),
    "normals": (np.zeros(SIZE, np.float32), "32FC1", "3 channels of float32"),
    "semantic": (np.zeros(SIZE, np.float32), "32FC1", "1 channel of uint8"),
    "instance": (np.zeros((*SIZE, 3), np.float32), "32FC3", "1 channel of uint16"),
}


def with_image(folder: Path, layer: str) -> Path:
    """Write a bag of one room whose images of a layer are those of another."""
    whole = write_room_bag(folder / "whole", rooms=1, frames=2, size=SIZE, records=OURS)
    pixels, encoding, _ = OTHERS[layer]
    with BagReader(whole.path) as reader, BagWriter(folder / "bag") as writer:
        writer.set_record("scene_synth", OURS["scene_synth"])
        for message in reader.messages():
            data = message.data
            if message.topic == f"{CAMERA}/{layer}/image_raw":
                data = bytes(serialize_message(image_to_msg(pixels, encoding, message.log_ns, "eye")))
            writer.add_topic(message.topic, message.type_name)
            writer.write(message.topic, data, message.log_ns, message.publish_ns)
    return folder / "bag"


@pytest.mark.parametrize("layer", OTHERS)
def test_every_format_refuses_it_in_one_line(layer: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag, (_, encoding, expected) = with_image(tmp_path, layer), OTHERS[layer]
    said = f"frame 0 (room 0, stamp 1000000000 ns), layer {layer}: expected {expected}, got an image encoded as {encoding}"
    for name, form in FORMATS.items():
        if not (form.any_layer and form.unasked) and not any(layer in role.layers for role in form.roles):
            continue
        with pytest.raises(SystemExit) as status:
            main(["convert", str(bag), "--to", name, "--out", str(tmp_path / name)])
        (line,) = [line for line in capsys.readouterr().err.splitlines() if "expected" in line or "Traceback" in line]
        assert status.value.code == 2 and line.endswith(said) and not (tmp_path / name).exists()

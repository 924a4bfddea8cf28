"""The noise of sensed layers: the same for a seed, a frame and a camera, whatever was read before, and no other's."""

import numpy as np
import pytest
from box_room import VIEW, furnished_room

from renderer import CameraConfig, DepthSensorConfig, RenderConfig, Renderer, SensorConfig
from renderer.sensors.devices import DEVICES

CAMERA = CameraConfig(width=240, height=64)
NOISY = SensorConfig(full_well_e=2000.0, read_noise_e=5.0, bits=10)
CASES = {name: ("depth_sensed", DepthSensorConfig(model=name), SensorConfig()) for name in DEVICES if name != "ideal"}
CASES["color"] = ("color_sensed", DepthSensorConfig(), NOISY)


def read(case, frames, scene_key=3, camera=CAMERA, threads=2):
    """What a sensor reads of one view in some frames, in this order."""
    layer, depth_sensor, sensor = CASES[case]
    config = RenderConfig(samples_per_pixel=1, max_depth=2, threads=threads)
    with Renderer(furnished_room(), camera, config, scene_key, sensor=sensor, depth_sensor=depth_sensor) as renderer:
        return {frame: renderer.render(VIEW, frame, (layer,)).layers[layer].astype(np.float64) for frame in frames}


@pytest.mark.parametrize("case", CASES)
def test_noise_repeats_with_its_seed_and_with_no_other(case):
    here, again = read(case, (0, 1)), read(case, (1, 0), threads=1)
    for frame in here:
        np.testing.assert_array_equal(here[frame], again[frame])
    beside = CameraConfig(width=240, height=64, mount_rotation_rad=(0.0, 0.0, 1e-9))
    images = np.stack([*here.values(), read(case, (0,), scene_key=4)[0], read(case, (0,), camera=beside)[0]])
    images = images[:, np.isfinite(images).all(axis=0)].reshape(4, -1)
    # What sets two images apart has nothing to do with what sets the other two apart; a noise that two of them share gives 0 or 0.5.
    for a, b, c, d in ((0, 1, 2, 3), (0, 2, 1, 3), (0, 3, 1, 2)):
        one, other = np.sign(images[a] - images[b]), np.sign(images[c] - images[d])
        assert one.any() and abs(np.corrcoef(one, other)[0, 1]) < 0.35

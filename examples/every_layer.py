"""Draw the picture of docs/layers.md: every layer of one view as people see it.  No ROS.

python examples/every_layer.py docs [SAMPLES]
"""

import sys
from pathlib import Path

import numpy as np

from grammar.spec.request import SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer import LAYERS, CameraConfig, RenderConfig, Renderer, SensorConfig
from renderer.exposure import exposed, meter
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from renderer.sensors.devices import DepthSensorConfig
from scene_synth_ros.cli.files.frame_files import pictures
from scene_synth_ros.cli.pictures.picture_grid import Tile, write_grid

FOLDER, SAMPLES = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 64
CAMERA = CameraConfig(width=208, height=156)
RENDER = RenderConfig(samples_per_pixel=SAMPLES, clamp=8.0, denoise="auto", auto_exposure=True)
SENSOR = SensorConfig(vignetting=1.0, full_well_e=400.0, read_noise_e=6.0, bits=8, black_level=0.05)
DEPTH_SENSOR = DepthSensorConfig(model="kinect_v2")
VIEW = 6

request = SceneRequest(room_type="living_room", lamps="lit", daylight="clear")
scene = SceneSynthesizer.from_config().synthesize(request, 1, 0, CameraTimes(frames=30, start_ns=0, rate_hz=10.0))
flat, key = flatten(scene), scene_key(scene)
exposure = exposed(RENDER, meter(flat, CAMERA, RENDER, key, scene.camera_path))
with Renderer(flat, CAMERA, RENDER, key, sensor=SENSOR, depth_sensor=DEPTH_SENSOR) as renderer:
    frame = renderer.render(scene.camera_path[VIEW], VIEW, tuple(LAYERS), exposure=exposure, path=scene.camera_path)

tiles = []
for name, picture in pictures(frame.layers).items():
    most = max(int(picture.max()), 1)
    shown = picture if picture.dtype == np.uint8 else (picture.astype(np.float64) * 255.0 / most).astype(np.uint8)
    tiles.append(Tile(name, shown if shown.ndim == 3 else np.repeat(shown[..., None], 3, axis=2)))
write_grid(tiles, 6, FOLDER / "layers.jpg", quality=72)

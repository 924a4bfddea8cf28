"""Draw the picture of docs/cameras.md of what single stages of a colour sensor do to one ideal view, enlarged.  No ROS.

python examples/color_sensor.py docs [SAMPLES]
"""

import sys
from pathlib import Path

import numpy as np

from grammar.spec.request import SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer import CameraConfig, RenderConfig, Renderer, SensorConfig
from renderer.camera.cameras import pose_camera
from renderer.color_sensor import read_color
from renderer.exposure import exposed, meter
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from scene_synth_ros.cli.pictures.picture_grid import Tile, write_grid

FOLDER, SAMPLES = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 64
CAMERA = CameraConfig(width=320, height=240)
RENDER = RenderConfig(samples_per_pixel=SAMPLES, clamp=8.0, denoise="auto", auto_exposure=True)
DETAIL, ENLARGED = np.s_[80:160, 213:320], 3
NOISE = {"full_well_e": 2000.0, "read_noise_e": 6.0, "bits": 8, "black_level": 0.05}
STAGES = {
    "ideal: color": {},
    "red 2 px, blue -2 px at the corner": {"red_shift_px": 2.0, "blue_shift_px": -2.0},
    "full well 2000 e-, read noise 6 e-": NOISE,
    "rggb, bilinear": {"bayer": "rggb", "demosaic": "bilinear"},
    "rggb, Malvar": {"bayer": "rggb"},
    "Rec. 709 curve, clipped at white": {"response": "rec709"},
    "JPEG, quality 20": {"jpeg_quality": 20},
    "noise, rggb, shifts of 1 px, JPEG 80": {**NOISE, "bayer": "rggb", "red_shift_px": 1.0, "blue_shift_px": -1.0, "jpeg_quality": 80},
}

times = CameraTimes(frames=30, start_ns=0, rate_hz=10.0)
scene = SceneSynthesizer.from_config().synthesize(SceneRequest(room_type="living_room", daylight="night", lamps="lit"), 3, 0, times)
flat, key, pose = flatten(scene), scene_key(scene), scene.camera_path[15]
exposure = exposed(RENDER, meter(flat, CAMERA, RENDER, key, scene.camera_path))
with Renderer(flat, CAMERA, RENDER, key) as renderer:
    light = renderer.render(pose, 15, ("color",), exposure=exposure).radiance

tiles = []
for label, settings in STAGES.items():
    picture = read_color(light, pose_camera(CAMERA, pose), SensorConfig(**settings), exposure, RENDER.tone_curve, np.uint32(15))
    tiles.append(Tile(label, np.kron(picture[DETAIL], np.ones((ENLARGED, ENLARGED, 1), np.uint8))))
write_grid(tiles, 4, FOLDER / "color_sensor.jpg", quality=85)

"""Draw the pictures of docs/lights.md and docs/cameras.md: one room at several hours, one view through several lenses.  No ROS.

python examples/lights_and_lenses.py docs [SAMPLES [WIDTH]]
"""

import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

from grammar.spec.request import SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer import CameraConfig, RenderConfig, Renderer, SensorConfig
from renderer.exposure import exposed, meter
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from scene_synth_ros.cli.pictures.picture_grid import Tile, write_grid

FOLDER, SAMPLES = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 32
TIMES = CameraTimes(frames=30, start_ns=0, rate_hz=10.0)
VIEW = 15
WIDTH = int(sys.argv[3]) if len(sys.argv) > 3 else 320
CAMERA = CameraConfig(width=WIDTH, height=WIDTH * 3 // 4)
RENDER = RenderConfig(samples_per_pixel=SAMPLES, clamp=8.0, denoise="auto", auto_exposure=True)

synthesizer = SceneSynthesizer.from_config()


def picture(label, scene, camera=CAMERA, render=RENDER, sensor=None, view=VIEW):
    """Render one view with what the room's own meter says."""
    flat, key = flatten(scene), scene_key(scene)
    with Renderer(flat, camera, render, key, sensor=sensor or SensorConfig()) as renderer:
        exposure = exposed(render, meter(flat, camera, render, key, scene.camera_path, like=renderer))
        frame = renderer.render(scene.camera_path[view], view, ("color_sensed",), exposure=exposure, path=scene.camera_path)
    print(label, flush=True)
    return Tile(label, frame.layers["color_sensed"])


@cache
def room(kind="living_room", seed=3, **wishes):
    """Synthesize a room; wishes are those of `scene_synth sample -p`."""
    return synthesizer.synthesize(SceneRequest(room_type=kind, **wishes), seed, 0, TIMES)


DAY = {"daylight": "clear", "lamps": "unlit", "day_of_year": 120, "latitude_deg": 40.0, "north_yaw_deg": -60.0, "cloud_cover": 0.1}
write_grid(
    [
        picture("clear, 15 h", room(**DAY, solar_hour=15.0)),
        picture("clear and hazy, 17.5 h", room(**DAY, solar_hour=17.5, turbidity=6.0)),
        picture("overcast", room(daylight="overcast", lamps="unlit")),
        picture("dusk, lamps lit", room(daylight="dusk", lamps="lit")),
        picture("night, lamps lit", room(daylight="night", lamps="lit")),
        picture("night, spots in the ceiling", room("kitchen", 5, daylight="night", lamps="lit")),
    ],
    3,
    FOLDER / "lights.jpg",
    quality=80,
)

noon, night = room(**DAY, solar_hour=15.0), room(daylight="night", lamps="lit")
hurried = replace(noon, camera_path=tuple(replace(pose, stamp_ns=pose.stamp_ns // 3) for pose in noon.camera_path))
plain = replace(RENDER, white_balance="none", tone_curve="srgb")
noisy = SensorConfig(vignetting=1.0, full_well_e=600.0, read_noise_e=6.0, bits=8, black_level=0.05)
write_grid(
    [
        picture("pinhole", noon),
        picture("f/0.95, sensor 36 mm wide, focus at 1 m", noon, replace(CAMERA, f_stop=0.95, sensor_width_mm=36.0, focus_distance_m=1.0)),
        picture("three times as fast, shutter 1/15 s", hurried, replace(CAMERA, shutter_s=1 / 15)),
        picture("small full well, read noise, vignetting", night, sensor=noisy),
        picture("lamplight without white balance, plain sRGB", night, render=plain),
        picture("the same, balanced, filmic", night),
    ],
    3,
    FOLDER / "lenses.jpg",
    quality=80,
)

"""Draw the pictures of docs/sensors.md: what depth cameras read of a room, and their noise, steps and holes on planes.  No ROS.

python examples/depth_sensors.py docs [POINTS]
"""

import math
import sys
import time
from pathlib import Path

import numpy as np

from grammar.drawing.shapes import Drawing, dot, line, to_svg, words
from grammar.spec.request import SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer import CameraConfig, DepthSensorConfig, RenderConfig, Renderer, tabulate_materials
from renderer.film.false_color import depth_to_color
from renderer.geometry.mesh import Mesh
from renderer.scene.flat_scene import FlatScene, PartTable, Sky
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from scene_description import CameraPose, Material
from scene_description.poses import look_at
from scene_synth_ros.cli.pictures.picture_grid import Tile, write_grid

FOLDER, POINTS = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 9
CAMERAS = {
    "kinect_v1": CameraConfig(width=640, height=480, focal_x_px=585.0),
    "kinect_v2": CameraConfig(width=512, height=424, horizontal_fov_rad=1.232202),
    "azure_kinect": CameraConfig(model="rational", width=640, height=576, horizontal_fov_rad=1.308997),
    "realsense_d435": CameraConfig(width=848, height=480, horizontal_fov_rad=1.518436),
    "stereo": CameraConfig(),
}
COLORS = {"kinect_v1": "#b5442c", "kinect_v2": "#2c6cb5", "azure_kinect": "#2c8f4e", "realsense_d435": "#8a4bb0", "stereo": "#777777"}
NARROW = CameraConfig(width=320, height=240, horizontal_fov_rad=0.1)
EYE = CameraPose(stamp_ns=0, position_m=(0.0, 0.0, 0.0), orientation=look_at((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)))


def tilted(z, angle):
    """Return the published factor of grazing noise."""
    return (angle / (0.5 * np.pi - angle)) ** 2


PUBLISHED = {
    "kinect_v1": lambda z, a: 0.0012 + 0.0019 * (z - 0.4) ** 2 + 1e-4 / np.sqrt(z) * tilted(z, a),
    "kinect_v2": lambda z, a: 1e-3 * (1.5 - 0.5 * z + 0.3 * z**2 + 0.1 * z**1.5 * tilted(z, a)),
    "azure_kinect": lambda z, a: (0.0005 + 0.0165 * (z / 3.86) ** 2 + 1e-4 * z**1.5 * tilted(z, a)) * math.sqrt(0.15 / 0.5),
    "realsense_d435": lambda z, a: z**2 * 0.08 / (CAMERAS["realsense_d435"].focal_length_px * 0.05),
}
"""Standard deviation of depth in metres at a depth and an angle, of a surface of reflectance 0.5; sources: docs/sensors.md."""


def wall(distance, tilt=0.0, reflectance=0.5):
    """Return a plane that the optical axis meets at ``distance``, turned about the vertical."""
    along, up = 20.0 * np.array([math.sin(tilt), math.cos(tilt), 0.0]), np.array([0.0, 0.0, 20.0])
    middle = np.array([distance, 0.0, 0.0])
    corners = np.array([middle - along - up, middle - along + up, middle + along + up, middle + along - up], np.float32)
    normal = np.tile(np.array([-math.cos(tilt), math.sin(tilt), 0.0], np.float32), (4, 1))
    mesh = Mesh(corners, normal, np.array([[0, 1, 2], [0, 2, 3]], np.uint32), corners[:, 1:].copy())
    parts = PartTable(np.zeros(1, np.uint16), np.zeros(1, np.uint8), np.zeros(1, np.int32), np.zeros((1, 3), np.float32), np.zeros(1, bool))
    paint = Material(id="m", family="m", base_color=(reflectance,) * 3, roughness=1.0)
    dark = Sky(*(np.zeros(3, np.float32) for _ in range(3)))
    return FlatScene(mesh, np.zeros(2, np.int32), parts, ("0/wall",), tabulate_materials([paint]), dark)


def read(flat, model, camera=NARROW, pose=EYE, key=1):
    """Return sensed and true depth."""
    with Renderer(flat, camera, RenderConfig(), key, depth_sensor=DepthSensorConfig(model=model)) as renderer:
        layers = renderer.render(pose, 0, ("depth", "depth_sensed")).layers
    return layers["depth_sensed"], layers["depth"]


def deviation(model, distance, tilt=0.0):
    """Return the measured standard deviation, from the median of distances for matched devices, whose errors have long tails."""
    matched = model == "realsense_d435"
    sensed, true = read(wall(distance, 0.15 if matched else tilt), model, CAMERAS[model] if matched else NARROW)
    error = (sensed - true)[np.isfinite(sensed)]
    return 1.4826 * float(np.median(np.abs(error - np.median(error)))) if matched else float(error.std())


class Chart:
    """A panel with axes: curves and dots in units of the axes."""

    def __init__(self, left, top, title, x, y, x_range, y_range):
        self.box, self.x_range, self.y_range = (left + 60, top + 34, 350, 230), x_range, y_range
        ax, ay, width, height = self.box
        self.shapes = [words((ax, top + 14), title, 14, anchor="start"), words((ax + width / 2, ay + height + 34), x, 12)]
        self.shapes += [
            words((ax - 50, ay - 12), y, 12, anchor="start"),
            line([(ax, ay), (ax, ay + height), (ax + width, ay + height)], "#222222"),
        ]
        for k in range(6):
            u, v = x_range[0] + k / 5 * (x_range[1] - x_range[0]), y_range[0] + k / 5 * (y_range[1] - y_range[0])
            self.shapes += [
                words((self.at(u, 0)[0], ay + height + 14), f"{u:.4g}", 11),
                words((ax - 6, self.at(0, v)[1]), f"{v:g}", 11, anchor="end"),
            ]

    def at(self, u, v):
        """Return the place of a point in the drawing."""
        ax, ay, width, height = self.box
        f = (u - self.x_range[0]) / (self.x_range[1] - self.x_range[0])
        g = (v - self.y_range[0]) / (self.y_range[1] - self.y_range[0])
        return ax + f * width, ay + height - min(max(g, 0.0), 1.0) * height

    def curve(self, u, v, color, dash=None):
        """Add a line."""
        self.shapes.append(line([self.at(*pair) for pair in zip(u, v, strict=True)], color, 1.6, dash))

    def dots(self, u, v, color):
        """Add measured points."""
        self.shapes += [dot(self.at(*pair), 3.2, color) for pair in zip(u, v, strict=True)]


def draw_charts():
    """Return the four panels as SVG."""
    far = Chart(0, 0, "Noise by distance, facing", "m", "mm", (0.0, 5.0), (0.0, 80.0))
    steep = Chart(450, 0, "Noise by angle, at 1.5 m", "degrees", "mm", (0.0, 75.0), (0.0, 10.0))
    steps = Chart(0, 330, "Depths that a Kinect v1 tells of a slanting wall", "m", "%", (3.8, 4.2), (0.0, 20.0))
    holes = Chart(450, 330, "Pixels without depth by reflectance, at 3 m", "reflectance", "share", (0.0, 0.1), (0.0, 1.0))
    for model, formula in PUBLISHED.items():
        z = np.linspace(0.5, {"kinect_v2": 4.5, "azure_kinect": 3.86}.get(model, 5.0), 60)
        far.curve(z, [1e3 * formula(x, 0.0) for x in z], COLORS[model])
        measured = np.linspace(0.8, min(z[-1] - 0.15, 4.6), POINTS)
        far.dots(measured, [1e3 * deviation(model, x) for x in measured], COLORS[model])
        if model != "realsense_d435":
            angles = np.radians(np.linspace(0.0, 75.0, 60))
            steep.curve(np.degrees(angles), [1e3 * formula(1.5, a) for a in angles], COLORS[model])
            tilts = np.linspace(0.0, 72.0, POINTS)
            steep.dots(tilts, [1e3 * deviation(model, 1.5, math.radians(tilt)) for tilt in tilts], COLORS[model])
        dark = np.linspace(0.001, 0.1, 3 * POINTS - 2)
        camera = CAMERAS[model] if model == "realsense_d435" else NARROW
        inner = np.s_[20:-20, 60:-20]
        share = [1.0 - np.isfinite(read(wall(3.0, 0.0, rho), model, camera)[0][inner]).mean() for rho in dark]
        holes.curve(dark, share, COLORS[model])
    sensed, _ = read(wall(4.0, 0.35), "kinect_v1", CameraConfig(width=640, height=480, horizontal_fov_rad=0.3))
    told, counts = np.unique(sensed[np.isfinite(sensed)], return_counts=True)
    for depth, count in zip(told, counts, strict=True):
        if 3.8 <= depth <= 4.2:
            steps.curve([depth, depth], [0.0, 100.0 * count / counts.sum()], COLORS["kinect_v1"])
    for count in range(math.ceil(351.3 / 4.2), math.floor(351.3 / 3.8) + 1):
        steps.dots([351.3 / count], [19.6], "#444444")
    shapes = [*far.shapes, *steep.shapes, *steps.shapes, *holes.shapes]
    for k, model in enumerate(PUBLISHED):
        shapes += [dot((90 + 210 * k, 664), 4, COLORS[model]), words((100 + 210 * k, 664), model, 12, anchor="start")]
    return to_svg(Drawing(width=880, height=684, shapes=tuple(shapes)))


def draw_rooms():
    """Write what each device reads of a living room; print times."""
    scene = SceneSynthesizer.from_config().synthesize(
        SceneRequest(room_type="living_room"), 3, 0, CameraTimes(frames=30, start_ns=0, rate_hz=10.0)
    )
    flat, tiles = flatten(scene), []
    for model, camera in {"ideal": CAMERAS["kinect_v1"], **CAMERAS}.items():
        with Renderer(flat, camera, RenderConfig(), scene_key(scene), depth_sensor=DepthSensorConfig(model=model)) as renderer:
            sensed = renderer.render(scene.camera_path[4], 4, ("depth_sensed",)).layers["depth_sensed"]
        color = depth_to_color(sensed)
        color[np.isposinf(sensed)], color[np.isneginf(sensed)] = 70, 255
        height, width = min(sensed.shape[0], sensed.shape[1] * 3 // 4), min(sensed.shape[1], sensed.shape[0] * 4 // 3)
        rows = np.arange(300) * height // 300 + (sensed.shape[0] - height) // 2
        columns = np.arange(400) * width // 400 + (sensed.shape[1] - width) // 2
        tiles.append(Tile(model, np.ascontiguousarray(color[np.ix_(rows, columns)])))
    write_grid(tiles, 3, FOLDER / "sensors.jpg", quality=82)
    for model in CAMERAS:
        with Renderer(flat, CameraConfig(), RenderConfig(), 1, depth_sensor=DepthSensorConfig(model=model)) as renderer:
            seconds, cpu_seconds = [], []
            for index in range(min(POINTS, 8)):
                began, cpu_began = time.perf_counter(), time.process_time()
                renderer.render(scene.camera_path[4], index, ("depth_sensed",))
                seconds.append(time.perf_counter() - began)
                cpu_seconds.append(time.process_time() - cpu_began)
        print(f"{model}: {1e3 * min(seconds):.0f} ms a frame at 640x480, {1e3 * min(cpu_seconds):.0f} ms of processor", flush=True)


draw_rooms()
(FOLDER / "sensors.svg").write_text(draw_charts(), encoding="utf-8")

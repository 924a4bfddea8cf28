"""Render the first view of a scene description and save colour and class ids as PNG.  No ROS.

python examples/one_room.py room.json && python examples/one_image.py room.json
"""

import sys
from pathlib import Path

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.files.image_io import write_png
from renderer.film.false_color import classes_to_color
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from scene_description import scene_from_json

scene = scene_from_json(Path(sys.argv[1]).read_text())
with Renderer(flatten(scene), CameraConfig(width=320, height=240), RenderConfig(samples_per_pixel=32), scene_key(scene)) as renderer:
    frame = renderer.render(scene.camera_path[0], 0, {"color", "depth", "semantic"})

write_png(Path("color.png"), frame.layers["color"])
write_png(Path("classes.png"), classes_to_color(frame.layers["semantic"]))
print(f"nearest surface {frame.layers['depth'].min():.2f} m; wrote color.png and classes.png")

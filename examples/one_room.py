"""Sample one bedroom, print what is in it, save its description.  No ROS.

python examples/one_room.py room.json
"""

import sys
from pathlib import Path

from grammar import SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from scene_description import scene_to_json

synthesizer = SceneSynthesizer.from_config()
times = CameraTimes(frames=4, start_ns=1_000_000_000, rate_hz=10.0)
scene = synthesizer.synthesize(SceneRequest(room_type="bedroom", max_objects=25), seed=7, index=0, times=times)

for thing in scene.objects:
    x, y, z = thing.position_m
    print(f"{thing.id:3d} {thing.category:14s} at ({x:5.2f}, {y:5.2f}, {z:4.2f}) m, on {thing.support.kind}")
print(f"log-probability of the structure {scene.parse_graph.log_probability:.1f}, energy of the layout {scene.parse_graph.energy:.2f}")
for check in scene.validity.checks:
    print(f"{check.name:20s} {check.value:8.4f}  (limit {check.limit:g})  {'ok' if check.passed else 'FAILED'}")

if len(sys.argv) > 1:
    Path(sys.argv[1]).write_text(scene_to_json(scene))

"""Digests of all that small rooms publish, and the file of those that only a change that is meant may change.

python test/helpers/golden_rooms.py bathroom gym    print theirs, JSON: room -> topic -> the first 16 digits of its SHA-256
python test/helpers/golden_rooms.py --renew         write test/golden_hashes.json anew
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

from grammar.synthesize import SceneSynthesizer
from scene_description import scene_to_json
from scene_synth_ros.messages.canonical_cdr import canonical_cdr
from scene_synth_ros.messages.frame_messages import StreamConfig
from scene_synth_ros.offline.offline_renderer import OfflineRenderer
from scene_synth_ros.offline.rules import rules_of, sample_room
from scene_synth_ros.offline.settings import OfflineSettings, read_settings
from scene_synth_ros.render.stream_topics import SETTINGS
from scene_synth_ros.synthesize.scene_messages import scene_to_msgs

GOLDEN = Path(__file__).parents[1] / "golden_hashes.json"
Digests = dict[str, dict[str, str]]
"""Room -> topic -> digest of its messages, in their order."""

_SEED, _FRAMES = 3, 2
_GRAMMAR = {"seed": _SEED, "rooms": 1, "frames_per_room": _FRAMES, "rate_hz": 5.0}
_NOT_LAYERS = {"lazy", "publish_tf", "color_companions"}
_STREAMS = {
    f"streams.{field.name}": True for field in fields(StreamConfig) if isinstance(field.default, bool) and field.name not in _NOT_LAYERS
}
_CACHED = {
    "render.integrator": "cached",
    "render.cache_spacing_m": 0.1,
    "render.cache_rays": 16,
    "render.cache_light_samples": 16,
    "render.samples_per_pixel": 1,
    "render.clamp": 4.0,
    "render.caustic_blur": 0.3,
}
_TRACED = {"render.integrator": "path", "render.samples_per_pixel": 2}
_ALL = {
    "camera.width": 48,
    "camera.height": 36,
    "render.auto_exposure": True,
    "render.threads": 1,
    "render.portable": True,
    "scan.enabled": True,
    "scan.beams": 90,
    **_STREAMS,
}
_SENSOR = {
    "sensor.vignetting": 1.0,
    "sensor.corner_loss": 0.2,
    "sensor.full_well_e": 9000.0,
    "sensor.read_noise_e": 3.0,
    "sensor.bits": 10,
    "sensor.bayer": "rggb",
    "sensor.response": "gamma",
    "sensor.jpeg_quality": 90,
}
_BLUR = {"camera.f_stop": 1.8, "camera.shutter_s": 0.05, "camera.row_time_s": 0.001}
ROOMS: dict[str, dict[str, object]] = {
    "bathroom": {**_CACHED, "depth_sensor.model": "kinect_v1"},
    "bedroom": {**_TRACED, **_SENSOR, "depth_sensor.model": "kinect_v2"},
    "dining_room": {**_CACHED, **_BLUR, "scan.noise_share": 0.01, "scan.divergence_rad": 0.003},
    "garage": {**_TRACED, "camera.model": "kannala_brandt", "camera.distortion": [0.1, 0.01, 0.0, 0.0]},
    "guest_room": {**_CACHED, **_SENSOR, "render.tone_curve": "srgb", "depth_sensor.model": "azure_kinect"},
    "gym": {**_TRACED, **_BLUR, "scan.level": False},
    "hallway": {**_CACHED, "camera.model": "equirectangular"},
    "kitchen": {**_TRACED, "depth_sensor.model": "stereo"},
    "laundry_room": {**_CACHED, "camera.model": "brown_conrady", "camera.distortion": [-0.2, 0.05, 0.001, 0.001, 0.0]},
    "living_room": {**_TRACED, **_SENSOR, **_BLUR, "render.white_balance": "kelvin"},
    "office": {**_CACHED, "depth_sensor.model": "realsense_d435"},
    "study": {**_TRACED, "scene.room_ceiling": "two_slopes"},
}
"""Room type -> what is its own: lights, lenses, sensors and scanners take turns."""


def settings_of(room: str) -> OfflineSettings:
    """Return the settings of a room of the table."""
    own = {**_ALL, **ROOMS[room]}
    scene = {name: own.pop(name) for name in [*own] if name.startswith("scene.")}
    return read_settings({"grammar_node": {**_GRAMMAR, "scene.room_type": room, **scene}, "renderer_node": own, "recorder_node": {}})


def digests_of(room: str) -> dict[str, str]:
    """Return the digest of each topic of a room of the table."""
    found: dict[str, hashlib._Hash] = defaultdict(hashlib.sha256)
    for topic, message in _published(settings_of(room)):
        if topic != SETTINGS:  # every new parameter would change it
            found[topic].update(canonical_cdr(message))
    return {topic: digest.hexdigest()[:16] for topic, digest in sorted(found.items())}


def changes(expected: Digests, got: Digests) -> list[str]:
    """Return what differs, a line for each room."""
    told = []
    for room in sorted({*expected, *got}):
        before, after = expected.get(room, {}), got.get(room, {})
        topics = [topic for topic in sorted({*before, *after}) if before.get(topic) != after.get(topic)]
        if topics:
            told.append(f"{room}: {', '.join(topics)}")
    return told


def _published(settings: OfflineSettings) -> Iterator[tuple[str, object]]:
    rules: SceneSynthesizer = rules_of(settings)
    scene = sample_room(rules, settings, 0)
    yield from scene_to_msgs(scene, scene_to_json(scene), rules.floor_map(scene), "map").items()
    renderer = OfflineRenderer(settings.renderers["renderer_node"], lambda topic: True)
    try:
        renderer.begin_room(scene)
        for index in range(_FRAMES):
            yield from renderer.frame(index)
    finally:
        renderer.end_room()


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("rooms", nargs="*", help="of the table; all without")
    parser.add_argument("--renew", action="store_true")
    asked = parser.parse_args()
    digests = {room: digests_of(room) for room in asked.rooms or ROOMS}
    if asked.renew:
        GOLDEN.write_text(f"{json.dumps(digests, indent=1)}\n")
    else:
        sys.stdout.write(f"{json.dumps(digests, indent=1)}\n")


if __name__ == "__main__":
    main()

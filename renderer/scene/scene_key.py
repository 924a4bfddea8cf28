"""The number that keys a scene's random samples."""

import hashlib

from scene_description import SceneDescription


def scene_key(scene: SceneDescription) -> int:
    """Return a 63-bit number that depends only on the scene's id: the same room has the same noise, live and offline."""
    digest = hashlib.blake2b(scene.id.encode(), digest_size=8).digest()
    return int.from_bytes(digest, "little") >> 1

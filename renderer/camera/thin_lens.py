"""A lens with an aperture: rays of a pixel leave from points of a disc and meet where the camera is in focus.

A point at depth d, where the lens of diameter A is in focus at depth f, is spread over a circle of f_px A |1/f - 1/d| pixels across (the
thin lens equation; f_px is the focal length in pixels).  A = focal length / f-stop.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.camera.camera_rays import CENTRE, TILE, aim_tile
from renderer.camera.cameras import PosedCamera
from renderer.core import ray_packet as ray
from renderer.core.embree import SceneHandle, intersect16
from renderer.core.kernel import entry, kernel
from renderer.core.ray_packet import INVALID_ID, LANES, Packet
from renderer.core.sampling import coordinate_system

FAR_M = 1e4
NEAREST_M = 0.05
"""Shortest distance that autofocus sets."""

_ZERO, _ONE, _TWO, _QUARTER_PI = np.float32(0.0), np.float32(1.0), np.float32(2.0), np.float32(0.25 * np.pi)


@kernel
def sample_lens(camera: PosedCamera, u: NDArray[np.float32], packet: Packet) -> None:
    """Move 16 rays from the middle of the lens to points all over it, still through the same points in focus.

    Lenses that see less than a hemisphere are in focus on a plane, others on a sphere.  ``u``: (32,) float32 in [0, 1), two per ray.
    """
    real, r = packet.real, camera.rotation
    for k in range(LANES):
        a, b = _sample_disk(u[k], u[LANES + k])
        a, b = a * camera.lens_radius_m, b * camera.lens_radius_m
        ux, uy, uz, vx, vy, vz = r[0, 0], r[1, 0], r[2, 0], r[0, 1], r[1, 1], r[2, 1]
        if camera.sees_aside:
            ux, uy, uz, vx, vy, vz = coordinate_system(real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k])
        x, y, z = a * ux + b * vx, a * uy + b * vy, a * uz + b * vz
        real[ray.ORG_X + k] += x
        real[ray.ORG_Y + k] += y
        real[ray.ORG_Z + k] += z
        real[ray.DIR_X + k] -= x / camera.focus_m
        real[ray.DIR_Y + k] -= y / camera.focus_m
        real[ray.DIR_Z + k] -= z / camera.focus_m


@kernel
def _sample_disk(u: np.float32, v: np.float32) -> tuple[np.float32, np.float32]:
    """Return a point of the unit disc (Shirley and Chiu, "A Low Distortion Map Between Disk and Square", 1997)."""
    a, b = _TWO * u - _ONE, _TWO * v - _ONE
    if a == _ZERO and b == _ZERO:
        return _ZERO, _ZERO
    if abs(a) > abs(b):
        angle = _QUARTER_PI * b / a
        return a * np.cos(angle), a * np.sin(angle)
    angle = _TWO * _QUARTER_PI - _QUARTER_PI * a / b
    return b * np.cos(angle), b * np.sin(angle)


def focus_on_centre(scene: SceneHandle, camera: PosedCamera, packet: Packet) -> float:
    """Return the distance in metres of what lies in the middle of the image: depth, or range for lenses that see aside."""
    distance = float(_centre_distance(scene, camera, packet, CENTRE))
    return min(max(distance, NEAREST_M), FAR_M)


@entry
def _centre_distance(scene: SceneHandle, camera: PosedCamera, packet: Packet, centre: NDArray[np.float32]) -> np.float32:
    column, row = camera.width // 2 // TILE * TILE, camera.height // 2 // TILE * TILE
    aim_tile(camera, column, row, centre, packet)
    intersect16(packet.alive.ctypes.data, scene.address, packet.real.ctypes.data, scene.coherent)
    k = (camera.height // 2 - row) * TILE + camera.width // 2 - column
    hit = packet.alive[k] != 0 and packet.integer[ray.GEOM_ID + k] != INVALID_ID
    distance: np.float32 = packet.real[ray.TFAR + k]
    return distance if hit else np.float32(np.inf)

"""Light of a time-of-flight camera that comes by way of one other surface.

A point P at distance r that is lit directly also receives what other points Q scatter, all matt.  With directions to Q drawn by the
cosine's law, each of n brings, over the direct light, reflectance_Q (cos_Q / |OQ|^2) (|OP|^2 / cos_P) / n.  Its way is longer than the
direct one by |OQ| + |QP| - |OP|, half of which appears as distance, so its phase is later by 4 pi f / c times that half.  The device
reads the phase of the sum of all (S. Fuchs, "Multipath interference compensation in time-of-flight camera images", ICPR 2010, which takes
light of one further bounce as this does; A. Dorrington et al., "Separating true range measurements from multi-path and scattering
interference in commercial range cameras", SPIE 7864, 2011).  That makes corners round and floors sink.  The device lights what its image
shows, evenly.

The sum changes slowly over a surface: it is taken at one pixel of eight by eight, with the same 64 directions for all, so it carries no
noise, smoothed over 3 x 3 such pixels and interpolated where the surface goes on.  Not modelled: ways of more bounces, gloss, light
scattered within the lens.
"""

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.camera.cameras import PosedCamera
from renderer.core import ray_packet as ray
from renderer.core.embree import intersect16, occluded16
from renderer.core.kernel import entry, kernel
from renderer.core.ray_packet import INVALID_ID, LANES, Packet
from renderer.core.sampling import coordinate_system
from renderer.path import surface_tables as st
from renderer.path.surfaces import lift_height
from renderer.sensors.beams import Beams, Eye
from renderer.sensors.devices import Device
from renderer.sensors.surfaces_seen import goes_on, pixel_plane

GRID = 8
"""Pixels from one place where the light is summed to the next."""
DIRECTIONS = 64
SPEED_OF_LIGHT = 299_792_458.0
_ZERO, _ONE, _TINY, _INFINITE = np.float32(0.0), np.float32(1.0), np.float32(1e-20), np.float32(np.inf)
_SHARE_REAL, _SHARE_IMAGINARY = ray.NG_X, ray.NG_Y
_SHADOW_END, _NEAREST_M, _SAME_WAY = np.float32(0.999), np.float32(0.02), 0.9


def cosine_directions() -> NDArray[np.float32]:
    """Return (64, 3) unit directions about +z, spread by the cosine's law (Hammersley's points)."""
    index = np.arange(DIRECTIONS)
    bits = DIRECTIONS.bit_length() - 1
    radical = np.array([int(f"{k:0{bits}b}"[::-1], 2) / DIRECTIONS for k in index])
    radius, angle = np.sqrt((index + 0.5) / DIRECTIONS), 2.0 * np.pi * (radical + 0.5 / DIRECTIONS)
    return np.column_stack([radius * el.cos(angle), radius * el.sin(angle), np.sqrt(1.0 - radius**2)]).astype(np.float32)


@kernel
def radians_per_metre(device: Device) -> float:
    """Return how the phase grows with distance."""
    return 4.0 * np.pi * device.modulation_mhz * 1e6 / SPEED_OF_LIGHT


@entry
def sum_multipath(
    eye: Eye,
    device: Device,
    directions: NDArray[np.float32],
    beams: Beams,
    rays: Packet,
    result: NDArray[np.float32],
    first: int,
    step: int,
) -> None:
    """Fill rows ``first``, ``first + step``, ... of ``result``, (rows, columns, 2) float32: the sum over the direct light, complex.

    Row i, column j belongs to the pixel in row ``GRID * i``, column ``GRID * j``, or the image's last.
    """
    camera, per_metre = eye.camera, radians_per_metre(device)
    for i in range(first, result.shape[0], step):
        for j in range(result.shape[1]):
            x, y = min(GRID * j, camera.width - 1), min(GRID * i, camera.height - 1)
            result[i, j, 0] = result[i, j, 1] = _ZERO
            if beams.lit[y, x] and beams.normal[y, x, 0] ** 2 + beams.normal[y, x, 1] ** 2 + beams.normal[y, x, 2] ** 2 > _ZERO:
                for begin in range(0, DIRECTIONS, LANES):
                    _aim_around(directions, begin, beams, x, y, rays)
                    intersect16(rays.alive.ctypes.data, eye.tree.address, rays.real.ctypes.data, eye.tree.incoherent)
                    for k in range(LANES):
                        rays.alive[k] = -1 if _scatter(eye, per_metre, beams, x, y, k, rays) else 0
                    occluded16(rays.alive.ctypes.data, eye.tree.address, rays.real.ctypes.data, eye.tree.incoherent)
                    for k in range(LANES):
                        if rays.alive[k] != 0 and rays.real[ray.TFAR + k] > _ZERO:
                            result[i, j, 0] += rays.real[_SHARE_REAL + k]
                            result[i, j, 1] += rays.real[_SHARE_IMAGINARY + k]


@kernel
def _aim_around(directions: NDArray[np.float32], begin: int, beams: Beams, x: int, y: int, rays: Packet) -> None:
    """Aim rays from the point that a pixel sees in 16 directions about its normal, from number ``begin`` on."""
    real = rays.real
    px, py, pz = beams.point[y, x, 0], beams.point[y, x, 1], beams.point[y, x, 2]
    nx, ny, nz = beams.world_normal[y, x, 0], beams.world_normal[y, x, 1], beams.world_normal[y, x, 2]
    tx, ty, tz, sx, sy, sz = coordinate_system(nx, ny, nz)
    for k in range(LANES):
        u, v, w = directions[begin + k, 0], directions[begin + k, 1], directions[begin + k, 2]
        real[ray.ORG_X + k], real[ray.ORG_Y + k], real[ray.ORG_Z + k] = px, py, pz
        real[ray.DIR_X + k] = u * tx + v * sx + w * nx
        real[ray.DIR_Y + k] = u * ty + v * sy + w * ny
        real[ray.DIR_Z + k] = u * tz + v * sz + w * nz
        real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, _INFINITE
        rays.integer[ray.GEOM_ID + k] = INVALID_ID
        rays.alive[k] = -1


@kernel
def _scatter(eye: Eye, per_metre: float, beams: Beams, x: int, y: int, k: int, rays: Packet) -> bool:
    """Aim ray k from the point Q that it has hit at the device, with what light brings that way; return False where none comes.

    The normal's fields keep that, complex, while the shadow ray is traced.
    """
    real, surfaces, camera, distance = rays.real, eye.surfaces, eye.camera, beams.distance[y, x]
    if rays.integer[ray.GEOM_ID + k] == INVALID_ID:
        return False
    at = np.int64(surfaces.face_part[rays.integer[ray.PRIM_ID + k]]) * st.ROW_SIZE
    table = surfaces.materials
    matt = table[at + st.BASE] * (_ONE - table[at + st.METALLIC]) * (_ONE - table[at + st.TRANSMISSION])
    # Q, and its normal towards P.
    t = max(real[ray.TFAR + k], _NEAREST_M)
    qx, qy, qz = beams.point[y, x, 0], beams.point[y, x, 1], beams.point[y, x, 2]
    qx, qy, qz = qx + t * real[ray.DIR_X + k], qy + t * real[ray.DIR_Y + k], qz + t * real[ray.DIR_Z + k]
    mx, my, mz = real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k]
    scale = _ONE / max(np.sqrt(mx * mx + my * my + mz * mz), _TINY)
    if mx * real[ray.DIR_X + k] + my * real[ray.DIR_Y + k] + mz * real[ray.DIR_Z + k] > _ZERO:
        scale = -scale
    # The way from there to the device.
    dx, dy, dz = camera.position[0] - qx, camera.position[1] - qy, camera.position[2] - qz
    away = np.sqrt(dx * dx + dy * dy + dz * dz)
    cosine = (mx * dx + my * dy + mz * dz) * scale / max(away, _NEAREST_M)
    if table[at + st.PORTAL] > _ZERO or matt <= _ZERO or cosine <= _ZERO or not _is_illuminated(camera, -dx, -dy, -dz):
        return False
    direct = beams.cosine[y, x] / (distance * distance)
    share = matt * cosine / (away * away) / direct / np.float32(DIRECTIONS)
    phase = per_metre * 0.5 * (away + t - distance)
    lift = lift_height(qx, qy, qz)
    real[ray.ORG_X + k] = qx + lift * mx * scale
    real[ray.ORG_Y + k] = qy + lift * my * scale
    real[ray.ORG_Z + k] = qz + lift * mz * scale
    real[_SHARE_REAL + k], real[_SHARE_IMAGINARY + k] = share * np.float32(np.cos(phase)), share * np.float32(np.sin(phase))
    real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k] = dx, dy, dz
    real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, _SHADOW_END
    return True


@entry
def smooth_multipath(
    camera: PosedCamera, beams: Beams, grid: NDArray[np.float32], result: NDArray[np.float32], first: int, step: int
) -> None:
    """Fill rows of ``result`` with the means of 3 x 3 places of ``grid`` that lie on the same surface, as few directions leave steps."""
    for i in range(first, grid.shape[0], step):
        for j in range(grid.shape[1]):
            x, y = min(GRID * j, camera.width - 1), min(GRID * i, camera.height - 1)
            real = imaginary = 0.0
            count = 0
            for row in range(max(i - 1, 0), min(i + 2, grid.shape[0])):
                for column in range(max(j - 1, 0), min(j + 2, grid.shape[1])):
                    if _is_alike(camera, beams, x, y, row, column):
                        real += grid[row, column, 0]
                        imaginary += grid[row, column, 1]
                        count += 1
            result[i, j, 0], result[i, j, 1] = real / max(count, 1), imaginary / max(count, 1)


@kernel
def _is_alike(camera: PosedCamera, beams: Beams, x: int, y: int, row: int, column: int) -> bool:
    """Return whether a place of the grid lies on the surface that a pixel sees."""
    at_x, at_y = min(GRID * column, camera.width - 1), min(GRID * row, camera.height - 1)
    alike = 0.0
    for axis in range(3):
        alike += beams.world_normal[y, x, axis] * beams.world_normal[at_y, at_x, axis]
    return bool(alike > _SAME_WAY) and goes_on(camera, beams, x, y, at_x, at_y)


@kernel
def _is_illuminated(camera: PosedCamera, dx: np.float32, dy: np.float32, dz: np.float32) -> bool:
    """Return whether light goes that way from the device: as far as the image reaches."""
    r = camera.rotation
    depth = r[0, 2] * dx + r[1, 2] * dy + r[2, 2] * dz
    if depth <= _ZERO:
        return False
    u = (r[0, 0] * dx + r[1, 0] * dy + r[2, 0] * dz) / depth
    v = (r[0, 1] * dx + r[1, 1] * dy + r[2, 1] * dz) / depth
    left, top = pixel_plane(camera, 0, 0)
    right, bottom = pixel_plane(camera, camera.width - 1, camera.height - 1)
    return bool(left <= u <= right and top <= v <= bottom)


@kernel
def multipath_at(camera: PosedCamera, beams: Beams, grid: NDArray[np.float32], x: int, y: int) -> tuple[float, float]:
    """Return the sum at a pixel, from the places around it that lie on the same surface."""
    i, j = y // GRID, x // GRID
    f, g = (y - GRID * i) / GRID, (x - GRID * j) / GRID
    real = imaginary = weights = 0.0
    for di in range(2):
        for dj in range(2):
            row, column = min(i + di, grid.shape[0] - 1), min(j + dj, grid.shape[1] - 1)
            weight = (f if di else 1.0 - f) * (g if dj else 1.0 - g)
            if weight > 0.0 and _is_alike(camera, beams, x, y, row, column):
                real += weight * grid[row, column, 0]
                imaginary += weight * grid[row, column, 1]
                weights += weight
    return (real / weights, imaginary / weights) if weights > 0.0 else (0.0, 0.0)

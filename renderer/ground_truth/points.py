"""Where the hits lie, in the world, before the camera, on their surface and in the box of their object, and how they are turned.

All of it comes from one pass over the hit record that computes what is asked for and no more.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.camera.camera_rays import CENTRE, TILE
from renderer.camera.cameras import PosedCamera
from renderer.camera.row_times import project_by_rows
from renderer.camera.shutter import aim_exposed_tile, turn_vectors
from renderer.core.kernel import entry, inlined, kernel
from renderer.core.lanes import LANES_SIZE
from renderer.core.layout import Layout
from renderer.core.ray_packet import DIR_X, DIR_Y, DIR_Z, LANES, ORG_X, ORG_Y, ORG_Z, Packet
from renderer.core.tiles import load_numbers, load_vectors, store_numbers, store_pairs, store_vectors
from renderer.ground_truth.hit_view import HitView, shared_fields
from renderer.path.ground_truth import Hits

_ZERO, _ONE, _TINY, _NAN = np.float32(0.0), np.float32(1.0), np.float32(1e-30), np.float32(np.nan)
_BEHIND_M = 1e-6
_ARC = tuple(
    np.float32(a)
    for a in (1.5707963050, -0.2145988016, 0.0889789874, -0.0501743046, 0.0308918810, -0.0170881256, 0.0066700901, -0.0012624911)
)
"""Coefficients of the powers of a cosine, for its angle over the root of one less the cosine."""

_LANES = Layout(LANES)
_P_X, _P_Y, _P_Z = _LANES.vector()  # the point, world
_N_X, _N_Y, _N_Z = _LANES.vector()  # its unit normal towards the camera, world
_C_X, _C_Y, _C_Z = _LANES.vector()  # the point, optical frame
_DISTANCE = _LANES.field()  # along the ray
_ANGLE = _LANES.field()  # of incidence, rad
_FLOW = _LANES.field(2)  # optical flow, right and down
assert _LANES.size <= LANES_SIZE


class PointImages(NamedTuple):
    """What :func:`measure_points` fills, float32, a field for each layer of that name; those that nobody needs have a height of 0.

    position, position_camera: (height, width, 3), metres; normals_world: (height, width, 3), 0 where nothing is hit; incidence: (height,
    width), rad; uv: (height, width, 2), metres; object_coordinates: (height, width, 3); flow, flow_backward: (height,
    width, 2), pixels.  All but normals are NaN where nothing is hit.
    """

    position: NDArray[np.float32]
    position_camera: NDArray[np.float32]
    normals_world: NDArray[np.float32]
    incidence: NDArray[np.float32]
    uv: NDArray[np.float32]
    object_coordinates: NDArray[np.float32]
    flow: NDArray[np.float32]
    flow_backward: NDArray[np.float32]


class PointInputs(NamedTuple):
    """What points are made of.

    distance: (height, width), along the rays, metres; normals: (height, width, 3), optical frame; hits: the hit record; faces, face_part:
    triangle -> corners (m, 3) and part (m,); uvs: vertex -> texture coordinates (n, 2); part_box: part -> box (p, 3, 4), or none at all
    (0, 3, 4).
    """

    distance: NDArray[np.float32]
    normals: NDArray[np.float32]
    hits: Hits
    faces: NDArray[np.uint32]
    face_part: NDArray[np.int32]
    uvs: NDArray[np.float32]
    part_box: NDArray[np.float32]


class Cameras(NamedTuple):
    """The view's camera, and those of the frames before and after it."""

    now: PosedCamera
    before: PosedCamera
    after: PosedCamera


_CHANNELS = {"incidence": (), "uv": (2,), "flow": (2,), "flow_backward": (2,)}
_INPUTS = {
    "object_coordinates": ("position",),
    "boundaries": ("position", "normals_world"),
    "occlusion": ("position", "normals_world", "flow"),
    "occlusion_backward": ("position", "normals_world", "flow_backward"),
}
"""Layer that is computed from these images -> which of them."""


def point_images(view: HitView) -> PointImages:
    """Return the images that the view's layers need.

    Flow is left NaN where there is no other frame, and where the lens is no ideal pinhole: see ``renderer.ground_truth.motion``.
    """
    height, width = view.hits.face.shape
    needed = {field for name in view.names for field in (name, *_INPUTS.get(name, ()))}
    if not view.config.is_plain and {"flow", "flow_backward"} & needed:
        needed.add("position")
    shapes = [(height if name in needed else 0, width, *_CHANNELS.get(name, (3,))) for name in PointImages._fields]
    images = PointImages(*view.scene.memory.empty([(shape, np.float32) for shape in shapes]))
    flat, filled, cameras = view.scene.flat, images, []
    for name, other in zip(("flow_backward", "flow"), view.neighbour_views, strict=True):
        if other is None or not view.config.is_plain:
            getattr(images, name).fill(np.nan)
            filled = filled._replace(**{name: np.empty((0, width, 2), np.float32)})
        cameras.append(other or view.camera)
    tables = (flat.mesh.faces, flat.face_part, flat.mesh.uvs, flat.part_box)
    inputs = PointInputs(view.images.range, view.images.normals, view.hits, *tables)
    view.scene.in_tiles(measure_points, inputs, Cameras(view.camera, *cameras), filled)
    return images


@entry
def measure_points(
    rays: Packet, lanes: NDArray[np.float32], inputs: PointInputs, cameras: Cameras, images: PointImages, first: int, step: int
) -> None:
    """Fill the rows of tiles ``first``, ``first + step``, ...

    Points lie on their pixels' rays, at their distance along them: barycentric weights of slender triangles seen at grazing angles are off
    by up to a millimetre.
    """
    camera, hits = cameras.now, inputs.hits
    turned = len(images.normals_world) > 0 or len(images.incidence) > 0
    for row in range(first * TILE, camera.height, step * TILE):
        for column in range(0, camera.width, TILE):
            aim_exposed_tile(camera, column, row, CENTRE, rays)
            load_numbers(inputs.distance, column, row, _DISTANCE, lanes)
            _place(rays, lanes)
            if len(images.position):
                store_vectors(lanes, _P_X, column, row, images.position)
            if len(images.position_camera):
                _place_before_camera(camera, lanes)
                store_vectors(lanes, _C_X, column, row, images.position_camera)
            if turned:
                load_vectors(inputs.normals, column, row, _N_X, lanes)
                _turn_normals(camera, lanes)
                if camera.row_step > _ZERO:
                    turn_vectors(camera, row, _N_X, lanes)
            if len(images.normals_world):
                store_vectors(lanes, _N_X, column, row, images.normals_world)
            if len(images.incidence):
                _find_incidence(rays, lanes)
                store_numbers(lanes, _ANGLE, column, row, images.incidence)
            if len(images.flow):
                _move(cameras.after, column, row, lanes)
                store_pairs(lanes, _FLOW, column, row, images.flow)
            if len(images.flow_backward):
                _move(cameras.before, column, row, lanes)
                store_pairs(lanes, _FLOW, column, row, images.flow_backward)
        for y in range(row, min(row + TILE, camera.height)):
            if len(images.uv):
                _interpolate(inputs, hits.face[y], hits.u[y], hits.v[y], images.uv[y])
            if len(images.object_coordinates):
                _put_into_boxes(inputs, hits.face[y], images.position[y], images.object_coordinates[y])


@kernel
def _place(rays: Packet, lanes: NDArray[np.float32]) -> None:
    """Write the points at the distances that ``_DISTANCE`` holds; NaN where one is not finite."""
    real = rays.real
    for k in range(LANES):
        dx, dy, dz = real[DIR_X + k], real[DIR_Y + k], real[DIR_Z + k]
        t = lanes[_DISTANCE + k] / np.sqrt(dx * dx + dy * dy + dz * dz)
        t = t if abs(t) < np.float32(np.inf) else _NAN
        lanes[_P_X + k], lanes[_P_Y + k], lanes[_P_Z + k] = real[ORG_X + k] + t * dx, real[ORG_Y + k] + t * dy, real[ORG_Z + k] + t * dz


@kernel
def _place_before_camera(camera: PosedCamera, lanes: NDArray[np.float32]) -> None:
    r, p = camera.rotation, camera.position
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = r[0, 0], r[0, 1], r[0, 2], r[1, 0], r[1, 1], r[1, 2], r[2, 0], r[2, 1], r[2, 2]
    px, py, pz = p[0], p[1], p[2]
    for k in range(LANES):
        x, y, z = lanes[_P_X + k] - px, lanes[_P_Y + k] - py, lanes[_P_Z + k] - pz
        lanes[_C_X + k] = r00 * x + r10 * y + r20 * z
        lanes[_C_Y + k] = r01 * x + r11 * y + r21 * z
        lanes[_C_Z + k] = r02 * x + r12 * y + r22 * z


@kernel
def _turn_normals(camera: PosedCamera, lanes: NDArray[np.float32]) -> None:
    """Turn the normals of the lanes from the optical frame into the world."""
    r = camera.rotation
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = r[0, 0], r[0, 1], r[0, 2], r[1, 0], r[1, 1], r[1, 2], r[2, 0], r[2, 1], r[2, 2]
    for k in range(LANES):
        x, y, z = lanes[_N_X + k], lanes[_N_Y + k], lanes[_N_Z + k]
        lanes[_N_X + k] = r00 * x + r01 * y + r02 * z
        lanes[_N_Y + k] = r10 * x + r11 * y + r12 * z
        lanes[_N_Z + k] = r20 * x + r21 * y + r22 * z


@kernel
def _find_incidence(rays: Packet, lanes: NDArray[np.float32]) -> None:
    """Write the angles between the normals and the ways to where the rays begin, 0 to pi / 2.

    The arc cosine is a polynomial, off by 2e-8 at most (Abramowitz and Stegun, "Handbook of Mathematical Functions", 4.4.46).
    """
    real = rays.real
    for k in range(LANES):
        x, y, z = real[ORG_X + k] - lanes[_P_X + k], real[ORG_Y + k] - lanes[_P_Y + k], real[ORG_Z + k] - lanes[_P_Z + k]
        along = x * lanes[_N_X + k] + y * lanes[_N_Y + k] + z * lanes[_N_Z + k]
        length = np.sqrt(x * x + y * y + z * z)
        cosine = along / (length if length > _TINY else _TINY)
        cosine = _ZERO if cosine < _ZERO else cosine
        cosine = _ONE if cosine > _ONE else cosine
        value = _ARC[7]
        for power in range(6, -1, -1):
            value = value * cosine + _ARC[power]
        lanes[_ANGLE + k] = value * np.sqrt(_ONE - cosine)


@kernel
def _move(camera: PosedCamera, column: int, row: int, lanes: NDArray[np.float32]) -> None:
    """Write the way from the pixels to where an ideal pinhole sees their points, each row at its time; NaN behind it."""
    if camera.row_step > _ZERO:
        for k in range(LANES):
            here_u, here_v = column + (k & 3) + 0.5, row + (k >> 2) + 0.5
            u, v = project_by_rows(camera, lanes[_P_X + k], lanes[_P_Y + k], lanes[_P_Z + k], here_v)
            lanes[_FLOW + k], lanes[_FLOW + LANES + k] = np.float32(u - here_u), np.float32(v - here_v)
    else:
        _project(camera, column, row, lanes)


@inlined
def _project(camera: PosedCamera, column: int, row: int, lanes: NDArray[np.float32]) -> None:
    r, p, focal = camera.rotation, camera.position, camera.focal_px
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = r[0, 0], r[0, 1], r[0, 2], r[1, 0], r[1, 1], r[1, 2], r[2, 0], r[2, 1], r[2, 2]
    px, py, pz = p[0], p[1], p[2]
    middle_u, middle_v = 0.5 * camera.width, 0.5 * camera.height
    for k in range(LANES):
        x, y, z = lanes[_P_X + k] - px, lanes[_P_Y + k] - py, lanes[_P_Z + k] - pz
        depth = r02 * x + r12 * y + r22 * z
        across, down = r00 * x + r10 * y + r20 * z, r01 * x + r11 * y + r21 * z
        depth = depth if depth > _BEHIND_M else _NAN
        lanes[_FLOW + k] = np.float32(focal * across / depth + middle_u - (column + (k & 3) + 0.5))
        lanes[_FLOW + LANES + k] = np.float32(focal * down / depth + middle_v - (row + (k >> 2) + 0.5))


@kernel
def _interpolate(
    inputs: PointInputs, face: NDArray[np.int32], v: NDArray[np.float32], w: NDArray[np.float32], uv: NDArray[np.float32]
) -> None:
    """Write the texture coordinates of a row of hits, NaN where there is none."""
    faces, values = inputs.faces, inputs.uvs
    before = np.int32(-1)
    u0 = v0 = u1 = v1 = u2 = v2 = _NAN
    for x in range(len(face)):
        # Neighbours often hit one triangle: its corners are looked up once.
        if face[x] != before:
            before = face[x]
            u0 = v0 = u1 = v1 = u2 = v2 = _NAN
            if before >= 0:
                a, b, c = faces[before, 0], faces[before, 1], faces[before, 2]
                u0, v0, u1, v1, u2, v2 = values[a, 0], values[a, 1], values[b, 0], values[b, 1], values[c, 0], values[c, 1]
        rest = _ONE - v[x] - w[x]
        uv[x, 0] = rest * u0 + v[x] * u1 + w[x] * u2
        uv[x, 1] = rest * v0 + v[x] * v1 + w[x] * v2


@kernel
def _put_into_boxes(inputs: PointInputs, face: NDArray[np.int32], points: NDArray[np.float32], places: NDArray[np.float32]) -> None:
    """Write where a row of points lies in the boxes of their objects, NaN where nothing is hit or no box is told."""
    boxes = inputs.part_box
    before = np.int32(-1)
    x0 = x1 = x2 = x3 = y0 = y1 = y2 = y3 = z0 = z1 = z2 = z3 = _NAN
    for i in range(len(face)):
        if face[i] != before:
            before = face[i]
            x0 = x1 = x2 = x3 = y0 = y1 = y2 = y3 = z0 = z1 = z2 = z3 = _NAN
            if before >= 0 and len(boxes):
                part = inputs.face_part[before]
                x0, x1, x2, x3 = boxes[part, 0, 0], boxes[part, 0, 1], boxes[part, 0, 2], boxes[part, 0, 3]
                y0, y1, y2, y3 = boxes[part, 1, 0], boxes[part, 1, 1], boxes[part, 1, 2], boxes[part, 1, 3]
                z0, z1, z2, z3 = boxes[part, 2, 0], boxes[part, 2, 1], boxes[part, 2, 2], boxes[part, 2, 3]
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        places[i, 0] = x0 * x + x1 * y + x2 * z + x3
        places[i, 1] = y0 * x + y1 * y + y2 * z + y3
        places[i, 2] = z0 * x + z1 * y + z2 * z + z3


LAYERS = shared_fields(point_images, PointImages._fields[:6])
"""Flow is that of :mod:`renderer.ground_truth.motion`."""

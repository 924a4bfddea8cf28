"""Where rays meet triangles, exactly: the same on processors of every maker, whose estimates of reciprocals Embree divides by.

Distances and places on triangles are computed anew after Embree has found a hit; a filter that Embree calls takes the first face of those
at one distance.
"""

import ctypes
import functools
from typing import Any

import numpy as np
from numba import cfunc, types

from renderer.core.addresses import addresses_at, floats_at, words_at
from renderer.core.kernel import inlined
from renderer.core.ray_packet import BARY_U, BARY_V, FIRST_FACE, GEOM_ID, ID, LANES, NEAREST, PRIM_ID, TFAR, TIME

_SAME_ULP, _BEYOND_ULP = 4, 64
"""Hits so near to each other count as at one distance, and rays end so far behind a hit, as Embree has it, that all of these are seen."""


class IntersectArguments(ctypes.Structure):
    """RTCIntersectArguments."""

    _fields_ = (
        ("flags", ctypes.c_int),
        ("feature_mask", ctypes.c_int),
        ("context", ctypes.c_void_p),
        ("filter", ctypes.c_void_p),
        ("intersect", ctypes.c_void_p),
        ("min_width_distance_factor", ctypes.c_float),
        # ours, behind what Embree reads: whether rays go by halves, the mesh by which their hits are then settled, arguments for occlusion
        ("halves", ctypes.c_int),
        ("faces", ctypes.c_void_p),
        ("vertices", ctypes.c_void_p),
        ("occlusion", ctypes.c_void_p),
    )


HALVES = IntersectArguments.halves.offset // 4
FILTER, _FACES, _VERTICES, OCCLUSION = (
    getattr(IntersectArguments, name).offset // 8 for name in ("filter", "faces", "vertices", "occlusion")
)


@inlined
def _volumes(rays: Any, stride: int, k: int, faces: Any, vertices: Any, face: np.int64) -> tuple[float, float, float, float]:
    """Return six times the volumes by which ray ``k`` of ``stride`` meets the plane of a face, in double precision.

    Those that the ray's direction spans with its edges as seen from the origin, all together and over the edges that face its second and
    third corner: their shares are u and v (Pluecker coordinates: K. Shoemake, "Pluecker Coordinate Tutorial", Ray Tracing News 11(1),
    1998); and that of the face with the origin, which is the distance in directions times the first.
    """
    i, j, m = np.int64(faces[3 * face]) * 3, np.int64(faces[3 * face + 1]) * 3, np.int64(faces[3 * face + 2]) * 3
    ox, oy, oz = np.float64(rays[k]), np.float64(rays[stride + k]), np.float64(rays[2 * stride + k])
    dx, dy, dz = np.float64(rays[4 * stride + k]), np.float64(rays[5 * stride + k]), np.float64(rays[6 * stride + k])
    ax, ay, az = vertices[i] - ox, vertices[i + 1] - oy, vertices[i + 2] - oz
    bx, by, bz = vertices[j] - ox, vertices[j + 1] - oy, vertices[j + 2] - oz
    cx, cy, cz = vertices[m] - ox, vertices[m + 1] - oy, vertices[m + 2] - oz
    px, py, pz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    at_b = dx * (cy * az - cz * ay) + dy * (cz * ax - cx * az) + dz * (cx * ay - cy * ax)
    at_c = dx * (ay * bz - az * by) + dy * (az * bx - ax * bz) + dz * (ax * by - ay * bx)
    return dx * px + dy * py + dz * pz + at_b + at_c, at_b, at_c, ax * px + ay * py + az * pz


@inlined
def _distance(rays: Any, stride: int, k: int, faces: Any, vertices: Any, face: int, estimate: np.float32) -> np.float32:
    """Return how far along ray ``k`` of ``stride`` it meets the plane of a face; the estimate where it lies in the plane."""
    whole, _, _, height = _volumes(rays, stride, k, faces, vertices, np.int64(face))
    return estimate if whole == 0.0 else np.float32(height / whole)


@functools.cache
def first_of_equals_filter() -> Any:
    """Return Embree's filter, compiled: it refuses a hit that lies behind one of the same ray at the same distance with an earlier face.

    Distances are compared as the integers that positive floats are in memory; those that Embree has so near to each other that its
    estimates may have mixed them up are computed anew.  Arguments: RTCFilterFunctionNArguments of any N: pointers to valid, the scene's
    ``IntersectArguments``, context, rays and hits, and N.
    """

    @cfunc(types.void(types.CPointer(types.int64)))
    def first_of_equals(arguments):  # type: ignore[no-untyped-def]
        valid, ray, hit, own = words_at(arguments[0]), words_at(arguments[3]), words_at(arguments[4]), addresses_at(arguments[1])
        rays, faces, vertices = floats_at(arguments[3]), words_at(own[_FACES]), floats_at(own[_VERTICES])
        lanes = arguments[5] & 0xFFFFFFFF
        for k in range(lanes):
            if valid[k] == -1:
                face, end = hit[5 * lanes + k], TFAR // LANES * lanes + k
                low, high = ray[ID // LANES * lanes + k], ray[TIME // LANES * lanes + k]
                address = (high << 32) | (low & 0xFFFFFFFF)
                taken, nearest = words_at(address), floats_at(address)
                kept, met, before = ray[end], rays[end], nearest[0]
                behind = np.int64(kept) - taken[0]
                if -_BEYOND_ULP <= behind <= _BEYOND_ULP:
                    first = taken[FIRST_FACE - NEAREST]
                    nearest[0] = _distance(rays, lanes, k, faces, vertices, first, before)
                    behind = -np.int64(taken[0])
                    nearest[0] = _distance(rays, lanes, k, faces, vertices, face, met)
                    behind += taken[0]
                    if -_SAME_ULP <= behind <= _SAME_ULP:
                        behind = face - first
                if behind > 0:
                    valid[k], nearest[0] = 0, before
                else:
                    nearest[0], taken[FIRST_FACE - NEAREST] = met, face
                    ray[end] = kept + _BEYOND_ULP

    return first_of_equals


@inlined
def settle(alive: int, packet: int, arguments: int) -> None:
    """Compute anew how far along their rays and where on their triangles hits are."""
    lives, rays, hits = words_at(np.int64(alive)), floats_at(np.int64(packet)), words_at(np.int64(packet))
    own = addresses_at(np.int64(arguments))
    faces, vertices = words_at(own[_FACES]), floats_at(own[_VERTICES])
    for k in range(LANES):
        if lives[k] == 0 or hits[GEOM_ID + k] == -1:
            continue
        whole, at_b, at_c, height = _volumes(rays, LANES, k, faces, vertices, np.int64(np.uint32(hits[PRIM_ID + k])))
        if whole != 0.0:
            u, v = min(max(at_b / whole, 0.0), 1.0), min(max(at_c / whole, 0.0), 1.0)
            rays[BARY_U + k], rays[BARY_V + k], rays[TFAR + k] = np.float32(u), np.float32(min(v, 1.0 - u)), np.float32(height / whole)

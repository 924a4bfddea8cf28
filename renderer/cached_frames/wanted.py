"""Which fine nodes a view reads: those around what its pixels hit, and around what smooth mirrors and clear glass show there."""

import numpy as np
from numpy.typing import NDArray

from renderer.cached_frames.records import CachedView, ShadeScratch
from renderer.camera.camera_rays import CENTRE, TILE
from renderer.camera.shutter import aim_exposed_tile
from renderer.core import ray_packet as ray
from renderer.core.embree import intersect16
from renderer.core.kernel import entry, inlined
from renderer.core.ray_packet import INVALID_ID, LANES
from renderer.ground_truth.surface_images import restore_hits
from renderer.irradiance_cache.atlas import mark_nodes
from renderer.irradiance_cache.specular import go_on, is_brushed, is_clear, is_mirror
from renderer.path import surface_tables as st
from renderer.path.ground_truth import Hits
from renderer.path.light_nodes import STRIP, Atlas
from renderer.path.surface_tables import Surfaces

DEEPEST = 8
"""So many mirrors and faces of glass a ray passes at most."""


@entry
def want_nodes(atlas: Atlas, hits: Hits, is_read: NDArray[np.bool_], first: int, step: int) -> None:
    """Mark the nodes around the hits of rows ``first``, ``first + step``, ..., on both sides where there are two."""
    height, width = hits.face.shape
    for y in range(first, height, step):
        last_face = last_cell = -1
        for x in range(width):
            # Neighbours often read the same nodes.
            face = hits.face[y, x]
            if face < 0 or (face == last_face and atlas.cells[face, 3] < STRIP):
                continue
            last_face, last_cell = face, mark_nodes(atlas, face, hits.u[y, x], hits.v[y, x], last_cell, is_read)


@entry
def want_shown(shown: CachedView, memory: ShadeScratch, is_read: NDArray[np.bool_], first: int, step: int) -> None:
    """Mark the nodes around what mirrors and glass show in the rows of tiles ``first``, ``first + step``, ..., on both sides."""
    view, surfaces, packet = shown.traced, shown.scene.surfaces, memory.trace.rays
    height, width = view.hits.face.shape
    for row in range(first * TILE, height, step * TILE):
        last_face, last_shows = np.int32(-1), False
        for column in range(0, width, TILE):
            waiting = 0
            for k in range(LANES):
                packet.alive[k] = 0
                y, x = row + (k >> 2), column + (k & 3)
                face = view.hits.face[y, x] if y < height and x < width else np.int32(-1)
                if face >= 0 and face != last_face:
                    last_face, last_shows = face, sends_on(surfaces, int(face))
                if face >= 0 and last_shows:
                    packet.alive[k] = -1
                    waiting += 1
            if waiting > 0:
                _follow(shown, column, row, waiting, memory, is_read)


@inlined
def sends_on(surfaces: Surfaces, face: int) -> bool:
    """Return whether a triangle is of smooth metal or clear glass."""
    materials, at = surfaces.materials, surfaces.face_part[face] * st.ROW_SIZE
    return bool(is_mirror(materials, at) | is_clear(materials, at))


@inlined
def _follow(shown: CachedView, column: int, row: int, waiting: int, memory: ShadeScratch, is_read: NDArray[np.bool_]) -> None:
    """Follow the alive rays of a tile, whose hits are those of the view, to what is neither; panes and brushed metal end them."""
    surfaces, tree, packet = shown.scene.surfaces, shown.scene.tree, memory.trace.rays
    real, integer, alive, materials = packet.real, packet.integer, packet.alive, surfaces.materials
    chosen = 0
    for k in range(LANES):
        chosen |= (1 << k) if alive[k] != 0 else 0
    aim_exposed_tile(shown.traced.camera, column, row, CENTRE, packet)
    restore_hits(shown.traced, column, row, packet)
    for k in range(LANES):
        alive[k] = 0
        if chosen >> k & 1:
            go_on(packet, k, is_mirror(materials, surfaces.face_part[integer[ray.PRIM_ID + k]] * st.ROW_SIZE))
    for _ in range(DEEPEST):
        if waiting == 0:
            break
        intersect16(alive.ctypes.data, tree.address, real.ctypes.data, tree.incoherent)
        waiting = 0
        for k in range(LANES):
            met = alive[k] != 0 and integer[ray.GEOM_ID + k] != INVALID_ID
            alive[k] = 0
            if not met:
                continue
            face = int(integer[ray.PRIM_ID + k])
            at = surfaces.face_part[face] * st.ROW_SIZE
            if sends_on(surfaces, face):
                go_on(packet, k, is_mirror(materials, at))
                waiting += 1
            elif materials[at + st.PORTAL] == np.float32(0.0) and not is_brushed(materials, at):
                mark_nodes(shown.tables.fine, face, real[ray.BARY_U + k], real[ray.BARY_V + k], -1, is_read)

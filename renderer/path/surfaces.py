"""What the rays of a packet hit: position, normals, material and emission, one table look-up per lane.

Textures are asked for one lane at a time, after the material of its part is known; a pane shows the sky only where nothing stands behind.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.embree import SceneHandle, occluded16
from renderer.core.kernel import inlined, kernel
from renderer.core.lanes import lane_count
from renderer.core.ray_packet import INVALID_ID, LANES, PASS_PANES, Packet
from renderer.path import surface_tables as st
from renderer.path.emission import emitter_le, escaped_le, material_glow
from renderer.path.records import LitScene, Scratch
from renderer.path.surface_tables import Surfaces
from renderer.textures import look_up as tex
from renderer.textures.look_up import Textures, evaluate_texture
from renderer.textures.wear import apply_wear

_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-30)
_USABLE, _GRAZING = np.float32(1e-3), np.float32(1e-4)
_LIFT_M, _LIFT_RATIO = np.float32(2e-5), np.float32(4e-6)


@inlined
def lift_height(x: np.float32, y: np.float32, z: np.float32) -> np.float32:
    """Return how far to stay off a surface at a point, in metres: some ten roundings of its coordinates."""
    x, y, z = abs(x), abs(y), abs(z)
    most = x if x > y else y
    return _LIFT_M + _LIFT_RATIO * (most if most > z else z)


@inlined
def evaluate_surfaces(scene: LitScene, primary: bool, trilinear: bool, widest: np.float32, scratch: Scratch) -> None:
    """Fill the hits, their materials and emission for 16 traced rays, and make the rays' directions unit.

    Camera rays (``primary``) that leave the scene see the sky, and rays that come from outside; others are dark, as light from outside
    enters by portals only.
    ``trilinear``: textures are filtered for rays that are their pixel's only ones; ``widest``: most that ray cones grow per metre.
    """
    packet, lanes, parts = scratch.rays, scratch.lanes, scratch.parts
    surfaces, lights = scene.surfaces, scene.lights
    _place_hits(packet, lanes)
    _fetch_materials(packet, surfaces, _ONE if primary else _ZERO, widest, lanes, parts)
    look_through_panes(scene.tree, scratch)
    # One by one, the few lanes whose material is more than a row of the table.
    for k in range(LANES):
        if lanes[ln.SPECIAL + k] == _ZERO:
            continue
        part = parts[k]
        if part < 0:
            escaped_le(surfaces, lights, packet, k, lanes)
            continue
        texture = surfaces.textures.part[part]
        if texture >= 0:
            apply_texture(surfaces.textures, texture, trilinear, packet, k, lanes)
        worn = surfaces.materials[part * st.ROW_SIZE + st.WEAR]
        if worn > _ZERO:
            apply_wear(surfaces.wear, worn, k, lanes)
        if lanes[ln.SPECIAL + k] > _ONE:
            material_glow(surfaces.materials[part * st.ROW_SIZE + st.GLOW], k, lanes)
            emitter_le(surfaces, lights, part, primary, packet, k, lanes)
    _orient_shading_normals(packet, lanes)


@inlined
def _fetch_materials(
    packet: Packet, surfaces: Surfaces, missed: np.float32, widest: np.float32, lanes: NDArray[np.float32], parts: NDArray[np.int32]
) -> None:
    """Write parts, HIT, the material up to SPECIAL, WIDTH, NS as the mesh has it, and no emission.

    ``missed``: SPECIAL of rays from inside that hit nothing.
    """
    real, integer, table = packet.real, packet.integer, surfaces.materials
    normals = surfaces.normals
    # Part, ray cone and defaults.
    for k in range(lane_count(lanes)):
        hit = integer[ray.GEOM_ID + k] != INVALID_ID
        parts[k] = surfaces.face_part[integer[ray.PRIM_ID + k]] if hit else -1
        lanes[ln.HIT + k] = _ONE if hit else _ZERO
        lanes[ln.SPECIAL + k] = missed + lanes[ln.OUTSIDE + k] if packet.alive[k] != 0 else _ZERO
        growth = lanes[ln.SPREAD + k] if lanes[ln.SPREAD + k] < widest else widest
        lanes[ln.WIDTH + k] += growth * real[ray.TFAR + k]
        lanes[ln.LE_R + k] = lanes[ln.LE_G + k] = lanes[ln.LE_B + k] = lanes[ln.LE_PDF + k] = _ZERO
        lanes[ln.THIN + k] = lanes[ln.OPEN + k] = lanes[ln.BEHIND + k] = _ZERO
    # The row of the part.
    for k in range(lane_count(lanes)):
        if parts[k] >= 0:
            row = parts[k] * st.ROW_SIZE
            lanes[ln.BASE_R + k] = table[row + st.BASE]
            lanes[ln.BASE_G + k] = table[row + st.BASE + 1]
            lanes[ln.BASE_B + k] = table[row + st.BASE + 2]
            lanes[ln.ROUGHNESS + k] = table[row + st.ROUGHNESS]
            lanes[ln.METALLIC + k] = table[row + st.METALLIC]
            lanes[ln.TRANSMISSION + k] = table[row + st.TRANSMISSION]
            lanes[ln.DIFFUSE_TRANSMISSION + k] = table[row + st.DIFFUSE_TRANSMISSION]
            lanes[ln.OPENNESS + k] = table[row + st.OPENNESS]
            lanes[ln.IOR + k] = table[row + st.IOR]
            lanes[ln.COAT + k] = table[row + st.COAT]
            lanes[ln.COAT_ROUGHNESS + k] = table[row + st.COAT_ROUGHNESS]
            lanes[ln.SHEEN + k] = table[row + st.SHEEN]
            lanes[ln.THIN + k] = table[row + st.PORTAL]
            lanes[ln.GLASS + k] = table[row + st.GLASS]
            lanes[ln.SPECIAL + k] = table[row + st.SPECIAL]
    # The interpolated normal.
    for k in range(lane_count(lanes)):
        if parts[k] >= 0:
            at = 9 * np.int64(integer[ray.PRIM_ID + k])
            v, w = real[ray.BARY_U + k], real[ray.BARY_V + k]
            u = _ONE - v - w
            lanes[ln.NS_X + k] = u * normals[at] + v * normals[at + 3] + w * normals[at + 6]
            lanes[ln.NS_Y + k] = u * normals[at + 1] + v * normals[at + 4] + w * normals[at + 7]
            lanes[ln.NS_Z + k] = u * normals[at + 2] + v * normals[at + 5] + w * normals[at + 8]


@kernel
def _place_hits(packet: Packet, lanes: NDArray[np.float32]) -> None:
    """Make directions unit, face the geometric normals to the viewer and lift the hit points off their surfaces."""
    real, integer = packet.real, packet.integer
    for k in range(LANES):
        # The unit direction, and the distance in metres.
        dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        dx, dy, dz = dx / length, dy / length, dz / length
        t = _ZERO if integer[ray.GEOM_ID + k] == INVALID_ID else real[ray.TFAR + k] * length
        # The unit normal, on the viewer's side.
        nx, ny, nz = real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k]
        scale = _ONE / max(np.sqrt(nx * nx + ny * ny + nz * nz), _TINY)
        cosine = -(nx * dx + ny * dy + nz * dz) * scale
        scale = -scale if cosine < _ZERO else scale
        nx, ny, nz = nx * scale, ny * scale, nz * scale
        # The point, lifted along it.
        x, y, z = real[ray.ORG_X + k] + t * dx, real[ray.ORG_Y + k] + t * dy, real[ray.ORG_Z + k] + t * dz
        lift = lift_height(x, y, z)
        real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k], real[ray.TFAR + k] = dx, dy, dz, t
        lanes[ln.COS_FRONT + k] = cosine
        lanes[ln.NG_X + k], lanes[ln.NG_Y + k], lanes[ln.NG_Z + k] = nx, ny, nz
        lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k] = nx, ny, nz
        lanes[ln.P_X + k], lanes[ln.P_Y + k], lanes[ln.P_Z + k] = x + lift * nx, y + lift * ny, z + lift * nz


@kernel
def _orient_shading_normals(packet: Packet, lanes: NDArray[np.float32]) -> None:
    """Make shading normals unit and turn them to the viewer; where they are unusable, take the geometric one.

    A normal that faces away from the viewer, as happens at the outlines of smooth surfaces, is bent until it just does not.
    """
    real = packet.real
    for k in range(LANES):
        x, y, z = lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k]
        nx, ny, nz = lanes[ln.NG_X + k], lanes[ln.NG_Y + k], lanes[ln.NG_Z + k]
        # To the side of the geometric normal, or replaced by it.
        side = x * nx + y * ny + z * nz
        length = np.sqrt(x * x + y * y + z * z)
        scale = _ONE / max(length, _TINY)
        scale = -scale if side < _ZERO else scale
        usable = abs(side) > _USABLE * length
        x, y, z = x * scale if usable else nx, y * scale if usable else ny, z * scale if usable else nz
        # Away from the ray as far as needed to see the viewer.
        dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
        bend = _GRAZING + (x * dx + y * dy + z * dz)
        bend = bend if bend > _ZERO else _ZERO
        x, y, z = x - bend * dx, y - bend * dy, z - bend * dz
        scale = _ONE / max(np.sqrt(x * x + y * y + z * z), _TINY)
        lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k] = x * scale, y * scale, z * scale


_INFINITE = np.float32(np.inf)


@inlined
def look_through_panes(scene: SceneHandle, scratch: Scratch) -> None:
    """Fill OPEN of the lanes that hit a pane from inside: their rays go on through it, and through any other, to the sky or not.

    Frames, sills and the reveals of walls are what they meet.  The packet of the shadow rays serves, as none is traced meanwhile.
    """
    lanes, rays, packet = scratch.lanes, scratch.rays, scratch.shadow_rays.packet
    count = 0
    for k in range(LANES):
        count += 1 if lanes[ln.THIN + k] > _ZERO else 0
    if count == 0:
        return
    for k in range(LANES):
        for axis in range(0, 3 * LANES, LANES):
            packet.real[ray.ORG_X + axis + k] = lanes[ln.P_X + axis + k]
            packet.real[ray.DIR_X + axis + k] = rays.real[ray.DIR_X + axis + k]
        packet.real[ray.TNEAR + k], packet.real[ray.TFAR + k] = _ZERO, _INFINITE
        packet.integer[ray.MASK + k] = PASS_PANES
        looks = (lanes[ln.THIN + k] > _ZERO) & (lanes[ln.COS_FRONT + k] > _ZERO) & (rays.alive[k] != 0)
        packet.alive[k] = -1 if looks else 0
    occluded16(packet.alive.ctypes.data, scene.address, packet.real.ctypes.data, scene.incoherent)
    for k in range(LANES):
        # Embree sets the end of a blocked ray to minus infinity.
        lanes[ln.OPEN + k] = _ONE if (packet.alive[k] != 0) & (packet.real[ray.TFAR + k] > _ZERO) else _ZERO


_HALF, _LEAST = np.float32(0.5), np.float32(1e-20)
_LEAST_COSINE, _SHARPNESS = np.float32(0.02), np.float32(0.5)
_STEEPEST, _LOWEST_ROUGHNESS = np.float32(1.2), np.float32(0.02)
_EXPONENT, _MANTISSA = np.float32(127.0), np.float32(1.0 / 8388608.0)


@inlined
def apply_texture(textures: Textures, row: int, trilinear: bool, packet: Packet, k: int, lanes: NDArray[np.float32]) -> None:
    """Change the base colour, roughnesses, metalness and shading normal of lane k as texture ``row`` says.

    NS is the interpolated normal of the mesh on the triangle's front; WIDTH is that of the ray cone, in metres.
    """
    at = tex.FACE_SIZE * np.int64(packet.integer[ray.PRIM_ID + k])
    faces, rows = textures.faces, textures.rows
    v, w = packet.real[ray.BARY_U + k], packet.real[ray.BARY_V + k]
    per_u, per_v, turn, lean = rows[row, tex.PER_U], rows[row, tex.PER_V], rows[row, tex.COS], rows[row, tex.SIN]
    # How many texels the ray cone covers, aslant, which tells the level of detail; then where the hit lies on the texture.
    texels = abs(per_u * per_v) * np.float32(1 << (textures.layout[row, tex.WIDTH_LOG] + textures.layout[row, tex.HEIGHT_LOG]))
    cosine = max(abs(lanes[ln.COS_FRONT + k]), _LEAST_COSINE)
    width = lanes[ln.WIDTH + k]
    seen = _SHARPNESS * width * width / cosine * texels * faces[at + tex.FACE_DENSITY]
    detail = _HALF * _log2(max(seen, _ONE))
    u = faces[at + tex.FACE_U] + v * faces[at + tex.FACE_AU] + w * faces[at + tex.FACE_BU]
    v = faces[at + tex.FACE_V] + v * faces[at + tex.FACE_AV] + w * faces[at + tex.FACE_BV]
    texture = evaluate_texture(
        textures,
        row,
        (turn * u + lean * v) * per_u,
        (turn * v - lean * u) * per_v,
        detail,
        (lanes[ln.BASE_R + k], lanes[ln.BASE_G + k], lanes[ln.BASE_B + k]),
        lanes[ln.ROUGHNESS + k],
        lanes[ln.METALLIC + k],
        trilinear,
    )
    # Slopes too fine to be seen make the surface rougher.
    lanes[ln.BASE_R + k], lanes[ln.BASE_G + k], lanes[ln.BASE_B + k] = texture.red, texture.green, texture.blue
    lanes[ln.METALLIC + k] = texture.metallic
    lanes[ln.ROUGHNESS + k] = _roughen(texture.roughness, texture.spread)
    if lanes[ln.COAT + k] > _ZERO:
        lanes[ln.COAT_ROUGHNESS + k] = _roughen(lanes[ln.COAT_ROUGHNESS + k], texture.spread)
    if rows[row, tex.SLOPE] == _ZERO or faces[at + tex.FACE_DENSITY] == _ZERO:
        return
    # Relief: the normal leans against the slopes, along the texture's axes on the triangle.
    tx, ty, tz = faces[at + tex.FACE_TX], faces[at + tex.FACE_TY], faces[at + tex.FACE_TZ]
    sx, sy, sz = faces[at + tex.FACE_SX], faces[at + tex.FACE_SY], faces[at + tex.FACE_SZ]
    slope_u = turn * texture.slope_u - lean * texture.slope_v
    slope_v = lean * texture.slope_u + turn * texture.slope_v
    slope_u, slope_v = min(max(slope_u, -_STEEPEST), _STEEPEST), min(max(slope_v, -_STEEPEST), _STEEPEST)
    hx, hy, hz = _unit(lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k])
    lanes[ln.NS_X + k] = hx - slope_u * tx - slope_v * sx
    lanes[ln.NS_Y + k] = hy - slope_u * ty - slope_v * sy
    lanes[ln.NS_Z + k] = hz - slope_u * tz - slope_v * sz


@kernel
def _roughen(roughness: np.float32, spread: np.float32) -> np.float32:
    """Return the roughness of a surface whose slopes vary: their variance adds to that of the microfacets.

    For Beckmann's distribution alpha^2 = 2 sigma^2.
    """
    alpha = max(roughness, _LOWEST_ROUGHNESS)
    alpha *= alpha
    return min(np.sqrt(np.sqrt(alpha * alpha + spread * spread)), _ONE)


@kernel
def _unit(x: np.float32, y: np.float32, z: np.float32) -> tuple[np.float32, np.float32, np.float32]:
    scale = _ONE / max(np.sqrt(x * x + y * y + z * z), _LEAST)
    return x * scale, y * scale, z * scale


@kernel
def _log2(x: np.float32) -> np.float32:
    """Return the binary logarithm of x >= 1 to 0.09: exact at powers of two, straight between; the same on every processor."""
    bits = np.float32(x).view(np.int32)
    logarithm: np.float32 = np.float32(bits) * _MANTISSA - _EXPONENT
    return logarithm

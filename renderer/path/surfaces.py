"""What the rays of a packet hit: position, normals, look and light sent back, one table look-up per lane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.albedo import STEPS, Albedos, glass_table, reflected_table
from renderer.bsdf.microfacet import fresnel_pane
from renderer.core.embree import (
    BARY_U,
    BARY_V,
    DIR_X,
    DIR_Y,
    DIR_Z,
    GEOM_ID,
    INVALID_ID,
    LANES,
    NG_X,
    NG_Y,
    NG_Z,
    ORG_X,
    ORG_Y,
    ORG_Z,
    PRIM_ID,
    TFAR,
    Packet,
)
from renderer.core.kernel import inlined, kernel
from renderer.core.lanes import (
    BASE_R,
    CHANCE,
    COAT,
    COAT_ROUGHNESS,
    COSINE,
    FROM_X,
    FROM_Y,
    FROM_Z,
    GLASS,
    GLOW_CHANCE,
    GLOW_R,
    IMPORTANCE,
    IOR,
    METALLIC,
    MORE,
    POINT_X,
    POINT_Y,
    POINT_Z,
    REFLECTS,
    ROUGHNESS,
    SHADE_X,
    SHADE_Y,
    SHADE_Z,
    SHEEN,
    SIDE_X,
    SIDE_Y,
    SIDE_Z,
    SPREAD,
    THIN,
    TRANSMISSION,
    WIDTH,
    lane_count,
)
from renderer.path.lights import Lights, importance, load_bounds
from renderer.path.outside import Rgb, hot_toward, sky_color
from renderer.path.records import (
    LOOK_BASE,
    LOOK_COAT,
    LOOK_COAT_ROUGHNESS,
    LOOK_EMISSION,
    LOOK_GLASS,
    LOOK_GLOW,
    LOOK_IOR,
    LOOK_METALLIC,
    LOOK_MORE,
    LOOK_PORTAL,
    LOOK_PROFILE,
    LOOK_ROUGHNESS,
    LOOK_SHEEN,
    LOOK_SIZE,
    LOOK_TRANSMISSION,
    Scratch,
    Surfaces,
)
from renderer.path.textured_hits import apply_texture
from renderer.scene.flat_scene import FlatScene, Sky
from renderer.scene.spot_lights import profile_toward
from renderer.textures.look_up import build_textures

_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-30)
_USABLE, _GRAZING = np.float32(1e-3), np.float32(1e-4)
_UNLIT = np.float32(0.03)
_LIFT_M, _LIFT_RATIO = np.float32(2e-5), np.float32(4e-6)


def build_surfaces(flat: FlatScene) -> Surfaces:
    """Resolve the materials of a scene's parts."""
    materials, parts = flat.materials, flat.parts
    row = parts.material
    clear = (materials.transmission[row] > 0.0) & ~parts.portal
    iors, glass = np.unique(materials.ior[row[clear]], return_inverse=True)
    look = np.zeros((len(row), LOOK_SIZE), np.float32)
    look[:, LOOK_BASE : LOOK_BASE + 3] = materials.base_color[row]
    look[:, LOOK_EMISSION : LOOK_EMISSION + 3] = parts.emission
    for column, table in (
        (LOOK_ROUGHNESS, materials.roughness),
        (LOOK_METALLIC, materials.metallic),
        (LOOK_TRANSMISSION, materials.transmission),
        (LOOK_IOR, materials.ior),
        (LOOK_COAT, materials.clearcoat),
        (LOOK_COAT_ROUGHNESS, materials.clearcoat_roughness),
        (LOOK_SHEEN, materials.sheen),
        (LOOK_GLOW, materials.glow_cd_m2),
    ):
        look[:, column] = table[row]
    look[:, LOOK_PORTAL] = parts.portal
    look[clear, LOOK_GLASS] = glass
    if len(flat.part_profile):
        look[:, LOOK_PROFILE] = flat.part_profile + 1
    textured = flat.part_texture if len(flat.part_texture) else np.full(len(row), -1, np.int32)
    if len(flat.absorbs):
        look[flat.absorbs, :LOOK_PROFILE] = 0.0
        look[flat.absorbs, LOOK_EMISSION : LOOK_EMISSION + 3] = parts.emission[flat.absorbs]
        look[flat.absorbs, LOOK_ROUGHNESS] = look[flat.absorbs, LOOK_IOR] = 1.0
        textured = np.where(flat.absorbs, -1, textured).astype(np.int32)
    lit = parts.portal | (parts.emission > 0.0).any(axis=1) | (look[:, LOOK_GLOW] > 0.0)
    look[:, LOOK_MORE] = lit | (textured >= 0)
    return Surfaces(
        flat.mesh.normals[flat.mesh.faces].reshape(-1),
        np.ascontiguousarray(flat.face_part),
        look.reshape(-1),
        Albedos(
            reflected_table(),
            np.stack([glass_table(float(ior)) for ior in iors]) if len(iors) else np.zeros((0, 2, STEPS, STEPS), np.float32),
        ),
        build_textures(
            textured,
            flat.textures,
            flat.mesh.vertices,
            flat.mesh.uvs,
            flat.mesh.faces,
        ),
        Sky(*(np.ascontiguousarray(item, np.float32) for item in flat.sky)),
        np.ascontiguousarray(flat.profiles, np.float32),
    )


@inlined
def lift_height(x: np.float32, y: np.float32, z: np.float32) -> np.float32:
    """Return how far to stay off a surface at a point, in metres: some ten roundings of its coordinates."""
    x, y, z = abs(x), abs(y), abs(z)
    most = x if x > y else y
    return _LIFT_M + _LIFT_RATIO * (most if most > z else z)


@inlined
def find_surfaces(surfaces: Surfaces, lights: Lights, primary: bool, widest: np.float32, scratch: Scratch) -> None:
    """Fill POINT to WIDTH for 16 traced rays, and make their directions unit; lanes without a surface neither reflect nor glow.

    Camera rays (``primary``) that leave the scene see the sky; others are dark, as light from outside enters by panes only.
    ``widest``: most that footprints grow per metre.
    """
    packet, lanes, parts = scratch.rays, scratch.lanes, scratch.parts
    real = packet.real
    _place_points(packet, lanes)
    _fetch_looks(packet, surfaces, _ONE if primary else _ZERO, widest, lanes, parts)
    for k in range(LANES):
        if lanes[MORE + k] == _ZERO:
            continue
        part = parts[k]
        if part < 0:
            x, y, z = real[DIR_X + k], real[DIR_Y + k], real[DIR_Z + k]
            r, g, b = sky_color(surfaces.sky, x, y, z)
            hot_r, hot_g, hot_b, _ = hot_toward(lights.outside, x, y, z)
            lanes[GLOW_R + k], lanes[GLOW_R + LANES + k], lanes[GLOW_R + 2 * LANES + k] = r + hot_r, g + hot_g, b + hot_b
            continue
        texture = surfaces.textures.part[part]
        if texture >= 0:
            apply_texture(surfaces.textures, texture, packet, k, lanes)
        _glow(surfaces.look[part * LOOK_SIZE + LOOK_GLOW], k, lanes)
        group = lights.face_group[packet.integer[PRIM_ID + k]]
        if group >= 0 and lanes[COSINE + k] > _ZERO:
            x, y, z = real[DIR_X + k], real[DIR_Y + k], real[DIR_Z + k]
            r, g, b = emitted_luminance(surfaces, part, x, y, z, lanes[COSINE + k])
            lanes[GLOW_R + k], lanes[GLOW_R + LANES + k], lanes[GLOW_R + 2 * LANES + k] = r, g, b
            if not primary:
                lanes[GLOW_CHANCE + k] = _light_chance(packet, lights, group, k, lanes)
            if len(lights.outside.part) > 0 and surfaces.look[part * LOOK_SIZE + LOOK_PORTAL] > _ZERO:
                _add_hot(surfaces, lights, part, k, x, y, z, lanes)
    _orient_shading(packet, lanes)


@inlined
def _fetch_looks(
    packet: Packet, surfaces: Surfaces, missed: np.float32, widest: np.float32, lanes: NDArray[np.float32], parts: NDArray[np.int32]
) -> None:
    """Write parts, REFLECTS, BASE_R to GLASS, WIDTH, SHADE as the mesh has it, and no glow; ``missed``: MORE of rays that hit nothing."""
    real, integer, look = packet.real, packet.integer, surfaces.look
    normals = surfaces.normals
    for k in range(lane_count(lanes)):
        hit = integer[GEOM_ID + k] != INVALID_ID
        parts[k] = surfaces.face_part[integer[PRIM_ID + k]] if hit else -1
        lanes[REFLECTS + k] = _ONE if hit else _ZERO
        lanes[MORE + k] = missed if packet.alive[k] != 0 else _ZERO
        growth = lanes[SPREAD + k] if lanes[SPREAD + k] < widest else widest
        lanes[WIDTH + k] += growth * real[TFAR + k]
        lanes[GLOW_R + k] = lanes[GLOW_R + LANES + k] = lanes[GLOW_R + 2 * LANES + k] = lanes[GLOW_CHANCE + k] = _ZERO
    for k in range(lane_count(lanes)):
        if parts[k] >= 0:
            row = parts[k] * LOOK_SIZE
            lanes[BASE_R + k] = look[row + LOOK_BASE]
            lanes[BASE_R + LANES + k] = look[row + LOOK_BASE + 1]
            lanes[BASE_R + 2 * LANES + k] = look[row + LOOK_BASE + 2]
            lanes[ROUGHNESS + k] = look[row + LOOK_ROUGHNESS]
            lanes[METALLIC + k] = look[row + LOOK_METALLIC]
            lanes[TRANSMISSION + k] = look[row + LOOK_TRANSMISSION]
            lanes[IOR + k] = look[row + LOOK_IOR]
            lanes[COAT + k] = look[row + LOOK_COAT]
            lanes[COAT_ROUGHNESS + k] = look[row + LOOK_COAT_ROUGHNESS]
            lanes[SHEEN + k] = look[row + LOOK_SHEEN]
            lanes[THIN + k] = look[row + LOOK_PORTAL]
            lanes[GLASS + k] = look[row + LOOK_GLASS]
            lanes[MORE + k] = look[row + LOOK_MORE]
    for k in range(lane_count(lanes)):
        if parts[k] >= 0:
            at = 9 * np.int64(integer[PRIM_ID + k])
            v, w = real[BARY_U + k], real[BARY_V + k]
            u = _ONE - v - w
            lanes[SHADE_X + k] = u * normals[at] + v * normals[at + 3] + w * normals[at + 6]
            lanes[SHADE_Y + k] = u * normals[at + 1] + v * normals[at + 4] + w * normals[at + 7]
            lanes[SHADE_Z + k] = u * normals[at + 2] + v * normals[at + 5] + w * normals[at + 8]


@inlined
def _glow(luminance: np.float32, k: int, lanes: NDArray[np.float32]) -> None:
    """Let the front of lane k send out its colour times a luminance, and leave a dark surface.

    Such light is found by rays that happen to hit it only, at full weight: lights are not drawn there (GLOW_CHANCE stays 0).
    """
    if luminance > _ZERO and lanes[COSINE + k] > _ZERO:
        for channel in range(0, 3 * LANES, LANES):
            lanes[GLOW_R + channel + k] = luminance * lanes[BASE_R + channel + k]
            lanes[BASE_R + channel + k] *= _UNLIT


@inlined
def _light_chance(packet: Packet, lights: Lights, group: int, k: int, lanes: NDArray[np.float32]) -> np.float32:
    """Return the probability per steradian that drawing lights at the ray's origin gives the point that the ray hit."""
    real, groups = packet.real, lights.groups
    x, y, z = real[ORG_X + k], real[ORG_Y + k], real[ORG_Z + k]
    value = importance(load_bounds(groups, group), x, y, z, lanes[FROM_X + k], lanes[FROM_Y + k], lanes[FROM_Z + k])
    chance: np.float32 = value / lanes[IMPORTANCE + k] * real[TFAR + k] * real[TFAR + k] / (groups.area[group] * lanes[COSINE + k])
    return chance


@inlined
def _add_hot(
    surfaces: Surfaces, lights: Lights, part: int, k: int, x: np.float32, y: np.float32, z: np.float32, lanes: NDArray[np.float32]
) -> None:
    """Add what is drawn by direction to the glow of a pane.

    Its light has a chance of its own against the ray's; the glow is scaled so that the weight that the pane's gets makes it right.
    """
    r, g, b, chance = hot_toward(lights.outside, x, y, z)
    if r + g + b > _ZERO:
        ray = lanes[CHANCE + k]
        scale = pane_through(surfaces, part, lanes[COSINE + k]) * (_ONE + lanes[GLOW_CHANCE + k] / ray) / (_ONE + chance / ray)
        lanes[GLOW_R + k] += scale * r
        lanes[GLOW_R + LANES + k] += scale * g
        lanes[GLOW_R + 2 * LANES + k] += scale * b


@inlined
def pane_through(surfaces: Surfaces, part: int, cosine: np.float32) -> np.float32:
    """Return the share of light that a pane lets through at this cosine: what it does not reflect, times its transmission."""
    look, row = surfaces.look, part * LOOK_SIZE
    through: np.float32 = look[row + LOOK_TRANSMISSION] * (_ONE - fresnel_pane(cosine, look[row + LOOK_IOR]))
    return through


@inlined
def emitted_luminance(surfaces: Surfaces, part: int, x: np.float32, y: np.float32, z: np.float32, cosine: np.float32) -> Rgb:
    """Return the smooth luminance (r, g, b) that the front of a part sends back to where a ray comes from, cd/m2.

    (x, y, z): the ray's unit direction in the world; ``cosine`` > 0 between the way back and the front.
    """
    look, row = surfaces.look, part * LOOK_SIZE
    if look[row + LOOK_PORTAL] > _ZERO:
        through = pane_through(surfaces, part, cosine)
        r, g, b = sky_color(surfaces.sky, x, y, z)
        return through * r, through * g, through * b
    share = _ONE
    if look[row + LOOK_PROFILE] > _ZERO:
        share = profile_toward(surfaces.profiles, int(look[row + LOOK_PROFILE]) - 1, -x, -y, -z)
    return share * look[row + LOOK_EMISSION], share * look[row + LOOK_EMISSION + 1], share * look[row + LOOK_EMISSION + 2]


@kernel
def _place_points(packet: Packet, lanes: NDArray[np.float32]) -> None:
    """Make directions unit, face the geometric normals to the viewer and lift the hit points off their surfaces."""
    real, integer = packet.real, packet.integer
    for k in range(LANES):
        dx, dy, dz = real[DIR_X + k], real[DIR_Y + k], real[DIR_Z + k]
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        dx, dy, dz = dx / length, dy / length, dz / length
        t = _ZERO if integer[GEOM_ID + k] == INVALID_ID else real[TFAR + k] * length
        nx, ny, nz = real[NG_X + k], real[NG_Y + k], real[NG_Z + k]
        scale = _ONE / max(np.sqrt(nx * nx + ny * ny + nz * nz), _TINY)
        cosine = -(nx * dx + ny * dy + nz * dz) * scale
        scale = -scale if cosine < _ZERO else scale
        nx, ny, nz = nx * scale, ny * scale, nz * scale
        x, y, z = real[ORG_X + k] + t * dx, real[ORG_Y + k] + t * dy, real[ORG_Z + k] + t * dz
        lift = lift_height(x, y, z)
        real[DIR_X + k], real[DIR_Y + k], real[DIR_Z + k], real[TFAR + k] = dx, dy, dz, t
        lanes[COSINE + k] = cosine
        lanes[SIDE_X + k], lanes[SIDE_Y + k], lanes[SIDE_Z + k] = nx, ny, nz
        lanes[SHADE_X + k], lanes[SHADE_Y + k], lanes[SHADE_Z + k] = nx, ny, nz
        lanes[POINT_X + k], lanes[POINT_Y + k], lanes[POINT_Z + k] = x + lift * nx, y + lift * ny, z + lift * nz


@kernel
def _orient_shading(packet: Packet, lanes: NDArray[np.float32]) -> None:
    """Make shading normals unit and turn them to the viewer; where they are unusable, take the geometric one.

    A normal that looks away from the viewer, as happens where smooth surfaces turn away, is bent until it just does not.
    """
    real = packet.real
    for k in range(LANES):
        x, y, z = lanes[SHADE_X + k], lanes[SHADE_Y + k], lanes[SHADE_Z + k]
        nx, ny, nz = lanes[SIDE_X + k], lanes[SIDE_Y + k], lanes[SIDE_Z + k]
        side = x * nx + y * ny + z * nz
        length = np.sqrt(x * x + y * y + z * z)
        scale = _ONE / max(length, _TINY)
        scale = -scale if side < _ZERO else scale
        usable = abs(side) > _USABLE * length
        x, y, z = x * scale if usable else nx, y * scale if usable else ny, z * scale if usable else nz
        dx, dy, dz = real[DIR_X + k], real[DIR_Y + k], real[DIR_Z + k]
        bend = _GRAZING + (x * dx + y * dy + z * dz)
        bend = bend if bend > _ZERO else _ZERO
        x, y, z = x - bend * dx, y - bend * dy, z - bend * dz
        scale = _ONE / max(np.sqrt(x * x + y * y + z * z), _TINY)
        lanes[SHADE_X + k], lanes[SHADE_Y + k], lanes[SHADE_Z + k] = x * scale, y * scale, z * scale

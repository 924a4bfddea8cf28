"""Scenes for the comparison with another renderer: small classics made here, and a bedroom that the grammar samples.

Triangles shade flat in all of them (normals are left out), as renderers treat bent normals differently.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from grammar import SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer import CameraConfig, FlatScene, Mesh, PartTable, Sky, tabulate_materials
from renderer.geometry.shapes import flat_quads, lathe, merged, moved, rotated
from renderer.scene.flat_scene import NO_SUN
from renderer.scene.flatten import flatten
from renderer.textures.apply import AppliedTexture
from renderer.textures.tile import ImageMaps, image_tile
from scene_description import CameraPose, Material
from scene_description.poses import look_at

DARK = Sky(*(np.zeros(3, np.float32) for _ in range(3)))
Point = tuple[float, float, float]


class View(NamedTuple):
    """A scene and who looks at it; ``ev100``: exposure of its picture."""

    flat: FlatScene
    pose: CameraPose
    horizontal_fov_rad: float
    ev100: float

    def camera(self, width: int, height: int) -> CameraConfig:
        """Return the camera at a size in pixels."""
        return CameraConfig(width=width, height=height, horizontal_fov_rad=self.horizontal_fov_rad)


class Thing(NamedTuple):
    """A part of a scene."""

    mesh: Mesh
    material: Material
    emission: Point = (0.0, 0.0, 0.0)
    portal: bool = False
    texture: AppliedTexture | None = None


def matt(r: float, g: float, b: float) -> Material:
    """Return a material after Lambert: an index of 1 leaves no gloss."""
    return Material(id="matt", family="matt", base_color=(r, g, b), ior=1.0)


def metal(r: float, g: float, b: float, roughness: float) -> Material:
    """Return a metal, by its reflectance at normal incidence."""
    return Material(id="metal", family="metal", base_color=(r, g, b), metallic=1.0, roughness=roughness, ior=1.0)


def clear(ior: float) -> Material:
    """Return smooth, clear glass, or the boundary to something denser, by the ratio of indices."""
    return Material(id="clear", family="clear", base_color=(1.0, 1.0, 1.0), transmission=1.0, roughness=0.0, ior=ior)


BLACK = matt(0.0, 0.0, 0.0)


def quad(corner: Point, along: Point, across: Point) -> Mesh:
    """Return a rectangle whose front looks along ``along`` x ``across``; texture coordinates run along its sides, in metres."""
    c, a, b = (np.array(item, np.float64) for item in (corner, along, across))
    u, v = float(np.linalg.norm(a)), float(np.linalg.norm(b))
    return flat_quads([[c, c + a, c + a + b, c + b]], [[(0.0, 0.0), (u, 0.0), (u, v), (0.0, v)]])


def box(low: Point, high: Point, inward: bool = False) -> dict[str, Mesh]:
    """Return the six sides of a box by name, looking out or in: -x, +x, -y, +y, -z, +z."""
    sides: dict[str, Mesh] = {}
    size = np.subtract(high, low)
    for axis in range(3):
        for side in (0, 1):
            corner, u, v = np.array(low, np.float64), np.zeros(3), np.zeros(3)
            corner[axis] += side * size[axis]
            u[(axis + 1) % 3], v[(axis + 2) % 3] = size[(axis + 1) % 3], size[(axis + 2) % 3]
            pair = (u, v) if (side == 1) != inward else (v, u)
            sides["-+"[side] + "xyz"[axis]] = quad(tuple(corner), tuple(pair[0]), tuple(pair[1]))
    return sides


def ball(center: Point, radius: float, segments: int = 32) -> Mesh:
    """Return a ball of facets."""
    angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, segments // 2 + 1)
    profile = [(max(radius * math.cos(a), 0.0), radius * math.sin(a)) for a in angle]
    profile[0], profile[-1] = (0.0, -radius), (0.0, radius)
    return moved(lathe(profile, segments), *center)


def assemble(things: Sequence[Thing], sky: Sky = DARK) -> FlatScene:
    """Return the flat scene of some things; what shines reflects nothing."""
    count = len(things)
    mesh = merged(*(thing.mesh if len(thing.mesh.uvs) else thing.mesh._replace(uvs=thing.mesh.vertices[:, :2].copy()) for thing in things))
    textures = tuple(thing.texture for thing in things if thing.texture is not None)
    numbers = iter(range(len(textures)))
    emission = np.array([thing.emission for thing in things], np.float32)
    return FlatScene(
        mesh=mesh._replace(normals=np.zeros_like(mesh.normals)),
        face_part=np.repeat(np.arange(count, dtype=np.int32), [len(thing.mesh.faces) for thing in things]),
        parts=PartTable(
            np.arange(count, dtype=np.uint16),
            np.ones(count, np.uint8),
            np.arange(count, dtype=np.int32),
            emission,
            np.array([thing.portal for thing in things]),
        ),
        part_names=tuple(f"{k}/{thing.material.family}" for k, thing in enumerate(things)),
        materials=tabulate_materials([thing.material for thing in things]),
        sky=sky,
        part_texture=np.array([-1 if thing.texture is None else next(numbers) for thing in things], np.int32),
        textures=textures,
        absorbs=emission.any(axis=1),
    )


def view(things: Sequence[Thing], eye: Point, target: Point, fov_deg: float, ev100: float, sky: Sky = DARK) -> View:
    """Return a view of some things from ``eye``, metres, towards ``target``."""
    pose = CameraPose(stamp_ns=0, position_m=eye, orientation=look_at(eye, target))
    return View(assemble(things, sky), pose, math.radians(fov_deg), ev100)


def cornell_box() -> View:
    """Two matt blocks in a matt box, one lamp (after the measured one of Cornell University, in round numbers)."""
    white, red, green = matt(0.73, 0.73, 0.72), matt(0.63, 0.06, 0.05), matt(0.14, 0.45, 0.09)
    sides = box((0, 0, 0), (2, 2, 2), inward=True)
    things = [Thing(sides[name], look) for name, look in {"+x": white, "-z": white, "+z": white, "-y": red, "+y": green}.items()]
    for low, high, turn in (((-0.3, -0.3, 0), (0.3, 0.3, 0.6), 0.29), ((-0.3, -0.3, 0), (0.3, 0.3, 1.2), -0.32)):
        block = rotated(merged(*box(low, high).values()), "z", turn)
        things.append(Thing(moved(block, 0.62, 0.7) if high[2] < 1 else moved(block, 1.3, 1.3), white))
    lamp = quad((0.75, 0.75, 1.995), (0, 0.5, 0), (0.5, 0, 0))
    things.append(Thing(lamp, BLACK, (1700.0, 1200.0, 500.0)))
    return view(things, (-2.6, 1.0, 1.0), (0.0, 1.0, 1.0), 42.0, 6.0)


def many_lights_on_gloss() -> View:
    """Plates of rising roughness reflect balls of light of four sizes and equal power (after Veach and Guibas 1995)."""
    things = [Thing(quad((-4, -5, -0.6), (12, 0, 0), (0, 10, 0)), matt(0.4, 0.4, 0.4))]
    things.append(Thing(quad((3.2, -5, -0.6), (0, 0, 6), (0, 10, 0)), matt(0.4, 0.4, 0.4)))
    eye, lights = np.array((-3.5, 0.0, 1.4)), np.array((1.6, 0.0, 1.9))
    for k, roughness in enumerate((0.08, 0.15, 0.24, 0.36)):
        middle = np.array((-0.9 + 0.72 * k, 0.0, 0.05 + 0.13 * k * k))
        half = sum((way - middle) / np.linalg.norm(way - middle) for way in (eye, lights))
        up = half / np.linalg.norm(half)
        along = np.cross((0.0, 1.0, 0.0), up)
        corner = middle - 1.6 * np.array((0.0, 1.0, 0.0)) - 0.3 * along
        plate = quad(tuple(corner), tuple(0.6 * along), (0.0, 3.2, 0.0))
        facing = (
            plate if float(np.cross(along, (0.0, 1.0, 0.0)) @ up) > 0 else plate._replace(faces=np.ascontiguousarray(plate.faces[:, ::-1]))
        )
        things.append(Thing(facing, metal(0.85, 0.85, 0.85, roughness)))
    for y, radius, color in (
        (1.5, 0.02, (1, 0.6, 0.4)),
        (0.55, 0.06, (1, 1, 0.5)),
        (-0.4, 0.18, (0.5, 1, 0.6)),
        (-1.5, 0.45, (0.5, 0.6, 1)),
    ):
        things.append(Thing(ball((1.6, y, 1.9), radius, 16), BLACK, tuple(300.0 / radius**2 * c for c in color)))
    return view(things, tuple(eye), (0.6, 0.0, 0.6), 50.0, 9.0)


def glass_of_water() -> View:
    """A tumbler of water on a table under a broad lamp, with a coloured wall behind it: nested refraction and caustics.

    It is a hundred times as large as a real one: Mitsuba lets rays go on about 0.1 mm off surfaces, which shows in glass of 4 mm.
    """
    outer, inner, level, base, height = 4.0, 3.6, 7.5, 0.8, 11.0
    glass = lathe([(0.0, 0.1), (outer, 0.1), (outer, height), (inner, height), (inner, level)], 96)
    wetted = lathe([(inner, level), (inner, base), (0.0, base)], 96)
    surface = lathe([(inner, level), (0.0, level)], 96)
    things = [
        Thing(glass, clear(1.5)),
        Thing(wetted, clear(1.5 / 1.33)),  # its normals look into the water
        Thing(surface, clear(1.33)),
        Thing(quad((-50, -50, 0), (100, 0, 0), (0, 100, 0)), matt(0.6, 0.5, 0.4)),
        Thing(quad((30, -50, 0), (0, 0, 60), (0, 50, 0)), matt(0.7, 0.2, 0.15)),
        Thing(quad((30, 0, 0), (0, 0, 60), (0, 50, 0)), matt(0.15, 0.3, 0.6)),
        Thing(quad((-20, -30, 60), (0, 60, 0), (50, 0, 0)), BLACK, (900.0, 850.0, 800.0)),
    ]
    return view(things, (-32, -5, 20), (0.0, 0.0, 5), 36.0, 8.0)


def mirror_room() -> View:
    """A room whose walls are mirrors but for one, with a matt block and two metal ones."""
    mirror = metal(0.9, 0.9, 0.9, 0.0)
    sides = box((0, 0, 0), (3, 4, 2.5), inward=True)
    looks = {"-x": mirror, "+x": mirror, "+y": mirror, "-y": matt(0.7, 0.4, 0.2), "-z": matt(0.5, 0.5, 0.5), "+z": matt(0.8, 0.8, 0.8)}
    things = [Thing(sides[name], look) for name, look in looks.items()]
    for at, size, look in (
        ((0.8, 1.2), 0.6, matt(0.2, 0.5, 0.3)),
        ((2.1, 2.4), 0.8, metal(0.9, 0.6, 0.35, 0.3)),
        ((1.0, 2.9), 0.5, metal(0.7, 0.7, 0.75, 0.55)),
    ):
        block = merged(*box((-size / 2, -size / 2, 0), (size / 2, size / 2, size)).values())
        things.append(Thing(moved(rotated(block, "z", 0.5 + size), *at), look))
    things.append(Thing(quad((1.0, 1.5, 2.49), (0, 1.0, 0), (1.0, 0, 0)), BLACK, (600.0, 570.0, 520.0)))
    return view(things, (0.5, 0.4, 1.5), (1.6, 2.4, 0.8), 75.0, 7.0)


def textured_room() -> View:
    """A matt room with pictures on walls and floor."""
    rng = np.random.default_rng(5)
    things = []
    for name, side in box((0, 0, 0), (4, 3, 2.5), inward=True).items():
        low = rng.uniform(0.1, 0.9, (8, 8, 3))
        image = np.kron(low, np.ones((4, 4, 1))) * rng.uniform(0.7, 1.0, (32, 32, 1))
        tile = image_tile(ImageMaps(color=(255 * image).astype(np.uint8)))
        things.append(Thing(side, matt(1, 1, 1), texture=AppliedTexture(tile, (2.0, 2.0), 0.4 if name == "-z" else 0.0)))
    block = merged(*box((-0.4, -0.4, 0), (0.4, 0.4, 0.8)).values())
    things.append(Thing(moved(rotated(block, "z", 0.4), 2.6, 1.5), matt(0.7, 0.7, 0.7)))
    things.append(Thing(quad((1.6, 1.1, 2.49), (0, 0.8, 0), (0.8, 0, 0)), BLACK, (900.0, 850.0, 750.0)))
    return view(things, (0.3, 0.4, 1.6), (2.8, 1.7, 0.7), 75.0, 6.5)


def lamp_with_shade() -> View:
    """A bulb in an open, light shade: all but what goes up and down comes by way of the shade."""
    sides = box((0, 0, 0), (3, 3, 2.4), inward=True)
    things = [Thing(mesh, matt(0.6, 0.55, 0.5)) for mesh in sides.values()]
    shade = lathe([(0.2, 1.2), (0.13, 1.5), (0.125, 1.5), (0.195, 1.2)], 48, closed=True)
    table = merged(*box((-0.35, -0.35, 0.6), (0.35, 0.35, 0.65)).values())
    post = lathe([(0.0, 0.65), (0.08, 0.65), (0.08, 0.67), (0.015, 0.68), (0.015, 1.3), (0.0, 1.3)], 24)
    things += [
        Thing(moved(shade, 2.0, 1.8), matt(0.85, 0.75, 0.6)),
        Thing(moved(post, 2.0, 1.8), metal(0.8, 0.6, 0.3, 0.3)),
        Thing(moved(table, 2.0, 1.8), matt(0.35, 0.2, 0.1)),
        Thing(ball((2.0, 1.8, 1.38), 0.06, 24), BLACK, (6000.0, 5000.0, 3400.0)),
    ]
    return view(things, (0.9, 0.7, 1.62), (2.0, 1.8, 1.12), 55.0, 6.5)


def sun_through_a_window() -> View:
    """The sun in a clear sky, through an opening, on the floor of a matt room."""
    sides = box((0, 0, 0), (4, 4, 2.5), inward=True)
    looks = {"-x": (0.6, 0.3, 0.2), "+x": (0.7, 0.7, 0.7), "-y": (0.7, 0.7, 0.7), "-z": (0.5, 0.4, 0.3), "+z": (0.8, 0.8, 0.8)}
    things = [Thing(sides[name], matt(*color)) for name, color in looks.items()]
    wall = matt(0.7, 0.7, 0.7)
    for x, z, width, height in ((0.0, 0.0, 4.0, 0.9), (0.0, 2.1, 4.0, 0.4), (0.0, 0.9, 1.2, 1.2), (2.8, 0.9, 1.2, 1.2)):
        things.append(Thing(quad((x, 4.0, z), (width, 0, 0), (0, 0, height)), wall))
    opening = Material(id="opening", family="opening", base_color=(1.0, 1.0, 1.0), transmission=1.0, ior=1.0)
    things.append(Thing(quad((1.2, 4.0, 0.9), (1.6, 0, 0), (0, 0, 1.2)), opening, portal=True))
    block = merged(*box((-0.3, -0.3, 0), (0.3, 0.3, 0.7)).values())
    things.append(Thing(moved(rotated(block, "z", 0.4), 1.6, 2.1), matt(0.2, 0.35, 0.6)))
    way = np.array((0.25, 0.8, 0.6)) / np.linalg.norm((0.25, 0.8, 0.6))
    radius, illuminance = math.radians(0.2665), np.array((62000.0, 58000.0, 50000.0))
    cap = 1.0 - math.cos(radius)
    sun = np.array([*way, cap, *illuminance / (2.0 * math.pi * cap)], np.float32)
    sky = Sky(*(np.array(color, np.float32) for color in ((2500, 3500, 6000), (5000, 5500, 6500), (1500, 1400, 1200))), sun=sun)
    return view(things, (3.6, 0.4, 1.6), (1.5, 2.6, 0.7), 72.0, 11.0, sky)


def sampled_bedroom() -> View:
    """A bedroom of the grammar by the light of the sky, its lamps off.

    It is without its textures, as they are filtered differently everywhere, and without its sun: through panes, Mitsuba finds that by
    luck only.
    """
    flat, pose = bedroom()
    parts = flat.parts._replace(emission=np.zeros_like(flat.parts.emission))
    plain = flat._replace(
        sky=flat.sky._replace(sun=NO_SUN),
        parts=parts,
        part_texture=np.full_like(flat.part_texture, -1),
        mesh=flat.mesh._replace(normals=np.zeros_like(flat.mesh.normals)),
    )
    return View(plain, pose, 1.2217304763960306, 8.0)


def bedroom() -> tuple[FlatScene, CameraPose]:
    """Return a bedroom of the grammar as it is, and the first pose of the path through it."""
    synthesizer = SceneSynthesizer.from_config()
    scene = synthesizer.synthesize(SceneRequest(room_type="bedroom"), 4, 0, CameraTimes(frames=4, start_ns=0, rate_hz=1.0))
    return flatten(scene, Path.cwd()), scene.camera_path[0]


SCENES: dict[str, Callable[[], View]] = {
    "Cornell box": cornell_box,
    "many lights on gloss": many_lights_on_gloss,
    "glass of water": glass_of_water,
    "mirror room": mirror_room,
    "textured room": textured_room,
    "lamp with shade": lamp_with_shade,
    "sun through a window": sun_through_a_window,
    "bedroom by daylight": sampled_bedroom,
}

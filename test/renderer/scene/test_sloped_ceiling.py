"""Rooms under a roof: their shells against the planes that bound them, seen by rays and by the renderer."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from box_room import Piece, pose, scene
from cached_rooms import CACHED, filled
from embreex_reference import reference_hits
from sample_scene import parts, sample_scene
from shell_rooms import L_SHAPE, RECTANGLE, area_vectors, opening, room_of

from renderer import GEOMETRIC_LAYERS, CameraConfig, RenderConfig, Renderer
from renderer.camera.cameras import unproject
from renderer.geometry.shapes import merged
from renderer.scene.flat_scene import FlatScene, Sky
from renderer.scene.flatten import flatten
from renderer.scene.room_shell import build_opening, build_shell, wall_frame
from renderer.scene.sloped_ceiling import wall_profile
from scene_description import Room, Slope
from scene_description.ceilings import ceiling_height_m, ceiling_planes
from scene_description.poses import rotation_from_quaternion

QUARTER = 0.25 * math.pi
HIP = ((0.0, 0.0), (5.0, 0.4), (5.4, 3.0), (0.3, 3.6))


def sloped(outline: tuple[tuple[float, float], ...], *slopes: tuple[int, float, float]) -> Room:
    planes = tuple(Slope(wall=wall, eaves_height_m=eaves, pitch_rad=pitch) for wall, eaves, pitch in slopes)
    return replace(room_of(outline), slopes=planes)


ROOMS = {
    "one side": sloped(RECTANGLE, (0, 1.0, QUARTER)),
    "two sides": sloped(RECTANGLE, (0, 1.2, QUARTER), (2, 1.0, 0.9)),
    "ridge": sloped(RECTANGLE, (0, 0.9, 0.7), (2, 1.4, 0.6)),
    "hip": sloped(HIP, (0, 0.9, 0.8), (1, 1.0, 0.9), (2, 0.8, 0.7), (3, 1.3, 1.1)),
    "l_shape": sloped(L_SHAPE, (0, 1.1, 0.7), (5, 0.8, 0.9)),
}


def exits(room: Room, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance and inward normal where rays from inside a convex room leave it."""
    polygon = np.array(room.polygon_m)
    frames = [wall_frame(polygon, index) for index in range(len(polygon))]
    planes = [(0.0, 0.0, -1.0, room.height_m), (0.0, 0.0, 1.0, 0.0), *((a, b, -1.0, c) for a, b, c in ceiling_planes(room))]
    planes += [(*inward, 0.0, -float(start @ inward)) for start, _, inward, _ in frames]
    rows = np.array(planes) / np.linalg.norm(np.array(planes)[:, :3], axis=1, keepdims=True)
    towards = directions @ rows[:, :3].T
    with np.errstate(divide="ignore"):
        steps = np.where(towards < 0.0, -(origins @ rows[:, :3].T + rows[:, 3]) / towards, np.inf)
    nearest = steps.argmin(axis=1)
    return steps.min(axis=1), rows[nearest, :3]


@pytest.mark.parametrize("name", ROOMS)
def test_parts_are_closed_and_the_ceiling_covers_the_floor_once(name: str) -> None:
    room = replace(ROOMS[name], openings=(opening(1, "window", 3, 1.1, 0.3, 0.8, 0.6),))
    shell = build_shell(room)
    for mesh in shell.values():
        vectors = area_vectors(mesh)
        assert np.linalg.norm(vectors.sum(axis=0)) < 1e-5 * np.linalg.norm(vectors, axis=1).sum()
    floor, ceiling = area_vectors(shell["floor"]), area_vectors(shell["ceiling"])
    assert -ceiling[ceiling[:, 2] < 0.0, 2].sum() == pytest.approx(floor[floor[:, 2] > 0.0, 2].sum(), rel=1e-6)
    below = shell["ceiling"].vertices[shell["ceiling"].faces[ceiling[:, 2] < -1e-9]].reshape(-1, 3)
    assert [ceiling_height_m(room, x, y) for x, y, _ in below.tolist()] == pytest.approx(below[:, 2].tolist(), abs=1e-5)


@pytest.mark.parametrize("name", ["one side", "two sides", "ridge", "hip"])
def test_rays_end_at_the_planes_of_the_room_and_nowhere_else(name: str) -> None:
    """Distance and normal of every ray; one through a crack would go further, or meet the back of something."""
    room, rng, count = ROOMS[name], np.random.default_rng(4), 40000
    mesh = merged(*(part for key, part in build_shell(room).items() if key != "skirting"))
    mix = 0.96 * rng.dirichlet(np.ones(4), count) + 0.01
    ground = mix @ np.array(room.polygon_m)
    tall = np.array([ceiling_height_m(room, x, y) for x, y in ground.tolist()])
    origins = np.column_stack([ground, tall * rng.uniform(0.02, 0.98, count)])
    directions = rng.normal(size=(count, 3))
    hits = reference_hits(mesh.vertices[mesh.faces], origins, directions, robust=True)["primID"]
    assert (hits >= 0).all()
    normals = area_vectors(mesh)[hits]
    assert (np.einsum("ij,ij->i", normals, directions) < 0.0).all()
    first = mesh.vertices[mesh.faces[hits, 0]].astype(np.float64)
    reach = np.einsum("ij,ij->i", first - origins, normals) / np.einsum("ij,ij->i", directions, normals)
    distance, expected = exits(room, origins, directions)
    np.testing.assert_allclose(reach, distance, rtol=1e-4, atol=1e-5)
    cosine = np.einsum("ij,ij->i", normals, expected) / np.linalg.norm(normals, axis=1)
    assert np.count_nonzero(cosine < 1.0 - 1e-6) < 20, "only rays into an edge may take its other side"


def test_no_ray_leaves_a_sloped_l_shape_with_openings() -> None:
    holes = (opening(1, "door", 1, 0.8, 0.0, 0.85, 1.7), opening(2, "window", 2, 0.3, 0.9, 0.8, 0.9))
    room, rng = replace(ROOMS["l_shape"], openings=holes), np.random.default_rng(5)
    pieces = [mesh for part, mesh in build_shell(room).items() if part != "skirting"]
    for item in holes:
        pieces += build_opening(room, item, item.category, "default", 7).values()
    mesh = merged(*pieces)
    origins = np.tile((1.4, 1.4, 1.2), (60000, 1)) + rng.uniform(-0.9, 0.9, (60000, 3)) * (1.0, 1.0, 0.2)
    directions = rng.normal(size=origins.shape)
    hits = reference_hits(mesh.vertices[mesh.faces], origins, directions, robust=True)["primID"]
    assert (hits >= 0).all()
    assert (np.einsum("ij,ij->i", area_vectors(mesh)[hits], directions) < 0.0).all()


def test_a_gable_wall_is_a_trapezoid_and_a_knee_wall_low() -> None:
    room = ROOMS["two sides"]
    polygon, walls = np.array(room.polygon_m), build_shell(room)["wall"]
    assert wall_profile(room, polygon, 0) == [(0.0, 1.2), (4.0, 1.2)]
    gable = wall_profile(room, polygon, 1)
    assert [place for place, _ in gable] == pytest.approx([0.0, 1.4, 3.0 - 1.6 / math.tan(0.9), 3.0])
    assert [high for _, high in gable] == pytest.approx([1.2, 2.6, 2.6, 1.0])
    for wall, profile in ((0, [(0.0, 1.2), (4.0, 1.2)]), (1, gable)):
        start, _, inward, _ = wall_frame(polygon, wall)
        corners = walls.vertices[walls.faces]
        on_face = (np.abs((corners[..., :2] - start) @ inward) < 1e-6).all(axis=1)
        expected = sum((b - a) * (0.5 * (low + high) + 0.15) for (a, low), (b, high) in itertools.pairwise(profile))
        assert (area_vectors(walls)[on_face, :2] @ inward).sum() == pytest.approx(expected, rel=1e-5)


def test_ground_truth_of_a_slope_is_exact() -> None:
    """Depth and normals of an empty sloped room at every pixel; what is seen of the slope is ceiling."""
    base = sample_scene()
    surfaces = parts(floor="oak", wall="paint", ceiling="paint", skirting="paint")
    room = replace(ROOMS["two sides"], surfaces=surfaces)
    camera, view = CameraConfig(width=161, height=121, horizontal_fov_rad=1.4), pose((2.0, 2.2, 1.4), (1.2, 0.3, 1.7))
    flat = flatten(replace(base, room=room, objects=(), lights=(), luminaires=()))
    with Renderer(flat, camera, RenderConfig(threads=2), 0) as renderer:
        layers = renderer.render(view, 0, GEOMETRIC_LAYERS).layers
    v, u = np.mgrid[: camera.height, : camera.width] + 0.5
    rays = unproject(camera, view, np.column_stack([u.ravel(), v.ravel(), np.ones(u.size)])) - np.array(view.position_m)
    distance, normal = exits(room, np.broadcast_to(view.position_m, rays.shape), rays)
    skirting = (np.array(view.position_m) + rays * distance[:, None])[:, 2] < 0.08
    slope = (normal[:, 2] < -0.1) & (normal[:, 2] > -0.9)
    assert slope.mean() > 0.2
    error = np.abs(layers["depth"].ravel() - distance)[~skirting]
    assert np.count_nonzero(error > 1e-4) == 0
    seen = layers["normals"].reshape(-1, 3) @ rotation_from_quaternion(view.orientation).T
    assert np.quantile((seen[slope] * normal[slope]).sum(axis=1), 0.01) > 1.0 - 1e-6
    assert (layers["semantic"].ravel()[slope] == 22).mean() > 0.995


def shining(room: Room) -> FlatScene:
    """A bare shell that sends 0.5 and reflects 0.5 everywhere, below a sky of luminance 100."""
    look = {"color": (0.5,) * 3, "emission": (0.5,) * 3, "roughness": 1.0, "object_id": 0}
    shell = {name: mesh for name, mesh in build_shell(room).items() if name != "skirting"}
    pieces = [Piece(mesh.vertices.astype(float), mesh.faces.astype(np.int64), f"0/{name}", **look) for name, mesh in shell.items()]
    return scene(*pieces, sky=Sky(*(np.full(3, 100.0, np.float32) for _ in range(3))))


@pytest.mark.parametrize(("integrator", "noise"), [("path", 0.15), ("cached", 0.25)])
def test_a_closed_room_below_slopes_is_a_furnace(integrator: str, noise: float) -> None:
    """0.5 + 0.25 + 0.125 ... is 1 in every direction, along creases too; of the sky nothing is seen."""
    traced = RenderConfig(samples_per_pixel=64, threads=1, max_depth=12, denoise="none")
    config = traced if integrator == "path" else replace(CACHED, cache_spacing_m=0.05)
    with Renderer(shining(ROOMS["two sides"]), CameraConfig(width=48, height=36, horizontal_fov_rad=1.6), config, 3) as renderer:
        image = renderer.render(pose((2.0, 2.2, 1.2), (3.9, 0.3, 1.7)), 0, ("radiance",)).radiance
    assert image.mean(dtype=np.float64) == pytest.approx(1.0, abs=0.015)
    assert np.abs(image - 1.0).max() < noise


@pytest.mark.parametrize("name", ["two sides", "hip"])
def test_no_node_of_a_wall_above_its_ceiling_lends_light(name: str) -> None:
    """Nodes on the inner face of a wall lie in the room, or within the ceiling, where they see insides only and count for nothing."""
    room, flat = ROOMS[name], shining(ROOMS[name])
    cache, counts = filled(flat), []
    place, normal = cache.atlas.position.astype(float), cache.atlas.normal
    over = place[:, 2] - [ceiling_height_m(room, x, y) for x, y, _ in place.tolist()]
    for index in range(len(room.polygon_m)):
        start, _, inward, _ = wall_frame(np.array(room.polygon_m), index)
        on_face = (
            (np.abs((place[:, :2] - start) @ inward) < 1e-5) & (normal[:, :2] @ inward > 0.99) & (flat.face_part[cache.atlas.face] == 1)
        )
        assert not cache.light.valid[on_face & (over > 2e-3)].any()
        counts.append((np.count_nonzero(on_face & (over > 2e-3)), np.count_nonzero(cache.light.valid[on_face & (over < -0.05)])))
    assert np.array(counts).all(axis=1).any() and (np.array(counts)[:, 1] > 0).all()

"""A room as a model of MuJoCo: walls and what hangs fixed, all that stands or lies free, each part's pieces convex."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np

from benchmarks.physics.convex_pieces import Piece, convex_pieces
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, NORMAL_X, NORMAL_Y, START_X, START_Y, WALL_YAW, wall_rows
from grammar.spec.categories import Categories
from renderer.scene.flatten import flatten
from scene_description import SceneDescription

SECONDS, STEP_S = 2.0, 0.002
MOVED_M, TURNED_RAD = 0.01, np.radians(5.0)
DENSITY_KG_M3, FRICTION, WALL_M = 400.0, (0.8, 0.005, 0.0001), 0.1
HUNG = "hung"
"""The style of what stands before a wall and is screwed to it."""


class Moved(NamedTuple):
    """A free object after the time: how far its origin is from where it was, and by how much it has turned."""

    category: str
    object_id: int
    support: str
    moved_m: float
    turned_rad: float

    @property
    def stays(self) -> bool:
        """Whether it counts as at rest."""
        return self.moved_m < MOVED_M and self.turned_rad < TURNED_RAD


def room_model(scene: SceneDescription, categories: Categories) -> tuple[Any, list[int]]:
    """Return the compiled model of a room and the ids of its free objects, one body each, named by the id."""
    spec = mujoco.MjSpec()
    spec.option.timestep = STEP_S
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[20.0, 20.0, 0.1], friction=FRICTION)
    for wall in wall_rows(scene.room.polygon_m):
        along, half = 0.5 * wall[LENGTH], 0.5 * WALL_M
        x = wall[START_X] + along * wall[ALONG_X] - half * wall[NORMAL_X]
        y = wall[START_Y] + along * wall[ALONG_Y] - half * wall[NORMAL_Y]
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, size=[half, along, 0.5 * scene.room.height_m], pos=[x, y, 0.5 * scene.room.height_m],
            quat=_turn(float(wall[WALL_YAW])), friction=FRICTION,
        )  # fmt: skip
    flat, free = flatten(scene, Path.cwd()), []
    owner = flat.parts.object_id[flat.face_part]
    for item in scene.objects:
        if categories[item.category].underlay:
            continue
        turn = np.array([[np.cos(item.yaw_rad), -np.sin(item.yaw_rad), 0], [np.sin(item.yaw_rad), np.cos(item.yaw_rad), 0], [0, 0, 1]])
        pieces: list[Piece] = []
        for part in np.unique(flat.face_part[owner == item.id]):
            faces = flat.mesh.faces[flat.face_part == part]
            used, faces = np.unique(faces, return_inverse=True)
            pieces += convex_pieces((flat.mesh.vertices[used] - np.array(item.position_m)) @ turn, faces.reshape(-1, 3))
        body = spec.worldbody.add_body(name=str(item.id), pos=item.position_m, quat=_turn(item.yaw_rad))
        if item.support.kind in ("floor", "object") and item.model.style != HUNG and pieces:
            body.add_freejoint()
            free.append(item.id)
        for number, piece in enumerate(pieces):
            _add_piece(spec, body, f"{item.id}_{number}", piece)
    return spec.compile(), free


def _turn(yaw_rad: float) -> list[float]:
    return [float(np.cos(0.5 * yaw_rad)), 0.0, 0.0, float(np.sin(0.5 * yaw_rad))]


def _add_piece(spec: Any, body: Any, name: str, piece: Piece) -> None:
    if piece.is_box:
        low, high = piece.corners
        size, middle = 0.5 * (high - low), 0.5 * (low + high)
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=size, pos=middle, density=DENSITY_KG_M3, friction=FRICTION)
        return
    spec.add_mesh(name=name, uservert=piece.corners.ravel(), inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, density=DENSITY_KG_M3, friction=FRICTION)


def simulate(scene: SceneDescription, categories: Categories) -> Iterator[Moved]:
    """Yield what became of each free object of a room."""
    model, free = room_model(scene, categories)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    bodies = [model.body(str(key)).id for key in free]
    places, turns = data.xpos[bodies].copy(), data.xquat[bodies].copy()
    for _ in range(round(SECONDS / STEP_S)):
        mujoco.mj_step(model, data)
    moved = np.linalg.norm(data.xpos[bodies] - places, axis=1)
    turned = 2.0 * np.arccos(np.clip(np.abs((data.xquat[bodies] * turns).sum(1)), 0.0, 1.0))
    by_id = {item.id: item for item in scene.objects}
    for key, far, angle in zip(free, moved, turned, strict=True):
        below = by_id[key].support
        support = by_id[below.id].category if below.id in by_id else below.kind
        yield Moved(by_id[key].category, key, support, float(far), float(angle))


def deepest_contacts(scene: SceneDescription, categories: Categories, least_m: float = 0.0015) -> dict[tuple[str, str], float]:
    """Return pairs of things (category and id) that are deeper in each other than ``least_m`` before anything moves, metres."""
    model, _ = room_model(scene, categories)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    names = {str(item.id): f"{item.category} {item.id}" for item in scene.objects}
    found: dict[tuple[str, str], float] = {}
    for contact in data.contact[: data.ncon]:
        pair = sorted(names.get(model.body(model.geom_bodyid[geom]).name, "shell") for geom in contact.geom)
        if -contact.dist > least_m:
            found[pair[0], pair[1]] = max(found.get((pair[0], pair[1]), 0.0), -float(contact.dist))
    return found

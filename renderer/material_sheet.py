"""A small stage for looking at materials: a ball and a tilted board of each, under a broad lamp on a grey floor."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from renderer.camera.config import CameraConfig
from renderer.film.tone import Exposure, to_display
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, lathe, merged, moved, rotated
from renderer.path.config import RenderConfig
from renderer.renderer import Renderer
from renderer.scene.flat_scene import FlatScene, PartTable, Sky, tabulate_materials
from renderer.textures.apply import AppliedTexture, applied_texture
from scene_description import Material
from scene_description.poses import look_at
from scene_description.types import CameraPose

BALL_M = 0.30
_STAGE = (
    Material(id="stage", family="stage", base_color=(0.32, 0.32, 0.33), roughness=0.9),
    Material(id="lamp", family="lamp", base_color=(0.0, 0.0, 0.0)),
)
_EYE, _TARGET = (1.55, 0.0, 0.95), (0.0, 0.02, 0.24)
_LAMP_CD_M2, _AROUND_CD_M2 = 2500.0, 120.0


def render_material(material: Material, edge_px: int = 128, samples: int = 32, threads: int = 0) -> NDArray[np.uint8]:
    """Return a picture (edge_px, edge_px, 3) uint8 of one material on a ball and on a board.

    Raises:
        KeyError: the material's texture has an unknown generator.
        RenderError: Embree is missing.
    """
    camera = CameraConfig(width=edge_px, height=edge_px, horizontal_fov_rad=0.70)
    config = RenderConfig(samples_per_pixel=samples, threads=threads, denoise="auto")
    pose = CameraPose(stamp_ns=0, position_m=_EYE, orientation=look_at(_EYE, _TARGET))
    with Renderer(stage(material), camera, config, 0) as renderer:
        radiance = renderer.render(pose, 0, ("color",)).radiance
    if radiance is None:
        raise RuntimeError("render of the layer 'color' gave no radiance")
    return to_display(radiance, Exposure(9.0))


def stage(material: Material) -> FlatScene:
    """Return the stage with a ball and a board of a material."""
    angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 25)
    ball = lathe([(max(BALL_M * math.cos(a), 0.0), BALL_M * (1.0 + math.sin(a))) for a in angle], 48)
    board = rotated(block((-0.01, -0.29, 0.0), (0.01, 0.29, 0.5), 0.004), "y", -0.35)
    dressed: list[tuple[Mesh, AppliedTexture | None]] = []
    for mesh in (moved(ball, y=-0.30), moved(board, x=-0.1, y=0.38)):
        dressed.append((mesh, None) if material.texture is None else applied_texture(material, material.texture, mesh))
    floor = block((-3.0, -3.0, -0.1), (3.0, 3.0, 0.0))
    lamp = merged(block((-0.2, -1.6, 2.2), (1.8, 0.2, 2.25)))
    meshes = [*(mesh for mesh, _ in dressed), floor, lamp]
    textures = tuple(texture for _, texture in dressed if texture is not None)
    emission = np.zeros((4, 3), np.float32)
    emission[3] = _LAMP_CD_M2
    around = np.full(3, _AROUND_CD_M2, np.float32)
    return FlatScene(
        mesh=merged(*meshes),
        face_part=np.repeat(np.arange(4, dtype=np.int32), [len(mesh.faces) for mesh in meshes]),
        parts=PartTable(
            object_id=np.arange(4, dtype=np.uint16),
            label=np.zeros(4, np.uint8),
            material=np.array([0, 0, 1, 2], np.int32),
            emission=emission,
            portal=np.zeros(4, np.bool_),
        ),
        part_names=("1/ball", "2/board", "3/floor", "4/lamp"),
        materials=tabulate_materials([material, *_STAGE]),
        sky=Sky(around, around, around),
        part_texture=np.array([0, 1, -1, -1] if textures else [-1] * 4, np.int32),
        textures=textures,
    )


def material_sheet(materials: Sequence[Material], columns: int = 12, edge_px: int = 128, samples: int = 32) -> NDArray[np.uint8]:
    """Return the pictures of all materials side by side, row by row, (rows * edge_px, columns * edge_px, 3) uint8; the rest is black."""
    rows = -(-len(materials) // columns)
    sheet = np.zeros((rows * edge_px, columns * edge_px, 3), np.uint8)
    for k, material in enumerate(materials):
        y, x = divmod(k, columns)
        sheet[y * edge_px : (y + 1) * edge_px, x * edge_px : (x + 1) * edge_px] = render_material(material, edge_px, samples)
    return sheet

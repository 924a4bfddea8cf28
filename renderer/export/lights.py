"""Every light of a scene as a table for JSON: lamps, lights that no object holds, glowing surfaces, windows, sun and sky.

Photometric units: flux in lumen, luminance in cd/m2 as linear RGB, illuminance in lux as linear RGB; places in the world, metres.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.export.scene_glb import split_parts
from renderer.geometry.mesh import Mesh, surface_area
from renderer.scene.flat_scene import FlatScene, Sky
from renderer.scene.sky import sky_of
from scene_description import SceneDescription
from scene_description.labels import part_ids
from scene_description.products import matmul
from scene_description.strict import to_mapping

SCHEMA = "scene_synth/lights/1"


def lights_table(scene: SceneDescription, flat: FlatScene) -> dict[str, Any]:
    """Return the lights of a scene and of the same one flattened; ``docs/truth.md`` tells what each field is."""
    meshes, numbers = split_parts(flat), part_ids(scene)
    rows = {name: row for row, name in enumerate(flat.part_names)}
    categories = {thing.id: thing.category for thing in scene.objects}
    lamps = []
    for light in scene.lights:
        name = f"{light.object}/{light.part}"
        told = {key: value for key, value in to_mapping(light).items() if key not in ("object", "part")}
        place = _surface(meshes[rows[name]]) | {"luminance_cd_m2": flat.parts.emission[rows[name]].tolist()}
        lamps.append({**_who(name, numbers), "category": categories.get(light.object, ""), **told, **place})
    luminaires = [to_mapping(item) | {"index": i, "object": 0} for i, item in enumerate(scene.luminaires)]
    lit = {f"{light.object}/{light.part}" for light in scene.lights}
    glowing, windows = [], []
    for row, name in enumerate(flat.part_names):
        material = scene.materials[int(flat.parts.material[row])]
        if material.glow_cd_m2 > 0.0 and name not in lit and not flat.parts.emission[row].any():
            glowing.append({**_who(name, numbers), "material": material.id, "glow_cd_m2": material.glow_cd_m2, **_surface(meshes[row])})
        if flat.parts.portal[row]:
            windows.append({**_who(name, numbers), "transmission": material.transmission, **_surface(meshes[row])})
    environment = {"description": to_mapping(scene.environment), "sun": _sun(flat.sky), "sky": _sky(scene, sky_of(flat))}
    head = {"schema": SCHEMA, "scene": scene.id}
    return {**head, "lamps": lamps, "luminaires": luminaires, "glowing": glowing, "windows": windows, "environment": environment}


def _who(name: str, numbers: dict[str, int]) -> dict[str, Any]:
    owner, _, part = name.partition("/")
    return {"object": int(owner), "part": part, "part_id": numbers.get(name, 0)}


def _surface(mesh: Mesh) -> dict[str, Any]:
    """Return area, centre (the mean over the area) and bounds of a part in the world."""
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    centre = (corners.mean(axis=1) * area[:, None]).sum(axis=0) / area.sum()
    bounds = [mesh.vertices.min(axis=0).tolist(), mesh.vertices.max(axis=0).tolist()]
    return {"position_m": centre.tolist(), "area_m2": surface_area(mesh), "bounds_m": bounds}


def _sun(sky: Sky) -> dict[str, Any] | None:
    """Return direction, size and light of the sun, None where there is none."""
    if not len(sky.sun):
        return None
    versine, luminance = float(sky.sun[3]), sky.sun[4:].astype(np.float64)
    return {
        "direction": sky.sun[:3].tolist(),
        "angular_radius_rad": 2.0 * math.asin(math.sqrt(0.5 * versine)),
        "luminance_cd_m2": luminance.tolist(),
        "illuminance_lx": (luminance * 2.0 * math.pi * versine).tolist(),
    }


def _sky(scene: SceneDescription, sky: Sky) -> dict[str, Any]:
    """Return what kind of sky there is, with its light; ``illuminance_lx`` is that of a level plane in the open, without the sun."""
    if not sky.table.size:
        ends = {f"{name}_cd_m2": getattr(sky, name).tolist() for name in ("zenith", "horizon", "ground")}
        return {"kind": "gradient", **ends}
    kind = "daylight" if scene.environment.map is None else "map"
    lux = sum((_level_illuminance(image) for image in (sky.table, sky.bright) if image.size), np.zeros(3))
    return {"kind": kind, "zenith_cd_m2": sky.table[0].mean(axis=0, dtype=np.float64).tolist(), "illuminance_lx": lux.tolist()}


def _level_illuminance(image: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return the illuminance (3,) that the upper half of an equirectangular map (h, w, 3) gives a level plane: the sum of L cos t dw."""
    height = len(image)
    edges = np.linspace(0.0, math.pi, height + 1)[: height // 2 + 1]
    weight = math.pi * np.diff(el.sin(edges) ** 2)  # 2 pi times the integral of cos t sin t over a row
    return np.asarray(matmul(weight, image[: height // 2].mean(axis=1, dtype=np.float64)))

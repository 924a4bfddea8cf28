"""Scene description -> flat scene: build all models, move them into the world, and write the look-up tables.

Order is fixed: the room's surfaces, the openings, then the objects, each in the order of the description, so that equal scenes give equal
bytes.
"""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.color import LUMINANCE
from renderer.core.errors import FlattenError, MeshFileError
from renderer.files.file_textures import file_texture
from renderer.files.mesh_files import find_mesh_file, load_mesh_file
from renderer.geometry.coordinates import box_mapped
from renderer.geometry.mesh import UNMAPPED, Mesh, surface_area
from renderer.geometry.shapes import merged
from renderer.models import MODELS, build_model
from renderer.models.model import Parts
from renderer.models.openings import OPENING_MODELS
from renderer.scene.flat_scene import NO_PROFILE, NO_PROFILES, FlatScene, PartTable, tabulate_materials
from renderer.scene.moved_parts import moved_model
from renderer.scene.object_boxes import object_box, opening_box, room_box
from renderer.scene.room_shell import build_opening, build_shell
from renderer.scene.sky import build_sky
from renderer.scene.spot_lights import intensity_profile, luminaire_emission, luminaire_mesh, profile_row
from renderer.textures.apply import AppliedTexture, applied_texture
from renderer.textures.generators import GENERATORS
from renderer.textures.wear import tabulate_wear
from scene_description import Environment, Light, Luminaire, Material, ModelReference, Opening, Part, SceneDescription, SceneObject
from scene_description.labels import LABEL_ID, part_ids
from scene_description.light_labels import light_ids
from scene_description.products import matmul
from scene_description.scene_json import SURFACES

SURFACE_LABELS = {"floor": 2, "wall": 1, "ceiling": 22, "skirting": 1}
MAX_SCENE_FACES = 20_000_000
"""Most triangles of a scene."""


class _Materials(NamedTuple):
    """The scene's materials: row of the table by id, and the rows."""

    rows: dict[str, int]
    table: tuple[Material, ...]


class _Row(NamedTuple):
    """One part in the world, with what the tables say of it."""

    name: str
    mesh: Mesh
    object_id: int
    label: int
    material: int
    emission: NDArray[np.float64]
    portal: bool
    texture: AppliedTexture | None = None


def flatten(scene: SceneDescription, catalog_dir: Path | None = None) -> FlatScene:
    """Return the world-space mesh and tables of a scene.

    ``catalog_dir``: folder of the user's meshes; model files are looked up below it only.

    Raises:
        FlattenError: unknown generator or style, a part without material, a model file that cannot be used.
    """
    materials = _Materials({material.id: row for row, material in enumerate(scene.materials)}, scene.materials)
    lights = {(light.object, light.part): light for light in scene.lights}
    rows = _shell_rows(scene, materials)
    for opening in scene.room.openings:
        rows += _opening_rows(scene, opening, materials)
    total = 0
    for thing in scene.objects:
        added = _object_rows(thing, lights, materials, catalog_dir)
        total += sum(len(row.mesh.faces) for row in added)
        if total > MAX_SCENE_FACES:
            raise FlattenError(f"object {thing.id} ({thing.category}): expected at most {MAX_SCENE_FACES} triangles in a scene, got more")
        rows += added
    rows += [_luminaire_row(i, luminaire, rows[0].material) for i, luminaire in enumerate(scene.luminaires)]
    profiles = [intensity_profile(luminaire) for luminaire in scene.luminaires]
    textures = [row.texture for row in rows if row.texture is not None]
    numbers, ids = iter(range(len(textures))), part_ids(scene)
    shining = light_ids(scene)
    return FlatScene(
        mesh=merged(*(row.mesh for row in rows)),
        face_part=np.repeat(np.arange(len(rows), dtype=np.int32), [len(row.mesh.faces) for row in rows]),
        parts=PartTable(
            object_id=np.array([row.object_id for row in rows], np.uint16),
            label=np.array([row.label for row in rows], np.uint8),
            material=np.array([row.material for row in rows], np.int32),
            emission=np.array([row.emission for row in rows], np.float32),
            portal=np.array([row.portal for row in rows], np.bool_),
        ),
        part_names=tuple(row.name for row in rows),
        materials=tabulate_materials(scene.materials),
        sky=build_sky(scene.environment, catalog_dir),
        part_texture=np.array([-1 if row.texture is None else next(numbers) for row in rows], np.int32),
        textures=tuple(textures),
        # The flux of a lamp is what leaves it: what shines does not reflect its own light a second time.
        absorbs=np.array([row.emission.any() for row in rows], np.bool_),
        part_profile=_profile_rows(len(rows), len(profiles)),
        profiles=np.array([profile_row(*pair) for pair in zip(scene.luminaires, profiles, strict=True)], np.float32)
        if profiles
        else NO_PROFILES,
        part_box=_boxes(scene, rows),
        part_id=np.array([ids.get(row.name, 0) for row in rows], np.uint16),
        light_id=np.array([shining.get(row.name, 0) for row in rows], np.uint16),
        steady=scene.counterfactuals is not None,
        wear=tabulate_wear(scene.wear),
        outside=_outside(scene, rows),
    )


def _outside(scene: SceneDescription, rows: Sequence[_Row]) -> Environment | None:
    """Return ``outside``."""
    environment = scene.environment
    stands_there = environment.surroundings is not None and environment.map is None
    return environment if stands_there and any(row.portal for row in rows) else None


def _boxes(scene: SceneDescription, rows: Sequence[_Row]) -> NDArray[np.float32]:
    """Return ``part_box``."""
    boxes = {0: room_box(scene.room)} | {thing.id: object_box(thing) for thing in scene.objects}
    for opening in scene.room.openings:
        boxes[opening.id] = opening_box(scene.room, opening, [row.mesh for row in rows if row.object_id == opening.id])
    return np.stack([boxes[row.object_id] for row in rows])


def _profile_rows(rows: int, luminaires: int) -> NDArray[np.int32]:
    """Return ``part_profile`` for parts of which the last are the luminaires."""
    if not luminaires:
        return NO_PROFILE
    return np.concatenate([np.full(rows - luminaires, -1), np.arange(luminaires)]).astype(np.int32)


def _luminaire_row(index: int, luminaire: Luminaire, material: int) -> _Row:
    """Return a light that no object holds as a part; what it is made of shows only where it is off."""
    mesh = luminaire_mesh(luminaire)
    emission = luminaire_emission(luminaire, mesh, intensity_profile(luminaire))
    return _Row(f"0/luminaire_{index}", box_mapped(mesh), 0, LABEL_ID["lamp"], material, emission, False)


def emitted_luminance(light: Light, area_m2: float) -> NDArray[np.float64]:
    """Return the RGB luminance (3,) in cd/m2 of a diffuse emitter of this area: Y = flux / (pi area), in the light's colour.

    Raises:
        FlattenError: the light's colour is black.
    """
    if not light.on or light.flux_lm == 0.0:
        return np.zeros(3)
    color = np.asarray(light.color, np.float64)
    luminance = float(matmul(color, LUMINANCE))
    if luminance <= 0.0:
        raise FlattenError(f"light of object {light.object}, part '{light.part}': expected a colour, got black; switch it off instead")
    return color * (light.flux_lm / (math.pi * area_m2) / luminance)


def _shell_rows(scene: SceneDescription, materials: _Materials) -> list[_Row]:
    """Return the room's surfaces; there are skirting boards only where the description has a material for them."""
    surfaces = {part.name: part.material for part in scene.room.surfaces}
    try:
        shell = build_shell(scene.room)
    except FlattenError as error:
        raise FlattenError(f"room: {error}") from error
    rows = []
    for name, mesh in shell.items():
        if name not in surfaces and name not in SURFACES:
            continue
        if name not in surfaces:
            raise FlattenError(f"room: expected a material for surface '{name}', got only {_listed(surfaces)}")
        row = _material(materials, surfaces[name], "room")
        mapped, texture = _textured(mesh, materials.table[row], "room")
        rows.append(_Row(f"0/{name}", mapped, 0, SURFACE_LABELS[name], row, np.zeros(3), False, texture))
    return rows


def _opening_rows(scene: SceneDescription, opening: Opening, materials: _Materials) -> list[_Row]:
    where = f"{opening.category} {opening.id}"
    model = opening.model
    if model.generator not in OPENING_MODELS:
        got = f"'{model.generator}'" if model.generator else "a model file"
        raise FlattenError(f"{where}: expected one of the generators {_listed(OPENING_MODELS)}, got {got}")
    _check_style(where, model, OPENING_MODELS[model.generator].styles)
    parts = build_opening(scene.room, opening, model.generator, model.style, model.seed)
    chosen = _part_materials(where, parts, opening.parts, materials)
    rows = []
    for name, mesh in parts.items():
        mapped, texture = _textured(mesh, materials.table[chosen[name]], where)
        portal = opening.category == "window" and name == "pane"
        rows.append(_Row(f"{opening.id}/{name}", mapped, opening.id, opening.label, chosen[name], np.zeros(3), portal, texture))
    return rows


def _object_rows(thing: SceneObject, lights: dict[tuple[int, str], Light], materials: _Materials, catalog_dir: Path | None) -> list[_Row]:
    where = f"object {thing.id} ({thing.category})"
    parts = _build(where, thing, catalog_dir)
    for owner, part in lights:
        if owner == thing.id and part not in parts:
            raise FlattenError(f"{where}: expected its light in one of the parts {_listed(parts)}, got '{part}'")
    chosen = _part_materials(where, parts, thing.parts, materials)
    cosine, sine = math.cos(thing.yaw_rad), math.sin(thing.yaw_rad)
    rotation = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    rows = []
    for name, mesh in parts.items():
        material = materials.table[chosen[name]]
        if thing.model.file is not None and material.images is None:
            mesh = mesh._replace(uvs=UNMAPPED)  # the file's coordinates are no metres
        mapped, texture = _textured(mesh, material, where, catalog_dir)
        world = mapped._replace(
            vertices=(matmul(mapped.vertices, rotation.T) + np.asarray(thing.position_m)).astype(np.float32),
            normals=matmul(mapped.normals, rotation.T).astype(np.float32),
        )
        light = lights.get((thing.id, name))
        emission = np.zeros(3) if light is None else emitted_luminance(light, surface_area(mesh))
        rows.append(_Row(f"{thing.id}/{name}", world, thing.id, thing.label, chosen[name], emission, False, texture))
    return rows


def _build(where: str, thing: SceneObject, catalog_dir: Path | None) -> Parts:
    """Build an object's parts in its own frame, from its generator or file."""
    model = thing.model
    if model.file is not None:
        if catalog_dir is None:
            raise FlattenError(f"{where}: expected a catalogue folder for model file '{model.file}', got none; name one")
        try:
            return load_mesh_file(find_mesh_file(catalog_dir, model.file), catalog_dir, thing.size_m, model.reading)
        except MeshFileError as error:
            raise FlattenError(f"{where}: {error}") from error
    if model.generator not in MODELS:
        raise FlattenError(f"{where}: expected one of the generators {_listed(MODELS)}, got '{model.generator}'")
    _check_style(where, model, MODELS[model.generator].styles)
    return moved_model(model, thing.size_m) if model.ajar else build_model(model.generator, model.style, model.seed, thing.size_m)


def _check_style(where: str, model: ModelReference, styles: tuple[str, ...]) -> None:
    if model.style != "default" and model.style not in styles:
        raise FlattenError(
            f"{where}: expected style 'default' or one of {_listed(styles)} of generator '{model.generator}', got '{model.style}'"
        )


def _part_materials(where: str, built: Parts, given: tuple[Part, ...], materials: _Materials) -> dict[str, int]:
    """Return part name -> row of the material table for every built part."""
    named = {part.name: part.material for part in given}
    missing = [name for name in built if name not in named]
    if missing:
        raise FlattenError(f"{where}: expected materials for the parts {_listed(built)}, got none for {_listed(missing)}")
    return {name: _material(materials, named[name], where) for name in built}


def _material(materials: _Materials, name: str, where: str) -> int:
    if name not in materials.rows:
        raise FlattenError(f"{where}: expected the id of one of the scene's {len(materials.rows)} materials, got '{name}'")
    return materials.rows[name]


def _textured(mesh: Mesh, material: Material, where: str, catalog_dir: Path | None = None) -> tuple[Mesh, AppliedTexture | None]:
    """Return a part, still in its own frame, with texture coordinates, and its texture."""
    mapped = box_mapped(mesh)
    if material.images is not None:
        if catalog_dir is None:
            raise FlattenError(f"{where}: expected a catalogue folder for the images of material '{material.id}', got none; name one")
        try:
            return mapped, file_texture(catalog_dir, material.images, material.base_color)
        except MeshFileError as error:
            raise FlattenError(f"{where}: material '{material.id}': {error}") from error
    if material.texture is None:
        return mapped, None
    if material.texture.generator not in GENERATORS:
        got = material.texture.generator
        raise FlattenError(f"{where}: material '{material.id}': expected one of the textures {_listed(GENERATORS)}, got '{got}'")
    return applied_texture(material, material.texture, mapped)


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f"'{name}'" for name in names)

"""Models of the user's catalogue as the grammar needs them: size, parts, materials."""

from __future__ import annotations

from pathlib import Path

from renderer.core.errors import MeshFileError
from renderer.files.file_parts import MeshFile
from renderer.files.gltf_materials import FileMaterial
from renderer.files.mesh_files import find_mesh_file, read_mesh_file
from scene_description import FileImages, Material
from scene_description.catalog import CatalogEntry, CatalogModel

LEAST_M, MOST_M = 0.0005, 100.0


def measure_model(root: Path, entry: CatalogEntry) -> CatalogModel:
    """Read a model of a catalogue.

    Raises:
        MeshFileError: the file cannot be used, or has a size that no object can have.
    """
    read = read_mesh_file(find_mesh_file(root, entry.file), root, entry.reading)
    depth, width, height = (side * entry.unit_m for side in read.size)
    if min(depth, width, height) < LEAST_M or max(depth, width, height) > MOST_M:
        raise MeshFileError(
            f"model file '{entry.file}': expected sides of {LEAST_M} to {MOST_M} m, got {depth:.4g} x {width:.4g} x {height:.4g} m; "
            "state unit_m, or give flat models a thickness"
        )
    return CatalogModel(entry=entry, size_m=(depth, width, height), parts=part_materials(entry.file, read))


def part_materials(file: str, read: MeshFile) -> dict[str, Material]:
    """Return part name -> material of the file, as a scene has it; parts of one material get equal ones."""
    return {name: to_material(file, read.materials[part.material], part.material) for name, part in read.parts.items()}


def to_material(file: str, material: FileMaterial, index: int) -> Material:
    """Return a material of a file as a scene's material; ``index`` is its row in the file.

    What is blended in the file becomes glass by as much.
    """
    images = any((material.base_image, material.metallic_roughness_image, material.normal_image))
    stem = _plain(file.rpartition(".")[0].replace("/", "."))[-60:]
    return Material(
        id=f"{stem}:{index}:{_plain(material.name)[:40]}",
        family="file",
        base_color=material.base_color,
        roughness=material.roughness,
        metallic=material.metallic,
        transmission=max(material.transmission, 1.0 - material.alpha),
        ior=material.ior,
        clearcoat=material.clearcoat,
        clearcoat_roughness=material.clearcoat_roughness,
        sheen=material.sheen,
        images=FileImages(file=file, material=index) if images else None,
    )


def _plain(name: str) -> str:
    return "".join(c if c.isascii() and (c.isalnum() or c in "_.-") else "_" for c in name) or "_"

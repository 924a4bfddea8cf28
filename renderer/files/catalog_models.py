"""Models of the user's catalogue: sizes, parts and materials for the grammar, and what is wrong with one though it can be read."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.errors import MeshFileError
from renderer.files.file_parts import MeshFile
from renderer.files.gltf_materials import FileMaterial
from renderer.files.image_io import decode_image
from renderer.files.mesh_files import find_mesh_file, read_mesh_file
from renderer.geometry.mesh import Mesh, signed_volume
from renderer.geometry.shapes import merged, stretched
from scene_description import FileImages, Material
from scene_description.catalog import CatalogEntry, CatalogModel, CatalogSurface
from scene_description.products import dot

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
        diffuse_transmission=material.diffuse_transmission,
        ior=material.ior,
        clearcoat=material.clearcoat,
        clearcoat_roughness=material.clearcoat_roughness,
        sheen=material.sheen,
        images=FileImages(file=file, material=index) if images else None,
    )


def _plain(name: str) -> str:
    return "".join(c if c.isascii() and (c.isalnum() or c in "_.-") else "_" for c in name) or "_"


MANY_FACES = 15_000
TOP_TOLERANCE_M = 0.01
TOP_COVER = 0.9
_GRID = 48
_IMAGE_SIDE = 4096


class Top(NamedTuple):
    """What a horizontal top looks like from above: share of its cells at its height, and the height that most cells have (m)."""

    cover: float
    level_m: float


def check_model(root: Path, entry: CatalogEntry, tops: Sequence[CatalogSurface]) -> list[str]:
    """Return what people should know of a model, one line each; ``tops`` are its own surfaces or else its category's.

    Raises:
        MeshFileError: the file, or an image of it, cannot be used at all.
    """
    read = read_mesh_file(find_mesh_file(root, entry.file), root, entry.reading)
    for index, data in read.images.items():
        decode_image(data, f"image {index}", _IMAGE_SIDE)
    parts = {name: part.mesh for name, part in read.parts.items()}
    return [*_shape_faults(parts), *_look_faults(read, entry), *_top_faults(merged(*parts.values()), entry, read.size, tops)]


def open_edges(mesh: Mesh) -> int:
    """Return how many edges do not have two triangles, with vertices at one place taken as one."""
    _, weld = np.unique(np.round(mesh.vertices.astype(np.float64), 6), axis=0, return_inverse=True)
    faces = weld.reshape(-1)[mesh.faces]
    faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    _, count = np.unique(edges, axis=0, return_counts=True)
    return int((count != 2).sum())


def look_at_top(mesh: Mesh, low: NDArray[np.float64], high: NDArray[np.float64], height: float, tolerance: float) -> Top:
    """Look down on a mesh over a rectangle (low to high, x and y) and compare what is seen with a height; all in one unit."""
    heights = _seen_from_above(mesh, low, high)
    seen = heights[np.isfinite(heights)]
    cover = float((np.abs(heights - height) <= tolerance).mean())
    if len(seen) == 0:
        return Top(cover, 0.0)
    steps = np.round(seen / max(tolerance, 1e-9))
    values, count = np.unique(steps, return_counts=True)
    return Top(cover, float(values[count.argmax()] * max(tolerance, 1e-9)))


def _seen_from_above(mesh: Mesh, low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the height (grid, grid) of the topmost triangle over the centres of a grid's cells, -inf where there is none."""
    heights = np.full((_GRID, _GRID), -np.inf)
    step = (high - low) / _GRID
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    first = np.clip(np.ceil((corners[:, :, :2].min(axis=1) - low) / step - 0.5).astype(int), 0, _GRID)
    last = np.clip(np.floor((corners[:, :, :2].max(axis=1) - low) / step - 0.5).astype(int) + 1, 0, _GRID)
    for k in np.flatnonzero((last > first).all(axis=1)):
        a, b, c = corners[k]
        (i0, j0), (i1, j1) = first[k], last[k]
        x = (low[0] + (np.arange(i0, i1) + 0.5) * step[0])[:, None] - a[0]
        y = (low[1] + (np.arange(j0, j1) + 0.5) * step[1])[None, :] - a[1]
        (ux, uy, uz), (vx, vy, vz) = b - a, c - a
        area = ux * vy - uy * vx
        if abs(area) < 1e-15:
            continue
        s, t = (x * vy - y * vx) / area, (y * ux - x * uy) / area
        inside = (s >= -1e-9) & (t >= -1e-9) & (s + t <= 1.0 + 1e-9)
        window = heights[i0:i1, j0:j1]
        np.maximum(window, np.where(inside, a[2] + s * uz + t * vz, -np.inf), out=window)
    return heights


def _shape_faults(parts: dict[str, Mesh]) -> list[str]:
    faults = []
    total = sum(len(mesh.faces) for mesh in parts.values())
    if total > MANY_FACES:
        faults.append(f"{total} triangles, many for one object (at most {MANY_FACES} keep rooms light)")
    holes = {name: count for name, mesh in parts.items() if (count := open_edges(mesh))}
    if holes:
        worst = max(holes, key=lambda name: holes[name])
        faults.append(f"not watertight: {len(holes)} of {len(parts)} parts, most open edges in '{worst}' ({holes[worst]})")
    inverted = [name for name, mesh in parts.items() if name not in holes and signed_volume(mesh) < 0.0]
    if inverted:
        faults.append(f"faces look inwards in {', '.join(inverted)}")
    against = [name for name, mesh in parts.items() if _normals_against(mesh) > 0.5]
    if against:
        faults.append(f"normals point against their triangles in {', '.join(against)}")
    return faults


def _normals_against(mesh: Mesh) -> float:
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float((dot(flat, mesh.normals[mesh.faces].mean(axis=1)) < 0.0).mean())


def _look_faults(read: MeshFile, entry: CatalogEntry) -> list[str]:
    if entry.materials == "sample":
        return []
    faults = []
    used: dict[str, FileMaterial] = {name: read.materials[part.material] for name, part in read.parts.items()}
    bare = [name for name, item in used.items() if item.base_image is not None and len(read.parts[name].mesh.uvs) == 0]
    for names, text in (
        (bare, "no texture coordinates for the image of"),
        ([name for name, item in used.items() if item.cutout], "holes cut by an image are filled in"),
        ([name for name, item in used.items() if item.alpha < 1.0 and item.transmission == 0.0], "blended, rendered as glass:"),
        ([name for name, item in used.items() if max(item.emission) > 0.0], "shines in the file, not in rooms (make it a lamp's part):"),
        ([name for name, item in used.items() if item.name == "plain"], "no material in the file, rendered grey:"),
    ):
        if names:
            faults.append(f"{text} {', '.join(names[:6])}{' ...' if len(names) > 6 else ''}")
    return faults


def _top_faults(mesh: Mesh, entry: CatalogEntry, size: tuple[float, float, float], tops: Sequence[CatalogSurface]) -> list[str]:
    """Check that tops which carry things are where they are said to be, at the model's own size."""
    own = np.array(size) * entry.unit_m
    low, high = mesh.vertices.min(axis=0).astype(np.float64), mesh.vertices.max(axis=0).astype(np.float64)
    scale = own / np.maximum(high - low, 1e-9)
    placed = stretched(mesh._replace(uvs=mesh.uvs[:0]), scale, -low * scale)
    faults = []
    for i, top in enumerate(tops):
        height = top.height_fraction * own[2] + top.height_m
        inset = np.full(2, top.inset_m)
        if (own[:2] <= 2.0 * inset).any():
            faults.append(f"top {i}: no room within its inset of {top.inset_m:g} m")
            continue
        seen = look_at_top(placed, inset, own[:2] - inset, height, TOP_TOLERANCE_M)
        if seen.cover < TOP_COVER and height < own[2] - TOP_TOLERANCE_M and seen.level_m > height + TOP_TOLERANCE_M:
            continue  # a shelf under something else: cannot be judged from above
        if seen.cover < TOP_COVER:
            faults.append(
                f"top {i}: only {seen.cover:.0%} of it lies at {height:.3f} m, most at {seen.level_m:.3f} m; state surfaces, "
                f"for example [{{height_m: {seen.level_m:.3f}, inset_m: 0.02}}], or [] for none"
            )
    return faults

"""The triangles of a glTF file: accessors, primitives and the node tree, every index and range checked before arrays are made.

glTF 2.0 specification, sections 3.5 to 3.7.  Skins and morph targets are left at the pose in which the vertices are stored.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.arrays import Array
from renderer.files.gltf_container import Container, fail, listed, mapped, pointed, view_bytes, whole
from scene_description.poses import rotation_from_quaternion
from scene_description.products import determinant, inverse, matmul

MAX_FACES = 500_000
MAX_VERTICES = 1_500_000
MAX_PIECES = 4_096
MAX_DEPTH = 64
_MOST = (MAX_PIECES, MAX_VERTICES, MAX_FACES)

_TYPES = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
_LARGEST: dict[Any, int] = {5120: 127, 5121: 255, 5122: 32_767, 5123: 65_535}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_LIST, _STRIP, _FAN = 4, 5, 6


class Piece(NamedTuple):
    """One primitive under one node, in the file's own frame and units.

    node: the node's name, else its mesh's; vertices, normals (n, 3) float64; faces (m, 3) int64, counter-clockwise from outside;
    material: index in the file or None; uvs: (n, 2) by number of the set (``TEXCOORD_<n>``), v downwards as glTF has it;
    color: mean of the vertex colours (linear RGB), white where there are none.
    """

    node: str
    vertices: Array
    normals: Array
    faces: NDArray[np.int64]
    material: int | None
    uvs: Mapping[int, Array]
    color: tuple[float, float, float]


def read_pieces(container: Container) -> tuple[Piece, ...]:
    """Return the triangles of the file's scene, node by node in the order of the tree.

    Raises:
        MeshFileError: an index, a range or a count does not fit; nodes are too deep, in a cycle, or have several parents.
    """
    nodes = list(_within_budget(container.tree, _placed_nodes(container.tree)))
    accessors: dict[int, Array] = {}
    pieces: list[Piece] = []
    for index, matrix in nodes:
        node = container.tree["nodes"][index]
        mesh = pointed(container.tree, "meshes", node["mesh"], f"nodes[{index}].mesh")
        name = str(node.get("name") or mesh.get("name") or f"node {index}")
        for k, primitive in enumerate(listed(mesh, "primitives")):
            piece = _read_primitive(container, primitive, f"meshes[{node['mesh']}].primitives[{k}]", name, matrix, accessors)
            if piece is not None:
                pieces.append(piece)
    return tuple(pieces)


def read_accessor(container: Container, index: object, path: str, width: int, cache: dict[int, Array]) -> Array:
    """Return an accessor's rows (count, width) as float64, normalised where it says so.

    Raises:
        MeshFileError: wrong type, ranges beyond the buffer, numbers that are not finite.
    """
    accessor = pointed(container.tree, "accessors", index, path)
    assert isinstance(index, int)
    where = f"accessors[{index}]"
    if _WIDTHS.get(str(accessor.get("type"))) != width:
        fail(f"{where}.type", next(name for name, w in _WIDTHS.items() if w == width), accessor.get("type"))
    if index in cache:
        return cache[index]
    count = whole(accessor.get("count"), f"{where}.count", 1, MAX_VERTICES * 3)
    if "bufferView" in accessor:
        rows = _rows(
            container, accessor["bufferView"], accessor.get("byteOffset", 0), accessor.get("componentType"), count, width, where
        ).astype(np.float64)
    else:
        rows = np.zeros((count, width))
    if "sparse" in accessor:
        _apply_sparse(container, mapped(accessor, "sparse", f"{where}."), accessor.get("componentType"), rows, where)
    if accessor.get("normalized") is True:
        rows = np.maximum(rows / _LARGEST.get(accessor.get("componentType"), 1), -1.0)
    if not np.isfinite(rows).all():
        fail(where, "finite numbers", "NaN or infinity")
    cache[index] = rows
    return rows


def _placed_nodes(tree: Mapping[str, Any]) -> Iterator[tuple[int, Array]]:
    """Yield every node of the scene that has a mesh, with its matrix to the file's frame, depth first."""
    nodes = listed(tree, "nodes")
    scenes = listed(tree, "scenes")
    if scenes:
        roots = listed(pointed(tree, "scenes", tree.get("scene", 0), "scene"), "nodes")
    else:
        children = {child for node in nodes if isinstance(node, Mapping) for child in listed(node, "children") if isinstance(child, int)}
        roots = [i for i in range(len(nodes)) if i not in children]
    stack = [(root, np.eye(4), 0, "scene") for root in reversed(roots)]
    seen: set[int] = set()
    while stack:
        index, above, depth, path = stack.pop()
        node = pointed(tree, "nodes", index, f"{path}.nodes" if path == "scene" else f"{path}.children")
        if depth > MAX_DEPTH:
            fail(f"nodes[{index}]", f"at most {MAX_DEPTH} levels of nodes", "more")
        if index in seen:
            fail(f"nodes[{index}]", "nodes with one parent, without cycles", "a second one")
        seen.add(index)
        matrix = matmul(above, _local_matrix(node, f"nodes[{index}]"))
        if not np.isfinite(matrix).all() or np.abs(matrix).max() > 1e9:
            fail(f"nodes[{index}]", "a matrix of finite numbers below 1e9", "others")
        if "mesh" in node:
            yield index, matrix
        stack.extend((child, matrix, depth + 1, f"nodes[{index}]") for child in reversed(listed(node, "children")))


def _local_matrix(node: Mapping[str, Any], path: str) -> Array:
    if "matrix" in node:
        return _numbers(node["matrix"], 16, f"{path}.matrix").reshape(4, 4).T
    x, y, z, w = _numbers(node.get("rotation", [0, 0, 0, 1]), 4, f"{path}.rotation")
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    if norm < 1e-9:
        fail(f"{path}.rotation", "a quaternion of unit length", "zero")
    matrix = np.eye(4)
    matrix[:3, :3] = rotation_from_quaternion((x / norm, y / norm, z / norm, w / norm))
    matrix[:3, :3] *= _numbers(node.get("scale", [1, 1, 1]), 3, f"{path}.scale")
    matrix[:3, 3] = _numbers(node.get("translation", [0, 0, 0]), 3, f"{path}.translation")
    return matrix


def _numbers(value: object, count: int, path: str) -> Array:
    if not isinstance(value, list) or len(value) != count or not all(isinstance(x, (int, float)) and abs(x) < 1e12 for x in value):
        fail(path, f"{count} numbers below 1e12", value)
    return np.array(value, np.float64)


def _within_budget(tree: Mapping[str, Any], nodes: Iterable[tuple[int, Array]]) -> Iterator[tuple[int, Array]]:
    """Yield the nodes and add up what the file says that they have, before any of it is read and no further than the budget goes."""
    pieces = faces = vertices = 0
    for index, matrix in nodes:
        mesh = pointed(tree, "meshes", tree["nodes"][index]["mesh"], f"nodes[{index}].mesh")
        for k, primitive in enumerate(listed(mesh, "primitives")):
            path = f"meshes[{tree['nodes'][index]['mesh']}].primitives[{k}]"
            if not isinstance(primitive, Mapping):
                fail(path, "a mapping", primitive)
            pieces += 1
            points = _count(tree, mapped(primitive, "attributes", f"{path}.").get("POSITION"), f"{path}.attributes.POSITION")
            corners = _count(tree, primitive["indices"], f"{path}.indices") if "indices" in primitive else points
            vertices += points
            faces += corners // 3 if primitive.get("mode", _LIST) == _LIST else max(corners - 2, 0)
            for name, value, most in zip(("primitives", "vertices", "triangles"), (pieces, vertices, faces), _MOST, strict=True):
                if value > most:
                    fail("scene", f"at most {most} {name}", f"{value} or more")
        yield index, matrix


def _count(tree: Mapping[str, Any], index: object, path: str) -> int:
    return whole(pointed(tree, "accessors", index, path).get("count"), f"accessors[{index}].count", 1)


def _read_primitive(
    container: Container, primitive: Mapping[str, Any], path: str, name: str, matrix: Array, cache: dict[int, Array]
) -> Piece | None:
    mode = primitive.get("mode", _LIST)
    if mode not in (_LIST, _STRIP, _FAN):
        return None
    attributes = mapped(primitive, "attributes", f"{path}.")
    points = read_accessor(container, attributes.get("POSITION"), f"{path}.attributes.POSITION", 3, cache)
    order = np.arange(len(points), dtype=np.int64)
    if "indices" in primitive:
        order = read_accessor(container, primitive["indices"], f"{path}.indices", 1, cache)[:, 0].astype(np.int64)
        if order.min() < 0 or order.max() >= len(points):
            fail(f"{path}.indices", f"vertex numbers below {len(points)}", f"{order.min()} to {order.max()}")
    faces = _triangles(order, mode)
    if len(faces) == 0:
        return None
    uvs = {}
    for k in (0, 1):
        if f"TEXCOORD_{k}" in attributes:
            uvs[k] = _attribute(container, attributes, f"TEXCOORD_{k}", 2, len(points), path, cache)
    if "NORMAL" in attributes:
        normals = _attribute(container, attributes, "NORMAL", 3, len(points), path, cache)
    else:  # flat, as the specification asks
        corners = points[faces]
        flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        uvs = {k: rows[faces].reshape(-1, 2) for k, rows in uvs.items()}
        points, normals = corners.reshape(-1, 3), np.repeat(flat, 3, axis=0)
        faces = np.arange(len(points), dtype=np.int64).reshape(-1, 3)
    linear = matrix[:3, :3]
    if abs(determinant(linear)) < 1e-18:
        return None  # scaled to nothing, a common way to hide a node
    if determinant(linear) < 0.0:
        faces = faces[:, ::-1]
    material = primitive.get("material")
    if material is not None:
        whole(material, f"{path}.material", 0, len(listed(container.tree, "materials")) - 1)
    return Piece(
        node=name,
        vertices=matmul(points, linear.T) + matrix[:3, 3],
        normals=matmul(normals, inverse(linear)),
        faces=faces,
        material=material,
        uvs=uvs,
        color=_mean_color(container, attributes, len(points), path, cache),
    )


def _attribute(
    container: Container, attributes: Mapping[str, Any], name: str, width: int, count: int, path: str, cache: dict[int, Array]
) -> Array:
    rows = read_accessor(container, attributes[name], f"{path}.attributes.{name}", width, cache)
    if len(rows) != count:
        fail(f"{path}.attributes.{name}", f"{count} rows, one for each vertex", len(rows))
    return rows


def _mean_color(
    container: Container, attributes: Mapping[str, Any], count: int, path: str, cache: dict[int, Array]
) -> tuple[float, float, float]:
    if "COLOR_0" not in attributes:
        return (1.0, 1.0, 1.0)
    accessor = pointed(container.tree, "accessors", attributes["COLOR_0"], f"{path}.attributes.COLOR_0")
    width = 4 if accessor.get("type") == "VEC4" else 3
    red, green, blue = read_accessor(container, attributes["COLOR_0"], path, width, cache).mean(axis=0)[:3].clip(0.0, 1.0)
    return float(red), float(green), float(blue)


def _triangles(order: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    if mode == _LIST:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    if mode == _FAN:
        faces = np.column_stack([np.full(max(len(order) - 2, 0), order[0]), order[1:-1], order[2:]])
    else:
        faces = np.column_stack([order[:-2], order[1:-1], order[2:]])
        faces[1::2, :2] = faces[1::2, 1::-1]
    a, b, c = faces.T
    return np.asarray(faces[(a != b) & (b != c) & (c != a)])


def _rows(container: Container, view: object, offset: object, component: object, count: int, width: int, path: str) -> NDArray[Any]:
    """Return ``count`` rows of ``width`` numbers from a buffer view, as they are stored."""
    if component not in _TYPES or isinstance(component, bool):
        fail(f"{path}.componentType", f"one of {', '.join(map(str, _TYPES))}", component)
    kind = np.dtype(_TYPES[component]).newbyteorder("<")
    data = view_bytes(container, view, f"{path}.bufferView")
    first = whole(offset, f"{path}.byteOffset")
    stride = container.tree["bufferViews"][view].get("byteStride", kind.itemsize * width)
    whole(stride, f"bufferViews[{view}].byteStride", kind.itemsize * width, 252 if stride != kind.itemsize * width else 2**31 - 1)
    if first + stride * (count - 1) + kind.itemsize * width > len(data):
        fail(path, f"{count} rows within the {len(data)} bytes of its view", f"a range to {first + stride * count}")
    return np.ndarray((count, width), kind, data, first, (stride, kind.itemsize))


def _apply_sparse(container: Container, sparse: Mapping[str, Any], component: object, rows: Array, path: str) -> None:
    count = whole(sparse.get("count"), f"{path}.sparse.count", 1, len(rows))
    where, values = mapped(sparse, "indices", f"{path}.sparse."), mapped(sparse, "values", f"{path}.sparse.")
    index = _rows(
        container, where.get("bufferView"), where.get("byteOffset", 0), where.get("componentType"), count, 1, f"{path}.sparse.indices"
    )[:, 0].astype(np.int64)
    if index.min() < 0 or index.max() >= len(rows):
        fail(f"{path}.sparse.indices", f"numbers below {len(rows)}", f"{index.max()}")
    rows[index] = _rows(
        container, values.get("bufferView"), values.get("byteOffset", 0), component, count, rows.shape[1], f"{path}.sparse.values"
    )

"""Ground truth of a bag against itself and the exported mesh, by programs of others: rosbags reads, Open3D fuses, trimesh measures.

python -m benchmarks.alignment_bench BAG MESH.glb [--camera /synth/camera] [--json FILE]

The bag has one room with the layers flow and occlusion beside depth, normals and ids; the mesh is what ``scene_synth export`` writes of the
room.  Needs the extra ``bench-alignment``, which has wheels for Python up to 3.12; Open3D 0.20 returns empty meshes here.
"""

import argparse
import itertools
import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray
from rosbags.highlevel import AnyReader
from scipy.ndimage import map_coordinates, maximum_filter, minimum_filter
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from benchmarks.table import Row, at_least, at_most, render_table

VOXEL_M, NEAR_M, POINTS = 0.01, 0.05, 200_000
_TYPES = {"32FC1": (np.float32, 1), "32FC2": (np.float32, 2), "32FC3": (np.float32, 3), "mono8": (np.uint8, 1), "16UC1": (np.uint16, 1)}
VISIBLE, HIDDEN = 0, 1


class View(NamedTuple):
    """One frame: images by layer, camera matrix (3, 3), world from optical frame (4, 4)."""

    images: dict[str, NDArray[Any]]
    matrix: NDArray[np.float64]
    pose: NDArray[np.float64]


def read_views(bag: Path, camera: str) -> tuple[list[View], dict[str, set[int]]]:
    """Return the frames of a bag in the order of their stamps, and the ids that the labels of each layer name."""
    found: dict[int, dict[str, Any]] = {}
    named: dict[str, set[int]] = {}
    with AnyReader([bag]) as reader:
        for connection, _, data in reader.messages([item for item in reader.connections if item.topic.startswith(f"{camera}/")]):
            layer, _, kind = connection.topic.removeprefix(f"{camera}/").rpartition("/")
            if kind not in ("image_raw", "camera_info", "pose", "labels"):
                continue
            message: Any = reader.deserialize(data, connection.msgtype)
            if kind == "labels":
                named.setdefault(layer, set()).update(map(int, json.loads(message.data)["labels"]))
                continue
            frame = found.setdefault(message.header.stamp.sec * 10**9 + message.header.stamp.nanosec, {})
            if kind == "pose":
                frame["pose"] = _matrix(message.pose)
            elif kind == "camera_info":
                frame["matrix"] = np.array(message.k).reshape(3, 3)
            elif message.encoding in _TYPES:
                dtype, channels = _TYPES[message.encoding]
                frame[layer] = np.frombuffer(message.data, dtype).reshape(message.height, message.width, channels).squeeze()
    views = []
    for _, frame in sorted(found.items()):
        matrix, pose = frame.pop("matrix"), frame.pop("pose")
        views.append(View(frame, matrix, pose))
    return views, named


def fuse(views: list[View]) -> NDArray[np.float64]:
    """Return points (n, 3) of the surface that Open3D's truncated signed distance field makes of depth and poses."""
    import open3d  # the options are read without it

    volume = open3d.pipelines.integration.ScalableTSDFVolume(VOXEL_M, 4 * VOXEL_M, open3d.pipelines.integration.TSDFVolumeColorType.RGB8)
    for view in views:
        depth = np.where(np.isfinite(view.images["depth"]), view.images["depth"], 0.0).astype(np.float32)
        height, width = depth.shape
        grey = open3d.geometry.Image(np.full((height, width, 3), 128, np.uint8))
        image = open3d.geometry.RGBDImage.create_from_color_and_depth(grey, open3d.geometry.Image(depth), 1.0, 20.0, False)
        k = view.matrix
        camera = open3d.camera.PinholeCameraIntrinsic(width, height, k[0, 0], k[1, 1], k[0, 2], k[1, 2])
        volume.integrate(image, camera, np.linalg.inv(view.pose))
    mesh = volume.extract_triangle_mesh()
    return np.asarray(mesh.sample_points_uniformly(POINTS).points)


def seen_points(mesh: trimesh.Trimesh, views: list[View]) -> NDArray[np.float64]:
    """Return points of a mesh that some frame sees: they lie within 2 cm of the depth at the pixel that they fall on."""
    points, _ = trimesh.sample.sample_surface(mesh, 8 * POINTS, seed=1)
    seen = np.zeros(len(points), bool)
    for view in views:
        depth = view.images["depth"]
        place, z = _project(points, view)
        column, row = np.rint(place[:, 0]).astype(int), np.rint(place[:, 1]).astype(int)
        inside = (z > 0.05) & (column >= 0) & (row >= 0) & (column < depth.shape[1]) & (row < depth.shape[0])
        seen[inside] |= np.abs(depth[row[inside], column[inside]] - z[inside]) < 0.02
    return np.asarray(points[seen])


def measure(bag: Path, mesh_file: Path, camera: str) -> list[Row]:
    """Return the measures."""
    views, named = read_views(bag, camera)
    mesh = trimesh.load(mesh_file, force="mesh")
    mesh.apply_transform([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])  # glTF has y up
    fused, truth = fuse(views), seen_points(mesh, views)
    precision = float((cKDTree(trimesh.sample.sample_surface(mesh, 20 * POINTS, seed=2)[0]).query(fused)[0] < NEAR_M).mean())
    recall = float((cKDTree(fused).query(truth)[0] < NEAR_M).mean())
    unnamed = sum(len(set(np.unique(view.images[layer])) - ids) for view in views for layer, ids in named.items())
    flow, agreed, angle = zip(*(_between(a, b) for a, b in itertools.pairwise(views)), strict=True)
    return [
        Row("frames", len(views), ""),
        at_least("TSDF of depth and poses against the mesh, F-score at 5 cm", 2 * precision * recall / (precision + recall), "", 0.99),
        at_most(f"ids without a label, in {len(named)} layers", unnamed, "", 0),
        at_most("flow against depth and poses, most", max(flow), "px", 0.05),
        at_least("pixels where occlusion agrees with a z-test", float(np.mean(agreed)), "", 0.999),
        at_most("normals from depth on planes, median angle", float(np.median(angle)), "degrees", 1.0),
    ]


def _between(here: View, there: View) -> tuple[float, float, float]:
    """Return the largest error of flow, the share of pixels with the right occlusion, and the median angle of normals from depth."""
    points = _points(here)
    height, width = here.images["depth"].shape
    place, z = _project(points.reshape(-1, 3), there)
    place, z = place.reshape(height, width, 2), z.reshape(height, width)
    column, row = np.meshgrid(np.arange(width), np.arange(height))
    error = np.abs(place - np.stack([column, row], axis=-1) - here.images["flow"]).max(axis=-1)
    inside = (z > 0.01) & (place >= 0).all(axis=-1) & (place <= (width - 1, height - 1)).all(axis=-1) & np.isfinite(z)
    other = there.images["depth"]
    span = [np.full((height, width), np.nan) for _ in range(2)]
    for low_high, edge in zip(span, (minimum_filter(other, 3), maximum_filter(other, 3)), strict=True):
        low_high[inside] = map_coordinates(edge, place[inside][:, ::-1].T, order=0)
    state = here.images["occlusion"]
    surely_hidden, surely_seen = inside & (z > span[1] + 0.02), inside & (z < span[0] + 0.005)
    judged = surely_hidden | surely_seen
    right = (surely_hidden & (state == HIDDEN)) | (surely_seen & (state == VISIBLE))
    return float(error[inside].max()), float(right[judged].mean()), _normal_angle(here)


def _normal_angle(view: View) -> float:
    """Return the median angle (degrees) between the normals and those of depth, where the neighbours have the same normal and id."""
    points = _points(view) @ view.pose[:3, :3]  # axes of the optical frame
    normals, ids = view.images["normals"], view.images["instance"]
    made = np.cross(points[2:, 1:-1] - points[:-2, 1:-1], points[1:-1, 2:] - points[1:-1, :-2])
    made /= np.maximum(np.linalg.norm(made, axis=-1, keepdims=True), 1e-12)
    centre = normals[1:-1, 1:-1]
    plane = np.ones(centre.shape[:2], bool)
    for dy, dx in ((0, 1), (2, 1), (1, 0), (1, 2)):
        beside = (slice(dy, dy + centre.shape[0]), slice(dx, dx + centre.shape[1]))
        plane &= (np.abs(normals[beside] - centre).max(axis=-1) < 1e-4) & (ids[beside] == ids[1:-1, 1:-1])
    cosine = np.clip((made * centre).sum(axis=-1), -1.0, 1.0)
    return float(np.degrees(np.median(np.arccos(cosine[plane]))))


def _points(view: View) -> NDArray[np.float64]:
    """Return the points (height, width, 3) of depth, in the world."""
    depth, k = view.images["depth"].astype(np.float64), view.matrix
    row, column = np.indices(depth.shape)
    optical = np.stack([(column - k[0, 2]) / k[0, 0] * depth, (row - k[1, 2]) / k[1, 1] * depth, depth], axis=-1)
    return np.asarray(optical @ view.pose[:3, :3].T + view.pose[:3, 3])


def _project(points: NDArray[np.float64], view: View) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return places (n, 2), pixel centres at integers, and depths (n,) of world points."""
    optical = (points - view.pose[:3, 3]) @ view.pose[:3, :3]
    with np.errstate(divide="ignore", invalid="ignore"):
        scaled = optical @ view.matrix.T
        return scaled[:, :2] / scaled[:, 2:], optical[:, 2]


def _matrix(pose: Any) -> NDArray[np.float64]:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat([pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w]).as_matrix()
    matrix[:3, 3] = pose.position.x, pose.position.y, pose.position.z
    return matrix


def main() -> None:
    """Measure, print the table and write it as JSON if asked."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.alignment_bench")
    parser.add_argument("bag", type=Path)
    parser.add_argument("mesh", type=Path)
    parser.add_argument("--camera", default="/synth/camera")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    rows = measure(arguments.bag, arguments.mesh, arguments.camera)
    print(render_table("Alignment", rows))
    if arguments.json:
        arguments.json.write_text(json.dumps([row._asdict() for row in rows], indent=1))


if __name__ == "__main__":
    main()

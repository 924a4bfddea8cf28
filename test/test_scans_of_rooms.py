"""Scans of whole rooms against the map that the grammar publishes, and against the section of the mesh by trimesh and shapely."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy import ndimage
from shapely import STRtree, linestrings, points

from grammar import SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer import CameraConfig, RenderConfig, Renderer
from renderer.lidar.config import ScanConfig
from renderer.lidar.mount import along_path, mounted_scanner
from renderer.lidar.scanner import Scanner
from renderer.scene.flatten import flatten

SYNTHESIZER = SceneSynthesizer.from_config()
CONFIG = ScanConfig(noise_m=0.005, height_m=0.25)


@pytest.mark.parametrize("room_type", ["bedroom", "kitchen", "office", "bathroom"])
def test_hits_lie_within_a_cell_of_what_the_map_calls_not_free_and_on_the_mesh(room_type: str) -> None:
    times = CameraTimes(frames=12, start_ns=10**9, rate_hz=10.0)
    scene = SYNTHESIZER.synthesize(SceneRequest(room_type=room_type), seed=11, index=0, times=times)
    grid = SYNTHESIZER.floor_map(scene)
    flat = flatten(scene)
    with Renderer(flat, CameraConfig(width=4, height=4), RenderConfig(threads=1), 1) as renderer:
        scans = list(Scanner(renderer.tree, flat, CONFIG, 1).along(scene.camera_path))
    assert len(scans) == 11
    angles = CONFIG.angle_min_rad + np.arange(CONFIG.beams) * CONFIG.angle_increment_rad
    seconds = np.arange(CONFIG.beams) * CONFIG.time_increment_s
    hits = []
    for scan in scans:
        placed = mounted_scanner(CONFIG, along_path(scene.camera_path, scan.stamp_ns, seconds))
        beams = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1) * scan.ideal[:, None]
        seen = np.isfinite(scan.ideal)
        hits.append((placed.position_m + np.einsum("nij,nj->ni", placed.rotation, beams))[seen])
    found = np.concatenate(hits)
    assert len(found) > 7000
    # the map: distance of each hit's cell to the nearest cell that is not free, in cells
    outside = 10
    taken = np.pad(grid.cells != 0, outside, constant_values=True)
    away = ndimage.distance_transform_edt(~taken)
    cell = np.floor((found[:, :2] - grid.origin_m) / grid.resolution_m).astype(int) + outside
    assert np.mean(away[cell[:, 1], cell[:, 0]] <= 1.0) >= 0.999
    # the mesh
    mesh = trimesh.Trimesh(flat.mesh.vertices, flat.mesh.faces, process=False)
    section = trimesh.intersections.mesh_plane(mesh, (0, 0, 1), (0, 0, CONFIG.height_m))
    tree = STRtree(linestrings(section[:, :, :2]))
    far = tree.query_nearest(points(found[:, :2]), return_distance=True, all_matches=False)[1]
    assert np.quantile(far, 0.999) < 1e-5

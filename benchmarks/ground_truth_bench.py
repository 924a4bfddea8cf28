"""Ground truth and colour, 640x480: the four geometric layers beside bare packets and embreex's own calls, and the price of colour."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene as ReferenceScene
from numba import njit
from numpy.typing import NDArray

from benchmarks.bench_room import VIEW, furnished_room
from benchmarks.table import Row, at_least
from grammar import SceneRequest, room_types
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer import GEOMETRIC_LAYERS, CameraConfig, FlatScene, RenderConfig, Renderer
from renderer.camera.camera_rays import TILE, aim_tile
from renderer.camera.cameras import PosedCamera, pose_camera, unproject
from renderer.core.embree import LANES, EmbreeScene, Packet, SceneHandle, intersect16, make_packet
from renderer.core.workers import Workers
from renderer.scene.flatten import flatten
from scene_description import CameraPose

CAMERA = CameraConfig(width=640, height=480)
ROUNDS, FRAMES_PER_ROUND, COLOR_FRAMES, SAMPLES, SEED = 9, 5, 3, 16, 1
LIGHT_COPIES, HEAVY_COPIES = 1, 4


def measure() -> list[Row]:
    """Return frame rates and ratios; rounds alternate between what is compared, and medians of rounds are taken."""
    rows: list[Row] = []
    heavy = furnished_room(HEAVY_COPIES)
    size = f"{len(heavy.mesh.faces) // 1000}k triangles"
    for threads in (1, 2):
        bare_s, ours_s, ratio = _geometry(heavy, threads)
        rows += [
            Row(f"bare 16-wide coherent packets, {size}, {threads} threads", 1.0 / bare_s, "frames/s"),
            Row(f"depth, normals, semantic, instance, {size}, {threads} threads", 1.0 / ours_s, "frames/s"),
            at_least(f"geometric layers over bare packets, {threads} threads", ratio, "", 0.7),
        ]
    rows += _sampled_rooms()
    rows.append(Row(f"embreex's own calls, {size}, 1 thread", 1.0 / _own_calls(heavy), "frames/s"))
    light = furnished_room(LIGHT_COPIES)
    for threads in (1, 2):
        seconds = _color(light, threads)
        name = f"colour, {SAMPLES} samples, one bounce, {len(light.mesh.faces) // 1000}k triangles, {threads} threads"
        rows += [Row(name, seconds, "s/frame"), Row("  as paths", CAMERA.width * CAMERA.height * SAMPLES / seconds / 1e6, "M/s")]
    return rows


def _sampled_rooms() -> list[Row]:
    """Return the same ratio in a sampled room of each type, by time of the processor."""
    times, synthesizer = CameraTimes(frames=2, start_ns=0, rate_hz=1.0), SceneSynthesizer.from_config()
    ratios, faces = {}, []
    for room_type in room_types():
        scene = synthesizer.synthesize(SceneRequest(room_type=room_type), SEED, 0, times)
        flat = flatten(scene, Path.cwd())
        faces.append(len(flat.mesh.faces))
        ratios[room_type] = _geometry(flat, 1, scene.camera_path[0], time.process_time)[2]
    least = min(ratios, key=lambda name: ratios[name])
    name = f"{len(ratios)} sampled rooms of {min(faces) // 1000}k to {max(faces) // 1000}k triangles, 1 thread"
    return [
        at_least(f"{name}: median", float(np.median(list(ratios.values()))), "", 0.85),
        Row(f"  least, {least}", ratios[least], ""),
    ]


@njit(nogil=True)
def cast_bare(scene: SceneHandle, camera: PosedCamera, packet: Packet, first: int, step: int) -> None:
    """Cast the same camera rays in the same order, and look at nothing."""
    centre = np.zeros(2 * LANES, np.float32)
    for row in range(first * TILE, camera.height, step * TILE):
        for column in range(0, camera.width, TILE):
            aim_tile(camera, column, row, centre, packet)
            intersect16(packet.alive.ctypes.data, scene.address, packet.real.ctypes.data, scene.coherent)


def _geometry(
    flat: FlatScene, threads: int, pose: CameraPose = VIEW, clock: Callable[[], float] = time.perf_counter
) -> tuple[float, float, float]:
    """Return seconds a frame of bare packets and of the renderer, and the median ratio of neighbouring rounds."""
    view, packets, workers = pose_camera(CAMERA, pose), [make_packet() for _ in range(threads)], Workers(threads)
    with EmbreeScene(flat.mesh.vertices, flat.mesh.faces) as scene, Renderer(flat, CAMERA, RenderConfig(threads=threads), 0) as renderer:

        def bare() -> None:
            workers.run(lambda worker, first: cast_bare(scene.handle, view, packets[worker], first, threads), range(threads))

        def ours() -> None:
            renderer.render(pose, 0, GEOMETRIC_LAYERS)

        bare(), ours()
        rounds = np.array([(_seconds(bare, clock), _seconds(ours, clock)) for _ in range(ROUNDS)])
    workers.close()
    bare_s, ours_s = np.median(rounds, axis=0)
    return float(bare_s), float(ours_s), float(np.median(rounds[:, 0] / rounds[:, 1]))


def _seconds(frame: Callable[[], None], clock: Callable[[], float] = time.perf_counter) -> float:
    began = clock()
    for _ in range(FRAMES_PER_ROUND):
        frame()
    return (clock() - began) / FRAMES_PER_ROUND


def _own_calls(flat: FlatScene) -> float:
    """Return seconds a frame of embreex's Python interface."""
    scene = ReferenceScene()
    TriangleMesh(scene, flat.mesh.vertices, flat.mesh.faces.astype(np.int32))
    v, u = np.mgrid[: CAMERA.height, : CAMERA.width] + 0.5
    points: NDArray[np.float64] = unproject(CAMERA, VIEW, np.column_stack([u.ravel(), v.ravel(), np.ones(u.size)]))
    origins = np.tile(np.array(VIEW.position_m, np.float32), (len(points), 1))
    directions = (points - VIEW.position_m).astype(np.float32)
    return min(_seconds(lambda: scene.run(origins, directions)) for _ in range(2))


def _color(flat: FlatScene, threads: int) -> float:
    """Return the median seconds of a colour frame."""
    config = RenderConfig(threads=threads, samples_per_pixel=SAMPLES)
    with Renderer(flat, CAMERA, config, 0) as renderer:
        renderer.render(VIEW, 0, ("depth",))
        seconds = []
        for frame in range(COLOR_FRAMES):
            began = time.perf_counter()
            renderer.render(VIEW, frame, ("color",))
            seconds.append(time.perf_counter() - began)
    return float(np.median(seconds))

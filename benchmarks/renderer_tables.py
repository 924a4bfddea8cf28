"""Speed tables of the renderer: ground truth against bare Embree packets, layers of the hit record, geometry, light that presets lose."""

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene as ReferenceScene
from numba import njit
from numpy.typing import NDArray

from benchmarks.table import Row, at_least, at_most
from grammar import SceneRequest, room_types
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer import GEOMETRIC_LAYERS, CameraConfig, FlatScene, Mesh, PartTable, RenderConfig, Renderer, Sky, tabulate_materials
from renderer.camera.camera_rays import TILE, aim_tile
from renderer.camera.cameras import PosedCamera, pose_camera, unproject
from renderer.core.color import LUMINANCE
from renderer.core.embree import EmbreeScene, SceneHandle, intersect16
from renderer.core.ray_packet import LANES, Packet, make_packet
from renderer.core.workers import Workers
from renderer.exposure import exposed, meter
from renderer.film.layers import HIT_LAYERS
from renderer.film.tone import Exposure
from renderer.geometry.coordinates import box_mapped
from renderer.geometry.shapes import merged, moved, rotated
from renderer.models import build_model
from renderer.path.surface_tables import build_surfaces
from renderer.scene.flatten import flatten
from renderer.scene.room_shell import build_opening, build_shell
from renderer.scene.scene_key import scene_key
from renderer.textures.tile import forget_tiles
from scene_description import CameraPose, Material, ModelReference, Opening, Part, Room, SceneDescription, SceneObject, from_mapping
from scene_description.labels import LABEL_ID
from scene_description.poses import look_at
from scene_synth_ros.cli.parameters.render_settings import PRESETS, preset_settings

ROOM_M, HEIGHT_M = (5.0, 4.2), 2.7
FURNITURE = (
    # generator, size (depth, width, height), position, yaw in degrees
    ("bed", (2.1, 1.7, 1.1), (1.15, 3.0, 0.0), 0.0),
    ("nightstand", (0.4, 0.45, 0.5), (0.3, 1.85, 0.0), 0.0),
    ("table_lamp", (0.25, 0.25, 0.45), (0.3, 1.85, 0.5), 0.0),
    ("wardrobe", (0.6, 1.6, 2.1), (1.4, 0.35, 0.0), 90.0),
    ("desk", (0.7, 1.4, 0.75), (4.6, 1.4, 0.0), 180.0),
    ("desk_chair", (0.6, 0.6, 1.0), (3.9, 1.4, 0.0), 10.0),
    ("laptop", (0.25, 0.35, 0.24), (4.6, 1.3, 0.75), 180.0),
    ("mug", (0.1, 0.08, 0.1), (4.5, 1.8, 0.75), 40.0),
    ("armchair", (0.85, 0.9, 0.85), (4.2, 3.3, 0.0), 215.0),
    ("pouf", (0.45, 0.45, 0.4), (3.3, 2.9, 0.0), 0.0),
    ("rug", (1.6, 2.2, 0.012), (2.9, 2.2, 0.0), 0.0),
    ("bookshelf", (0.3, 0.9, 1.9), (3.2, 0.2, 0.0), 90.0),
    ("floor_lamp", (0.35, 0.35, 1.6), (4.7, 3.9, 0.0), 0.0),
    ("ceiling_lamp", (0.4, 0.4, 0.4), (2.5, 2.1, 2.3), 0.0),
    ("potted_plant", (0.5, 0.5, 1.0), (4.65, 0.4, 0.0), 0.0),
    ("potted_plant", (0.4, 0.4, 0.7), (2.6, 3.8, 0.0), 70.0),
    ("vase", (0.2, 0.2, 0.5), (4.7, 1.9, 0.75), 0.0),
    ("waste_bin", (0.25, 0.25, 0.3), (4.75, 2.3, 0.0), 0.0),
    ("book_stack", (0.2, 0.25, 0.15), (3.3, 2.9, 0.4), 25.0),
    ("picture", (0.03, 0.8, 0.6), (0.02, 3.0, 1.5), 0.0),
)
"""About 50,000 triangles."""
SHINING = {"shade": (2300.0, 1900.0, 1300.0)}
VIEW = CameraPose(stamp_ns=0, position_m=(4.75, 0.35, 1.65), orientation=look_at((4.75, 0.35, 1.65), (1.6, 2.9, 0.7)))


def furnished_room(copies: int = 1) -> FlatScene:
    """Return the room; every further copy adds all furniture again, a hand's breadth aside, to make the mesh heavier."""
    window = Opening(
        id=2, category="window", label=LABEL_ID["window"], wall=2, offset_m=1.6, sill_m=0.9, width_m=1.8, height_m=1.3,
        model=ModelReference(generator="window", seed=4), parts=(),
    )  # fmt: skip
    (depth, width), paint = ROOM_M, Part(name="wall", material="paint")
    room = Room(
        polygon_m=((0.0, 0.0), (depth, 0.0), (depth, width), (0.0, width)),
        height_m=HEIGHT_M,
        wall_thickness_m=0.2,
        openings=(window,),
        surfaces=(paint,),
    )
    parts: list[tuple[str, int, int, Mesh]] = [(name, 0, LABEL_ID["wall"], mesh) for name, mesh in build_shell(room).items()]
    parts += [(name, 2, window.label, mesh) for name, mesh in build_opening(room, window, "window", "default", 4).items()]
    for copy in range(copies):
        for index, (generator, size, (x, y, z), yaw_deg) in enumerate(FURNITURE):
            identity = 3 + copy * len(FURNITURE) + index
            for name, mesh in build_model(generator, "default", identity, size).items():
                turned = rotated(mesh, "z", math.radians(yaw_deg))
                parts.append((name, identity, 1 + index % 40, moved(turned, x + 0.07 * copy, y - 0.05 * copy, z)))
    return _flat_scene(parts)


def _flat_scene(parts: list[tuple[str, int, int, Mesh]]) -> FlatScene:
    """Give every part a material of its own, in a colour drawn from its index."""
    count = len(parts)
    names, identities, labels, meshes = zip(*parts, strict=True)
    colors = np.random.default_rng(1).uniform(0.2, 0.8, (count, 3)).astype(np.float32)
    colors[[name in ("wall", "ceiling") for name in names]] = 0.78
    shell = np.array(identities) == 0
    emission = np.array([(0.0, 0.0, 0.0) if dark else SHINING.get(name, (0.0, 0.0, 0.0)) for name, dark in zip(names, shell, strict=True)])
    panes = np.array([name == "pane" for name in names])
    return FlatScene(
        mesh=merged(*map(box_mapped, meshes)),
        face_part=np.repeat(np.arange(count, dtype=np.int32), [len(mesh.faces) for mesh in meshes]),
        parts=PartTable(
            np.array(identities, np.uint16),
            np.array(labels, np.uint8),
            np.arange(count, dtype=np.int32),
            emission.astype(np.float32),
            panes,
        ),
        part_names=tuple(f"{identity}/{name}" for identity, name in zip(identities, names, strict=True)),
        materials=tabulate_materials(
            [
                Material(id=name, family="bench", base_color=tuple(color), transmission=0.85 if pane else 0.0)
                for name, color, pane in zip(names, colors, panes, strict=True)
            ]
        ),
        sky=Sky(*(np.array(color, np.float32) for color in ((2500, 3500, 6000), (6000, 6500, 7500), (900, 850, 700)))),
    )


CAMERA = CameraConfig(width=640, height=480)
ROUNDS, FRAMES_PER_ROUND, COLOR_FRAMES, SAMPLES, SEED = 9, 5, 3, 16, 1
LIGHT_COPIES, HEAVY_COPIES = 1, 4


def measure_ground_truth() -> list[Row]:
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
    return [at_least(f"{name}: median", float(np.median(list(ratios.values()))), "", 0.9), Row(f"  least, {least}", ratios[least], "")]


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


def _seconds(act: Callable[[], object], clock: Callable[[], float] = time.perf_counter, repeats: int = FRAMES_PER_ROUND) -> float:
    began = clock()
    for _ in range(repeats):
        act()
    return (clock() - began) / repeats


def _processor_seconds(act: Callable[[], object]) -> float:
    return _seconds(act, time.process_time, 1)


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


LAYERS_CAMERA = CameraConfig(width=640, height=480)
LAYERS_ROUNDS = 7
SHIFT_M = 0.02


def measure_layers() -> list[Row]:
    """Return milliseconds of the basic layers, of each further one on top of them, and the ratio of all to the basic ones."""
    path = tuple(_step_aside(number) for number in range(3))
    with Renderer(furnished_room(1), LAYERS_CAMERA, RenderConfig(threads=1), 0) as renderer:

        def cost(*names: str) -> Callable[[], object]:
            return lambda: renderer.render(path[1], 0, (*GEOMETRIC_LAYERS, *names), path=path)

        cost(*HIT_LAYERS)()
        basic = cost()
        rows = []
        for name in HIT_LAYERS:
            pairs = np.array([(_processor_seconds(basic), _processor_seconds(cost(name))) for _ in range(LAYERS_ROUNDS)])
            rows.append(Row(f"{name}, beside the basic layers", 1e3 * float(np.median(pairs[:, 1] - pairs[:, 0])), "ms"))
        pairs = np.array([(_processor_seconds(basic), _processor_seconds(cost(*HIT_LAYERS))) for _ in range(LAYERS_ROUNDS)])
    basic_s, all_s = np.median(pairs, axis=0)
    head = [Row("depth, range, normals, semantic, instance", 1e3 * float(basic_s), "ms")]
    total = [
        Row("all layers of the hit record together", 1e3 * float(all_s), "ms"),
        at_most("all layers over the basic ones", float(np.median(pairs[:, 1] / pairs[:, 0])), "", 2.0),
    ]
    return head + rows + total


def _step_aside(number: int) -> CameraPose:
    x, y, z = VIEW.position_m
    return replace(VIEW, stamp_ns=number, position_m=(x + SHIFT_M * number, y, z))


OBJECTS, BEDROOMS, WARM_BEDROOMS = 30, 40, 24
LIMIT_S = 0.3


def measure_geometry() -> list[Row]:
    """Build bedrooms one after the other, as a renderer does, and return the times of one room."""
    rooms = list(_bedrooms())
    for room in rooms:
        flatten(room)  # compiles and loads the kernels
    forget_tiles()
    seconds = [_processor_seconds(lambda room=room: flatten(room)) for room in rooms]
    next_rooms, again = (seconds[WARM_BEDROOMS:], [_processor_seconds(lambda room=room: flatten(room)) for room in rooms[WARM_BEDROOMS:]])
    cold = []
    for room in rooms[:6]:
        forget_tiles()
        cold.append(_processor_seconds(lambda room=room: flatten(room)))
    flats = [flatten(room) for room in rooms[WARM_BEDROOMS:]]
    return [
        at_most(f"geometry of the next bedroom of {OBJECTS} objects, warm, median", float(np.median(next_rooms)), "s", LIMIT_S),
        Row(f"geometry of the next bedroom of {OBJECTS} objects, warm, longest", max(next_rooms), "s"),
        at_most("geometry of a bedroom whose textures are known, median", float(np.median(again)), "s", LIMIT_S),
        Row("geometry of a bedroom without any texture known, median", float(np.median(cold)), "s"),
        Row("triangles of a room, median", float(np.median([len(flat.mesh.faces) for flat in flats])), ""),
        Row("memory of a room's meshes and tables, median", float(np.median([_mesh_bytes(flat) for flat in flats])) / 1e6, "MB"),
        Row("memory of a room's textures, median", float(np.median([_texture_bytes(flat) for flat in flats])) / 1e6, "MB"),
    ]


def _bedrooms() -> Iterator[SceneDescription]:
    """Yield bedrooms of 30 objects: sampled ones, made up to the number by the things of the bedroom that follows."""
    synthesizer, times = SceneSynthesizer.from_config(), CameraTimes(frames=1, start_ns=0, rate_hz=1.0)
    rooms = [synthesizer.synthesize(SceneRequest(room_type="bedroom"), 1, index, times) for index in range(BEDROOMS + 4)]
    for first in range(BEDROOMS):
        room = rooms[first]
        objects, materials = list(room.objects), list(room.materials)
        for number, other in enumerate(rooms[first + 1 :]):
            objects += [_renamed(thing, number) for thing in other.objects]
            materials += [replace(material, id=f"{number}:{material.id}") for material in other.materials]
            if len(objects) >= OBJECTS:
                break
        yield replace(room, objects=tuple(objects[:OBJECTS]), materials=tuple(materials))


def _renamed(thing: SceneObject, number: int) -> SceneObject:
    parts = tuple(replace(part, material=f"{number}:{part.material}") for part in thing.parts)
    return replace(thing, id=thing.id + 1000 * (number + 1), parts=parts)


def _mesh_bytes(flat: FlatScene) -> int:
    arrays = (*flat.mesh, flat.face_part, *flat.parts, flat.part_texture)
    return sum(array.nbytes for array in arrays)


def _texture_bytes(flat: FlatScene) -> int:
    return build_surfaces(flat).textures.texels.nbytes


ROOM_TYPES, PRESETS_SEED = ("bedroom", "kitchen", "living_room", "bathroom"), 1
EXACT = RenderConfig(samples_per_pixel=1024, max_depth=32, blur_textures=False)
MEAN_SAMPLES = 256
PRESETS_CAMERA = CameraConfig(width=160, height=120)
PRESETS_TIMES = CameraTimes(frames=3, start_ns=10**9, rate_hz=10.0)
LEAST = 0.98
TRACED = [name for name in PRESETS if preset_settings(name)["integrator"] == "path"]
"""The presets that trace paths; ``cache_bench`` has the others."""


def measure_presets() -> list[Row]:
    """Return, for every room, each preset's share of the exact mean, and its seconds for a million samples."""
    synthesizer = SceneSynthesizer.from_config()
    rows = []
    for room_type in ROOM_TYPES:
        scene = synthesizer.synthesize(SceneRequest(room_type=room_type), PRESETS_SEED, 0, PRESETS_TIMES)
        flat, pose = flatten(scene), scene.camera_path[1]
        shown = exposed(RenderConfig(auto_exposure=True), meter(flat, PRESETS_CAMERA, EXACT, scene_key(scene), scene.camera_path))
        exact, _ = mean_and_seconds(flat, pose, EXACT, shown)
        for preset in TRACED:
            config = replace(from_mapping(RenderConfig, preset_settings(preset, MEAN_SAMPLES)), denoise="none")
            mean, seconds = mean_and_seconds(flat, pose, config, shown)
            rows.append(at_least(f"{room_type}, {preset}, mean over the exact one", mean / exact, "", LEAST))
            rows.append(
                Row(
                    f"{room_type}, {preset}, a million samples",
                    1e6 * seconds / (MEAN_SAMPLES * PRESETS_CAMERA.width * PRESETS_CAMERA.height),
                    "s",
                )
            )
    return rows


def mean_and_seconds(flat: FlatScene, pose: CameraPose, config: RenderConfig, shown: Exposure) -> tuple[float, float]:
    """Return the mean luminance (cd/m2) of one frame, and the processor time it took."""
    with Renderer(flat, PRESETS_CAMERA, config, PRESETS_SEED) as renderer:
        renderer.render(pose, 0, ("albedo",), exposure=shown)  # builds the tree
        began = time.process_time()
        frame = renderer.render(pose, 0, ("color",), exposure=shown)
    seconds = time.process_time() - began
    assert frame.radiance is not None
    return float((frame.radiance.astype(np.float64) @ LUMINANCE).mean()), seconds

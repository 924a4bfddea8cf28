"""Embree through numba against embreex's own calls, and its failures."""

import ctypes
import gc
import os
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest
from embreex_reference import reference_hits
from numba import njit

from renderer.core import embree
from renderer.core.embree import EmbreeScene, SceneHandle, intersect1, intersect16, occluded1, occluded16
from renderer.core.errors import RenderError
from renderer.core.ray_packet import (
    BARY_U,
    BARY_V,
    DIR_X,
    GEOM_ID,
    INVALID_ID,
    LANES,
    MASK,
    NG_X,
    ORG_X,
    PASS_PANES,
    PRIM_ID,
    TFAR,
    TNEAR,
    Packet,
    make_packet,
)
from renderer.geometry.mesh import Mesh

PATHS = {"PYTHONPATH": os.pathsep.join(sys.path)}


def triangle_soup(count: int = 500) -> Mesh:
    rng = np.random.default_rng(5)
    corners = rng.uniform(-1, 1, (count, 1, 3)) + rng.uniform(-0.2, 0.2, (count, 3, 3))
    vertices = corners.reshape(-1, 3).astype(np.float32)
    return Mesh(vertices, np.zeros_like(vertices), np.arange(3 * count, dtype=np.uint32).reshape(-1, 3))


def random_rays(count: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(6)
    directions = rng.normal(size=(count, 3))
    return rng.uniform(-1, 1, (count, 3)).astype(np.float32), directions.astype(np.float32)


@njit
def cast16(scene, packet, occlusion, coherent):
    arguments = scene.coherent if coherent else scene.incoherent
    if occlusion:
        occluded16(packet.alive.ctypes.data, scene.address, packet.real.ctypes.data, arguments)
    else:
        intersect16(packet.alive.ctypes.data, scene.address, packet.real.ctypes.data, arguments)


@njit
def cast1(scene, ray, occlusion):
    if occlusion:
        occluded1(scene.address, ray.ctypes.data, scene.incoherent)
    else:
        intersect1(scene.address, ray.ctypes.data, scene.incoherent)


def load(packet: Packet, origins: np.ndarray, directions: np.ndarray) -> None:
    for axis in range(3):
        packet.real[ORG_X + LANES * axis :][:LANES] = origins[:, axis]
        packet.real[DIR_X + LANES * axis :][:LANES] = directions[:, axis]
    packet.real[TNEAR:][:LANES] = 0
    packet.real[TFAR:][:LANES] = np.inf
    packet.integer[GEOM_ID:][:LANES] = INVALID_ID


def trace_all(handle: SceneHandle, origins: np.ndarray, directions: np.ndarray, coherent: bool, mask: int = 0xFFFFFFFF) -> dict:
    packet, rows = make_packet(), {name: [] for name in ("tfar", "primID", "u", "v", "Ng")}
    packet.integer[MASK : MASK + LANES] = mask
    for start in range(0, len(origins), LANES):
        load(packet, origins[start : start + LANES], directions[start : start + LANES])
        cast16(handle, packet, False, coherent)
        hit = packet.integer[GEOM_ID:][:LANES] != INVALID_ID
        rows["primID"].append(np.where(hit, packet.integer[PRIM_ID:][:LANES].astype(np.int64), -1))
        for name, field in (("tfar", TFAR), ("u", BARY_U), ("v", BARY_V)):
            rows[name].append(packet.real[field:][:LANES].copy())
        rows["Ng"].append(packet.real[NG_X:][: 3 * LANES].reshape(3, LANES).T.copy())
    return {name: np.concatenate(parts) for name, parts in rows.items()}


def test_packets_hit_what_embreex_hits():
    mesh = triangle_soup()
    origins, directions = random_rays(4096)
    expected = reference_hits(mesh.vertices[mesh.faces], origins, directions)
    with EmbreeScene(mesh.vertices, mesh.faces) as scene:
        for coherent in (True, False):
            ours = trace_all(scene.handle, origins, directions, coherent)
            assert np.array_equal(ours["primID"], expected["primID"])
            hit = ours["primID"] >= 0
            assert 1000 < hit.sum() < 4000
            np.testing.assert_allclose(ours["tfar"][hit], expected["tfar"][hit], rtol=2e-4)
            np.testing.assert_allclose(ours["u"][hit], expected["u"][hit], atol=2e-4)
            np.testing.assert_allclose(ours["v"][hit], expected["v"][hit], atol=2e-4)
            assert np.isinf(ours["tfar"][~hit]).all()


def test_portable_hits_are_where_exact_arithmetic_has_them():
    """Embree's own differ in last digits, by the processor's estimates of reciprocals."""
    mesh = triangle_soup()
    origins, directions = random_rays(4096)
    with EmbreeScene(mesh.vertices, mesh.faces, portable=True) as scene:
        ours = trace_all(scene.handle, origins, directions, True)
    hit = np.flatnonzero(ours["primID"] >= 0)
    assert len(hit) > 1000
    for row in hit:
        o, d = ([Fraction(float(value)) for value in array[row]] for array in (origins, directions))
        corners = mesh.vertices[mesh.faces[ours["primID"][row]]]
        a, b, c = ([Fraction(float(v)) - p for v, p in zip(corner, o, strict=True)] for corner in corners)
        u, v, whole = volume(d, c, a), volume(d, a, b), volume(d, b, c) + volume(d, c, a) + volume(d, a, b)
        for name, exact in (("tfar", volume(a, b, c) / whole), ("u", u / whole), ("v", v / whole)):
            assert abs(float(ours[name][row]) - float(exact)) <= np.spacing(np.float32(float(exact))), name


def volume(a: list[Fraction], b: list[Fraction], c: list[Fraction]) -> Fraction:
    """Return a . (b x c)."""
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])


def test_geometric_normals_follow_the_winding():
    mesh = triangle_soup()
    origins, directions = random_rays(512)
    with EmbreeScene(mesh.vertices, mesh.faces) as scene:
        ours = trace_all(scene.handle, origins, directions, True)
    hit = ours["primID"] >= 0
    a, b, c = (mesh.vertices[mesh.faces[ours["primID"][hit], corner]] for corner in range(3))
    expected = np.cross(b - a, c - a)
    cosine = (expected * ours["Ng"][hit]).sum(1) / np.linalg.norm(expected, axis=1) / np.linalg.norm(ours["Ng"][hit], axis=1)
    assert cosine.min() > 0.9999


@pytest.mark.parametrize("portable", [False, True])
def test_a_steady_scene_shows_the_first_of_faces_at_one_distance(portable: bool):
    """Whatever else is there: a square of two triangles lies twice in one plane, behind and beside other triangles.

    Portable, and on processors without AVX-512, the filter sees half a packet; portable scenes show it to all rays.
    """
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    halves = np.array([[0, 1, 2], [0, 2, 3], [1, 2, 3], [0, 1, 3]], np.uint32)  # cut along both diagonals
    origins = np.column_stack([np.random.default_rng(1).uniform(0.01, 0.99, (256, 2)), np.full(256, 1.0)]).astype(np.float32)
    origins[:LANES, 1] = origins[:LANES, 0]  # some rays meet the edge between the first two
    directions = np.tile(np.array([0.0, 0.0, -1.0], np.float32), (256, 1))
    expected = np.where(origins[:, 0] >= origins[:, 1], 0, 1)
    for seed in range(4):
        more = triangle_soup()
        kept = np.random.default_rng(seed).permutation(len(more.faces))[: 50 * seed]
        vertices = np.concatenate([square, more.vertices - np.float32(50.0)])
        faces = np.concatenate([halves, more.faces[kept] + np.uint32(4)])
        with EmbreeScene(vertices, faces, steady=True, portable=portable) as scene:
            packet, found = make_packet(), []
            for first in range(0, 256, LANES):
                load(packet, origins[first : first + LANES], directions[first : first + LANES])
                cast16(scene.handle._replace(coherent=scene.handle.primary), packet, False, True)
                found.append(packet.integer[PRIM_ID:][:LANES].copy())
                np.testing.assert_allclose(packet.real[TFAR:][:LANES], 1.0, rtol=1e-7)
            others = [trace_all(scene.handle, origins, directions, coherent) for coherent in (True, False)] if portable else []
        assert all(np.array_equal(primitives, expected) for primitives in (np.concatenate(found), *(rays["primID"] for rays in others)))
    with EmbreeScene(square, halves) as scene:
        assert scene.handle.primary == scene.handle.coherent


def test_single_rays_and_occlusion_agree_with_packets():
    mesh = triangle_soup()
    origins, directions = random_rays(256)
    memory = np.zeros(96 // 4 + 16, np.float32)
    ray = memory[(-memory.ctypes.data % 64) // 4 :][:24]
    with EmbreeScene(mesh.vertices, mesh.faces) as scene:
        expected = trace_all(scene.handle, origins, directions, False)
        packet, occluded = make_packet(), []
        for start in range(0, 256, LANES):
            load(packet, origins[start : start + LANES], directions[start : start + LANES])
            cast16(scene.handle, packet, True, False)
            occluded.append(packet.real[TFAR:][:LANES] == -np.inf)
        assert np.array_equal(np.concatenate(occluded), expected["primID"] >= 0)
        for i in range(256):
            for occlusion in (False, True):
                ray[:] = 0
                ray[0:3], ray[4:7], ray[8] = origins[i], directions[i], np.inf
                ray.view(np.uint32)[9] = ray.view(np.uint32)[18] = INVALID_ID
                cast1(scene.handle, ray, occlusion)
                if occlusion:
                    assert (ray[8] == -np.inf) == (expected["primID"][i] >= 0)
                elif expected["primID"][i] >= 0:
                    assert ray.view(np.uint32)[17] == expected["primID"][i]
                    assert ray[8] == pytest.approx(expected["tfar"][i], rel=1e-4)


@pytest.mark.parametrize("watertight", [True, False])
def test_panes_stop_only_rays_that_meet_all(watertight):
    """With every third triangle a pane, other rays hit what the rest of the mesh alone has, under the same numbers."""
    mesh = triangle_soup()
    panes = np.arange(len(mesh.faces)) % 3 == 0
    origins, directions = random_rays(2048)
    with EmbreeScene(mesh.vertices, mesh.faces, watertight=watertight) as whole:
        everything = trace_all(whole.handle, origins, directions, False)
    with EmbreeScene(mesh.vertices, mesh.faces[~panes], watertight=watertight) as rest:
        others = trace_all(rest.handle, origins, directions, False)
    with EmbreeScene(mesh.vertices, mesh.faces, panes=panes, watertight=watertight) as scene:
        meeting = trace_all(scene.handle, origins, directions, False)
        passing = trace_all(scene.handle, origins, directions, False, int(PASS_PANES))
    numbers = np.append(np.flatnonzero(~panes), -1)
    assert np.array_equal(meeting["primID"], everything["primID"]) and np.array_equal(meeting["tfar"], everything["tfar"])
    assert np.array_equal(passing["primID"], numbers[others["primID"]]) and np.array_equal(passing["tfar"], others["tfar"])
    assert 200 < (meeting["primID"] != passing["primID"]).sum()


def test_dead_lanes_are_left_alone():
    packet, mesh = make_packet(), triangle_soup()
    with EmbreeScene(mesh.vertices, mesh.faces) as scene:
        load(packet, *random_rays(LANES))
        packet.alive[:] = 0
        packet.integer[MASK : MASK + LANES] = 7
        cast16(scene.handle, packet, True, False)
    assert np.isinf(packet.real[TFAR:][:LANES]).all() and (packet.real[TFAR:][:LANES] > 0).all()


def test_packets_are_aligned():
    packets = [make_packet() for _ in range(20)]
    assert all(packet.real.ctypes.data % 64 == 0 and packet.alive.ctypes.data % 64 == 0 for packet in packets)


def test_the_mesh_may_be_dropped_by_its_owner():
    mesh = triangle_soup()
    origins, directions = random_rays(256)
    scene = EmbreeScene(mesh.vertices, mesh.faces)
    before = trace_all(scene.handle, origins, directions, True)
    mesh.vertices[:] = 0
    del mesh
    gc.collect()
    after = trace_all(scene.handle, origins, directions, True)
    scene.close()
    scene.close()
    assert np.array_equal(before["primID"], after["primID"])


def test_an_empty_mesh_is_never_hit():
    empty = Mesh(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32))
    with EmbreeScene(empty.vertices, empty.faces) as scene:
        assert (trace_all(scene.handle, *random_rays(LANES), True)["primID"] == -1).all()


def test_wrong_types_are_refused():
    mesh = triangle_soup()
    with pytest.raises(RenderError, match="expected float32 vertices and uint32 faces, got float64"):
        EmbreeScene(mesh.vertices.astype(np.float64), mesh.faces)


def test_faults_of_the_device_become_one_line(monkeypatch):
    library, mesh = embree.load_library(), triangle_soup()

    class Faulty:
        """The library, but building reports code 4."""

        def __getattr__(self, name):
            return (lambda device: 4) if name == "rtcGetDeviceError" else getattr(library, name)

    monkeypatch.setattr(embree, "load_library", Faulty)
    with pytest.raises(RenderError, match=r"^Embree: building a scene of 500 triangles failed: out of memory$"):
        EmbreeScene(mesh.vertices, mesh.faces)


def test_its_task_scheduler_is_not_forced_on_other_libraries():
    """The library brings a libtbb; were it loaded for all to see, the denoiser would take it for its own, and its one thread with it."""
    seen = "from renderer.core.embree import load_library; import ctypes; load_library(); print(hasattr(ctypes.CDLL(None), 'rtcNewDevice'))"
    assert subprocess.run([sys.executable, "-c", seen], stdout=subprocess.PIPE, text=True, check=True).stdout == "False\n"


def test_where_the_wheel_is_absent_the_library_of_the_system_is_taken(monkeypatch):
    path = embree._library_path()
    monkeypatch.setattr(embree.importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(ctypes.util, "find_library", {"embree4": path}.get)
    assert embree.load_library.__wrapped__()._name == path


def test_a_missing_library_is_said_so(monkeypatch):
    monkeypatch.setattr(embree.importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(ctypes.util, "find_library", lambda name: None)
    with pytest.raises(RenderError, match="run 'pip install embreex'"):
        embree.load_library.__wrapped__()


SPINNING = """
import time
from box_room import furnished_room
from renderer.core.embree import EmbreeScene
mesh = furnished_room().mesh
buffers = mesh.vertices, mesh.faces
with EmbreeScene(*buffers), EmbreeScene(*buffers, watertight=False), EmbreeScene(*buffers):
    began = time.process_time()
    time.sleep(0.5)
    print(time.process_time() - began)
"""


def test_open_scenes_leave_the_processor_alone():
    """Two devices of one thread each once kept a worker of the task scheduler spinning; in a process that has opened no other device."""
    process = subprocess.run([sys.executable, "-c", SPINNING], capture_output=True, text=True, check=True, env=os.environ | PATHS)
    assert float(process.stdout) < 0.1

"""Embree 4 through its C interface: the library, triangle scenes, and ray calls for numba kernels.

The only file that knows the library.  It is taken from the embreex wheel, or else from the system.  Kernels call the functions at the end
of this file with the packets of :mod:`renderer.core.ray_packet`.

Every scene is built by one thread: so the choice between two triangles at the same distance never depends on the number of processors.  It
does depend on the other triangles of the scene and on the maker of the processor, but where the scene is *steady*, for primary rays, or
portable, for all: a filter then takes the first face of those at one distance.
"""

import ctypes
import ctypes.util
import functools
import importlib.util
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import llvmlite.binding
import numpy as np
from numba import types
from numpy.typing import NDArray

from kernel_cache.processor import AVX512
from renderer.core.addresses import addresses_at, floats_at, words_at
from renderer.core.errors import RenderError
from renderer.core.exact_hits import FILTER, HALVES, OCCLUSION, IntersectArguments, first_of_equals_filter, settle
from renderer.core.kernel import inlined, kernel
from renderer.core.ray_packet import LANES, NEAREST, NG_X, PACKET_SIZE, PASS_PANES, TFAR

_COHERENT, _INVOKE_FILTER = 1 << 16, 1 << 1
_FEATURE_TRIANGLE, _FEATURE_FILTER = 1 << 1, 1 << 24
_SCENE_FLAG_ROBUST, _SCENE_FLAG_FILTER = 1 << 2, 1 << 3
_BUILD_QUALITY_MEDIUM, _BUILD_QUALITY_HIGH = 1, 2
_GEOMETRY_TYPE_TRIANGLE = 0
_BUFFER_TYPE_INDEX, _BUFFER_TYPE_VERTEX = 0, 1
_FORMAT_UINT3, _FORMAT_FLOAT3 = 0x5003, 0x9003
_ERRORS = ("none", "unknown error", "invalid argument", "invalid operation", "out of memory", "unsupported processor", "cancelled")

_pointer = ctypes.c_void_p
_SIGNATURES: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "rtcNewDevice": (_pointer, (ctypes.c_char_p,)),
    "rtcGetDeviceError": (ctypes.c_int, (_pointer,)),
    "rtcNewScene": (_pointer, (_pointer,)),
    "rtcSetSceneFlags": (None, (_pointer, ctypes.c_int)),
    "rtcSetSceneBuildQuality": (None, (_pointer, ctypes.c_int)),
    "rtcCommitScene": (None, (_pointer,)),
    "rtcReleaseScene": (None, (_pointer,)),
    "rtcNewGeometry": (_pointer, (_pointer, ctypes.c_int)),
    "rtcSetSharedGeometryBuffer": (
        None,
        (_pointer, ctypes.c_int, ctypes.c_uint, ctypes.c_int, _pointer, ctypes.c_size_t, ctypes.c_size_t, ctypes.c_size_t),
    ),
    "rtcSetGeometryMask": (None, (_pointer, ctypes.c_uint)),
    "rtcSetGeometryUserData": (None, (_pointer, _pointer)),
    "rtcCommitGeometry": (None, (_pointer,)),
    "rtcAttachGeometry": (ctypes.c_uint, (_pointer, _pointer)),
    "rtcReleaseGeometry": (None, (_pointer,)),
}


_RAY_CALLS = ("rtcIntersect16", "rtcOccluded16", "rtcIntersect8", "rtcOccluded8", "rtcIntersect1", "rtcOccluded1")


class SceneHandle(NamedTuple):
    """What kernels need of an :class:`EmbreeScene`: the scene's address and those of the arguments for coherent and incoherent rays.

    ``primary``: the arguments for :func:`renderer.path.ground_truth.trace_geometry`, those for coherent rays unless the scene is steady.
    Arguments are for :func:`intersect16` and :func:`occluded16`.
    """

    address: int
    coherent: int
    incoherent: int
    primary: int


def _library_path() -> str:
    spec = importlib.util.find_spec("embreex")
    if spec is not None and spec.origin is not None:
        wheel_libraries = Path(spec.origin).parents[1] / "embreex.libs"
        for path in sorted(wheel_libraries.glob("libembree4*.so*")):
            return str(path)
    system = ctypes.util.find_library("embree4")
    if system is None:
        raise RenderError("Embree: expected libembree4 in the embreex wheel or on the system, found neither; run 'pip install embreex'")
    return system


@functools.cache
def load_library() -> ctypes.CDLL:
    """Load Embree for this process and for numba's kernels.

    Raises:
        RenderError: there is no Embree 4 on this machine.
    """
    path = _library_path()
    try:
        # Not for all to see: other libraries, as the denoiser's, would take Embree's libtbb for theirs, and be held to its one thread.
        library = ctypes.CDLL(path, mode=ctypes.RTLD_LOCAL)
        for name, (result, arguments) in _SIGNATURES.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
        for name in _RAY_CALLS:
            llvmlite.binding.add_symbol(name, ctypes.cast(getattr(library, name), ctypes.c_void_p).value)
    except (OSError, RuntimeError, AttributeError) as error:
        raise RenderError(f"Embree: cannot use {path}: {error}") from error
    return library


@functools.cache
def _open_device(settings: str) -> int:
    """Return the process's one device with these settings.

    With two devices of one thread each, a worker of the library's task scheduler spins for as long as both are open.
    """
    device: int | None = load_library().rtcNewDevice(settings.encode())
    if not device:
        raise RenderError(f"Embree: no device with '{settings}': {_ERRORS[load_library().rtcGetDeviceError(None)]}")
    return device


class EmbreeScene:
    """One triangle mesh, ready for rays; a context manager that releases Embree's memory.

    The mesh's arrays are shared with Embree, not copied: they stay referenced here and must not change.  ``handle`` is what kernels take.
    """

    def __init__(
        self,
        vertices: NDArray[np.float32],
        faces: NDArray[np.uint32],
        *,
        panes: NDArray[np.bool_] | None = None,
        watertight: bool = True,
        portable: bool = False,
        steady: bool = False,
    ) -> None:
        """Build the scene of ``vertices`` (n, 3) in metres and ``faces`` (m, 3).

        ``panes`` (m,) tells which faces rays with the mask ``PASS_PANES`` do not meet; ``PRIM_ID`` is the row in ``faces`` for all.

        ``portable``: rays are traced as on a processor without AVX-512, so that all that have AVX2 compute the same; where they meet a
        triangle is computed anew, see :func:`intersect16`, and of several faces at one distance all rays meet the first.
        ``watertight``: no ray ever slips between two triangles that share an edge, which costs half as much time again.  Without it such
        rays are rare (none of 20 million in a furnished bedroom), too few to be seen in light; and as many more rays are traced for light
        than for geometry, the tree is built four times as long (27 ms for 21,000 triangles) to make them faster still.

        ``steady``: which of several faces at one distance a primary ray meets depends on their order only, not on what else is in the
        scene; this costs a fifth to a quarter more time.

        Raises:
            RenderError: the library is missing or reports a fault, or the mesh's arrays have wrong types.
        """
        self._library = load_library()
        self._vertices, self._indices = _embree_buffers(vertices, faces, panes)
        self._faces = np.ascontiguousarray(faces)
        halves = {"halves": int(portable or not AVX512), "faces": self._faces.ctypes.data, "vertices": self._vertices.ctypes.data}
        plain = [IntersectArguments(flags, _FEATURE_TRIANGLE, **halves) for flags in (_COHERENT, 0)]
        self._arguments = [*plain]
        if steady or portable:
            chosen = (_FEATURE_TRIANGLE | _FEATURE_FILTER, None, first_of_equals_filter().address)
            first = [IntersectArguments(flags | _INVOKE_FILTER, *chosen, **halves) for flags in (_COHERENT, 0)]
            self._arguments += first
        for arguments, for_occlusion in zip(self._arguments, 2 * plain, strict=False):
            arguments.occlusion = ctypes.addressof(for_occlusion)
        self._scene: int | None = None
        self._device = _open_device("threads=1" + (",isa=avx2" if portable else ""))
        try:
            self._build(watertight, steady or portable)
        except RenderError:
            self.close()
            raise
        addresses = [ctypes.addressof(arguments) for arguments in self._arguments]
        coherent, incoherent = addresses[2:] if portable else addresses[:2]
        self.handle = SceneHandle(self._scene or 0, coherent, incoherent, addresses[2] if steady else coherent)

    def _build(self, watertight: bool, filtered: bool) -> None:
        library = self._library
        self._scene = library.rtcNewScene(self._device)
        library.rtcSetSceneFlags(self._scene, (_SCENE_FLAG_ROBUST if watertight else 0) | (_SCENE_FLAG_FILTER if filtered else 0))
        library.rtcSetSceneBuildQuality(self._scene, _BUILD_QUALITY_MEDIUM if watertight else _BUILD_QUALITY_HIGH)
        vertices, face_count = self._vertices, 0
        for mask, faces in self._indices:
            face_count = len(faces)
            geometry = library.rtcNewGeometry(self._device, _GEOMETRY_TYPE_TRIANGLE)
            buffer = (_BUFFER_TYPE_VERTEX, 0, _FORMAT_FLOAT3, vertices.ctypes.data, 0, 12, len(vertices) - 1)
            library.rtcSetSharedGeometryBuffer(geometry, *buffer)
            library.rtcSetSharedGeometryBuffer(geometry, _BUFFER_TYPE_INDEX, 0, _FORMAT_UINT3, faces.ctypes.data, 0, 12, face_count)
            library.rtcSetGeometryMask(geometry, mask)
            library.rtcSetGeometryUserData(geometry, ctypes.addressof(self._arguments[0]))
            library.rtcCommitGeometry(geometry)
            library.rtcAttachGeometry(self._scene, geometry)
            library.rtcReleaseGeometry(geometry)
        library.rtcCommitScene(self._scene)
        code = library.rtcGetDeviceError(self._device)
        if code:
            raise RenderError(f"Embree: building a scene of {face_count} triangles failed: {_ERRORS[code]}")

    def close(self) -> None:
        """Release Embree's memory; harmless when repeated."""
        if self._scene:
            self._library.rtcReleaseScene(self._scene)
        self._scene = None

    def __enter__(self) -> "EmbreeScene":
        """Return the scene itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Release the scene."""
        self.close()


def _embree_buffers(
    vertices: NDArray[np.float32], faces: NDArray[np.uint32], panes: NDArray[np.bool_] | None
) -> tuple[NDArray[np.float32], list[tuple[int, NDArray[np.uint32]]]]:
    """Return vertices (n + 2, 3) and, for each geometry, its mask and its faces (m, 3), as Embree shares them.

    Where there are panes they are a geometry of their own.  Each geometry has all faces, so that ``PRIM_ID`` is the same; those of the
    other have their corners in vertex n, which is nowhere: Embree leaves triangles out of its tree whose corners are not finite.  The last
    vertex is the padding that its 16-byte reads need.
    """
    if vertices.dtype != np.float32 or faces.dtype != np.uint32:
        raise RenderError(f"Embree: expected float32 vertices and uint32 faces, got {vertices.dtype} and {faces.dtype}")
    padded = np.zeros((len(vertices) + 2, 3), np.float32)
    padded[:-2], padded[-2] = vertices, np.nan
    faces = np.ascontiguousarray(faces)
    if not len(faces):
        return padded, []
    if panes is None or not panes.any():
        return padded, [(int(PASS_PANES), faces)]
    nowhere = np.uint32(len(vertices))
    apart = [np.where((panes == chosen)[:, None], faces, nowhere) for chosen in (False, True)]
    return padded, [(int(PASS_PANES), apart[0]), (int(PASS_PANES) << 1, apart[1])]


_trace_packet = types.void(types.intp, types.intp, types.intp, types.intp)
_trace_ray = types.void(types.intp, types.intp, types.intp)
_intersect16 = types.ExternalFunction("rtcIntersect16", _trace_packet)
_occluded16 = types.ExternalFunction("rtcOccluded16", _trace_packet)
_intersect8 = types.ExternalFunction("rtcIntersect8", _trace_packet)
_occluded8 = types.ExternalFunction("rtcOccluded8", _trace_packet)
intersect1 = types.ExternalFunction("rtcIntersect1", _trace_ray)
occluded1 = types.ExternalFunction("rtcOccluded1", _trace_ray)
"""``(scene, ray, arguments)``: the nearest hit of one ray, ``RTCRayHit`` layout; whether it hits anything, ``RTCRay`` layout."""


@kernel
def intersect16(alive: int, scene: int, packet: int, arguments: int) -> None:
    """Find the nearest hit of the alive rays of a packet of :func:`make_packet`; all addresses.

    Without AVX-512 Embree takes 16 rays one by one, so each half of the packet is copied to the room behind it and traced as one of 8:
    2.7 times as many coherent rays a second, 1.5 times as many others.  Embree divides by estimates of reciprocals, which differ between
    makers of processors; so distances and places on triangles are then computed anew, by divisions that are the same everywhere.
    """
    filtered = addresses_at(np.int64(arguments))[FILTER] != 0
    if filtered:
        for k in range(LANES):
            floats_at(np.int64(packet))[NEAREST + k] = np.float32(np.inf)
    if words_at(np.int64(arguments))[HALVES] == 0:
        _intersect16(alive, scene, packet, arguments)
        if filtered:
            settle(alive, packet, arguments)
        return
    for half in range(2):
        if _copy_half(alive, packet, half, 21):
            _intersect8(_half_alive(alive, half), scene, _room(packet), arguments)
            _copy_back(packet, half, TFAR // LANES, TFAR // LANES + 1)
            _copy_back(packet, half, NG_X // LANES, 21)
    settle(alive, packet, arguments)


@kernel
def occluded16(alive: int, scene: int, packet: int, arguments: int) -> None:
    """Set TFAR to -inf for alive rays of a packet of :func:`make_packet` that hit anything; all addresses."""
    arguments = addresses_at(np.int64(arguments))[OCCLUSION]
    if words_at(np.int64(arguments))[HALVES] == 0:
        _occluded16(alive, scene, packet, arguments)
        return
    for half in range(2):
        if _copy_half(alive, packet, half, 12):
            _occluded8(_half_alive(alive, half), scene, _room(packet), arguments)
            _copy_back(packet, half, TFAR // LANES, TFAR // LANES + 1)


@inlined
def _room(packet: int) -> np.int64:
    return np.int64(packet) + 4 * (PACKET_SIZE + LANES)


@inlined
def _half_alive(alive: int, half: int) -> np.int64:
    return np.int64(alive) + 4 * (LANES // 2) * half


@inlined
def _copy_half(alive: int, packet: int, half: int, fields: int) -> bool:
    """Copy the first fields of half a packet to the room behind it; return whether any of its rays is alive."""
    lives, rays, room = words_at(_half_alive(alive, half)), words_at(np.int64(packet)), words_at(_room(packet))
    any_alive = 0
    for k in range(LANES // 2):
        any_alive |= lives[k]
    for field in range(fields if any_alive else 0):
        for k in range(LANES // 2):
            room[field * (LANES // 2) + k] = rays[field * LANES + half * (LANES // 2) + k]
    return any_alive != 0


@inlined
def _copy_back(packet: int, half: int, first: int, end: int) -> None:
    rays, room = words_at(np.int64(packet)), words_at(_room(packet))
    for field in range(first, end):
        for k in range(LANES // 2):
            rays[field * LANES + half * (LANES // 2) + k] = room[field * (LANES // 2) + k]

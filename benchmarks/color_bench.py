"""Colour by preset in a sampled bedroom: time, FLIP against many samples, bytes by threads; memory by image size; what threads bring.

python -m benchmarks.color_bench [--size WxH] [--reference-samples N]
python -m benchmarks.color_bench --noise ROOMS [--seed N] [--json FILE] [--beside FILE]
python -m benchmarks.color_bench --gathering ROOMS [--seed N] [--types TYPE ...] [--samples N]

FLIP is that of ``benchmarks/sampled_rooms.py``.  Times are of processor and of clock, on all threads.

The second form measures the path tracer's noise at equal time in so many unseen rooms of each type, of a seed from the clock unless it is
given: the variance of exact transport's samples times the time that one takes.  ``--beside`` compares with the figures that another version
of the renderer has written for the same rooms.

The third form renders such rooms with the preset ``balanced``, with and without final gathering, beside exact transport: mean light, and
error at equal time.  Of two pictures each half their squared difference is the variance of one, and what their mean is off the reference,
beyond the variances of both, the squared bias; all relative to the pixels' luminance.  The variance counts by the time of a picture.
"""

import argparse
import hashlib
import json
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from reference_scenes import bedroom

from benchmarks.sampled_rooms import TIMES, VIEW, SampledRoom, camera_of, mean_flip, preset_config, sample_room
from benchmarks.table import Row, at_least, at_most, render_table
from grammar import room_types
from grammar.synthesize import SceneSynthesizer
from renderer import CameraConfig, FlatScene, RenderConfig, Renderer, warm_up
from renderer.core.color import LUMINANCE
from renderer.core.embree import EmbreeScene, SceneHandle, intersect16
from renderer.core.ray_packet import DIR_X, GEOM_ID, INVALID_ID, LANES, ORG_X, PACKET_SIZE, TFAR, TNEAR, Packet, make_packet
from renderer.core.workers import Workers
from renderer.film.tone import Exposure, to_display
from scene_description import CameraPose, from_mapping
from scene_synth_ros.cli.commands.render_command import PRESETS, preset_settings

EXPOSURE = Exposure(8.0)
REFERENCE_DEPTH = 32
_LIMITS = {"realtime": (1.0, None), "stream": (1.0, None), "balanced": (6.0, 0.10), "photo": (60.0, 0.05)}
"""Preset -> most seconds of clock on two processors, and most FLIP; None is no measure."""
_MEMORY = (((640, 480), 1024.0), ((3840, 2160), 4096.0), ((7680, 4320), None))
"""Image size -> most MiB."""
_HASH_SIZE = (96, 64)
_ROUNDS, _PACKETS = 7, 40_000
_NOISE_SIZE, _NOISE_SAMPLES, _FLOOR = (160, 120), 48, 0.05
"""Of the pictures whose noise is measured; relative variance is of the luminance plus this share of the picture's mean."""


def measure(size: tuple[int, int] = (640, 480), reference_samples: int = 512) -> list[Row]:
    """Return the table: presets at a size against a reference of so many samples, then memory, then what a second thread brings."""
    flat, pose = bedroom()
    rows = []
    truth = _reference(flat, pose, size, reference_samples)
    for preset in PRESETS:
        settings = preset_settings(preset)
        with Renderer(flat, CameraConfig(width=size[0], height=size[1]), _config(settings), 1) as renderer:
            renderer.render(pose, 1, ("color",), exposure=EXPOSURE)
            cpu, wall = time.process_time(), time.perf_counter()
            frame = renderer.render(pose, 0, ("color",), exposure=EXPOSURE)
            cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
        picture = np.asarray(frame.layers["color"], np.uint8)
        most_s, most_flip = _LIMITS[preset]
        rows.append(at_most(f"{preset}, {size[0]}x{size[1]}, time", wall, "s", most_s))
        rows.append(Row(f"{preset}, {size[0]}x{size[1]}, time of processor", cpu, "s"))
        flip = mean_flip(truth, picture)
        name = f"{preset}, FLIP against {reference_samples} samples"
        rows.append(Row(name, flip, "") if most_flip is None else at_most(name, flip, "", most_flip))
        rows.append(at_most(f"{preset}, different bytes by threads and pieces", float(_kinds_of_bytes(flat, pose, settings) - 1), "", 0.0))
    for (width, height), limit in _MEMORY:
        name, used = f"peak memory at {width}x{height}", _peak_mib(width, height)
        rows.append(Row(name, used, "MiB") if limit is None else at_most(name, used, "MiB", limit))
    return rows + _scaling(flat, pose)


class Noise(NamedTuple):
    """Of one sample: variance of luminance relative to each pixel, and to the picture's mean squared, means over pixels; seconds."""

    relative: float
    absolute: float
    seconds: float


def noise(first: NDArray[np.float64], second: NDArray[np.float64], seconds: float) -> Noise:
    """Return the noise of two pictures, each (2, h, w), luminance and variance of a sample; ``seconds``: what one takes.

    A picture's variance is set beside the other's luminance: rare strokes of light brighten the very pixels whose variance they raise, and
    beside these would hardly count.
    """
    mean = 0.5 * float(first[0].mean() + second[0].mean())
    pairs = [(one[1] / (other[0] + _FLOOR * mean) ** 2).mean() for one, other in ((first, second), (second, first))]
    return Noise(float(np.mean(pairs)), float(0.5 * (first[1].mean() + second[1].mean()) / mean**2), seconds)


def _noise_of(room: SampledRoom) -> Noise:
    """Render two pictures of a room by exact transport, each with samples of its own."""
    config = preset_config("photo", samples_per_pixel=_NOISE_SAMPLES, denoise="none", threads=1)
    found = []
    with Renderer(room.flat, camera_of(_NOISE_SIZE), config, room.key) as renderer:
        renderer.prepare(room.path[VIEW])
        cpu = time.process_time()
        for index in range(2):
            layers = renderer.render(room.path[VIEW], index, ("radiance", "variance"), exposure=room.exposure).layers
            light, variance = (np.asarray(layers[name], np.float64) for name in ("radiance", "variance"))
            found.append(np.stack([light @ LUMINANCE, (_NOISE_SAMPLES - 1) * (variance @ LUMINANCE**2)]))
        cpu = time.process_time() - cpu
    return noise(*found, cpu / (2 * _NOISE_SAMPLES))


def measure_noise(rooms: int, seed: int) -> dict[str, Noise]:
    """Return the noise of ``rooms`` rooms of each type."""
    synthesizer = SceneSynthesizer.from_config()
    named = [(room_type, index) for index in range(rooms) for room_type in room_types()]
    sampled = (sample_room(synthesizer, room_type, index, TIMES, seed) for room_type, index in named)
    return {room.name: _noise_of(room) for room in sampled}


def noise_rows(found: dict[str, Noise], before: dict[str, Noise]) -> list[Row]:
    """Return the figures of each room, and variance at equal time over that of ``before``, if that has the same rooms."""
    rows = [Row(f"{name}, relative variance of a sample", one.relative, "") for name, one in found.items()]
    rows += [Row(f"{name}, time of a sample at 160x120", 1e3 * one.seconds, "ms") for name, one in found.items()]
    if before:
        ratios = [one.relative * one.seconds / (before[name].relative * before[name].seconds) for name, one in found.items()]
        rows += [Row(f"{name}, variance at equal time", ratio, "") for name, ratio in zip(found, ratios, strict=True)]
        rows.append(at_most("variance at equal time over that of before, median", float(np.median(ratios)), "", 0.25))
        rows.append(at_most("variance at equal time over that of before, worst", max(ratios), "", 0.7))
    return rows


class Errors(NamedTuple):
    """Of a preset's pictures: mean luminance over the reference's, relative variance and squared bias, seconds of a picture and before."""

    light: float
    variance: float
    squared_bias: float
    seconds: float
    preparing_s: float

    def at(self, seconds: float) -> float:
        """Return the error of a picture that takes so long."""
        return float(np.sqrt(self.squared_bias + self.variance * self.seconds / seconds))


def errors(pictures: list[NDArray[np.float64]], references: list[NDArray[np.float64]], seconds: float, preparing_s: float) -> Errors:
    """Return the errors of two pictures, (h, w) luminance, beside two references of their own samples each."""
    picture, truth = (0.5 * (pair[0] + pair[1]) for pair in (pictures, references))
    scale = truth + _FLOOR * truth.mean()
    variance, own = (float((0.5 * ((pair[0] - pair[1]) / scale) ** 2).mean()) for pair in (pictures, references))
    squared_bias = float((((picture - truth) / scale) ** 2).mean()) - 0.5 * (variance + own)
    return Errors(float(picture.mean() / truth.mean()), variance, max(squared_bias, 0.0), seconds, preparing_s)


def _pair(room: SampledRoom, config: RenderConfig) -> tuple[list[NDArray[np.float64]], float, float]:
    """Return the luminance of two pictures of a room, seconds of processor that one takes, and those before the first."""
    found, began = [], time.process_time()
    with Renderer(room.flat, camera_of(_NOISE_SIZE), config, room.key) as renderer:
        renderer.prepare(room.path[VIEW])
        ready = time.process_time()
        for index in range(2):
            light = renderer.render(room.path[VIEW], index, ("radiance",), exposure=room.exposure).layers["radiance"]
            found.append(np.asarray(light, np.float64) @ LUMINANCE)
    return found, 0.5 * (time.process_time() - ready), ready - began


def _report_gathering(rooms: int, seed: int, types: list[str], samples: int) -> None:
    warm_up(final_gathering=True, guiding=True)
    synthesizer, ratios, lights, rows = SceneSynthesizer.from_config(), [], [], []
    for room in (sample_room(synthesizer, room_type, index, TIMES, seed) for index in range(rooms) for room_type in types):
        references, _, _ = _pair(room, preset_config("photo", samples_per_pixel=samples // 2, denoise="none", threads=1))
        exact, gathered = (
            errors(pictures, references, seconds, preparing_s)
            for pictures, seconds, preparing_s in (
                _pair(room, preset_config("balanced", final_gathering=gathers, denoise="none", threads=1)) for gathers in (False, True)
            )
        )
        ratios.append(gathered.at(exact.seconds) / exact.at(exact.seconds))
        lights.append(gathered.light)
        rows += [Row(f"{room.name}, error at equal time over that without", ratios[-1], "")]
        rows += [Row(f"  mean light: without {exact.light:.3f}, with", gathered.light, "")]
        rows += [Row(f"  a picture: without {exact.seconds:.2f} s, before it {exact.preparing_s:.2f} s, with", gathered.seconds, "s")]
        rows += [Row("  before it", gathered.preparing_s, "s")]
        print(f"{room.name}: {ratios[-1]:.3f}; {exact} {gathered}", flush=True)
    rows += [
        at_most(f"median of {len(ratios)} rooms", float(np.median(ratios)), "", 0.5),
        Row("worst", max(ratios), ""),
        at_most("mean light off by, median", 100.0 * float(np.median(np.abs(np.array(lights) - 1.0))), "%", 1.0),
        Row("  most", 100.0 * float(np.abs(np.array(lights) - 1.0).max()), "%"),
    ]
    print(render_table(f"Final gathering, seed {seed}, references of {samples} samples", rows))


def _report_noise(rooms: int, seed: int, written: Path | None, beside: Path | None) -> None:
    before = json.loads(beside.read_text()) if beside else {"seed": seed, "rooms": {}}
    found = measure_noise(rooms, int(before["seed"]))
    if written:
        written.write_text(json.dumps({"seed": before["seed"], "rooms": found}, indent=1))
    rows = noise_rows(found, {name: Noise(*figures) for name, figures in before["rooms"].items()})
    print(render_table(f"Noise of the path tracer, seed {before['seed']}", rows))


def _scaling(flat: FlatScene, pose: CameraPose) -> list[Row]:
    """Return how much faster two threads are than one, for colour and for bare rays in all directions, turn by turn."""
    generator = np.random.default_rng(1)
    packets = np.zeros((_PACKETS, PACKET_SIZE), np.float32)
    ways = generator.normal(size=(_PACKETS, 3, LANES))
    low, high = flat.mesh.vertices.min(axis=0), flat.mesh.vertices.max(axis=0)
    origins = generator.uniform(0.7 * low + 0.3 * high, 0.3 * low + 0.7 * high, (_PACKETS, LANES, 3)).transpose(0, 2, 1)
    packets[:, ORG_X : ORG_X + 3 * LANES] = origins.reshape(_PACKETS, -1)
    packets[:, DIR_X : DIR_X + 3 * LANES] = (ways / np.linalg.norm(ways, axis=1, keepdims=True)).reshape(_PACKETS, -1)
    rounds = []
    with EmbreeScene(flat.mesh.vertices, flat.mesh.faces, watertight=False) as scene:
        camera, config = CameraConfig(width=320, height=240), RenderConfig(samples_per_pixel=2, denoise="none")
        with Renderer(flat, camera, replace(config, threads=1), 1) as one, Renderer(flat, camera, replace(config, threads=2), 1) as two:
            workers = [Workers(1), Workers(2)]

            def bare(threads: int) -> None:
                def cast(worker: int, first: int) -> None:
                    cast_scattered(scene.handle, packets, made[worker], first, threads)

                workers[threads - 1].run(cast, range(threads))

            made = [make_packet(), make_packet()]
            for _ in range(_ROUNDS):
                color = [_seconds(lambda r=r: r.render(pose, 0, ("radiance",))) for r in (one, two)]  # type: ignore[misc]
                rays = [_seconds(lambda t=t: bare(t)) for t in (1, 2)]  # type: ignore[misc]
                rounds.append((color[0] / color[1], rays[0] / rays[1]))
            for group in workers:
                group.close()
    ours, theirs = (float(value) for value in np.median(rounds[1:], axis=0))
    return [
        Row("two threads over one, bare rays in all directions", theirs, ""),
        Row("two threads over one, colour", ours, ""),
        at_least("scaling of colour over that of bare rays", ours / theirs, "", 1.0),
    ]


@njit(nogil=True)
def cast_scattered(scene: SceneHandle, packets: NDArray[np.float32], packet: Packet, first: int, step: int) -> None:
    """Cast every ``step``-th of the packets, and look at nothing."""
    for i in range(first, len(packets), step):
        packet.real[:] = packets[i]
        for k in range(LANES):
            packet.real[TNEAR + k], packet.real[TFAR + k] = np.float32(0.0), np.float32(np.inf)
            packet.integer[GEOM_ID + k], packet.alive[k] = INVALID_ID, -1
        intersect16(packet.alive.ctypes.data, scene.address, packet.real.ctypes.data, scene.incoherent)


def _seconds(act: Callable[[], object]) -> float:
    began = time.perf_counter()
    act()
    return time.perf_counter() - began


def _config(settings: dict[str, object], **changed: object) -> RenderConfig:
    return from_mapping(RenderConfig, settings | changed, "preset")


def _reference(flat: FlatScene, pose: CameraPose, size: tuple[int, int], samples: int) -> NDArray[np.uint8]:
    """Return the displayed picture of exact transport with many samples, not denoised."""
    config = RenderConfig(samples_per_pixel=samples, max_depth=REFERENCE_DEPTH, blur_textures=False)
    with Renderer(flat, CameraConfig(width=size[0], height=size[1]), config, 99) as renderer:
        radiance = renderer.render(pose, 0, ("color",), exposure=EXPOSURE).radiance
    if radiance is None:
        raise RuntimeError("render of the layer 'color' gave no radiance")
    return to_display(radiance, EXPOSURE, config.tone_curve)


def _kinds_of_bytes(flat: FlatScene, pose: CameraPose, settings: dict[str, object]) -> int:
    """Return how many different pictures come from one and two threads and three sizes of pieces, before denoising."""
    camera = CameraConfig(width=_HASH_SIZE[0], height=_HASH_SIZE[1])
    found = set()
    for threads, piece in ((1, 65536), (2, 65536), (2, 256), (1, 5000)):
        config = _config(settings, threads=threads, denoise="none", samples_per_pixel=min(int(str(settings["samples_per_pixel"])), 8))
        with Renderer(flat, camera, config, 1, paths_per_piece=piece) as renderer:
            radiance = renderer.render(pose, 0, ("color",), exposure=EXPOSURE).radiance
        found.add(hashlib.sha256(b"" if radiance is None else radiance.tobytes()).hexdigest())
    return len(found)


def _peak_mib(width: int, height: int) -> float:
    """Return the peak of resident memory of a process of its own that renders one sample of every layer."""
    command = [sys.executable, "-m", "benchmarks.color_bench", "--peak-of", str(width), str(height)]
    return float(json.loads(subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()[-1]))


def _print_peak(width: int, height: int) -> None:
    flat, pose = bedroom()
    config = RenderConfig(samples_per_pixel=1, max_depth=2, denoise="none")
    with Renderer(flat, CameraConfig(width=width, height=height), config, 1) as renderer:
        renderer.render(pose, 0, ("color", "depth", "range", "normals", "semantic", "instance", "albedo"), exposure=EXPOSURE)
    # Not ru_maxrss: after exec that still counts the process that this one was made from.
    high_water = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
    print(json.dumps(int(high_water.split()[1]) / 1024.0))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.color_bench")
    parser.add_argument("--size", default="640x480", metavar="WxH", help="image size of the presets (default: %(default)s)")
    parser.add_argument("--reference-samples", type=int, default=512, help="samples of the reference (default: %(default)s)")
    parser.add_argument("--peak-of", nargs=2, type=int, help=argparse.SUPPRESS)
    parser.add_argument("--noise", type=int, metavar="ROOMS", help="measure noise at equal time in so many rooms of each type instead")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="of those rooms (default: from the clock)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the noise of each room to this file")
    parser.add_argument("--beside", type=Path, metavar="FILE", help="compare with such a file; its seed and its rooms are taken")
    parser.add_argument("--gathering", type=int, metavar="ROOMS", help="measure final gathering in so many rooms of each type instead")
    parser.add_argument("--types", nargs="+", choices=room_types(), default=list(room_types()), help="of --gathering (default: all)")
    parser.add_argument("--samples", type=int, default=512, help="of the references of --gathering (default: %(default)s)")
    arguments = parser.parse_args()
    if arguments.gathering:
        _report_gathering(arguments.gathering, arguments.seed, arguments.types, arguments.samples)
        return
    if arguments.noise:
        _report_noise(arguments.noise, arguments.seed, arguments.json, arguments.beside)
        return
    if arguments.peak_of:
        _print_peak(*arguments.peak_of)
        return
    width, _, height = arguments.size.partition("x")
    print(render_table("Colour", measure((int(width), int(height)), arguments.reference_samples)))


if __name__ == "__main__":
    main()

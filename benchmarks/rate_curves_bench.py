"""How the rate of the cache's frames goes with their size and with the triangles of the room: a table and a picture.

python -m benchmarks.rate_curves_bench [--clock] [--write]

Frames have colour, depth, normals, semantic and instance ids; light is known.  Rates are those that one thread's time of processor allows,
which a busy machine does not change; ``--clock`` measures frames a second of all threads as well, for a machine that does nothing else.
Triangles are those of one room, cut into four where they are largest, so that it looks the same.
"""

import argparse
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.sampled_rooms import SampledRoom, camera_of, frame_times, preset_config, sample_room
from benchmarks.table import DOCS, Row, render_table, write_section
from grammar.drawing.shapes import Drawing, Shape, dot, line, to_svg, words
from grammar.synthesize import SceneSynthesizer
from renderer import FlatScene, Renderer, warm_up

SIZES = ((160, 120), (320, 240), (640, 480), (1280, 720))
TRIANGLES = (20_000, 50_000, 100_000, 200_000, 500_000)
ROOM_TYPES, SMALL_ROOM, SIZE = ("bedroom", "kitchen", "living_room"), "storage", (640, 480)
PICTURE = "camera_rate.svg"
_BY_THREAD, _BY_CLOCK = "#1f6fb4", "#c0392b"


class Point(NamedTuple):
    """One place of a curve: pixels or triangles, milliseconds of one thread's processor, frames/s by the clock (NaN: not measured)."""

    name: str
    at: float
    processor_ms: float
    clock_rate: float


def resolution_curve(clock: bool) -> list[Point]:
    """Return medians over three rooms, by size."""
    synthesizer = SceneSynthesizer.from_config()
    rooms = [sample_room(synthesizer, room_type, 0) for room_type in ROOM_TYPES]
    return [_point(f"{size[0]}x{size[1]}", float(size[0] * size[1]), rooms, size, clock) for size in SIZES]


def triangle_curve(clock: bool) -> list[Point]:
    """Return the points of one room at ``SIZE`` with more and more triangles."""
    room = sample_room(SceneSynthesizer.from_config(), SMALL_ROOM, 0)
    points = []
    for count in (0, *TRIANGLES):
        finer = room._replace(flat=subdivided(room.flat, count))
        faces = len(finer.flat.mesh.faces)
        points.append(_point(f"{faces / 1000:.0f}k", float(faces), [finer], SIZE, clock))
    return points


def subdivided(flat: FlatScene, count: int) -> FlatScene:
    """Return a scene with ``count`` triangles or up to two more: the largest are cut into four at the middles of their sides."""
    while (lacking := -(-(count - len(flat.mesh.faces)) // 3)) > 0:
        mesh, faces = flat.mesh, flat.mesh.faces.astype(np.int64)
        corners = mesh.vertices.astype(np.float64)[faces]
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        cut = np.sort(np.argsort(-area, kind="stable")[: min(lacking, len(faces))])
        middle = len(mesh.vertices) + np.arange(3 * len(cut)).reshape(-1, 3)  # of the sides 0-1, 1-2, 2-0
        ends = np.stack([faces[cut], np.roll(faces[cut], -1, axis=1)])
        vertices, normals, uvs = (
            np.concatenate([values, (0.5 * (values[ends[0]] + values[ends[1]])).reshape(-1, values.shape[1])]).astype(np.float32)
            for values in (mesh.vertices, mesh.normals, mesh.uvs)
        )
        normals[len(mesh.normals) :] /= np.maximum(np.linalg.norm(normals[len(mesh.normals) :], axis=1, keepdims=True), 1e-12)
        (a, b, c), (ab, bc, ca) = faces[cut].T, middle.T
        four = np.stack([np.stack(each, axis=1) for each in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))], axis=1)
        kept = np.delete(np.arange(len(faces)), cut)
        flat = flat._replace(
            mesh=mesh._replace(
                vertices=vertices, normals=normals, uvs=uvs, faces=np.concatenate([faces[kept], four.reshape(-1, 3)]).astype(np.uint32)
            ),
            face_part=np.concatenate([flat.face_part[kept], np.repeat(flat.face_part[cut], 4)]),
        )
    return flat


def _point(name: str, at: float, rooms: Sequence[SampledRoom], size: tuple[int, int], clock: bool) -> Point:
    processor_s = [_known(room, size, 1)[1] for room in rooms]
    clock_s = [_known(room, size, 0)[0] if clock else np.nan for room in rooms]
    point = Point(name, at, 1e3 * float(np.median(processor_s)), 1.0 / float(np.median(clock_s)))
    print(*point, flush=True)
    return point


def _known(room: SampledRoom, size: tuple[int, int], threads: int) -> tuple[float, float]:
    with Renderer(room.flat, camera_of(size), preset_config("stream", threads=threads), room.key) as renderer:
        frame_times(renderer, room)
        return frame_times(renderer, room)


def measure() -> list[Row]:
    """Return both curves as rows."""
    warm_up(integrator="cached")
    return rows_of(resolution_curve(False), triangle_curve(False))


def rows_of(*curves: Sequence[Point]) -> list[Row]:
    """Return curves as rows."""
    return [Row(f"{point.name}, one thread's processor", point.processor_ms, "ms") for curve in curves for point in curve]


def draw(curves: dict[str, list[Point]]) -> Drawing:
    """Return panels side by side, one a curve, both axes logarithmic."""
    left, top, width, height, panel = 60.0, 60.0, 330.0, 240.0, 450.0
    rates = [rate for curve in curves.values() for point in curve for rate in (1e3 / point.processor_ms, point.clock_rate)]
    low, high = 0.8 * float(np.nanmin(rates)), 1.25 * float(np.nanmax(rates))
    shapes: list[Shape] = []
    for number, (title, curve) in enumerate(curves.items()):
        x0, ends = left + panel * number, (0.85 * curve[0].at, 1.15 * curve[-1].at)

        def place(at: float, rate: float, x0: float = x0, ends: tuple[float, float] = ends) -> tuple[float, float]:
            return x0 + width * np.log(at / ends[0]) / np.log(ends[1] / ends[0]), top + height * (
                1 - np.log(rate / low) / np.log(high / low)
            )

        shapes.append(words((x0, 24.0), title, 15.0, anchor="start"))
        shapes.append(line([(x0, top), (x0, top + height), (x0 + width, top + height)], "#888888"))
        for rate in (1, 2, 5, 10, 15, 30, 60, 120, 240):
            if low <= rate <= high:
                y = place(ends[0], rate)[1]
                shapes += [line([(x0, y), (x0 + width, y)], "#e4e4e4", 0.8), words((x0 - 8.0, y), f"{rate}", 11.0, anchor="end")]
        for color, values in (
            (_BY_THREAD, [1e3 / point.processor_ms for point in curve]),
            (_BY_CLOCK, [point.clock_rate for point in curve]),
        ):
            points = [place(point.at, rate) for point, rate in zip(curve, values, strict=True) if np.isfinite(rate)]
            shapes += [line(points, color, 2.0), *(dot(point, 3.0, color) for point in points)] if points else []
        shapes += [words((place(point.at, low)[0], top + height + 16.0), point.name, 11.0) for point in curve]
    note = top + height + 40.0
    shapes.append(words((left, note), "frames/s that one thread's processor allows", 12.0, fill=_BY_THREAD, anchor="start"))
    if any(np.isfinite(point.clock_rate) for curve in curves.values() for point in curve):
        shapes.append(words((left + panel, note), "frames/s by the clock, all threads", 12.0, fill=_BY_CLOCK, anchor="start"))
    return Drawing(width=left + 2 * panel - 40.0, height=note + 20.0, shapes=tuple(shapes))


def _markdown(curves: dict[str, list[Point]]) -> str:
    lines = [
        f"![rate against size and triangles]({PICTURE})",
        "",
        "| | one thread's processor, ms | frames/s by it | frames/s by the clock |",
    ]
    lines.append("| --- | --- | --- | --- |")
    for title, curve in curves.items():
        for point in curve:
            clock = f"{point.clock_rate:.1f}" if np.isfinite(point.clock_rate) else "not measured"
            lines.append(f"| {title}: {point.name} | {point.processor_ms:.0f} | {1e3 / point.processor_ms:.1f} | {clock} |")
    return "\n".join(lines)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rate_curves_bench")
    parser.add_argument("--clock", action="store_true", help="measure frames a second by the clock too, on a quiet machine")
    parser.add_argument("--write", action="store_true", help=f"put the table into docs/cache.md and the picture into docs/{PICTURE}")
    arguments = parser.parse_args()
    warm_up(integrator="cached")
    by_size, by_triangles = resolution_curve(arguments.clock), triangle_curve(arguments.clock)
    curves = {"pixels, medians of three rooms": by_size, f"triangles, a {SMALL_ROOM} room at {SIZE[0]}x{SIZE[1]}": by_triangles}
    print(render_table("Rate", rows_of(*curves.values())))
    if arguments.write:
        (DOCS / PICTURE).write_text(to_svg(draw(curves)), encoding="utf-8")
        write_section(DOCS / "cache.md", "rate curves", _markdown(curves))


if __name__ == "__main__":
    main()

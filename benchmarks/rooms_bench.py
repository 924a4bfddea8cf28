"""Rooms as a person judges them: faults of use by room type, validity, time; and beside real rooms, measure by measure.

python -m benchmarks.rooms_bench [--rooms N] [--types TYPE ...] [--seed S] [--workers N] [--real LAYOUTS.jsonl] [--json FILE]
                                 [--sheets FOLDER [--views N]]
python -m benchmarks.rooms_bench --clutter [C ...] [--rooms N] [--types TYPE ...] [--seed S]

``--rooms`` are shared by the types.  ``--real`` adds a table of medians: ours, those of the file's rooms, and their ratio, and how much
room the file's rooms have behind their chairs.  What the file records in no room, as small things, rugs and plants, counts in neither.
``--sheets`` draws N views from above of each type, four to a sheet, each with its seed, index and the faults that were found.
``--clutter`` says instead what clutter does: how many objects rooms have, whether they stay valid, what is odd in them and what it costs,
of N rooms of each type, the same ones at each level.
"""

import argparse
import io
import json
import math
import multiprocessing
import sys
import time
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from benchmarks.room_measures import MEASURES, RoomMeasures, measure_room, only, real_rooms
from benchmarks.seeds import add_seed
from benchmarks.table import Row, at_most, render_table
from grammar import GrammarError, RequestError, SceneRequest, read_categories, room_types
from grammar.checks.faults import FAULTS, find_faults, scene_faults
from grammar.checks.furnished import Furnished, furnished
from grammar.checks.use_of_seats import SEATED_M, behind_chairs_m
from grammar.drawing.top_view import top_view
from grammar.learning import read_category_map
from grammar.synthesize import CameraTimes, SceneSynthesizer
from scene_description.share import config_path
from scene_synth_ros.cli.pictures.picture_grid import Tile, png_bytes, write_grid

COLUMNS, TILE = 2, (1000, 760)
TIMES = CameraTimes(frames=1, start_ns=0, rate_hz=1.0)


def write_sheets(folder: Path, types: Sequence[str], seed: int, views: int) -> Iterator[Path]:
    """Write ``<type>.png`` for each type with its rooms 0 to ``views`` - 1, and yield the paths."""
    folder.mkdir(parents=True, exist_ok=True)
    synthesizer = SceneSynthesizer.from_config()
    for name in types:
        tiles = [_tile(synthesizer, name, seed, index) for index in range(views)]
        path = folder / f"{name}.png"
        write_grid(tiles, COLUMNS, path)
        yield path


def _tile(synthesizer: SceneSynthesizer, room_type: str, seed: int, index: int) -> Tile:
    scene = synthesizer.synthesize(SceneRequest(room_type=room_type), seed, index, TIMES)
    found = scene_faults(scene, synthesizer.categories)
    told = "; ".join(f"{name} {','.join(map(str, ids))}" for name, ids in found.items()) or "no fault found"
    view = top_view(replace(scene, camera_path=scene.camera_path[:1]))
    return Tile(f"{room_type} {index}, seed {seed}: {told}", _fitted(png_bytes(view)))


def _fitted(png: bytes) -> NDArray[np.uint8]:
    """Return a picture on a white sheet of the size ``TILE``, shrunk where it is larger."""
    picture = Image.open(io.BytesIO(png)).convert("RGB")
    picture.thumbnail(TILE)
    sheet = Image.new("RGB", TILE, (255, 255, 255))
    sheet.paste(picture, (0, 0))
    return np.asarray(sheet)


SEED = 18
FAULT_SHARE = 0.01
P50_S, P99_S = 0.2, 1.5
NEAR = 0.15
CLUTTER = (0.0, 0.5, 1.0, 2.0, 3.0)
ROOMS, ROOMS_OF_A_LEVEL = 1000, 20
OURS = {"office": "study"}
"""Our room type -> the type of the real rooms that it is laid beside, where the names differ."""


class Judged(NamedTuple):
    """One room: index, faults by name, measures, processor seconds of its layout; ``failed``: the line of a room that was not to be had.

    ``recorded``: measures of what real rooms record.
    """

    room_type: str
    index: int
    faults: dict[str, list[int]]
    measures: RoomMeasures | None
    seconds: float
    valid: bool
    failed: str = ""
    recorded: RoomMeasures | None = None


def judge(room_type: str, seed: int, indices: Sequence[int], clutter: float = 1.0, recorded: Collection[str] = ()) -> list[Judged]:
    """Return rooms of a type, judged; room i depends on the seed, the type, the clutter and i only.

    ``recorded``: categories that real rooms record.
    """
    synthesizer, rooms = SceneSynthesizer.from_config(), []
    request = SceneRequest(room_type=room_type, clutter=clutter)
    synthesizer.layout(request, seed, 0)  # loads the kernels
    for index in indices:
        began = time.process_time()
        try:
            drawn = synthesizer.layout(request, seed, index)
        except (RequestError, GrammarError) as error:
            rooms.append(Judged(room_type, index, {}, None, time.process_time() - began, False, str(error)))
            continue
        seconds = time.process_time() - began
        found = furnished(room_type, drawn.room, drawn.objects, synthesizer.categories)
        alike = measure_room(only(found, recorded)) if recorded else None
        rooms.append(Judged(room_type, index, find_faults(found), measure_room(found), seconds, drawn.validity.valid, recorded=alike))
    return rooms


def judge_all(types: Sequence[str], count: int, seed: int = SEED, workers: int = 1, recorded: Collection[str] = ()) -> list[Judged]:
    """Return ``count`` rooms, as many of each type as of the others, give or take one."""
    jobs = [
        (name, seed, range(k, count // len(types) + (i < count % len(types)), workers), 1.0, recorded)
        for i, name in enumerate(types)
        for k in range(workers)
    ]
    with ProcessPoolExecutor(workers, multiprocessing.get_context("spawn")) as pool:
        return [room for part in pool.map(judge, *zip(*jobs, strict=True)) for room in part]


def fault_rows(rooms: Sequence[Judged]) -> list[Row]:
    """Return the shares of rooms with each fault, of rooms with any, and validity and time."""
    rows = []
    for fault in FAULTS:
        bad = [room for room in rooms if fault.name in room.faults]
        rows.append(at_most(f"{fault.name}: {fault.says}"[:61], len(bad) / len(rooms), "of rooms", FAULT_SHARE))
    seconds = [room.seconds for room in rooms]
    return [
        *rows,
        Row("rooms with any of these faults", sum(bool(room.faults) for room in rooms) / len(rooms), "of rooms"),
        at_most("rooms that were not to be had or not valid", float(sum(not room.valid for room in rooms)), "rooms", 0.0),
        Row("objects a room, median", float(np.median([room.measures.objects for room in rooms if room.measures])), ""),
        at_most("processor seconds of a layout, p50", float(np.median(seconds)), "s", P50_S),
        at_most("processor seconds of a layout, p99", float(np.quantile(seconds, 0.99)), "s", P99_S),
    ]


def type_table(rooms: Sequence[Judged]) -> str:
    """Return the faults by type as text: rooms with each fault of all rooms of the type, and where to see the first of them."""
    lines = ["Faults by type: rooms with the fault / rooms, and the first indices"]
    by_type: dict[str, list[Judged]] = defaultdict(list)
    for room in rooms:
        by_type[room.room_type].append(room)
    for name, found in by_type.items():
        seconds = [room.seconds for room in found]
        objects = float(np.median([room.measures.objects for room in found if room.measures] or [0.0]))
        faulty, failed = sum(bool(room.faults) for room in found), sum(bool(room.failed) for room in found)
        lines.append(
            f"  {name}: {len(found)} rooms, {faulty} with a fault, objects {objects:g}, "
            f"p50 {np.median(seconds):.3f} s, p99 {np.quantile(seconds, 0.99):.2f} s, not to be had {failed}"
        )
        for fault in FAULTS:
            bad = [room.index for room in found if fault.name in room.faults]
            if bad:
                lines.append(f"    {fault.name:<20}{len(bad):>4} {' '.join(map(str, bad[:8]))}")
    return "\n".join(lines)


def beside(ours: Sequence[RoomMeasures], real: Sequence[RoomMeasures]) -> list[dict[str, Any]]:
    """Return medians of each measure by type, ours and real, and their ratio; then the mean numbers of objects by category."""
    rows: list[dict[str, Any]] = []
    for name in dict.fromkeys(room.room_type for room in ours):
        mine = [room for room in ours if room.room_type == name]
        theirs = [room for room in real if room.room_type == OURS.get(name, name)]
        if theirs:
            for field in MEASURES:
                if field in ("base_units", "wall_units", "runs") and name != "kitchen":
                    continue
                rows.append(_compared(name, field, [getattr(room, field) for room in mine], [getattr(room, field) for room in theirs]))
            for category in sorted({key for room in (*mine, *theirs) for key in room.by_category}):
                numbers = [[room.by_category.get(category, 0) for room in rooms] for rooms in (mine, theirs)]
                rows.append(_compared(name, f"mean number: {category}", *numbers, mean=True))
    return rows


def _compared(room_type: str, name: str, ours: Sequence[float], real: Sequence[float], mean: bool = False) -> dict[str, Any]:
    reduce = np.mean if mean else np.median
    a, b = float(reduce(ours)), float(reduce(real))
    row = {
        "room_type": room_type,
        "measure": name,
        "ours": a,
        "real": b,
        "ratio": a / b if b else None,
        "ours_n": len(ours),
        "real_n": len(real),
    }
    return row | {"ours_mean": float(np.mean(ours)), "real_mean": float(np.mean(real))}


def beside_table(rows: Sequence[Mapping[str, Any]], categories: bool = False) -> str:
    """Return the comparison as text: medians, in brackets means."""
    lines = ["Beside real rooms: medians (means), ratio; * further off than 15 %"]
    for row in rows:
        counted = row["measure"].startswith("mean number")
        if counted and not categories:
            continue
        ratio = row["ratio"]
        star = "" if counted or (ratio is not None and abs(ratio - 1.0) <= NEAR) or row["ours"] == row["real"] else " *"
        what = MEASURES.get(row["measure"], row["measure"])
        text = (
            f"  {row['room_type']:<12}{what:<62}{row['ours']:>8.3g} ({row['ours_mean']:.2f})  {row['real']:>8.3g} ({row['real_mean']:.2f})"
        )
        lines.append(f"{text}  {'-' if ratio is None else f'{ratio:.2f}'}{star}")
    return "\n".join(lines)


def behind_chairs(rooms: Sequence[Furnished]) -> str:
    """Return how far from their tables things stand behind the chairs of rooms, and the share that counts as wedged, as a line of text."""
    found = [behind_m for room in rooms for behind_m in behind_chairs_m(room)] or [math.nan]
    shares = (0.05, 0.1, 0.25, 0.5)
    told = ", ".join(f"{value:.2f} m ({share:.0%})" for share, value in zip(shares, np.quantile(found, shares), strict=True))
    wedged = np.mean(np.array(found) <= SEATED_M)
    return f"Behind {len(found)} chairs, from the edge of the table: {told}; nearer than {SEATED_M:g} m: {wedged:.1%}"


def clutter_table(rooms_by_type: Sequence[tuple[str, Sequence[Sequence[Judged]]]], clutter: Sequence[float]) -> str:
    """Return the table as markdown, of each type with its rooms at each level of clutter."""
    lines = [f"| room type | {' | '.join(f'{level:g}' for level in clutter)} |", f"|---|{'---|' * len(clutter)}"]
    for name, levels in rooms_by_type:
        counts = [np.median([room.measures.objects for room in rooms if room.measures]) for rooms in levels]
        lines.append(f"| {name} | {' | '.join(f'{count:g}' for count in counts)} |")
    by_level = [[room for _, levels in rooms_by_type for room in levels[k]] for k in range(len(clutter))]
    rows = {
        "not valid, of all rooms": [f"{sum(not room.valid for room in rooms)} of {len(rooms)}" for rooms in by_level],
        "with a fault of use, share": [f"{np.mean([bool(room.faults) for room in rooms]):.2f}" for rooms in by_level],
        "processor seconds, p50": [f"{np.median([room.seconds for room in rooms]):.2f}" for rooms in by_level],
        "processor seconds, p99": [f"{np.quantile([room.seconds for room in rooms], 0.99):.2f}" for rooms in by_level],
    }
    lines.extend(f"| {name} | {' | '.join(values)} |" for name, values in rows.items())
    return "\n".join(lines) + "\n"


def measure(rooms: int = 120, workers: int = 1) -> list[Row]:
    """Judge rooms of all types."""
    return fault_rows(judge_all(room_types(), rooms, SEED, workers))


def main() -> None:
    """Judge, compare, draw, print and write."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rooms_bench")
    parser.add_argument("--types", nargs="+", choices=room_types(), default=room_types())
    add_seed(parser)
    for option, default in (("workers", 1), ("views", 4)):
        parser.add_argument(f"--{option}", type=int, default=default)
    parser.add_argument("--rooms", type=int, help=f"of all types (default: {ROOMS}); with --clutter of each ({ROOMS_OF_A_LEVEL})")
    parser.add_argument("--clutter", nargs="*", type=float, metavar="C", help=f"compare levels (default: {CLUTTER})")
    parser.add_argument("--real", type=Path, help="layout file of real rooms")
    parser.add_argument("--categories", action="store_true", help="with --real: print the numbers of objects by category too")
    parser.add_argument("--json", type=Path, help="write everything to this file")
    parser.add_argument("--sheets", type=Path, help="folder for the sheets of views from above")
    arguments = parser.parse_args()
    sys.stdout.write(f"seed {arguments.seed}\n")
    if arguments.clutter is not None:
        levels, indices = arguments.clutter or CLUTTER, range(arguments.rooms or ROOMS_OF_A_LEVEL)
        rooms_by_type = [(name, [judge(name, arguments.seed, indices, level) for level in levels]) for name in arguments.types]
        sys.stdout.write(clutter_table(rooms_by_type, levels))
        return
    document: dict[str, Any] = {"seed": arguments.seed}
    count = ROOMS if arguments.rooms is None else arguments.rooms
    if count:
        found: list[Furnished] = []
        if arguments.real:
            categories = read_categories(config_path("categories.yaml"))
            found = list(real_rooms(arguments.real, read_category_map(config_path("learning/category_map.yaml")), categories))
        recorded = {item.category for room in found for item in room.objects}
        rooms = judge_all(arguments.types, count, arguments.seed, arguments.workers, recorded)
        rows = fault_rows(rooms)
        sys.stdout.write(f"{render_table('Rooms', rows)}\n{type_table(rooms)}\n")
        names = ("measures", "recorded")
        judged = [room._asdict() | {name: (one := getattr(room, name)) and asdict(one) for name in names} for room in rooms]
        document |= {"rows": [row._asdict() for row in rows], "rooms": judged}
        if found:
            document["beside"] = beside([room.recorded for room in rooms if room.recorded], [measure_room(room) for room in found])
            sys.stdout.write(f"{beside_table(document['beside'], arguments.categories)}\n{behind_chairs(found)}\n")
    if arguments.json:
        arguments.json.write_text(json.dumps(document, indent=1))
    if arguments.sheets:
        for path in write_sheets(arguments.sheets, arguments.types, arguments.seed, arguments.views):
            sys.stdout.write(f"{path}\n")


if __name__ == "__main__":
    main()

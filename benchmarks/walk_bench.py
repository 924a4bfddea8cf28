"""Pictures of slow walks, cached beside path traced: how they flicker, and what algorithms make of them.

python -m benchmarks.walk_bench flicker|perception [--seed N] [--types TYPE ...] [--frames N] [--references DIR] [--samples N]
    [--preset NAME] [--write]

The seed of the rooms is drawn from the clock unless it is given.

*Flicker*: each frame is warped into the next by true depth and poses.  A pixel counts where what it shows is opaque and was seen in the
frame before, where all four pixels around the place that it comes from show the same part.  The difference is the mean over its channels,
in codes of 255; that of gloss and metal has in it how mirror images move otherwise than their surface, in both kinds of pictures.

*Perception*: Open3D's RGB-D odometry, and ORB features.  Depth is the true one for both, so that only colour differs.  Frames are paired
with the next and, for a longer way, with the fifth after it.  Odometry (Park, Zhou and Koltun, "Colored Point Cloud Registration
Revisited", 2017, in Open3D) begins at rest; its error is that of the relative pose.  ORB features (Rublee et al., "ORB: An Efficient
Alternative to SIFT or SURF", 2011, in OpenCV) are matched both ways by Hamming distance; a match is an inlier where it lies within 2
pixels of the place to which true depth and poses lead.  Needs the extra ``bench-perception``, which has wheels for Python up to 3.12.
"""

import argparse
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from benchmarks.sampled_rooms import SLOW, SMALL, References, SampledRoom, camera_of, preset_config, sample_room
from benchmarks.seeds import add_seed
from benchmarks.table import DOCS, Row, at_most, markdown_table, render_table, write_section
from grammar import room_types
from grammar.synthesize import SceneSynthesizer
from renderer import FlatScene, Renderer, warm_up
from renderer.camera.cameras import intrinsics
from scene_description import CameraPose
from scene_description.poses import world_from_optical

ROOM_TYPES, FRAMES, SAMPLES = ("bedroom", "kitchen", "living_room"), 30, 128
VISIBLE = 0
LEAST_ROUGHNESS, MOST_METALLIC = 0.5, 0.1
MORE_THAN_TRACED = {"matt": 1.0, "gloss": 0.0}
"""Codes by which cached frames may flicker more than path-traced ones."""
STEPS, FEATURES, INLIER_PX, FARTHEST_M = (1, 5), 1000, 2.0, 20.0
TRUTH = ("depth", "flow", "flow_backward", "occlusion", "occlusion_backward", "instance", "part", "material", "roughness", "metallic")
"""Layers that tell of the motion, and which pixels are matt."""


class Walk(NamedTuple):
    """Frames of one room.

    Attributes:
        room: with as many poses as there are frames.
        traced, cached: pictures, (h, w, 3) uint8 each, by the path tracer, denoised, and by the cache.
        truth: layers of ``TRUTH``.
    """

    room: SampledRoom
    traced: list[NDArray[np.uint8]]
    cached: list[NDArray[np.uint8]]
    truth: list[dict[str, NDArray[Any]]]


def walks(seed: int, types: tuple[str, ...], frames: int, preset: str, references: References) -> Iterator[Walk]:
    """Yield a walk of so many frames, 15 a second at 0.5 m/s, through the first room of each type."""
    synthesizer = SceneSynthesizer.from_config()
    for room_type in types:
        room = sample_room(synthesizer, room_type, 0, SLOW, seed)
        room = room._replace(path=room.path[:frames])
        cached, truth = [], []
        with Renderer(room.flat, camera_of(SMALL), preset_config(preset), room.key) as renderer:
            for index, pose in enumerate(room.path):
                frame = renderer.render(pose, index, ("color", *TRUTH), exposure=room.exposure, path=room.path)
                cached.append(np.array(frame.layers["color"]))
                truth.append({name: np.array(frame.layers[name]) for name in TRUTH})
        yield Walk(room, [references.view(room, index, SMALL).color for index in range(len(room.path))], cached, truth)


class Flicker(NamedTuple):
    """Of what is matt or glossy in one room: mean differences, codes of 255, and 99th percentiles; the share of pixels that count."""

    cached: float
    traced: float
    cached_p99: float
    traced_p99: float
    share: float


def measure_flicker(
    seed: int, types: Sequence[str] = ROOM_TYPES, frames: int = FRAMES, references: References | None = None, preset: str = "stream"
) -> list[Row]:
    """Return the rows of each room."""
    references, rows = references or References(None, SAMPLES), []
    warm_up(integrator="cached")
    for walk in walks(seed, tuple(types), frames, preset, references):
        for kind, found in flicker(walk).items():
            title, limit = f"{walk.room.name}, {kind}", round(found.traced + MORE_THAN_TRACED[kind], 2)
            rows += [
                at_most(f"{title}: cached, {frames} frames of {SMALL[0]}x{SMALL[1]}", found.cached, "codes", limit),
                Row("  99 % of it below", found.cached_p99, "codes"),
                Row(f"  path traced, {references.samples} samples, denoised", found.traced, "codes"),
                Row("  99 % of it below", found.traced_p99, "codes"),
                Row("  pixels that count", 100.0 * found.share, "%"),
            ]
        print(render_table("", rows[-10:]), flush=True)
    return rows


def flicker(walk: Walk) -> dict[str, Flicker]:
    """Return the flicker of a walk's frames, of what is matt and of gloss and metal."""
    differences: dict[tuple[str, int], list[NDArray[np.float64]]] = {}
    for index in range(1, len(walk.truth)):
        before, now = walk.truth[index - 1], walk.truth[index]
        opaque, matt, followed = is_opaque(walk.room.flat, now), is_matt(walk.room.flat, now), is_followed(before, now)
        for kind, counts in (("matt", matt & followed), ("gloss", opaque & ~matt & followed)):
            for source, pictures in enumerate((walk.cached, walk.traced)):
                found = warped_difference(pictures[index - 1], pictures[index], now["flow_backward"], counts)
                differences.setdefault((kind, source), []).append(found)
    pixels = (len(walk.truth) - 1) * walk.truth[0]["depth"].size
    figures = {}
    for kind in MORE_THAN_TRACED:
        cached, traced = (np.concatenate(differences[kind, source]) for source in (0, 1))
        if len(cached):
            p99 = (float(np.quantile(found, 0.99)) for found in (cached, traced))
            figures[kind] = Flicker(float(cached.mean()), float(traced.mean()), *p99, len(cached) / pixels)
    return figures


def is_opaque(flat: FlatScene, truth: dict[str, NDArray[Any]]) -> NDArray[np.bool_]:
    """Return the pixels (h, w) that see a surface which lets nothing through."""
    lets_nothing = np.append(False, flat.materials.transmission == 0.0)
    return np.asarray(np.isfinite(truth["depth"]) & lets_nothing[truth["material"]])


def is_matt(flat: FlatScene, truth: dict[str, NDArray[Any]]) -> NDArray[np.bool_]:
    """Return those whose surface is rough besides, no metal and has no coat."""
    plain = np.append(False, flat.materials.clearcoat == 0.0)
    rough = (truth["roughness"] >= LEAST_ROUGHNESS) & (truth["metallic"] <= MOST_METALLIC)
    return np.asarray(is_opaque(flat, truth) & rough & plain[truth["material"]])


def is_followed(before: dict[str, NDArray[Any]], now: dict[str, NDArray[Any]]) -> NDArray[np.bool_]:
    """Return the pixels (h, w) of a frame whose place in the frame before lies amid four pixels of the same part that it was seen by."""
    height, width = now["part"].shape
    place = _places(now["flow_backward"])
    seen = (now["occlusion_backward"] == VISIBLE) & np.isfinite(place).all(axis=0)
    row, column = (np.nan_to_num(axis, nan=-1.0) for axis in place)
    seen &= (row >= 0) & (column >= 0) & (row <= height - 1) & (column <= width - 1)
    for round_row in (np.floor, np.ceil):
        for round_column in (np.floor, np.ceil):
            at = (np.clip(round_row(row), 0, height - 1).astype(int), np.clip(round_column(column), 0, width - 1).astype(int))
            seen &= (before["part"][at] == now["part"]) & (before["instance"][at] == now["instance"])
    return seen


def warped_difference(
    before: NDArray[np.uint8], now: NDArray[np.uint8], flow_backward: NDArray[np.float32], counts: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return how far the pixels that count differ from those of the picture (h, w, 3) before, read bilinearly where flow (h, w, 2) leads.

    (n,), codes, the mean of the channels.
    """
    place = _places(flow_backward)[:, counts]
    warped = np.stack([map_coordinates(before[..., channel].astype(np.float64), place, order=1) for channel in range(3)], axis=-1)
    return np.asarray(np.abs(warped - now[counts]).mean(axis=-1))


def _places(flow: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return rows and columns (2, h, w) to which flow leads."""
    return np.indices(flow.shape[:2]) + np.moveaxis(flow.astype(np.float64), -1, 0)[::-1]


class Perceived(NamedTuple):
    """Of a walk's pairs: medians of the relative pose's error, mm and degrees, of inliers and of the share of matches that are inliers."""

    translation_mm: float
    rotation_deg: float
    lost: float
    inliers: float
    inlier_share: float


TITLES = ("odometry: translation, mm", "odometry: rotation, degrees", "odometry: pairs lost", "ORB: inliers", "ORB: inlier share")
"""Of the fields of ``Perceived``."""


def measure_perception(
    seed: int, types: Sequence[str] = ROOM_TYPES, frames: int = FRAMES, references: References | None = None, preset: str = "stream"
) -> list[tuple[str, int, Perceived, Perceived]]:
    """Return room, step between frames, and what is made of cached and of path-traced pictures."""
    references, found = references or References(None, SAMPLES), []
    warm_up(integrator="cached")
    for walk in walks(seed, tuple(types), frames, preset, references):
        for step in STEPS:
            found.append((walk.room.name, step, perceive(walk, walk.cached, step), perceive(walk, walk.traced, step)))
            print(*found[-1], flush=True)
    return found


def perceive(walk: Walk, pictures: Sequence[NDArray[np.uint8]], step: int) -> Perceived:
    """Return the medians over the pairs of frames that are ``step`` apart; a pair is lost where odometry says so itself."""
    errors, inliers, shares, lost = [], [], [], 0
    for first in range(len(pictures) - step):
        pair, depth = (first, first + step), [walk.truth[first + offset]["depth"] for offset in (0, step)]
        true = second_from_first(*(walk.room.path[index] for index in pair))
        estimate = odometry([pictures[index] for index in pair], depth)
        if estimate is None:
            lost += 1
        else:
            errors.append(pose_error(true, estimate))
        count, share = orb_inliers([pictures[index] for index in pair], depth[0], true)
        inliers.append(count)
        shares.append(share)
    translation, rotation = np.median(errors, axis=0) if errors else (np.nan, np.nan)
    return Perceived(1e3 * float(translation), float(rotation), lost, float(np.median(inliers)), float(np.median(shares)))


def second_from_first(first: CameraPose, second: CameraPose) -> NDArray[np.float64]:
    """Return the transform (4, 4) of points from the optical frame of one pose to that of another."""
    a, b = (world_from_optical(pose.position_m, pose.orientation) for pose in (first, second))
    return np.asarray(np.linalg.inv(b) @ a)


def pose_error(true: NDArray[np.float64], estimate: NDArray[np.float64]) -> tuple[float, float]:
    """Return how far a transform (4, 4) is from the true one: metres and degrees."""
    off = np.linalg.inv(true) @ estimate
    # The angle by both its sine and its cosine, as small ones vanish in the cosine.
    sine = 0.5 * np.linalg.norm([off[2, 1] - off[1, 2], off[0, 2] - off[2, 0], off[1, 0] - off[0, 1]])
    angle = np.arctan2(sine, 0.5 * (np.trace(off[:3, :3]) - 1.0))
    return float(np.linalg.norm(off[:3, 3])), float(np.degrees(angle))


def odometry(pictures: Sequence[NDArray[np.uint8]], depth: Sequence[NDArray[np.float32]]) -> NDArray[np.float64] | None:
    """Return Open3D's transform (4, 4) from the first of two frames to the second; None where it finds none."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # sums of several threads differ from run to run
    import open3d  # the options are read without it

    k, (width, height) = intrinsics(camera_of(SMALL)), SMALL
    camera = open3d.camera.PinholeCameraIntrinsic(width, height, k.fx, k.fy, k.cx, k.cy)
    first, second = (
        open3d.geometry.RGBDImage.create_from_color_and_depth(
            open3d.geometry.Image(np.ascontiguousarray(picture)),
            open3d.geometry.Image(np.ascontiguousarray(np.nan_to_num(metres, nan=0.0, posinf=0.0))),
            depth_scale=1.0,
            depth_trunc=FARTHEST_M,
        )
        for picture, metres in zip(pictures, depth, strict=True)
    )
    option = open3d.pipelines.odometry.OdometryOption(depth_max=FARTHEST_M)
    term = open3d.pipelines.odometry.RGBDOdometryJacobianFromHybridTerm()
    done, transform, _ = open3d.pipelines.odometry.compute_rgbd_odometry(first, second, camera, np.eye(4), term, option)
    return np.asarray(transform) if done else None


def orb_inliers(pictures: Sequence[NDArray[np.uint8]], depth: NDArray[np.float32], true: NDArray[np.float64]) -> tuple[int, float]:
    """Return how many ORB matches of two pictures are inliers, and which share of those where depth (h, w) of the first is known."""
    import cv2  # the options are read without it

    finder = cv2.ORB_create(FEATURES)
    (first, a), (second, b) = (finder.detectAndCompute(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), None) for picture in pictures)
    if a is None or b is None:
        return 0, 0.0
    matches = cv2.BFMatcher(cv2.NORM_HAMMING, crossCheck=True).match(a, b)
    here, there = (np.array([points[at].pt for at in which]).reshape(-1, 2) for points, which in (
        (first, [match.queryIdx for match in matches]), (second, [match.trainIdx for match in matches])
    ))  # fmt: skip
    error = np.linalg.norm(moved(here, depth, true) - there, axis=1)
    judged = np.isfinite(error)
    inliers = int((error[judged] <= INLIER_PX).sum())
    return inliers, inliers / max(int(judged.sum()), 1)


def moved(places: NDArray[np.float64], depth: NDArray[np.float32], true: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where places (n, 2) of one picture, pixel centres at integers, lie in another; NaN where ``depth`` (h, w) is not known."""
    k = intrinsics(camera_of((depth.shape[1], depth.shape[0])))
    column, row = np.rint(places).astype(int).T
    z = depth[row, column].astype(np.float64)
    z[~np.isfinite(z)] = np.nan
    points = np.column_stack([(places - (k.cx, k.cy)) / (k.fx, k.fy) * z[:, None], z]) @ true[:3, :3].T + true[:3, 3]
    return np.asarray(points[:, :2] / points[:, 2:] * (k.fx, k.fy) + (k.cx, k.cy))


def _markdown(found: Sequence[tuple[str, int, Perceived, Perceived]]) -> str:
    lines = ["| room, frames apart | " + " | ".join(TITLES) + " |", "|" + " --- |" * 6]
    for name, step, cached, traced in found:
        cells = [
            f"{a:.2g} ({b:.2g})" if isinstance(a, float) and a < 100 else f"{a:.0f} ({b:.0f})" for a, b in zip(cached, traced, strict=True)
        ]
        lines.append(f"| {name}, {step} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def rows_of(found: Sequence[tuple[str, int, Perceived, Perceived]]) -> list[Row]:
    """Return the figures as rows."""
    return [
        Row(f"{name}, {step} apart, {source}, {unit}", float(value), "")
        for name, step, *both in found
        for source, perceived in zip(("cached", "traced"), both, strict=True)
        for unit, value in zip(TITLES, perceived, strict=True)
    ]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.walk_bench")
    parser.add_argument("what", choices=("flicker", "perception"))
    add_seed(parser)
    parser.add_argument("--types", nargs="+", choices=room_types(), default=list(ROOM_TYPES), help="room types (default: three)")
    parser.add_argument("--frames", type=int, default=FRAMES, help="of each room (default: %(default)s)")
    parser.add_argument("--references", type=Path, metavar="DIR", help="path-traced pictures are kept here, rendered if missing")
    parser.add_argument("--samples", type=int, default=SAMPLES, help="of the path-traced pictures (default: %(default)s)")
    parser.add_argument("--preset", choices=("realtime", "stream"), default="stream", help="of the cached pictures (default: %(default)s)")
    parser.add_argument("--write", action="store_true", help="put the table into docs/cache.md")
    arguments = parser.parse_args()
    references, preset, frames = References(arguments.references, arguments.samples), arguments.preset, arguments.frames
    seed = arguments.seed
    print(f"seed {seed}", flush=True)
    if arguments.what == "flicker":
        rows = measure_flicker(seed, arguments.types, frames, references, preset)
        asked = "asked is what path-traced frames have, for matt surfaces plus 1"
        caption, markdown = f"Seed {seed}, `{preset}`; {asked}", markdown_table(rows)
    else:
        found = measure_perception(seed, arguments.types, frames, references, preset)
        rows, markdown = rows_of(found), _markdown(found)
        pictures = f"Seed {seed}, {frames} frames of {SMALL[0]}x{SMALL[1]}, `{preset}` beside {arguments.samples} denoised samples"
        caption = f"{pictures}; medians of pairs, {FEATURES} features a frame, inliers within {INLIER_PX:g} pixels of their true place"
    print(render_table(arguments.what.capitalize(), rows))
    if arguments.write:
        write_section(DOCS / "cache.md", arguments.what, f"{caption}:\n\n{markdown}")


if __name__ == "__main__":
    main()

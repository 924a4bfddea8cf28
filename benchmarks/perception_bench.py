"""What algorithms make of cached pictures beside path-traced ones of the same walk: Open3D's RGB-D odometry, and ORB features.

python -m benchmarks.perception_bench [--types TYPE ...] [--frames N] [--references DIR] [--samples N] [--preset NAME] [--write]

Depth is the true one for both, so that only colour differs.  Frames are paired with the next and, for a longer way, with the fifth after
it.  Odometry (Park, Zhou and Koltun, "Colored Point Cloud Registration Revisited", 2017, in Open3D) begins at rest; its error is that of
the relative pose.  ORB features (Rublee et al., "ORB: An Efficient Alternative to SIFT or SURF", 2011, in OpenCV) are matched both ways
by Hamming distance; a match is an inlier where it lies within 2 pixels of the place to which true depth and poses lead.  Needs the extra
``bench-perception``, which has wheels for Python up to 3.12.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.flicker_bench import FRAMES, SAMPLES, add_arguments
from benchmarks.sampled_rooms import ROOM_TYPES, SIZE, References, Walk, camera_of, walks
from benchmarks.table import DOCS, Row, render_table, write_section
from renderer import warm_up
from renderer.camera.cameras import intrinsics
from scene_description import CameraPose
from scene_description.poses import world_from_optical

STEPS, FEATURES, INLIER_PX, FARTHEST_M = (1, 5), 1000, 2.0, 20.0


class Perceived(NamedTuple):
    """Of a walk's pairs: medians of the relative pose's error, mm and degrees, of inliers and of the share of matches that are inliers."""

    translation_mm: float
    rotation_deg: float
    lost: float
    inliers: float
    inlier_share: float


TITLES = ("odometry: translation, mm", "odometry: rotation, degrees", "odometry: pairs lost", "ORB: inliers", "ORB: inlier share")
"""Of the fields of ``Perceived``."""


def measure(
    types: Sequence[str] = ROOM_TYPES, frames: int = FRAMES, references: References | None = None, preset: str = "stream"
) -> list[tuple[str, int, Perceived, Perceived]]:
    """Return room, step between frames, and what is made of cached and of path-traced pictures."""
    references, found = references or References(None, SAMPLES), []
    warm_up(integrator="cached")
    for walk in walks(tuple(types), frames, preset, references):
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

    k, (width, height) = intrinsics(camera_of(SIZE)), SIZE
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
    parser = argparse.ArgumentParser(prog="python -m benchmarks.perception_bench")
    add_arguments(parser)
    arguments = parser.parse_args()
    found = measure(arguments.types, arguments.frames, References(arguments.references, arguments.samples), arguments.preset)
    print(render_table("Perception", rows_of(found)))
    if arguments.write:
        pictures = f"{arguments.frames} frames of {SIZE[0]}x{SIZE[1]}, `{arguments.preset}` beside {arguments.samples} denoised samples"
        caption = f"{pictures}; medians of pairs, {FEATURES} features a frame, inliers within {INLIER_PX:g} pixels of their true place:\n\n"
        write_section(DOCS / "cache.md", "perception", caption + _markdown(found))


if __name__ == "__main__":
    main()

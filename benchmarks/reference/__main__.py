"""Our path tracer beside Mitsuba 3 on the same scenes: the same image within noise, time per sample, error at equal time.

python -m benchmarks.reference [--scenes NAME ...] [--passes N] [--samples N] [--threads N] [--pictures DIR] [--json FILE]

Needs the extra ``bench-reference``; see docs/reference.md for what is compared and how.
"""

import argparse
import json
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from reference_scenes import SCENES, View
from scipy import stats

from benchmarks.reference.mitsuba import Mitsuba, Rendered
from benchmarks.table import Row, at_most, render_table
from renderer import RenderConfig, Renderer
from renderer.core.color import LUMINANCE
from renderer.files.image_io import write_png
from renderer.film.tone import Exposure, to_display

SIZE = (240, 180)
BLOCK = 12
DEPTH = 6
SIGMAS = 3.0
_FLOOR = 0.01
"""Relative errors are of the luminance, plus this share of the picture's mean."""

Images = NDArray[np.float64]


class Compared(NamedTuple):
    """What the comparison of a scene found.

    mean_ratio: ours over Mitsuba's mean radiance, mean_sigmas: how far from 1 in standard errors; beyond: share of blocks that differ by
    more than ``SIGMAS`` standard errors, chance: the share that chance gives; time_ratio: seconds of processor per sample, ours over
    Mitsuba's; error_ratio: relative mean squared error at equal time, ours over Mitsuba's; ours_us, theirs_us: microseconds of processor
    per sample.
    """

    mean_ratio: float
    mean_sigmas: float
    beyond: float
    chance: float
    time_ratio: float
    error_ratio: float
    ours_us: float
    theirs_us: float


def compare(name: str, other: Mitsuba, passes: int, samples: int, threads: int, pictures: Path | None) -> Compared:
    """Render a scene ``passes`` times with ``samples`` a pixel by both, turn by turn, and compare; the first pass of each warms up."""
    view = SCENES[name]()
    other.load(view, *SIZE, DEPTH)
    config = RenderConfig(samples_per_pixel=samples, max_depth=DEPTH, threads=threads, blur_textures=False)
    ours, theirs = [], []
    with Renderer(view.flat, view.camera(*SIZE), config, 1) as renderer:
        for turn in range(passes + 1):
            ours.append(_timed(renderer, view, turn))
            theirs.append(other.render(samples, turn))
    a, b = (np.stack([item.image for item in items[1:]]).astype(np.float64) for items in (ours, theirs))
    if pictures is not None:
        write_pictures(pictures / f"{name.replace(' ', '_').lower()}.png", view, a, b)
    ratio, sigmas = mean_difference(a, b)
    beyond, chance = blocks_beyond(a, b)
    seconds = [float(np.median([item.cpu_s for item in items[1:]])) for items in (ours, theirs)]
    scale = 1e6 / (SIZE[0] * SIZE[1] * samples)
    floor = 0.5 * (a.mean(axis=0) + b.mean(axis=0))
    errors = [relative_error(images, floor) for images in (a, b)]
    time_ratio = seconds[0] / seconds[1]
    error_ratio = time_ratio * errors[0] / errors[1]
    return Compared(ratio, sigmas, beyond, chance, time_ratio, error_ratio, scale * seconds[0], scale * seconds[1])


def _timed(renderer: Renderer, view: View, turn: int) -> Rendered:
    cpu, wall = time.process_time(), time.perf_counter()
    image = renderer.render(view.pose, turn, ("radiance",)).radiance
    if image is None:
        raise RuntimeError("render of the layer 'radiance' gave no radiance")
    return Rendered(image, time.process_time() - cpu, time.perf_counter() - wall)


def mean_difference(a: Images, b: Images) -> tuple[float, float]:
    """Return the ratio of the mean luminances of passes (n, h, w, 3), and how many standard errors it is from 1."""
    first, second = (images.mean(axis=(1, 2)) @ LUMINANCE for images in (a, b))
    error = np.sqrt(first.var(ddof=1) / len(first) + second.var(ddof=1) / len(second))
    return float(first.mean() / second.mean()), float((first.mean() - second.mean()) / error)


def blocks_beyond(a: Images, b: Images) -> tuple[float, float]:
    """Return which share of blocks differs by more than ``SIGMAS`` standard errors, and the share that chance gives.

    Errors come from the passes, so a block's difference follows Student's distribution, with Welch's degrees of freedom.
    """
    sigmas, freedom = block_sigmas(a, b)
    return float((np.abs(sigmas) > SIGMAS).mean()), float(2.0 * stats.t.sf(SIGMAS, freedom).mean())


def block_sigmas(a: Images, b: Images) -> tuple[Images, Images]:
    """Return the blocks' differences in standard errors and their degrees of freedom, (h / BLOCK, w / BLOCK)."""
    n, h, w, _ = a.shape
    means, variances = [], []
    for images in (a, b):
        blocks = (images @ LUMINANCE).reshape(n, h // BLOCK, BLOCK, w // BLOCK, BLOCK).mean(axis=(2, 4))
        means.append(blocks.mean(axis=0))
        variances.append(blocks.var(axis=0, ddof=1) / n)
    both = np.maximum(variances[0] + variances[1], 1e-300)
    freedom = (n - 1) * both**2 / np.maximum(variances[0] ** 2 + variances[1] ** 2, 1e-300)
    return (means[0] - means[1]) / np.sqrt(both), np.maximum(freedom, 1.0)


def relative_error(images: Images, reference: Images) -> float:
    """Return the mean over the pixels of a pass's variance over the squared luminance."""
    light, true = images @ LUMINANCE, reference @ LUMINANCE
    return float((light.var(axis=0, ddof=1) / (true**2 + (_FLOOR * true.mean()) ** 2 + _FLOOR * true.mean() * true)).mean())


def write_pictures(path: Path, view: View, a: Images, b: Images) -> None:
    """Write ours, Mitsuba's and the blocks' difference, from blue (-4 standard errors) by grey to red (4), side by side."""
    sigmas = np.clip(block_sigmas(a, b)[0] / 4.0, -1.0, 1.0)
    colors = np.stack([np.minimum(1.0 + sigmas, 1.0), 1.0 - np.abs(sigmas), np.minimum(1.0 - sigmas, 1.0)], axis=-1)
    blocks = np.kron((220.0 * colors).astype(np.uint8), np.ones((BLOCK, BLOCK, 1), np.uint8))
    path.parent.mkdir(parents=True, exist_ok=True)
    pictures = [to_display(np.ascontiguousarray(images.mean(axis=0), np.float32), Exposure(view.ev100)) for images in (a, b)]
    write_png(path, np.concatenate([*pictures, blocks], axis=1))


def table(found: dict[str, Compared]) -> str:
    """Return the figures as a table in Markdown."""
    titles = ("scene", "mean, ours / Mitsuba", "standard errors", "blocks beyond 3 (by chance)", "us per sample, ours / Mitsuba")
    lines = ["| " + " | ".join((*titles, "error at equal time")) + " |", "|---|---|---|---|---|---|"]
    for name, row in found.items():
        lines.append(
            f"| {name} | {row.mean_ratio:.4f} | {row.mean_sigmas:+.1f} | {100 * row.beyond:.1f} % ({100 * row.chance:.1f} %) |"
            f" {row.ours_us:.2f} / {row.theirs_us:.2f} = {row.time_ratio:.2f} | {row.error_ratio:.2f} |"
        )
    return "\n".join(lines)


def summary(found: dict[str, Compared]) -> list[Row]:
    """Return the figures that are held to a measure."""
    worst = max(abs(row.mean_ratio - 1.0) for row in found.values())
    return [
        at_most("mean radiance, worst difference from Mitsuba's", 100.0 * worst, "%", 1.0),
        at_most("time per sample over Mitsuba's, median scene", float(np.median([row.time_ratio for row in found.values()])), "", 0.8),
        at_most("relative error at equal time, median scene", float(np.median([row.error_ratio for row in found.values()])), "", 1.0),
    ]


def main() -> None:
    """Compare all scenes, or those named."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.reference")
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--passes", type=int, default=24, help="independent images of each (default: %(default)s)")
    parser.add_argument("--samples", type=int, default=32, help="samples per pixel of one (default: %(default)s)")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--pictures", type=Path, metavar="DIR", help="write pictures side by side")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    arguments = parser.parse_args()
    found: dict[str, Compared] = {}
    with Mitsuba(arguments.threads) as other:
        print(f"Mitsuba {other.version}, {arguments.threads} threads, depth {DEPTH}, {SIZE[0]}x{SIZE[1]}", flush=True)
        for name in arguments.scenes:
            found[name] = compare(name, other, arguments.passes, arguments.samples, arguments.threads, arguments.pictures)
            print(name, found[name], flush=True)
    print(table(found))
    print(render_table("Path tracing against Mitsuba", summary(found)))
    if arguments.json:
        arguments.json.write_text(json.dumps({name: row._asdict() for name, row in found.items()}, indent=1))


if __name__ == "__main__":
    main()

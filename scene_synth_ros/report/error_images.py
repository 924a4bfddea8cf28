"""What differs between truth and estimate, pixel by pixel: one row of a table for each task that has images.

Estimates of another size are brought to that of the truth by taking the nearest pixel.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[Any]
Errors = NDArray[np.float32]

SEQUENTIAL = ((0.05, 0.03, 0.20), (0.36, 0.09, 0.43), (0.73, 0.22, 0.33), (0.96, 0.49, 0.16), (0.99, 0.92, 0.55))
"""Colours from no error to the largest, evenly spaced; lightness rises all the way."""
DIVERGING = ((0.10, 0.25, 0.60), (0.45, 0.68, 0.90), (0.96, 0.96, 0.94), (0.95, 0.60, 0.40), (0.62, 0.08, 0.14))
"""Colours from the most negative error over none to the most positive."""
UNKNOWN = (0.45, 0.45, 0.45)
"""Colour of pixels without truth or estimate."""
RIGHT_WRONG = ((0.13, 0.16, 0.22), (0.95, 0.35, 0.20))
SHARE_IN_SCALE = 0.9
"""Share of the errors that lies within a scale."""
MOST_CONFUSIONS = 3


class ErrorImage(NamedTuple):
    """A task's error in images.

    Attributes:
        layer: whose images truth and estimate are.
        of: truth, estimate -> error (height, width) float32, NaN where there is none.
        words: what the error is.
        unit: of it.
        stops: colours of its scale; two colours are right and wrong.
        read: pixels of either, as a bag has them -> as they are compared.
        match: truth, estimate -> estimate as it is shown, for estimates that are compared after a change.
    """

    layer: str
    of: Callable[[Pixels, Pixels], Errors]
    words: str
    unit: str
    stops: Sequence[tuple[float, float, float]]
    read: Callable[[Pixels], Pixels] = lambda pixels: pixels
    match: Callable[[Pixels, Pixels], Pixels] = lambda _truth, estimate: estimate


def same_size(truth: Pixels, estimate: Pixels) -> Pixels:
    """Return the estimate with the height and width of the truth, nearest pixels."""
    if truth.shape[:2] == estimate.shape[:2]:
        return estimate
    rows, columns = (
        ((np.arange(wanted) + 0.5) * got / wanted).astype(np.int64) for wanted, got in zip(truth.shape[:2], estimate.shape[:2], strict=True)
    )
    resized: Pixels = estimate[rows][:, columns]
    return resized


def metres(depth: Pixels) -> Errors:
    """Return distances in metres, NaN where there is none; whole numbers are millimetres with 0 for none."""
    values = depth.astype(np.float32) if depth.dtype.kind == "f" else depth.astype(np.float32) / np.float32(1000.0)
    return np.where(np.isfinite(values) & (values > 0.0), values, np.float32(np.nan))


def median_scaled(truth: Pixels, estimate: Pixels) -> Pixels:
    """Return an estimate of depth times the median of truth over estimate; both metres, NaN for none."""
    ratios = truth / estimate
    ratios = ratios[np.isfinite(ratios)]
    return estimate * np.float32(np.median(ratios)) if ratios.size else estimate


def angle_deg(truth: Pixels, estimate: Pixels) -> Errors:
    """Return the angle between two images of directions, degrees; NaN where one has none."""
    a, b = truth.astype(np.float64), estimate.astype(np.float64)
    lengths = np.linalg.norm(a, axis=2) * np.linalg.norm(b, axis=2)
    cosine = np.divide((a * b).sum(axis=2), lengths, out=np.full(lengths.shape, np.nan), where=lengths > 0.0)
    angles: Errors = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))).astype(np.float32)
    return angles


def end_point_px(truth: Pixels, estimate: Pixels) -> Errors:
    """Return the distance of two flows, pixels; NaN where one has none."""
    apart: Errors = np.linalg.norm(truth.astype(np.float32) - estimate.astype(np.float32), axis=2)
    return np.where(np.isfinite(apart), apart, np.float32(np.nan))


def wrong_class(truth: Pixels, estimate: Pixels) -> Errors:
    """Return 1 where two images of ids differ, 0 where they agree, NaN where the truth has none (0)."""
    return np.where(truth == 0, np.nan, truth != estimate).astype(np.float32)


def matched_objects(truth: Pixels, estimate: Pixels) -> Pixels:
    """Return an estimate's object ids as those of the true objects that each covers most of; others get ids that no true object has."""
    pairs, counts = np.unique(np.stack([estimate.ravel(), truth.ravel()]).astype(np.int64), axis=1, return_counts=True)
    names: dict[int, int] = {0: 0}
    taken = {0}
    free = int(truth.max(initial=0)) + 1
    for k in np.argsort(-counts, kind="stable"):
        guess, true = (int(value) for value in pairs[:, k])
        if guess not in names and true not in taken:
            names[guess] = true
            taken.add(true)
    for guess in np.unique(pairs[0]):
        if int(guess) not in names:
            names[int(guess)], free = free, free + 1
    ids = np.array(sorted(names), np.int64)
    return np.array([names[int(key)] for key in ids], np.int64)[np.searchsorted(ids, estimate)].astype(np.uint16)


def confusions(truth: Pixels, estimate: Pixels, names: Mapping[int, str]) -> str:
    """Return the classes that are most often taken for others, in words, with their share of the pixels that have a true class."""
    wrong = (truth != 0) & (truth != estimate)
    if not wrong.any():
        return ""
    pairs, counts = np.unique(np.stack([truth[wrong], estimate[wrong]]).astype(np.int64), axis=1, return_counts=True)
    most = np.argsort(-counts, kind="stable")[:MOST_CONFUSIONS]
    called = [[names.get(int(key), f"class {key}") if key else "none" for key in pairs[:, k]] for k in most]
    shares = 100.0 * counts[most] / np.count_nonzero(truth)
    return ", ".join(f"{true} taken for {guess} {share:.2g} %" for (true, guess), share in zip(called, shares, strict=True))


ERROR_IMAGES: dict[str, ErrorImage] = {
    "depth": ErrorImage("depth", lambda t, e: e - t, "estimate minus truth: blue is too near, red too far", "m", DIVERGING, metres),
    "depth_aligned": ErrorImage(
        "depth",
        lambda t, e: e - t,
        "estimate, scaled by the median, minus truth: blue is too near, red too far",
        "m",
        DIVERGING,
        metres,
        median_scaled,
    ),
    "normals": ErrorImage("normals", angle_deg, "angle between truth and estimate", "°", SEQUENTIAL),
    "semantic": ErrorImage("semantic", wrong_class, "", "", RIGHT_WRONG),
    "instance": ErrorImage("instance", wrong_class, "", "", RIGHT_WRONG, match=matched_objects),
    "flow": ErrorImage("flow", end_point_px, "distance between true and estimated motion to the next frame", "px", SEQUENTIAL),
    "flow_backward": ErrorImage(
        "flow_backward", end_point_px, "distance between true and estimated motion to the frame before", "px", SEQUENTIAL
    ),
}
"""Task -> its error; other tasks have no images."""


def scale_end(errors: Sequence[Errors]) -> float:
    """Return where a scale ends that holds most errors: 1, 2 or 5 times a power of ten; 1 where there are none."""
    sizes = np.concatenate([np.abs(error[np.isfinite(error)]) for error in errors]) if errors else np.empty(0)
    end = float(np.quantile(sizes, SHARE_IN_SCALE)) if sizes.size else 0.0
    if end <= 0.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(end))
    return float(next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= end * (1.0 - 1e-6)))


def error_picture(error: Errors, row: ErrorImage, end: float) -> NDArray[np.uint8]:
    """Return the colours of an error, (height, width, 3); ``end`` is where the scale ends."""
    known = np.isfinite(error)
    values = np.where(known, error, 0.0) / end
    low = -1.0 if row.stops is DIVERGING else 0.0
    place = np.clip((values - low) / (1.0 - low), 0.0, 1.0) * (len(row.stops) - 1)
    channels = [np.interp(place, np.arange(len(row.stops)), [stop[c] for stop in row.stops]) for c in range(3)]
    return np.rint(np.where(known[..., None], np.stack(channels, axis=-1), UNKNOWN) * 255.0).astype(np.uint8)


def legend(row: ErrorImage, end: float) -> dict[str, Any]:
    """Return the scale of a task's errors: its colours, the last where there is none, texts at its ends and its middle, what it shows."""
    colors = [[round(255.0 * part) for part in stop] for stop in (*row.stops, UNKNOWN)]
    if row.stops is RIGHT_WRONG:
        return {"colors": colors, "ticks": [], "words": "", "names": ["right", "wrong", "no truth"]}
    low = -end if row.stops is DIVERGING else 0.0
    texts = (low, 0.5 * (low + end), end)
    ticks = [f"{value:.3g}{row.unit if row.unit == '°' else f' {row.unit}'}" for value in texts]
    ticks = [f"{'≤ ' if low else ''}{ticks[0]}", ticks[1], f"≥ {ticks[2]}"]
    return {"colors": colors, "ticks": ticks, "words": row.words, "names": ["no truth or no estimate"]}

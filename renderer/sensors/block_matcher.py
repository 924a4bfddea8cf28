"""Disparity by block matching: census transforms, summed over a window, the best of all disparities, interpolated.

A pixel's census word says which of 24 neighbours, every second one of the 7 x 7 around it, are darker than it, beyond noise (R. Zabih and
J. Woodfill, "Non-parametric local transforms for computing visual correspondence", ECCV 1994).  Two words differ by the number of their
unlike bits, and these are summed over the window.  The best disparity of the left image counts if the second best, more than one pixel
off, is worse by a share, if the window has contrast beyond its noise, and if the right image, whose best disparity comes from the same
sums, agrees.  Two lines of opposite slope through the sums beside the best give parts of a pixel.  All sums are whole numbers, so any
split into rows gives the same.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import entry, kernel
from renderer.sensors.devices import Device
from renderer.sensors.virtual_images import noise_of_level

REACH = 3
"""Pixels from the middle of a census window to its edge."""
_NOISES = 2.0
"""By how many standard deviations of the noise a neighbour must be darker to count: flat places have no bits then."""
_MOST, _ONE = np.uint16(65535), np.uint32(1)


class MatchScratch(NamedTuple):
    """Memory of one thread for images ``width`` wide, ``d`` disparities and a window of ``w`` pixels.

    unlike: (w, d, width) uint8, bits of the window's rows, in turn; columns: (d, width) uint16, their sum over the rows; sums: (d, width)
    uint16, over the window; best, second: (width,) uint16; at: (width,) int32, the best disparity; right, right_at: the same of the right
    image.
    """

    unlike: NDArray[np.uint8]
    columns: NDArray[np.uint16]
    sums: NDArray[np.uint16]
    best: NDArray[np.uint16]
    second: NDArray[np.uint16]
    at: NDArray[np.int32]
    right: NDArray[np.uint16]
    right_at: NDArray[np.int32]


def make_match_scratch(width: int, device: Device) -> MatchScratch:
    """Return the memory that one thread needs."""
    window, count = int(device.window_px) | 1, max(int(device.disparities), 2)
    return MatchScratch(
        np.zeros((window, count, width), np.uint8),
        np.zeros((count, width), np.uint16),
        np.zeros((count, width), np.uint16),
        np.zeros(width, np.uint16),
        np.zeros(width, np.uint16),
        np.zeros(width, np.int32),
        np.zeros(width, np.uint16),
        np.zeros(width, np.int32),
    )


@entry
def census(image: NDArray[np.float32], device: Device, words: NDArray[np.uint32], first: int, step: int) -> None:
    """Fill rows of the census words (height, width) of an image."""
    height, width = image.shape
    for y in range(first, height, step):
        for x in range(width):
            words[y, x] = np.uint32(0)
        if y < REACH or y >= height - REACH:
            continue
        for x in range(REACH, width - REACH):
            limit, word = image[y, x] - _NOISES * noise_of_level(device, image[y, x]), np.uint32(0)
            for dy in range(-REACH, REACH + 1):
                for dx in range(-REACH, REACH + 1):
                    if (dx + dy) & 1 == 0 and (dx != 0 or dy != 0):
                        word = np.uint32(np.uint32(word << _ONE) | (_ONE if image[y + dy, x + dx] < limit else np.uint32(0)))
            words[y, x] = word


@kernel
def _bits(word: np.uint32) -> np.uint32:
    """Return how many bits are set."""
    x = np.uint32(word)
    x = np.uint32(x - np.uint32(np.uint32(x >> np.uint32(1)) & np.uint32(0x55555555)))
    x = np.uint32(np.uint32(x & np.uint32(0x33333333)) + np.uint32(np.uint32(x >> np.uint32(2)) & np.uint32(0x33333333)))
    x = np.uint32(np.uint32(x + np.uint32(x >> np.uint32(4))) & np.uint32(0x0F0F0F0F))
    x = np.uint32(x + np.uint32(x >> np.uint32(8)))
    return np.uint32(np.uint32(x + np.uint32(x >> np.uint32(16))) & np.uint32(0x3F))


@entry
def match_rows(
    left: NDArray[np.uint32],
    right: NDArray[np.uint32],
    image: NDArray[np.float32],
    device: Device,
    scratch: MatchScratch,
    result: NDArray[np.float32],
    begin: int,
    end: int,
) -> None:
    """Fill rows [begin, end) of the disparity (height, width) of the left image, pixels; NaN where there is none.

    ``left``, ``right``: census words; ``image``: the left image, for its contrast.
    """
    height, width = left.shape
    window = scratch.unlike.shape[0]
    half = window // 2
    scratch.columns[:, :] = np.uint16(0)
    scratch.unlike[:, :, :] = np.uint8(0)
    for y in range(begin - half, end + half):
        _take_row(left, right, scratch, y, y % window if y >= 0 else (y + window) % window)
        middle = y - half
        if middle < begin:
            continue
        if middle < REACH or middle >= height - REACH:
            for x in range(width):
                result[middle, x] = np.nan
            continue
        _sum_window(scratch, half)
        _find_best(scratch)
        for x in range(width):
            result[middle, x] = _accept(image, device, scratch, half, x, middle)


@kernel
def _take_row(left: NDArray[np.uint32], right: NDArray[np.uint32], scratch: MatchScratch, y: int, slot: int) -> None:
    """Put a row of unlike bits in the place of the oldest one."""
    height, width = left.shape
    for d in range(scratch.unlike.shape[1]):
        old, columns = scratch.unlike[slot, d], scratch.columns[d]
        if y < 0 or y >= height:
            for x in range(width):
                columns[x] = np.uint16(columns[x] - old[x])
                old[x] = np.uint8(0)
            continue
        # Slices, because LLVM vectorises loops whose indices cannot be negative.
        begin, end = d + REACH, max(width - REACH, d + REACH)
        a, b, kept, total = left[y, begin:end], right[y, REACH : end - d], old[begin:end], columns[begin:end]
        for i in range(len(a)):
            new = np.uint8(_bits(np.uint32(a[i] ^ b[i])))
            total[i] = np.uint16(total[i] + np.uint16(new) - kept[i])
            kept[i] = new


@kernel
def _sum_window(scratch: MatchScratch, half: int) -> None:
    """Sum over the window's columns; where the right image does not reach as far to the left, the sum is the greatest."""
    width = scratch.columns.shape[1]
    for d in range(scratch.columns.shape[0]):
        columns, sums = scratch.columns[d], scratch.sums[d]
        sums[:] = _MOST
        begin, end = d + REACH + half, width - REACH
        if end <= begin:
            continue
        total = sums[begin:end]
        total[:] = np.uint16(0)
        for off in range(-half, half + 1):
            some = columns[begin + off : min(end, width - off) + off]
            for i in range(len(some)):
                total[i] = np.uint16(total[i] + some[i])


@kernel
def _find_best(scratch: MatchScratch) -> None:
    """Find the best disparity of each pixel in both images, then the best that is more than one pixel off."""
    count, width = scratch.sums.shape
    best, second, at, right, right_at = scratch.best, scratch.second, scratch.at, scratch.right, scratch.right_at
    best[:], second[:], right[:] = _MOST, _MOST, _MOST
    at[:], right_at[:] = 0, 0
    for d in range(count):
        sums = scratch.sums[d]
        for x in range(width):
            better = sums[x] < best[x]
            best[x] = sums[x] if better else best[x]
            at[x] = np.int32(d) if better else at[x]
        moved = sums[min(d, width) :]
        for x in range(len(moved)):
            better = moved[x] < right[x]
            right[x] = moved[x] if better else right[x]
            right_at[x] = np.int32(d) if better else right_at[x]
    for d in range(count):
        sums = scratch.sums[d]
        for x in range(width):
            other = sums[x] if abs(at[x] - d) > 1 else _MOST
            second[x] = other if other < second[x] else second[x]


@kernel
def _accept(image: NDArray[np.float32], device: Device, scratch: MatchScratch, half: int, x: int, y: int) -> float:
    """Return the interpolated disparity of a pixel, or NaN."""
    count, d = scratch.sums.shape[0], scratch.at[x]
    best = float(scratch.best[x])
    if scratch.best[x] == _MOST or d <= 0 or d >= count - 1:
        return np.nan
    before, after = float(scratch.sums[d - 1, x]), float(scratch.sums[d + 1, x])
    if scratch.sums[d - 1, x] == _MOST or scratch.sums[d + 1, x] == _MOST:
        return np.nan
    if float(scratch.second[x]) < (1.0 + device.min_uniqueness) * best + 1.0:
        return np.nan
    if abs(scratch.right_at[x - d] - d) > device.max_mismatch_px:
        return np.nan
    low, high = image[y, x], image[y, x]
    for v in range(max(y - half, 0), min(y + half + 1, image.shape[0])):
        for u in range(x - half, min(x + half + 1, image.shape[1])):
            low, high = min(low, image[v, u]), max(high, image[v, u])
    if high - low < device.min_contrast * noise_of_level(device, low):
        return np.nan
    rise = max(before, after) - best
    part = 0.5 * (before - after) / rise if rise > 0.0 else 0.0
    disparity = d + part
    step = device.disparity_step_px
    return float(np.floor(disparity / step + 0.5) * step) if step > 0.0 else disparity

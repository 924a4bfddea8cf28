"""What a laser scanner reads in one sweep."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_description.types import CameraPose


class Scan(NamedTuple):
    """One sweep.

    number: from 0 in the room; stamp_ns: of the first beam; poses: of the scanner's frame (x forward, y left, z up) in the world, see
    ``scanner_poses``; ranges: (n,) float32, metres, +inf and -inf as REP 117 has them, what the scanner reads; ideal: (n,) float32, the
    distance to the first surface, glass and mirrors too; intensities: (n,) float32, remission, 1 for a white matt surface head-on, 0 for
    nothing.
    """

    number: int
    stamp_ns: int
    poses: tuple[CameraPose, ...]
    ranges: NDArray[np.float32]
    ideal: NDArray[np.float32]
    intensities: NDArray[np.float32]

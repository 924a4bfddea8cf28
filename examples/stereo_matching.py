"""Semi-global stereo matching of OpenCV, for ``scene_synth evaluate``: depth of the left camera of a stereo rig.

scene_synth evaluate BAG --camera left --task depth --algorithm examples/stereo_matching.py:SemiGlobal

``SemiGlobal`` is cv2.StereoSGBM (Hirschmueller, PAMI 2008, with the cost of Birchfield and Tomasi), ``Block`` cv2.StereoBM, which compares
windows alone.  Pixels without a match have no estimate: they lower the coverage.  Needs the extra ``examples``.
"""

import cv2
import numpy as np

DISPARITIES = 64


def depth_of(frame, matcher):
    """Return depth in metres, NaN where nothing matched."""
    left, right = (cv2.cvtColor(frame.images[f"{side}/color_sensed"], cv2.COLOR_RGB2GRAY) for side in ("left", "right"))
    focal_baseline_px_m = -frame.projections["right/color_sensed"][0, 3]
    disparity_px = matcher.compute(left, right) / 16.0
    with np.errstate(divide="ignore"):
        return np.where(disparity_px > 0.0, focal_baseline_px_m / disparity_px, np.nan).astype(np.float32)


class SemiGlobal:
    """Costs of pixels, summed along paths that prefer smooth surfaces."""

    inputs = ("left/color_sensed", "right/color_sensed")

    def __init__(self):
        """Set the matcher up as OpenCV's samples do: penalties by the size of the window."""
        window = 3
        self.matcher = cv2.StereoSGBM_create(
            numDisparities=DISPARITIES,
            blockSize=window,
            P1=8 * window**2,
            P2=32 * window**2,
            disp12MaxDiff=1,
            uniquenessRatio=10,
            speckleWindowSize=100,
            speckleRange=2,
        )

    def __call__(self, frame):
        """Return the depth of the left camera."""
        return {"depth": depth_of(frame, self.matcher)}


class Block(SemiGlobal):
    """Windows compared one by one, without a preference for smooth surfaces."""

    def __init__(self):
        """Set the matcher up with its defaults and a window that fits small images."""
        self.matcher = cv2.StereoBM_create(DISPARITIES, 15)

"""Visual odometry by ORB features, for ``scene_synth evaluate``: how light changes what is found and matched.

scene_synth evaluate BAG --task poses --algorithm examples/orb_odometry.py:Orb

Features (Rublee et al., ICCV 2011) of a frame are matched with those of the last frame whose pose was found, with the ratio test of Lowe
(IJCV 2004); the depth of the earlier ones makes points of them, and P3P within RANSAC the pose (Gao et al., PAMI 2003; Fischler and Bolles,
CACM 1981).  Depth is the true one, so that colour alone can fail.  A frame with too few matches that agree has no pose.  Needs the extra
``examples``.
"""

import cv2
import numpy as np

RATIO = 0.8
FEWEST_MATCHES = 12
REPROJECTION_PX = 2.0


class Orb:
    """Poses of one room, in the frame of its first view."""

    inputs = ("color_sensed", "depth")

    def __init__(self):
        """Begin a room."""
        cv2.setRNGSeed(0)
        self.detector = cv2.ORB_create(nfeatures=800)
        self.matcher = cv2.BFMatcher(cv2.NORM_HAMMING)
        self.reference = None

    def grey(self, color):
        """Return the image that features are looked for in."""
        return cv2.cvtColor(color, cv2.COLOR_RGB2GRAY)

    def __call__(self, frame):
        """Return the pose of the camera's optical frame in that of the first view."""
        points, descriptors = self.detector.detectAndCompute(self.grey(frame.images["color_sensed"]), None)
        pixels = np.array([point.pt for point in points], np.float32).reshape(-1, 2)
        pose = np.eye(4) if self.reference is None else self.track(pixels, descriptors, frame.K)
        if pose is None:
            return None
        columns, rows = np.rint(pixels).astype(int).T
        depth = frame.images["depth"][rows, columns]
        rays = np.column_stack([(pixels - frame.K[:2, 2]) / np.diag(frame.K)[:2], np.ones(len(pixels))])
        known = np.isfinite(depth)
        if known.any():
            self.reference = pose, (rays * depth[:, None])[known], descriptors[known]
        return {"poses": pose}

    def track(self, pixels, descriptors, intrinsics):
        """Return the pose by the matches with the reference; None if too few of them agree."""
        reference_pose, points_m, known = self.reference
        if descriptors is None:
            return None
        pairs = [pair for pair in self.matcher.knnMatch(descriptors, known, k=2) if len(pair) == 2]
        good = [best for best, second in pairs if best.distance < RATIO * second.distance]
        if len(good) < FEWEST_MATCHES:
            return None
        seen, there = pixels[[match.queryIdx for match in good]], points_m[[match.trainIdx for match in good]]
        found, turn, shift, agreeing = cv2.solvePnPRansac(
            there.astype(np.float64),
            seen.astype(np.float64),
            intrinsics,
            None,
            iterationsCount=500,
            reprojectionError=REPROJECTION_PX,
            confidence=0.999,
            flags=cv2.SOLVEPNP_AP3P,
        )
        if not found or agreeing is None or len(agreeing) < FEWEST_MATCHES:
            return None
        inner = agreeing.ravel()
        turn, shift = cv2.solvePnPRefineLM(there[inner].astype(np.float64), seen[inner].astype(np.float64), intrinsics, None, turn, shift)
        now_from_reference = np.eye(4)
        now_from_reference[:3, :3], now_from_reference[:3, 3] = cv2.Rodrigues(turn)[0], shift.ravel()
        return reference_pose @ np.linalg.inv(now_from_reference)


class Equalized(Orb):
    """The same after contrast-limited equalisation of the histogram (Zuiderveld, Graphics Gems IV, 1994)."""

    def grey(self, color):
        """Return the grey image with its contrast spread, tile by tile."""
        return cv2.createCLAHE(clipLimit=3.0, tileGridSize=(8, 8)).apply(super().grey(color))

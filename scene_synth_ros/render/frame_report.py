"""What the rendering thread tells of its frames: how many a second, whether at their rate, and where they are seen from."""

import threading
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from renderer import RenderConfig
from renderer.film.frame import Frame
from scene_description import CameraPose, SceneDescription
from scene_synth_ros.render.rate_watch import Finding, FrameTime, Quality, RateWatch, held_line, is_resizable, late_line
from scene_synth_ros.render.renderer_config import RendererNodeConfig
from scene_synth_ros.suite.parameters import Parameters
from scene_synth_ros.suite.rclpy_internals import Logger
from scene_synth_ros.suite.suite_node import SuiteNode

WINDOW_S = 5.0


class Rates(NamedTuple):
    """Frames, samples of colour, and rays a second over the last seconds; 0 where there were none."""

    frames: float
    samples: float
    rays: float


class Throughput:
    """Counts frames over a sliding window; no clocks.

    Threading: the rendering thread counts, the executor's thread asks; one lock guards the frames of the window.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._frames: deque[tuple[float, int, int]] = deque()

    def take(self, now_s: float, samples: int, rays: int) -> None:
        """Count a frame with so many samples of colour and rays, all pixels together."""
        with self._lock:
            self._frames.append((now_s, samples, rays))
            self._forget(now_s)

    def rates(self, now_s: float) -> Rates:
        """Return the rates of the window that ends now; a window begins with its first frame, which does not count."""
        with self._lock:
            self._forget(now_s)
            frames = list(self._frames)
        if len(frames) < 2:
            return Rates(0.0, 0.0, 0.0)
        seconds = max(now_s, frames[-1][0]) - frames[0][0]
        if seconds <= 0.0:
            return Rates(0.0, 0.0, 0.0)
        counted = frames[1:]
        samples, rays = (sum(frame[column] for frame in counted) / seconds for column in (1, 2))
        return Rates(len(counted) / seconds, samples, rays)

    def _forget(self, now_s: float) -> None:
        while self._frames and now_s - self._frames[0][0] > WINDOW_S:
            self._frames.popleft()


IN_THE_ROOM = "in the room"


class CameraPlace:
    """Follows where the camera stands.

    Threading: the rendering thread; ``now`` is replaced as a whole and may be read by any.

    Attributes:
        now: where the newest frame was seen from: :data:`IN_THE_ROOM`, or what ``renderer.standpoint`` says.
    """

    def __init__(self, logger: Logger) -> None:
        self.now = IN_THE_ROOM
        self._logger = logger
        self._told = False

    def begin_room(self) -> None:
        """Forget the room before."""
        self.now, self._told = IN_THE_ROOM, False

    def take(self, scene: SceneDescription, pose: CameraPose, standpoint: Callable[[CameraPose], str]) -> None:
        """Take a frame that was rendered at ``pose``, the lens's own; ``standpoint``: of the room at work."""
        place = standpoint(pose)
        self.now = place or IN_THE_ROOM
        if place and not self._told:
            self._told = True
            x, y, z = pose.position_m
            self._logger.warning(
                f"room {scene.index}: the camera at ({x:.2f}, {y:.2f}, {z:.2f}) m is {place}; frames show what is seen from there"
            )


class RateReport:
    """Follows the frames of one life of a renderer.

    Threading: :meth:`take` and the two times belong to the rendering thread; :meth:`now` may be asked by any: what it reads is replaced as
    a whole.

    Attributes:
        waiting_s: how long the newest frame has waited for recorders.
        publishing_s: how long publishing it took.
    """

    def __init__(self, node: SuiteNode, settings: Parameters) -> None:
        self._node, self._settings = node, settings
        self.waiting_s = self.publishing_s = 0.0
        self._watch, self._late_line = RateWatch(), ""

    def take(self, frame: Frame, seconds: float, period_s: float) -> None:
        """Take how long a frame took to render, with the publishing of the one before."""
        sampling_s = frame.sampling_s - frame.filling_s if frame.samples else 0.0  # looking up goes with the pixels alone
        times = FrameTime(seconds, sampling_s, frame.denoising_s, self.publishing_s, self.waiting_s, frame.filling_s)
        is_news = self._watch.take(frame.layers, period_s, times)
        finding, logger = self._watch.finding, self._node.get_logger()
        if finding is None:
            return
        if self._watch.late != finding.layers:
            self._late_line = ""
            if is_news:
                logger.info(held_line(finding))
            return
        camera = self._settings["camera"]
        render: RenderConfig = self._settings["render"]
        spacing_m = render.cache_spacing_m if render.integrator == "cached" else 0.0
        quality = Quality(frame.samples, frame.denoising_s > 0.0, camera.width, camera.height, spacing_m)
        self._late_line = late_line(finding, quality, is_resizable(camera))
        if is_news:
            logger.warning(self._late_line)

    def now(self) -> tuple[Finding | None, str]:
        """Return, in real time, how fast frames are, and the line that is said while their rate is not held; else None and nothing."""
        config: RendererNodeConfig = self._settings[""]
        return (self._watch.finding, self._late_line) if config.realtime else (None, "")

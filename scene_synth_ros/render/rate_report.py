"""Tells of a node's frames in real time: in its log when their rate is held no longer or again, and on ``/diagnostics`` meanwhile."""

from __future__ import annotations

from renderer import RenderConfig
from renderer.film.frame import Frame
from scene_synth_ros.render.rate_proposal import FrameTime, Quality, is_resizable
from scene_synth_ros.render.rate_watch import Finding, RateWatch, held_line, late_line
from scene_synth_ros.render.renderer_config import RendererNodeConfig
from scene_synth_ros.suite.parameters import Parameters
from scene_synth_ros.suite.suite_node import SuiteNode


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

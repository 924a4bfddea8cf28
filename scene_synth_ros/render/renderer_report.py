"""What a renderer says of itself on ``/diagnostics``."""

from __future__ import annotations

import time

from scene_synth_ros.render.camera_place import IN_THE_ROOM
from scene_synth_ros.render.camera_requests import CameraRequests
from scene_synth_ros.render.output import Output
from scene_synth_ros.render.rendering import Rendering
from scene_synth_ros.suite.diagnostics import ERROR, OK, WARN, Report

WARNING_S = 10.0
"""How long a warning is the node's state; it stays among the values."""


class RendererReport:
    """Collects a report once a second, in the executor's thread; it reads what the rendering thread replaces as a whole."""

    def __init__(self, output: Output, rendering: Rendering, requests: CameraRequests) -> None:
        self._output, self._rendering, self._requests = output, rendering, requests

    def collect(self, newest_warning: str, last_warning: str) -> Report:
        """Return level, message and values.

        Args:
            newest_warning: one of the last seconds, or nothing.
            last_warning: however old.
        """
        rendering, status = self._rendering, self._output.status
        rates = rendering.throughput.rates(time.monotonic())
        scene = rendering.scene
        rate, late_line = rendering.rate.now()
        shown = rendering.meter.known_exposure()
        values = {
            "state": status.state,
            "frames_rendered": self._output.frames,
            "frames_skipped": rendering.skipped,
            "scenes_refused": rendering.refused,
            "rooms_made_ahead": rendering.made_ahead,
            "room": scene.index if scene is not None else -1,
            "last_room": status.done_scene,
            "rate_wanted_hz": f"{rate.wanted_hz:g}" if rate else "",
            "rate_held_hz": f"{rate.held_hz:.2f}" if rate else "",
            "frames_per_second": f"{rates.frames:.2f}",
            "samples_per_second": f"{rates.samples:.3g}",
            "rays_per_second": f"{rates.rays:.3g}",
            "layers": ", ".join(sorted(self._output.wanted_layers())),
            "exposure_ev100": shown.ev100,
            "white_xy": "{:.3f} {:.3f}".format(*shown.white_xy),
            "camera_place": rendering.place.now,
            "driven": self._requests.driven,
            "last_complaint": last_warning,
        }
        if status.state == "failed" or newest_warning:
            return ERROR, status.reason if status.state == "failed" else newest_warning, values
        if not rendering.warm:
            return WARN, "compiling kernels", values
        if late_line:
            return WARN, late_line, values
        if rendering.place.now != IN_THE_ROOM:
            return WARN, f"the camera is {rendering.place.now}", values
        return OK, "rendering", values

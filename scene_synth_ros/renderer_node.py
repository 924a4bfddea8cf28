"""The node that renders the rooms it is sent and publishes the streams of one camera."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from rclpy.node import Node
from std_msgs.msg import String

from renderer import CameraConfig, RenderCancelled, RenderConfig, Renderer, RenderError, warm_up
from renderer.exposure import meter_ev100
from renderer.flat_scene import FlatScene
from renderer.flatten import FlattenError, flatten
from renderer.scene_key import scene_key
from scene_description import FieldError, Limits, SceneDescription, scene_from_json
from scene_synth_ros.diagnostics import ERROR, OK, WARN, Diagnostics, Report
from scene_synth_ros.parameters import Parameters
from scene_synth_ros.process import run_node
from scene_synth_ros.qos import latched_qos
from scene_synth_ros.status import NodeStatus, status_from_json, status_to_json
from scene_synth_ros.streams import StreamConfig, StreamPublishers


@dataclass(frozen=True, slots=True, kw_only=True)
class RendererNodeConfig:
    """How a renderer keeps pace and where its user's models are."""

    realtime: Annotated[
        bool, Limits(description="Publish frames at their rate by the wall clock and skip late ones, instead of as fast as can be")
    ] = False
    expected_recorders: Annotated[
        int,
        Limits(ge=0, le=100, description="Recorders whose subscriptions it waits for before it says ready", fixed="peers are counted once"),
    ] = 0
    frames_ahead: Annotated[
        int, Limits(ge=1, le=1000, description="Frames that may be published beyond what the slowest recorder has taken")
    ] = 8
    catalog_dir: Annotated[
        str, Limits(max_length=1000, description="Folder of the user's models; empty: none", fixed="files are read from one folder")
    ] = ""
    exit_when_done: Annotated[bool, Limits(description="End the process when the grammar node has finished")] = False


class RendererNode(Node):
    """Renders every room that arrives on ``scene`` along its camera path; rendering runs in a thread of its own.

    Subscribes: ``scene`` (std_msgs/String, latched, JSON ``scene_synth/1``), ``status`` of the grammar node and the recorders.
    Publishes: the topics of ``StreamPublishers``, ``status`` (latched), ``/diagnostics``.
    Parameters: the fields of ``RendererNodeConfig``; ``camera.`` CameraConfig; ``render.`` RenderConfig; ``streams.`` StreamConfig.  Live
    changes of the exposure take effect with the next frame, others with the next room.  A scene that does not fit is
    refused with one line; the node keeps running.
    """

    def __init__(self) -> None:
        super().__init__("renderer_node", automatically_declare_parameters_from_overrides=True)
        self.exit_code: int | None = None
        groups = {"": RendererNodeConfig, "camera": CameraConfig, "render": RenderConfig, "streams": StreamConfig}
        self._settings = Parameters(self, groups)
        catalog = self._settings[""].catalog_dir
        self._catalog_dir = Path(catalog) if catalog else None
        if self._catalog_dir is not None and not self._catalog_dir.is_dir():
            raise FileNotFoundError(f"renderer_node: catalog_dir: expected a folder, got '{catalog}'")
        self._streams = StreamPublishers(self, self._settings["streams"], self._settings["camera"])
        self._wake = threading.Condition()
        self._waiting: str | None = None
        self._closed = False
        self._recorders: dict[str, NodeStatus] = {}
        self._rendered = self._skipped = self._refused = 0
        self._seconds_per_frame, self._done_scene, self._refused_scene = 0.0, -1, -1
        self._metered_ev100: float | None = None
        self._warm, self._fault, self._complaint = False, "", ""
        self._status = self.create_publisher(String, "status", latched_qos(10))
        self._state = "starting"
        self._publish_status()
        self.create_subscription(String, "status", self._on_status, latched_qos(100))
        self.create_subscription(String, "scene", self._on_scene, latched_qos())
        self._diagnostics = Diagnostics(self, self._report)
        self.create_timer(0.05, self._tick)
        self._thread = threading.Thread(target=self._work, name="render", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop rendering; the kernel at work ends its pass."""
        with self._wake:
            self._closed = True
            self._wake.notify_all()
        self._thread.join(timeout=0.6)
        self._streams.wait_until_delivered(0.3)

    def _on_scene(self, message: String) -> None:
        with self._wake:
            self._waiting = message.data
            self._wake.notify_all()

    def _on_status(self, message: String) -> None:
        try:
            status = status_from_json(message.data)
        except FieldError as error:
            self._complain(f"ignored a status that does not fit: {error}")
            return
        if status.role == "recorder":
            with self._wake:
                self._recorders[status.node] = status
                self._wake.notify_all()
        elif status.role == "grammar" and status.state in ("finished", "failed") and self._settings[""].exit_when_done:
            self.exit_code = 0 if status.state == "finished" else 1

    def _tick(self) -> None:
        if self._fault:
            self._state = "failed"
            self._publish_status()
            self.exit_code = 1
        elif self._state == "starting" and self._warm and self._recorders_are_connected():
            self._state = "ready"
            self._publish_status()

    def _recorders_are_connected(self) -> bool:
        recorders = [status.counts for status in self._recorders.values()]
        if len(recorders) < self._settings[""].expected_recorders:
            return False
        return not self._streams.unmatched(recorders)

    def _work(self) -> None:
        try:
            began = time.perf_counter()
            self.get_logger().info("loading kernels (the first run compiles them)")
            warm_up()
            self.get_logger().info(f"kernels are ready ({time.perf_counter() - began:.1f} s)")
            self._warm = True
            while (text := self._next_scene()) is not None:
                self._render_text(text)
        except Exception as error:  # whatever it is, the run must hear of it rather than wait for ever
            self._fault = f"{type(error).__name__}: {error}"
            self.get_logger().fatal(f"rendering ended: {self._fault}")

    def _next_scene(self) -> str | None:
        with self._wake:
            self._wake.wait_for(lambda: self._closed or self._waiting is not None)
            text, self._waiting = self._waiting, None
            return None if self._closed else text

    def _interrupted(self) -> bool:
        return self._closed or self._waiting is not None

    def _render_text(self, text: str) -> None:
        try:
            scene = scene_from_json(text)
            flat = flatten(scene, self._catalog_dir)
            with Renderer(flat, self._settings["camera"], self._settings["render"], scene_key(scene)) as renderer:
                self._render_room(scene, flat, renderer)
        except RenderCancelled:
            return
        except FieldError as error:
            self._refuse(f"refused a scene: {error}")
        except (FlattenError, RenderError) as error:
            self._refused_scene = scene.index
            self._refuse(f"refused room {scene.index}: {error}")
            self._publish_status()

    def _refuse(self, text: str) -> None:
        self._refused += 1
        self._complain(text)

    def _render_room(self, scene: SceneDescription, flat: FlatScene, renderer: Renderer) -> None:
        self._streams.begin_room(scene)
        self._metered_ev100 = self._meter(scene, flat)
        began = time.perf_counter()
        start_ns = scene.camera_path[0].stamp_ns
        published = 0
        for index, pose in enumerate(scene.camera_path):
            if self._interrupted():
                return
            if self._is_too_late(scene, index, began):
                self._skipped += 1
                continue
            frame_began = time.perf_counter()
            frame = renderer.render(
                pose,
                index,
                self._streams.wanted_layers(),
                exposure_ev100=self._exposure_ev100(),
                cancelled=self._interrupted,
            )
            if self._settings[""].realtime:
                time.sleep(max(0.0, began + (pose.stamp_ns - start_ns) * 1e-9 - time.perf_counter()))
            self._wait_for_recorders()
            self._streams.publish(frame, pose)
            published += 1
            self._rendered += 1
            self._seconds_per_frame = time.perf_counter() - frame_began
            self.get_logger().info(f"room {scene.index}: frame {index + 1}/{len(scene.camera_path)}", throttle_duration_sec=2.0)
        self._done_scene = scene.index
        self._publish_status()
        self.get_logger().info(f"room {scene.index}: {published} frames rendered in {time.perf_counter() - began:.1f} s")

    def _meter(self, scene: SceneDescription, flat: FlatScene) -> float | None:
        if not self._settings["render"].auto_exposure or "color" not in self._streams.wanted_layers():
            return None
        return meter_ev100(flat, self._settings["camera"], self._settings["render"], scene_key(scene), scene.camera_path)

    def _exposure_ev100(self) -> float:
        render: RenderConfig = self._settings["render"]
        if self._metered_ev100 is None:
            return render.exposure_ev100
        return self._metered_ev100 - render.exposure_compensation_ev

    def _is_too_late(self, scene: SceneDescription, index: int, began: float) -> bool:
        """Return whether, in real time, the frame after this one is already due; the last frame of a room is never skipped."""
        if not self._settings[""].realtime or index + 1 == len(scene.camera_path):
            return False
        due_s = (scene.camera_path[index + 1].stamp_ns - scene.camera_path[0].stamp_ns) * 1e-9
        return time.perf_counter() - began > due_s

    def _wait_for_recorders(self) -> None:
        """Hold back while a recorder is more than ``frames_ahead`` frames behind, so that no queue overflows."""
        if self._settings[""].expected_recorders == 0:
            return
        topic = self.resolve_topic_name(f"{self._settings['streams'].camera}/pose")
        allowed = self._settings[""].frames_ahead

        def has_room() -> bool:
            taken = [status.counts.get(topic, 0) for status in self._recorders.values() if status.state == "ready"]
            return self._closed or not taken or self._streams.counts[topic] - min(taken) < allowed

        with self._wake:
            while not self._wake.wait_for(has_room, timeout=10.0):
                self._complain("a recorder has taken no frame for 10 s; waiting")

    def _publish_status(self) -> None:
        status = NodeStatus(
            node=self.get_fully_qualified_name(),
            role="renderer",
            state=self._state,
            done_scene=self._done_scene,
            refused_scene=self._refused_scene,
            reason=(self._fault or self._complaint)[:1000],
            counts=dict(self._streams.counts),
        )
        self._status.publish(String(data=status_to_json(status)))

    def _complain(self, text: str) -> None:
        self._complaint = text
        self.get_logger().error(text, throttle_duration_sec=1.0)

    def _report(self) -> Report:
        values = {
            "state": self._state,
            "frames_rendered": self._rendered,
            "frames_skipped": self._skipped,
            "scenes_refused": self._refused,
            "last_room": self._done_scene,
            "seconds_per_frame": f"{self._seconds_per_frame:.3f}",
            "layers": ", ".join(sorted(self._streams.wanted_layers())),
            "exposure_ev100": self._exposure_ev100(),
        }
        if self._fault or self._complaint:
            return ERROR, self._fault or self._complaint, values
        return (WARN, "compiling kernels", values) if not self._warm else (OK, "rendering", values)


def main(args: list[str] | None = None) -> None:
    """Run the renderer node."""
    run_node(RendererNode, args)


if __name__ == "__main__":
    main()

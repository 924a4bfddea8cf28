"""The services by which people steer a run."""

from __future__ import annotations

import time
from collections.abc import Callable

from rclpy.node import Node
from std_srvs.srv import Trigger

from scene_synth_ros.synthesize.run import Run
from scene_synth_ros.synthesize.run_config import RunConfig


class RunServices:
    """Serves ``~/next_room``, ``~/pause``, ``~/resume`` and ``~/reset`` (std_srvs/Trigger); every answer is given in the executor's thread.

    Args:
        node: whose services they are.
        run: which they steer.
        config: returns the run's present settings.
    """

    def __init__(self, node: Node, run: Run, config: Callable[[], RunConfig]) -> None:
        self._run, self._config = run, config
        for name, answer in (("next_room", self._next_room), ("pause", self._pause), ("resume", self._resume), ("reset", self._reset)):
            node.create_service(Trigger, f"~/{name}", answer)

    def _next_room(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return _done(response, f"room {self._run.next_index} goes out", after=self._run.ask_for_one())

    def _pause(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._run.pause(time.monotonic())
        return _done(response, f"paused before room {self._run.next_index}")

    def _resume(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._run.resume(time.monotonic())
        return _done(response, f"going on with room {self._run.next_index}")

    def _reset(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        config = self._config()
        again = f"the run begins again with room {config.first_index} of seed {config.seed}"
        return _done(response, again, after=self._run.ask_for_reset())


def _done(response: Trigger.Response, message: str, after: str = "") -> Trigger.Response:
    """Fill in that something was done, and what it waits for."""
    response.success, response.message = True, message + (f", after {after}" if after else "")
    return response

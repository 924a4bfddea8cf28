"""The room that is synthesised while the ones before it are rendered."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from typing import NamedTuple

from grammar import SceneRequest
from grammar.checks.metrics import SamplingCost
from grammar.synthesize import CameraTimes, SceneSynthesizer
from scene_description import SceneDescription, SceneSynthError, scene_to_json
from scene_synth_ros.suite.daemon_job import start_daemon_job
from scene_synth_ros.suite.faults import Faults
from scene_synth_ros.synthesize.room_schedule import moved_to


class Prepared(NamedTuple):
    """A room that is ready to go out.

    Its description, JSON, what its layout cost, how long it took (s), and the settings' generation that it was made for.
    """

    scene: SceneDescription
    text: str
    cost: SamplingCost
    seconds: float
    generation: int

    def starting_at(self, start_ns: int) -> Prepared:
        """Return the room with its first frame at another time."""
        scene = replace(self.scene, camera_path=moved_to(self.scene.camera_path, start_ns))
        return self._replace(scene=scene, text=scene_to_json(scene))


class RoomJob(NamedTuple):
    """Synthesises one room of a run with the settings of the moment when it was queued."""

    synthesizer: SceneSynthesizer
    request: SceneRequest
    seed: int
    index: int
    times: CameraTimes
    generation: int

    def __call__(self) -> Prepared:
        """Return the room with its JSON.

        Raises:
            SceneSynthError: it cannot be synthesised; one line.
        """
        began = time.perf_counter()
        scene, cost = self.synthesizer.synthesize_with_cost(self.request, self.seed, self.index, self.times)
        return Prepared(scene, scene_to_json(scene), cost, time.perf_counter() - began, self.generation)


class RoomAhead:
    """Synthesises one room ahead.

    Threading: every method is called in the executor's thread.  Jobs run in threads of their own, one after the other: when the node is
    configured again, its first room waits for the one that was at work, and kernels are never compiled twice at once.

    Args:
        faults: takes what a job that nobody waits for any more has raised.
        ended: called whenever a job has ended, in its thread.
    """

    def __init__(self, faults: Faults, ended: Callable[[], None]) -> None:
        self._faults, self._ended = faults, ended
        self._future: Future[Prepared] | None = None
        self._dropped: Future[Prepared] | None = None
        self.job: RoomJob | None = None
        """The job that was begun last."""

    @property
    def idle(self) -> bool:
        """Whether no room is prepared or being prepared."""
        return self._future is None

    def prepare(self, job: RoomJob) -> None:
        """Begin a job; call it while idle."""
        self.job, self._future = job, start_daemon_job("synthesis", job, after=self._dropped)
        self._future.add_done_callback(lambda _future: self._ended())

    @property
    def ready(self) -> Prepared | None:
        """The room that is prepared; None while there is none, and if it could not be synthesised."""
        done = self._future is not None and self._future.done()
        return self._future.result() if done and self._future.exception() is None else None

    def take(self) -> Prepared | None:
        """Return the room if it is ready; then the next may be prepared.

        Raises:
            SceneSynthError: it cannot be synthesised; one line.
            Exception: whatever else the job has raised, a fault of the program.
        """
        if self._future is None or not self._future.done():
            return None
        future, self._future = self._future, None
        return future.result()

    def drop(self) -> None:
        """Forget the room; a job at work ends by itself, and only a fault of it is told."""
        future, self._future = self._future, None
        if future is not None:
            self._dropped = future
            if not future.cancel():
                future.add_done_callback(self._tell_fault)

    def _tell_fault(self, future: Future[Prepared]) -> None:
        error = future.exception()
        if error is not None and not isinstance(error, (SceneSynthError, OSError)):
            self._faults.tell(error, "a room that is not wanted any more was synthesised")

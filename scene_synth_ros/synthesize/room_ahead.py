"""The room that is synthesised while the ones before it are rendered."""

import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, replace
from typing import NamedTuple

from grammar import SceneRequest
from grammar.checks.metrics import SamplingCost
from grammar.synthesize import CameraTimes, SceneSynthesizer
from scene_description import SceneDescription, scene_to_json
from scene_synth_ros.simulation.world import UNCHANGED, World
from scene_synth_ros.suite.daemon_job import JobAhead
from scene_synth_ros.suite.faults import Faults
from scene_synth_ros.synthesize.room_schedule import moved_to


class Prepared(NamedTuple):
    """A room that is ready to go out.

    Its description, JSON, what its layout cost, how long it took (s), the settings' generation that it was made for, and the room as it was
    sampled, before somebody changed it.
    """

    scene: SceneDescription
    text: str
    cost: SamplingCost
    seconds: float
    generation: int
    sampled: SceneDescription

    def starting_at(self, start_ns: int) -> "Prepared":
        """Return the room with its first frame at another time."""
        scene = replace(self.scene, camera_path=moved_to(self.scene.camera_path, start_ns))
        return self._replace(scene=scene, text=scene_to_json(scene))


@dataclass(frozen=True, slots=True)
class RoomJob:
    """Synthesises one room of a run with the settings of the moment when it was queued."""

    synthesizer: SceneSynthesizer
    request: SceneRequest
    seed: int
    index: int
    times: CameraTimes
    generation: int
    world: World = UNCHANGED

    def make(self) -> Prepared:
        """Return the room with its JSON.

        Raises:
            SceneSynthError: it cannot be synthesised; one line.
        """
        began = time.perf_counter()
        sampled, cost = self.synthesizer.synthesize_with_cost(self.request, self.seed, self.index, self.times)
        scene = self.world.scene(sampled, self.times, self.synthesizer)
        return Prepared(scene, scene_to_json(scene), cost, time.perf_counter() - began, self.generation, sampled)


class RoomAhead:
    """Synthesises one room ahead.

    Threading: every method is called in the executor's thread.  Jobs run in threads of their own, one after the other: when the node is
    configured again, its first room waits for the one that was at work, and kernels are never compiled twice at once.

    Args:
        ended: called whenever a job has ended, in its thread.
    """

    def __init__(self, faults: Faults, ended: Callable[[], None]) -> None:
        self._jobs: JobAhead[Prepared] = JobAhead("synthesis", "a room that is not wanted any more was synthesised", faults)
        self._ended = ended

    @property
    def idle(self) -> bool:
        """Whether no room is prepared or being prepared."""
        return self._jobs.job is None

    def prepare(self, job: RoomJob) -> None:
        """Begin a job; call it while idle."""
        self._job = job
        self._jobs.begin(job.make).add_done_callback(lambda _: self._ended())

    @property
    def ready(self) -> Prepared | None:
        """The room that is prepared; None while there is none, and if it could not be synthesised."""
        job = self._jobs.job
        return job.result() if job is not None and job.done() and job.exception() is None else None

    def is_useless(self, generation: int) -> bool:
        """Return whether a room is ready that is not for the settings of a generation, or could not be made."""
        job = self._jobs.job
        return job is not None and job.done() and (job.exception() is not None or job.result().generation != generation)

    def change(self, world: World, rules: SceneSynthesizer) -> None:
        """Let the room that is ready differ by something else.

        Raises:
            ChangeError: it cannot be so; it stays as it is.
        """
        ready = self.ready
        assert ready is not None
        scene = world.scene(ready.sampled, self._job.times, rules)
        changed: Future[Prepared] = Future()
        changed.set_result(ready._replace(scene=scene, text=scene_to_json(scene)))
        self._jobs.job = changed

    def take(self) -> tuple[RoomJob, Future[Prepared]] | None:
        """Return the job that has ended with what became of it, None if there is none; then the next may be prepared."""
        ended = self._jobs.take()
        return None if ended is None else (self._job, ended)

    def drop(self) -> None:
        """Forget the room; a job at work ends by itself, and only a fault of it is told."""
        self._jobs.drop()

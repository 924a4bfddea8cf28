"""The work of making one room, for the thread that synthesises."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import NamedTuple

from grammar import SceneRequest
from grammar.checks.metrics import SamplingCost
from grammar.synthesize import CameraTimes, SceneSynthesizer
from scene_description import SceneDescription, scene_to_json
from scene_synth_ros.synthesize.frame_times import moved_to


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

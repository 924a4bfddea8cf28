"""The rooms of a shard in order; where a processor is free, the next one is sampled while the one before is rendered."""

from __future__ import annotations

import os
from concurrent.futures import Future
from types import TracebackType

from grammar.synthesize import SceneSynthesizer
from scene_description import SceneDescription
from scene_synth_ros.offline.rules import sample_room
from scene_synth_ros.offline.settings import OfflineSettings
from scene_synth_ros.suite.daemon_job import start_daemon_job


class RoomsAhead:
    """Samples rooms; what is sampled does not depend on when.

    On one processor nothing is sampled ahead: it would take from the frames what it saves.

    Threads: one calls every method; a room is sampled ahead in a thread of its own.

    Args:
        rules: that rooms are sampled by.
        settings: of the run.
        indices: of the rooms.
    """

    def __init__(self, rules: SceneSynthesizer, settings: OfflineSettings, indices: range) -> None:
        self._rules, self._settings, self._indices = rules, settings, indices
        self._ahead: dict[int, Future[SceneDescription]] = {}
        self._has_processor = len(os.sched_getaffinity(0)) > 1

    def take(self, index: int) -> SceneDescription:
        """Return a room, and begin with the next one.

        Raises:
            SceneSynthError: it cannot be sampled; asked for again, it is sampled again.
        """
        ahead = self._ahead.pop(index, None)
        try:
            return ahead.result() if ahead is not None else self._sample(index)
        finally:
            if self._has_processor and index + 1 in self._indices and index + 1 not in self._ahead:
                self._ahead = {index + 1: start_daemon_job("next room", lambda: self._sample(index + 1))}

    def _sample(self, index: int) -> SceneDescription:
        return sample_room(self._rules, self._settings, index)

    def __enter__(self) -> RoomsAhead:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        for ahead in self._ahead.values():  # no thread goes on behind the back of who is done
            ahead.exception()
        self._ahead = {}

"""Where the bags, the sweeps and the estimates of an evaluation are."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from scene_synth_ros.report.evaluation_file import Evaluation, FrameRow
from scene_synth_ros.report.samples import RoomKey
from scene_synth_ros.report.sweep_file import Sweep, find_sweep, read_sweep

MOST_NAMED = 3


class Places:
    """The files beside an evaluation.

    Args:
        evaluation: whose bags they are.
        bag_root: what their paths are relative to, in place of the file's folder.
    """

    def __init__(self, evaluation: Evaluation, bag_root: Path | None) -> None:
        self._evaluation = evaluation
        self._root = bag_root if bag_root is not None else evaluation.path.parent
        self._notes: list[str] = []
        self._sweeps: dict[Path, Sweep] = {}
        self._sweep_of: dict[str, Sweep] = {}
        self._estimates: dict[str, Path | None] = {}
        bags = dict.fromkeys(frame.bag for frame in evaluation.frames)
        for bag in bags:
            self._sweep_of[bag] = self._find_sweep(self._root / bag)
        missing = [bag for bag in bags if not (self._root / bag).exists()]
        if missing:
            named = ", ".join(missing[:MOST_NAMED]) + (", ..." if len(missing) > MOST_NAMED else "")
            self._notes.append(f"{len(missing)} of {len(bags)} bags not found, so no pictures of them: {named}; give --bag-root DIR")

    def notes(self) -> list[str]:
        """Return lines for people about what is missing."""
        return self._notes

    def sweeps(self) -> Iterator[Sweep]:
        """Yield the sweeps that the bags belong to."""
        yield from self._sweeps.values()

    def bag(self, frame: FrameRow) -> Path:
        """Return the bag of a frame."""
        return self._root / frame.bag

    def room(self, frame: FrameRow) -> RoomKey:
        """Return the room of a frame, the same in every variant of a sweep."""
        base = self._sweep_of[frame.bag].bases.get(frame.variant or "")
        return base or (frame.room_type, frame.seed, frame.room)

    def command(self, frame: FrameRow) -> str | None:
        """Return the command that makes a frame's variant again, None for a bag of no sweep."""
        return self._sweep_of[frame.bag].commands.get(frame.variant or "")

    def estimates(self, frame: FrameRow) -> tuple[Path | None, str]:
        """Return the bag that has the estimate of a frame, None where none is known, and its topic, "" for that of the layer."""
        topic = self._evaluation.estimate_topics.get(frame.task, "")
        if self._evaluation.estimates is None:
            return (self.bag(frame) if topic else None), topic
        if frame.bag not in self._estimates:
            folder = self._evaluation.path.parent / self._evaluation.estimates
            choices = (folder / frame.bag, folder / (frame.variant or "."), folder / Path(frame.bag).name, folder)
            self._estimates[frame.bag] = next((path for path in choices if path.is_dir() and any(path.glob("*.mcap*"))), None)
            if self._estimates[frame.bag] is None:
                self._notes.append(f"{folder}: no bag of estimates for {frame.bag}")
        return self._estimates[frame.bag], topic

    def _find_sweep(self, bag: Path) -> Sweep:
        path = find_sweep(bag)
        if path is None:
            return Sweep()
        if path not in self._sweeps:
            self._sweeps[path], note = read_sweep(path)
            if note:
                self._notes.append(note)
        return self._sweeps[path]

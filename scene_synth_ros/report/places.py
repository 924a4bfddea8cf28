"""Where the bags, the sweeps and the estimates of an evaluation are."""

import contextlib
import dataclasses
import shlex
from collections.abc import Iterator
from pathlib import Path

from evaluation.evaluation_file import Evaluation, FrameKey
from scene_synth_ros.bags.bag_reader import BagReader, BagReadError
from scene_synth_ros.bags.run_info import RECORD_NAME
from scene_synth_ros.report.samples import RoomKey
from scene_synth_ros.report.sweep_file import MAX_TEXT, Sweep, read_sweep
from scene_synth_ros.sweep.sweep_json import find_sweep

MOST_NAMED = 3
NOT_KEPT = "the estimates were not kept: evaluate with --estimates-out"
_ESTIMATES = ("--estimates-out", "--estimates")
"""Options of the command of an evaluation that name the folder of the estimates."""


class Places:
    """The files beside an evaluation.

    Args:
        evaluation: whose bags they are.
        path: of its file.
        bag_root: what the bags' paths are relative to, in place of the file's folder.
        estimates: the bag of the estimates, or the folder with one for each variant; None: as the evaluation's command says.

    Attributes:
        no_estimate: why there is no estimate of any frame, in words; empty where there may be.
    """

    def __init__(self, evaluation: Evaluation, path: Path, bag_root: Path | None, estimates: Path | None) -> None:
        self._path = path
        self._root = bag_root if bag_root is not None else path.parent
        self._words = _words(evaluation.created_with)
        self.no_estimate = ""
        self._folder = estimates if estimates is not None else self._told_folder(path)
        self._notes: list[str] = []
        self._sweeps: dict[Path, Sweep] = {}
        self._estimates: dict[str, Path | None] = {}
        if self._folder is None and "--algorithm" in self._words:
            self.no_estimate = NOT_KEPT
        bags = list(dict.fromkeys(frame.key.bag for frame in evaluation.frames))
        self._sweep_of = {bag: self._find_sweep(self._root / bag) for bag in bags}
        missing = [bag for bag in bags if not (self._root / bag).exists()]
        if missing:
            named = ", ".join(missing[:MOST_NAMED]) + (", ..." if len(missing) > MOST_NAMED else "")
            self._notes.append(f"{len(missing)} of {len(bags)} bags not found, so no pictures of them: {named}; give --bag-root DIR")

    def notes(self) -> list[str]:
        """Return lines for people about what is missing."""
        return self._notes

    def with_bases(self, evaluation: Evaluation) -> Evaluation:
        """Return the evaluation with the factors that a variant leaves as they are named as such."""
        frames = []
        for frame in evaluation.frames:
            factors = self._sweep_of[frame.key.bag].factors_of(frame.key.variant or "", frame.key.factors)
            frames.append(dataclasses.replace(frame, key=dataclasses.replace(frame.key, factors=factors)))
        return dataclasses.replace(evaluation, frames=tuple(frames))

    def sweeps(self) -> Iterator[Sweep]:
        """Yield the sweeps that the bags belong to."""
        yield from self._sweeps.values()

    def bag(self, frame: FrameKey) -> Path:
        """Return the bag of a frame."""
        return self._root / frame.bag

    def room(self, frame: FrameKey) -> RoomKey:
        """Return the room of a frame, the same in every variant of a sweep."""
        base = self._sweep_of[frame.bag].bases.get(frame.variant or "")
        return base or (frame.room_type, frame.seed, frame.room)

    def command(self, frame: FrameKey) -> str | None:
        """Return the command that makes a frame's variant again, None for a bag of no sweep."""
        return self._sweep_of[frame.bag].commands.get(frame.variant or "")

    def version(self) -> str:
        """Return the version of the program that made the first bag that is there, empty where none says it."""
        for bag in self._sweep_of:
            with contextlib.suppress(BagReadError, OSError), BagReader(self._root / bag) as reader:
                return reader.summary.records.get(RECORD_NAME, {}).get("version.scene_synth_ros", "")[:MAX_TEXT]
        return ""

    def camera(self) -> str:
        """Return the name of the camera that was judged, empty where the evaluation does not say."""
        return (self._words.get("--camera") or [""])[0]

    def topic(self, task: str, layer: str) -> str:
        """Return the topic of a task's estimates that the evaluation was told, empty for none."""
        chosen = dict(word.split(":=", 1) for word in self._words.get("--topic", ()) if ":=" in word)
        return chosen.get(task, chosen.get(layer, ""))

    def estimates(self, frame: FrameKey) -> Path | None:
        """Return the bag that has the estimate of a frame, None for none; where no folder or algorithm was named, the frame's own bag."""
        if self.no_estimate:
            note = f"{self._path}: {self.no_estimate}"
            self._notes += [note] if note not in self._notes else []
            return None
        if self._folder is None:
            return self.bag(frame)
        if frame.bag not in self._estimates:
            folder, variant = self._folder, frame.variant or "."
            choices = (folder / "variants" / variant, folder / variant, folder / frame.bag, folder / Path(frame.bag).name, folder)
            self._estimates[frame.bag] = next((path for path in choices if path.is_dir() and any(path.glob("*.mcap*"))), None)
            if self._estimates[frame.bag] is None:
                self._notes.append(f"{folder}: no bag of estimates for {frame.bag}; give --estimates DIR")
        return self._estimates[frame.bag]

    def _told_folder(self, path: Path) -> Path | None:
        """Return the folder of estimates that the command of the evaluation names, from its file's folder or from here."""
        name = next((self._words[option][0] for option in _ESTIMATES if self._words.get(option)), None)
        if name is None:
            return None
        beside, here = path.parent / name, Path(name)
        if beside.is_dir() and here.is_dir() and not beside.samefile(here):
            self.no_estimate = f"{name} is a folder both of {path.parent} and of the working directory; give --estimates DIR"
        return next((choice for choice in (beside, here, path.parent / here.name) if choice.is_dir()), beside)

    def _find_sweep(self, bag: Path) -> Sweep:
        path = find_sweep(bag)
        if path is None:
            return Sweep()
        if path not in self._sweeps:
            self._sweeps[path], note = read_sweep(path)
            if note:
                self._notes.append(note)
        return self._sweeps[path]


def _words(command: str) -> dict[str, list[str]]:
    """Return the options of a command, each with the words that follow it."""
    try:
        words = shlex.split(command)
    except ValueError:
        return {}
    found: dict[str, list[str]] = {}
    option = ""
    for word in words:
        if word.startswith("--"):
            option, _, value = word.partition("=")
            found.setdefault(option, []).extend([value] if value else [])
        elif option:
            found[option].append(word)
    return found

"""Runs somebody's estimator on the rooms of a test, judges its trajectories, and finds what broke it where they are not good enough."""

import math
import shlex
import subprocess
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

from evaluation.confidence import Interval, intervals
from evaluation.core.task import Measurement
from evaluation.metrics.poses import POSES
from scene_synth_ros.sweep.variant import Variant
from scene_synth_ros.testing.recordings import (
    Recording,
    TestError,
    base_plan,
    blame_plan,
    estimated_trajectory,
    record,
    sweep_folder,
    true_trajectory,
    unchanged,
)
from scene_synth_ros.testing.room import RoomTest

Estimator = Callable[[Recording], object]
_BARS: Mapping[str, str] = {"ate_rmse": "ate_m", "rpe_translation": "rpe_m", "rpe_rotation": "rpe_deg", "coverage": "coverage"}
"""Metric of poses -> its bar in a test."""
_SEED = 0
_COMMAND_S = 600.0


class Score(NamedTuple):
    """A metric over all rooms, its bar, and whether it is good enough."""

    name: str
    unit: str
    found: Interval
    bar: float
    good: bool

    def line(self) -> str:
        """Return it for people."""
        value = "none" if self.found.value is None else f"{self.found.value:.4g}"
        spread = "" if self.found.low is None or self.found.high is None else f" [{self.found.low:.4g}, {self.found.high:.4g}]"
        unit = f" {self.unit}" if self.unit else ""
        return f"{self.name} {value}{spread}{unit}, {'at least' if self.name == 'coverage' else 'at most'} {self.bar:g}{unit}"


class GateFailure(AssertionError):
    """An estimator that is not good enough; the message says by how much, where, and what broke it."""


class Judge:
    """Judges estimators in the rooms of one test.

    Args:
        test: what is asked.
        folder: where bags are kept from one run of the tests to the next.
        tell: is told what is done, a line at a time.
    """

    def __init__(self, test: RoomTest, folder: Path, tell: Callable[[str], None] = lambda _: None) -> None:
        self._test, self._folder, self._tell = test, folder, tell

    def __call__(self, estimator: Estimator) -> tuple[Score, ...]:
        """Run an estimator on every room; return its scores.

        The estimator is called with a :class:`Recording` and returns the ``Path`` of a TUM file, poses, or a ``Trajectory``.

        Raises:
            GateFailure: it is not good enough.
            SceneSynthError: a room cannot be made, or what it returns is no trajectory.
        """
        plan = base_plan(self._test, self._folder)
        rooms, bags = list(unchanged(plan)), sweep_folder(plan, self._folder)
        record(plan, bags, [variant.id for variant in rooms], self._tell)
        found = [self._measure(variant, bags, estimator) for variant in rooms]
        scores = self._scores([POSES.merge(repeats) for repeats in found])
        for score in scores:
            self._tell(score.line())
        if not all(score.good for score in scores):
            raise GateFailure("\n".join(self._failure(scores, rooms, found, estimator)))
        return scores

    def command(self, words: str) -> tuple[Score, ...]:
        """Do the same with a command, in which ``{bag}`` is the recording and ``{trajectory}`` the TUM file that it writes."""
        return self(lambda recording: _run(words, recording))

    def _measure(self, variant: Variant, bags: Path, estimator: Estimator) -> list[Measurement]:
        """Return what each repeat of an estimator is measured at."""
        bag = bags / variant.bag
        true, found = true_trajectory(bag, self._test), []
        for _ in range(self._test.repeats):
            with tempfile.TemporaryDirectory() as folder:
                estimate = estimator(Recording(bag, Path(folder), _name(variant)))
                found.append(POSES.measure({"poses": true}, estimated_trajectory(estimate, true)))
        return found

    def _scores(self, rooms: list[Measurement]) -> tuple[Score, ...]:
        found = intervals(POSES, [room.whole for room in rooms], seed=_SEED)
        units = {metric.name: metric.unit for metric in POSES.metrics}
        bars = {metric: getattr(self._test, name) for metric, name in _BARS.items()}
        return tuple(
            Score(metric, units[metric], found[metric], bar, _is_good(metric, found[metric].value, bar))
            for metric, bar in bars.items()
            if bar is not None
        )

    def _failure(self, scores: tuple[Score, ...], rooms: list[Variant], found: list[list[Measurement]], estimator: Estimator) -> list[str]:
        """Return the lines of a failure."""
        judged = next(score for score in scores if not score.good)
        worse = -1.0 if judged.name == "coverage" else 1.0
        values = [POSES.score(repeats)[judged.name] for repeats in found]
        worst = max(range(len(rooms)), key=lambda k: worse * values[k] if math.isfinite(values[k]) else math.inf)
        lines = ["not good enough:", *(f"  {score.line()}" for score in scores if not score.good)]
        for variant, value, repeats in zip(rooms, values, found, strict=True):
            each = [POSES.score([one])[judged.name] for one in repeats]
            lines.append(f"  {_name(variant)}: {value:.4g}" + (f" (repeats {min(each):.4g} to {max(each):.4g})" if len(each) > 1 else ""))
        if self._test.blamed:
            lines += self._blame(judged, rooms[worst], values[worst], estimator)
        return lines

    def _blame(self, judged: Score, broken: Variant, value: float, estimator: Estimator) -> list[str]:
        """Return lines on what the worst room would have been without one thing after the other, the most telling first."""
        plan = blame_plan(self._test, self._folder, broken)
        variants = [variant for variant in plan.variants if variant.base.scene.id == broken.base.scene.id and variant.changed]
        variants, bags = variants[: self._test.blamed], sweep_folder(plan, self._folder)
        record(plan, bags, [variant.id for variant in variants], self._tell)
        own = next(variant.factors for variant in unchanged(plan) if variant.base.scene.id == broken.base.scene.id)
        rows = []
        for variant in variants:
            if (bags / variant.bag).is_dir():
                without, name = POSES.score(self._measure(variant, bags, estimator))[judged.name], variant.changed[0]
                rows.append((without, f"{name} {variant.factors[name]} in place of {own[name]}"))
        rows.sort(key=lambda row: -row[0] if judged.name == "coverage" else row[0])
        told = [f"what broke it in {_name(broken)} ({judged.name} {value:.4g}), one thing changed at a time:"]
        told += [f"  {what}: {without:.4g}{', good' if _is_good(judged.name, without, judged.bar) else ''}" for without, what in rows]
        if not any(_is_good(judged.name, without, judged.bar) for without, _ in rows):
            told.append("  none of these alone: the room itself, its path, or the estimator")
        return told


def _run(words: str, recording: Recording) -> Path:
    """Run a command on a recording; return the file that it has written.

    Raises:
        TestError: it fails, takes too long, or writes nothing.
    """
    trajectory = recording.folder / "trajectory.txt"
    asked = [word.format(bag=recording.bag, trajectory=trajectory) for word in shlex.split(words)]
    try:
        done = subprocess.run(asked, capture_output=True, text=True, errors="replace", timeout=_COMMAND_S, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise TestError(f"{shlex.join(asked)}: {' '.join(str(error).split())}") from None
    if done.returncode or not trajectory.is_file():
        said = (done.stderr or done.stdout).strip().splitlines()
        what = f"exit status {done.returncode}" if done.returncode else "no file"
        raise TestError(
            f"{shlex.join(asked)}: expected a trajectory in {trajectory}, got {what}; {said[-1][:300] if said else 'it said nothing'}"
        )
    return trajectory


def _is_good(metric: str, value: float | None, bar: float) -> bool:
    """Return whether a value is good enough; one that is not defined is not."""
    return value is not None and math.isfinite(value) and (value >= bar if metric == "coverage" else value <= bar)


def _name(variant: Variant) -> str:
    scene = variant.base.scene
    return f"{scene.category} {scene.index} of seed {scene.seed}"

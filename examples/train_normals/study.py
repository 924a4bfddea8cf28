"""What is compared: networks by the rooms that they were trained on, judged in rooms of other types by ``evaluation``."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evaluation.confidence import Interval, intervals, mean_interval, pseudo_values
from evaluation.core.task import Tally
from evaluation.tasks import TASKS
from examples.train_normals.pictures import Views

NORMALS = TASKS["normals"]
CONSTANT = "constant"
TESTED_ON = ("color", "noisy")

Predict = Callable[[NDArray[np.uint8]], NDArray[np.float32]]
"""(n, h, w, 3) uint8 -> normals (n, h, w, 3) float32."""


@dataclass(frozen=True)
class Training:
    """One way to train: its name, whether rooms have their own light and materials, and which pictures of them are drawn from."""

    name: str
    own_looks: bool
    pictures: tuple[str, ...]


TRAININGS = (
    Training("one look", False, ("color",)),
    Training("random looks", True, ("color",)),
    Training("random looks, noise", True, ("color", "noisy")),
)


@dataclass(frozen=True)
class Judged:
    """A network, or the constant (0 rooms trained on), in the test rooms: one tally a room, and each metric with its interval."""

    training: str
    rooms: int
    tested_on: str
    tallies: tuple[Tally, ...]
    metrics: dict[str, Interval]


def judge(training: str, rooms: int, tested_on: str, predict: Predict, test: Sequence[Views], seed: int) -> Judged:
    """Judge a predictor by the pictures ``tested_on`` of the test rooms."""
    tallies = []
    for room in test:
        estimates = predict(getattr(room, tested_on))
        truths = room.normals.astype(np.float32)
        frames = [NORMALS.measure({"normals": truth}, estimate) for truth, estimate in zip(truths, estimates, strict=True)]
        tallies.append(NORMALS.merge(frames).whole)
    return Judged(training, rooms, tested_on, tuple(tallies), intervals(NORMALS, tallies, seed=seed))


def mean_normal(rooms: Sequence[Views]) -> Predict:
    """Return the predictor that knows no picture: at each pixel the mean of the normals that the rooms have there."""
    total = np.concatenate([room.normals for room in rooms]).astype(np.float64).sum(axis=0)
    return lambda pictures: np.broadcast_to(total.astype(np.float32), (len(pictures), *total.shape))


def difference(new: Judged, old: Judged, metric: str, seed: int) -> Interval:
    """Return new - old of a metric, with the 95 % interval over the test rooms, which are the same for both."""
    column = [one.name for one in NORMALS.metrics].index(metric)

    def apart(weights: NDArray[np.float64]) -> NDArray[np.float64]:
        after, before = (NORMALS.tallying.finish(judged.tallies, weights)[:, [column]] for judged in (new, old))
        return after - before

    rooms = len(new.tallies)
    pseudo = pseudo_values(apart, np.ones((rooms, 1), bool))
    return mean_interval(float(apart(np.ones((1, rooms)))[0, 0]), pseudo[:, 0], "signed", seed=seed)


def differences(judged: Sequence[Judged], counts: Sequence[int], seed: int) -> dict[str, Interval]:
    """Return the gains in the mean angle that the study asks for, by what is compared."""
    found = {(one.training, one.rooms, one.tested_on): one for one in judged}
    few, many = min(counts), max(counts)
    one, own, noise = (training.name for training in TRAININGS)

    def gain(new: tuple[str, int, str], old: tuple[str, int, str]) -> Interval:
        return difference(found[new], found[old], "mean", seed)

    return {
        f"{many} rooms against {few}, clean": gain((own, many, "color"), (own, few, "color")),
        f"{own} against {one}, {many} rooms, clean": gain((own, many, "color"), (one, many, "color")),
        f"{own} against {one}, {many} rooms, noisy": gain((own, many, "noisy"), (one, many, "noisy")),
        f"trained on noise or not, {many} rooms, noisy": gain((noise, many, "noisy"), (own, many, "noisy")),
        f"trained on noise or not, {many} rooms, clean": gain((noise, many, "color"), (own, many, "color")),
        f"{own}, {many} rooms, against the constant, clean": gain((own, many, "color"), (CONSTANT, 0, "color")),
    }

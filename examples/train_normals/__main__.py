"""Train networks for surface normals on generated rooms and draw the pictures of docs/training.md.  No ROS.

python -m examples.train_normals --out docs
"""

import argparse
import importlib.util
import json
import os
import sys
import time
from dataclasses import asdict
from pathlib import Path

from examples.train_normals.figures import network_label, write_curves, write_predictions
from examples.train_normals.pictures import Views, render_rooms
from examples.train_normals.rooms import TEST_SEED_OFFSET, TEST_TYPES, TRAINING_TYPES, sample_rooms, with_one_look
from examples.train_normals.study import CONSTANT, TESTED_ON, TRAININGS, Judged, Predict, differences, judge, mean_normal

SHOWN = ("mean", "median", "within_11.25", "within_22.5", "within_30")


def main(words: list[str]) -> int:
    """Render what is not there yet, train, judge, print a table, write the pictures and normals.json."""
    options = _options(words)
    if importlib.util.find_spec("jax") is None or importlib.util.find_spec("optax") is None:
        print("train_normals: expected JAX and optax, which are not installed; run: .venv/bin/pip install '.[train]'", file=sys.stderr)
        return 1
    began, counts = time.monotonic(), sorted(set(options.rooms))
    scenes = sample_rooms(TRAINING_TYPES, counts[-1], options.seed)
    test_scenes = sample_rooms(TEST_TYPES, options.test_rooms, options.seed + TEST_SEED_OFFSET)
    own = render_rooms(scenes, options.data)
    alike = render_rooms(with_one_look(scenes), options.data)
    test = render_rooms(test_scenes, options.data)
    print(
        f"{len(own)} rooms to train on, {len(test)} to test on, {len(test[0].color)} views each: {time.monotonic() - began:.0f} s",
        flush=True,
    )
    judged = [judge(CONSTANT, 0, tested_on, mean_normal(own), test, options.seed) for tested_on in TESTED_ON]
    networks = {}
    for training in TRAININGS:
        for count in counts:
            predict = _trained((own if training.own_looks else alike)[:count], training.pictures, options.steps, options.seed)
            networks[network_label(training.name, count)] = predict
            judged += [judge(training.name, count, tested_on, predict, test, options.seed) for tested_on in TESTED_ON]
            print(f"trained: {training.name}, {count} rooms: {time.monotonic() - began:.0f} s", flush=True)
    gains = differences(judged, counts, options.seed)
    _print_table(judged)
    for name, gain in gains.items():
        print(f"{name}: {gain.value:+.2f} deg ({gain.low:+.2f} to {gain.high:+.2f})")
    options.out.mkdir(parents=True, exist_ok=True)
    write_curves(judged, options.out / "training_curves.svg")
    last = {name: networks[name] for name in (network_label(training.name, counts[-1]) for training in TRAININGS)}
    types = [scene.category for scene in test_scenes[: len(TEST_TYPES)]]
    write_predictions(test[: len(TEST_TYPES)], types, last, options.out / "training.jpg")
    if options.json:
        rows = [{key: value for key, value in asdict(one).items() if key != "tallies"} for one in judged]
        document = {"judged": rows, "differences": {name: asdict(gain) for name, gain in gains.items()}}
        options.json.write_text(json.dumps(document, indent=1), encoding="utf-8")
    print(f"wrote {options.out}/training_curves.svg and training.jpg, {time.monotonic() - began:.0f} s in all")
    return 0


def _trained(rooms: list[Views], pictures: tuple[str, ...], steps: int, seed: int) -> Predict:
    from examples.train_normals.training import gather_examples, predict, train

    parameters = train(gather_examples(rooms, pictures), steps=steps, seed=seed)
    return lambda images: predict(parameters, images)


def _print_table(judged: list[Judged]) -> None:
    print(f"\n{'trained on':22s} {'rooms':>5s} {'tested on':9s} " + " ".join(f"{name:>20s}" for name in SHOWN))
    for one in judged:
        cells = [one.metrics[name] for name in SHOWN]
        texts = [f"{cell.value:.3f} ({cell.low:.3f}-{cell.high:.3f})" if cell.low is not None else f"{cell.value:.3f}" for cell in cells]
        print(f"{one.training:22s} {one.rooms:5d} {one.tested_on:9s} " + " ".join(f"{text:>20s}" for text in texts))
    print()


def _options(words: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m examples.train_normals", description="A network for normals, by what it is trained on."
    )
    parser.add_argument("--out", type=Path, default=Path("."), help="folder of training_curves.svg and training.jpg")
    caches = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    parser.add_argument("--data", type=Path, default=caches / "scene_synth_training", help="folder that keeps views")
    parser.add_argument("--json", type=Path, help="file for all metrics with their intervals")
    parser.add_argument("--rooms", type=int, nargs="+", default=[4, 16, 64], help="numbers of rooms to train on")
    parser.add_argument("--test-rooms", type=int, default=32, help="rooms to test on, of the unseen types in turn")
    parser.add_argument("--steps", type=int, default=1000, help="steps of each training, 8 pictures a step")
    parser.add_argument("--seed", type=int, default=1, help="of rooms, weights, order and intervals")
    options = parser.parse_args(words)
    if min(options.rooms) < 1 or options.test_rooms < len(TEST_TYPES) or options.steps < 20 or options.seed < 0:
        parser.error(f"expected --rooms above 0, --test-rooms from {len(TEST_TYPES)}, --steps from 20 and --seed from 0")
    return options


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))

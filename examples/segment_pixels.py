"""Learn the class of each pixel from colour and depth, without and with the balance of ``scene_synth split --balance``; numpy alone.

scene_synth generate --rooms 40 --frames 4 --seed 11 --overlay realtime --out rooms \
  -p renderer_node.camera.width:=160 -p renderer_node.camera.height:=120
scene_synth split rooms --shares train=0.8,val=0.2 --balance
python examples/segment_pixels.py rooms

A network of one hidden layer sees a pixel and the means around it.  Rooms of ``val`` are judged by the metrics of ``scene_synth evaluate``.
"""

import json
import sys
from pathlib import Path

import numpy as np

from evaluation.tasks import TASKS
from scene_synth_ros.dataset import open_dataset

CLASSES, HIDDEN = 41, 48
STEPS, PIXELS, RATE = 1500, 1024, 3e-3
AROUND_PX = (3, 9, 25)


def box_mean(image, side):
    """Return the means of a (h, w, c) image over squares, cut off at its border."""
    sums = np.pad(image, ((1, 0), (1, 0), (0, 0))).cumsum(axis=0).cumsum(axis=1)
    rows, columns = (np.arange(size) for size in image.shape[:2])
    top, left = (np.maximum(places - side // 2, 0) for places in (rows, columns))
    bottom, right = np.minimum(rows + side // 2 + 1, len(rows)), np.minimum(columns + side // 2 + 1, len(columns))
    total = sums[bottom][:, right] - sums[top][:, right] - sums[bottom][:, left] + sums[top][:, left]
    return total / ((bottom - top)[:, None] * (right - left))[:, :, None]


def features(frame):
    """Return (h, w, n) what a pixel is known by: colour, nearness in 1/m, place in the image, means around it, height over the axis."""
    depth = frame["depth"].astype(np.float64)
    seen = np.isfinite(depth) & (depth > 0.0)
    nearness = np.where(seen, 1.0 / np.where(seen, depth, 1.0), 0.0)
    y, x = np.meshgrid(*(np.linspace(-1.0, 1.0, size) for size in depth.shape), indexing="ij")
    image = np.dstack([frame["color"] / 255.0, nearness])
    return np.dstack([image, y, x, y * np.where(seen, depth, 0.0), *(box_mean(image, side) for side in AROUND_PX)])


def train(frames, frame_weights, class_weights, seed=0):
    """Return the network after ``STEPS`` of Adam (Kingma and Ba, ICLR 2015), each on pixels of one frame.

    Args:
        frames: (features, classes) of each.
        frame_weights: how often each is drawn, beside the others.
        class_weights: (CLASSES,) what a pixel of a class counts in the loss; void counts nothing.
        seed: of the draws.
    """
    rng = np.random.default_rng(seed)
    count = frames[0][0].shape[-1]
    every = np.concatenate([pixels.reshape(-1, count)[::97] for pixels, _ in frames])
    scale = (every.mean(axis=0), every.std(axis=0) + 1e-6)
    weights = [rng.normal(0.0, (2.0 / count) ** 0.5, (count, HIDDEN)), np.zeros(HIDDEN)]
    weights += [rng.normal(0.0, HIDDEN**-0.5, (HIDDEN, CLASSES)), np.zeros(CLASSES)]
    first, second = ([np.zeros_like(own) for own in weights] for _ in range(2))
    for step in range(1, STEPS + 1):
        pixels, classes = frames[rng.choice(len(frames), p=frame_weights / frame_weights.sum())]
        chosen = rng.integers(classes.size, size=PIXELS)
        inputs, truth = (pixels.reshape(-1, count)[chosen] - scale[0]) / scale[1], classes.reshape(-1)[chosen]
        hidden, scores = forward(weights, inputs)
        slope = np.exp(scores - scores.max(axis=1, keepdims=True))
        slope /= slope.sum(axis=1, keepdims=True)
        slope[np.arange(PIXELS), truth] -= 1.0
        slope *= (class_weights[truth] / PIXELS)[:, None]
        back = (slope @ weights[2].T) * (hidden > 0.0)
        for k, gradient in enumerate((inputs.T @ back, back.sum(axis=0), hidden.T @ slope, slope.sum(axis=0))):
            first[k] += 0.1 * (gradient - first[k])
            second[k] += 0.001 * (gradient**2 - second[k])
            size = RATE * (1.0 - step / (STEPS + 1)) * (1.0 - 0.999**step) ** 0.5 / (1.0 - 0.9**step)
            weights[k] -= size * first[k] / (np.sqrt(second[k]) + 1e-8)
    return weights, scale


def forward(weights, inputs):
    """Return what the hidden layer and the last one give."""
    hidden = np.maximum(inputs @ weights[0] + weights[1], 0.0)
    return hidden, hidden @ weights[2] + weights[3]


def predict(network, pixels):
    """Return (h, w) class ids, never void."""
    weights, (mean, spread) = network
    scores = forward(weights, (pixels.reshape(-1, pixels.shape[-1]) - mean) / spread)[1]
    return 1 + scores[:, 1:].argmax(axis=1).reshape(pixels.shape[:2])


def judge(network, frames):
    """Return the metrics of ``scene_synth evaluate --task semantic`` over frames."""
    task = TASKS["semantic"]
    found = [task.measure({"semantic": classes.astype(np.int64)}, predict(network, pixels)) for pixels, classes in frames]
    return task.score(found)


def read(folder, split):
    """Return (features, classes) of the frames of a split."""
    data = open_dataset(folder, split=split, layers=("color", "depth", "semantic"))
    return [(features(frame), frame["semantic"]) for frame in data]


def main(folder):
    """Train twice and print what is reached in rooms that were not trained on."""
    splits = json.loads((folder / "splits.json").read_text())
    weights = np.array([weight for room in splits["splits"]["train"] for weight in room["weights"]])
    training, held_out = read(folder, "train"), read(folder, "val")
    alike, balance = np.r_[0.0, np.ones(CLASSES - 1)], np.zeros(CLASSES)
    for key, row in open_dataset(folder, layers=("semantic",))[0].labels("semantic").items():
        balance[key] = splits["classes"]["train"].get(row["name"], {"weight": 0.0})["weight"] if key else 0.0
    for name, of_frames, of_classes in (("as they are", np.ones(len(training)), alike), ("balanced", weights, balance)):
        scores = judge(train(training, of_frames, of_classes), held_out)
        print(f"{name}: " + ", ".join(f"{metric} {scores[metric]:.3f}" for metric in ("pixel_accuracy", "mean_accuracy", "miou")))


if __name__ == "__main__":
    main(Path(sys.argv[1]))

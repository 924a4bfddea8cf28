"""Read what `scene_synth convert BAG --to webdataset --out DIR` wrote, as a stream of shards: nearness and class of the pixels.  No ROS.

python examples/web_dataset.py DIR
"""

import io
import sys
from pathlib import Path

import numpy as np
import webdataset as wds
from PIL import Image


def decode_png(data: bytes) -> np.ndarray:
    """Return the pixels as they were recorded: 8 bit colour, class ids of 8 and object ids of 16 bit."""
    return np.asarray(Image.open(io.BytesIO(data)))


def open_shards(folder: Path, seed: int = 0) -> wds.WebDataset:
    """Return samples in a random order, 100 of which are held to draw from; file endings are keys, as `depth.npy` is."""
    shards = [str(shard) for shard in sorted(folder.glob("shard-*.tar"))]
    data = wds.WebDataset(shards, shardshuffle=len(shards), seed=seed, empty_check=False)
    return data.shuffle(100).decode(wds.handle_extension("png", decode_png))


def main() -> None:
    """Say how near each class is, the mean over all frames."""
    near, pixels = np.zeros(256), np.zeros(256)
    # With PyTorch: wds.WebLoader(open_shards(...).batched(8), batch_size=None, num_workers=2)
    for sample in open_shards(Path(sys.argv[1])):
        classes, depth = sample["semantic.png"].reshape(-1), sample["depth.npy"].reshape(-1)
        hit = np.isfinite(depth)
        near += np.bincount(classes[hit], 1.0 / depth[hit], minlength=256)
        pixels += np.bincount(classes[hit], minlength=256)
    for label in np.flatnonzero(pixels):
        print(f"class {label:2d}: {pixels[label]:9.0f} pixels, mean nearness {near[label] / pixels[label]:.2f} 1/m")


if __name__ == "__main__":
    main()

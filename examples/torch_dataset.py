"""Train a small PyTorch network on frames of a bag or dataset: the class of each pixel from colour and depth.  No ROS.

python examples/torch_dataset.py BAG|DATASET|URL
"""

import sys
import time

import torch
from torch.utils.data import DataLoader

from scene_synth_ros.dataset import Frame, open_dataset

WORKERS, BATCH, EPOCHS = 2, 4, 2


def sample(frame: Frame) -> dict[str, torch.Tensor]:
    """Return tensors as they are in the bag: the processes that decode hand on a third of the bytes that floats would have."""
    return {layer: torch.from_numpy(pixels) for layer, pixels in frame.items()}


def inputs(batch: dict[str, torch.Tensor]) -> tuple[torch.Tensor, torch.Tensor]:
    """Return (batch, 4, height, width) colour in 0 to 1 and nearness in 1/m, 0 where nothing was hit; and the classes."""
    nearness = torch.nan_to_num(1.0 / batch["depth"], nan=0.0)
    return torch.cat([batch["color"].permute(0, 3, 1, 2) / 255.0, nearness[:, None]], dim=1), batch["semantic"].long()


def main() -> None:
    """Train, and say what is learned and how fast frames came."""
    data = open_dataset(sys.argv[1], layers=("color", "depth", "semantic"), transform=sample)
    print(data)
    network = torch.nn.Sequential(torch.nn.Conv2d(4, 16, 3, stride=4, padding=1), torch.nn.ReLU(), torch.nn.Conv2d(16, 41, 3, padding=1))
    optimizer = torch.optim.Adam(network.parameters(), lr=0.01)
    for epoch in range(EPOCHS):
        loader = DataLoader(data.shuffled(seed=epoch), batch_size=BATCH, num_workers=WORKERS, prefetch_factor=4)
        began, waited, frames, losses = time.perf_counter(), 0.0, 0, []
        batches, asked = iter(loader), time.perf_counter()
        for batch in batches:
            waited += time.perf_counter() - asked
            images, classes = inputs(batch)
            loss = torch.nn.functional.cross_entropy(network(images), classes[:, ::4, ::4])
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            losses.append(float(loss))
            frames += len(images)
            asked = time.perf_counter()
        took = time.perf_counter() - began
        mean = sum(losses) / len(losses)
        print(f"epoch {epoch}: loss {mean:.2f}, {frames / took:.0f} frames/s, {waited / took:.0%} of the time spent waiting for frames")


if __name__ == "__main__":
    main()

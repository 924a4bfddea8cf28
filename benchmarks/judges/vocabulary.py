"""A vocabulary for ORB-SLAM3, trained on pictures of one's own.

The tree is that of D. Galvez-Lopez and J. D. Tardos ("Bags of Binary Words for Fast Place Recognition in Image Sequences", T-RO 2012):
binary descriptors in groups about medians, level by level, words weighted by the logarithm of how few pictures have them.
"""

from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

Bits = NDArray[np.uint8]

BRANCHES, DEPTH = 10, 4
_HEADER = f"{BRANCHES} 6 0 0"
"""Branches, levels, L1 norm, term frequency by inverse document frequency; six levels are told, so that ORB-SLAM3, which looks up
neighbours four levels above the words, finds nodes of the second."""
_ROUNDS = 8


def descriptors(pictures: Iterable[Path], features: int = 1000) -> tuple[Bits, NDArray[np.int64]]:
    """Return the ORB descriptors (n, 32) of grey pictures, and the number of the picture of each (n,)."""
    orb, found, owners = cv2.ORB_create(nfeatures=features), [np.zeros((0, 32), np.uint8)], [np.zeros(0, np.int64)]  # type: ignore[attr-defined]
    for number, path in enumerate(pictures):
        described = orb.detectAndCompute(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), None)[1]
        if described is not None:
            found.append(described)
            owners.append(np.full(len(described), number))
    return np.concatenate(found), np.concatenate(owners)


def train(described: Bits, owners: NDArray[np.int64], seed: int = 1) -> str:
    """Return a vocabulary in the text format of ORB-SLAM3; its last line must not end, or it would count as a node."""
    random, lines = np.random.default_rng(seed), [_HEADER]
    pictures = int(owners.max()) + 1
    bits = np.unpackbits(described, axis=1).astype(np.float32)
    level = [(0, np.arange(len(bits)))]
    for depth in range(1, DEPTH + 1):
        below = []
        for parent, rows in level:
            for center, members in _groups(bits, rows, random):
                leaf = depth == DEPTH or len(members) <= 1
                weight = np.log(pictures / len(np.unique(owners[members]))) if leaf else 0.0
                lines.append(f"{parent} {int(leaf)} {' '.join(map(str, np.packbits(center)))} {weight:.6g}")
                if not leaf:
                    below.append((len(lines) - 1, members))
        level = below
    return "\n".join(lines)


def _groups(bits: NDArray[np.float32], rows: NDArray[np.int64], random: np.random.Generator) -> Iterable[tuple[Bits, NDArray[np.int64]]]:
    """Yield the median, (256,) of zeros and ones, and the members of each group of some rows."""
    points = bits[rows]
    unique = np.unique(points, axis=0)
    centers = unique[random.choice(len(unique), min(BRANCHES, len(unique)), replace=False)]
    for _ in range(_ROUNDS):
        nearest = (points @ (1.0 - 2.0 * centers.T) + centers.sum(axis=1)).argmin(axis=1)
        centers = np.array([points[nearest == k].mean(axis=0) > 0.5 if (nearest == k).any() else centers[k] for k in range(len(centers))])
        centers = centers.astype(np.float32)
    for k, center in enumerate(centers):
        if (nearest == k).any():
            yield center.astype(np.uint8), rows[nearest == k]

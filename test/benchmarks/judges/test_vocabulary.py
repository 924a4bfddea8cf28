"""A vocabulary is a tree whose words say in how few pictures they are."""

import numpy as np

from benchmarks.judges.vocabulary import BRANCHES, DEPTH, train


def test_every_node_stands_below_one_before_it_and_words_are_leaves() -> None:
    random = np.random.default_rng(5)
    centers = random.integers(0, 256, (30, 32), np.uint8)
    owners = np.repeat(np.arange(20), 40)
    described = centers[random.integers(0, 30, 800)] ^ (random.random((800, 32)) < 0.02).astype(np.uint8)
    text = train(described, owners)
    header, *rows = text.split("\n")
    assert header == "10 6 0 0" and not text.endswith("\n")
    parents, leaves = np.array([row.split()[:2] for row in rows], int).T
    numbers = np.arange(1, len(rows) + 1)
    assert (parents < numbers).all() and (np.bincount(parents) <= BRANCHES).all()
    assert set(numbers[leaves == 0]) == set(parents) - {0}
    depth = {0: 0}
    for number, parent in zip(numbers.tolist(), parents.tolist(), strict=True):
        depth[number] = depth[parent] + 1
    assert max(depth.values()) == DEPTH and all(len(row.split()) == 35 for row in rows)


def test_a_word_of_all_pictures_weighs_nothing_and_one_of_a_single_picture_most() -> None:
    zeros, ones = np.zeros((10, 32), np.uint8), np.full((1, 32), 255, np.uint8)
    rows = train(np.concatenate([zeros, ones]), np.array([*range(10), 3])).split("\n")[1:]
    weights = {row.split()[2]: float(row.split()[-1]) for row in rows if row.split()[1] == "1"}
    assert weights["0"] == 0.0 and abs(weights["255"] - np.log(10)) < 1e-5

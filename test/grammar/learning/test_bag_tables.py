"""Tables over bags: the probability and the counts of two independent parts."""

import numpy as np

from grammar.learning.branching import Table, _paired, _summed, product


def table(bags: list[tuple[int, ...]], seed: int) -> Table:
    rng = np.random.default_rng(seed)
    return {bag: (float(rng.random()), rng.random(5)) for bag in bags}


def test_bags_add_up_and_no_more_than_the_room_holds() -> None:
    first = {(0, 0): (0.5, np.array([1.0, 0.0])), (1, 0): (0.5, np.array([0.0, 1.0]))}
    second = {(1, 0): (0.25, np.array([2.0, 0.0])), (0, 1): (0.75, np.array([0.0, 0.0]))}
    found = product(first, second, (1, 1))
    assert {bag: probability for bag, (probability, _) in found.items()} == {(1, 0): 0.125, (0, 1): 0.375, (1, 1): 0.375}
    # 0.5 of the second part's counts and 0.25 of the first's
    assert found[1, 0][1].tolist() == [1.25, 0.0]


def test_the_kernel_gives_the_same_bits() -> None:
    first, second = (table([(i, j) for i in range(3) for j in range(4)], seed) for seed in (1, 2))
    one, other = _paired(first, second, (3, 4)), _summed(first, second, (3, 4))
    assert list(one) == list(other)
    for bag, (probability, counts) in one.items():
        assert (probability, counts.tolist()) == (other[bag][0], other[bag][1].tolist())

"""What the folds of the realism bench are learned with."""

import pytest

from benchmarks import realism_bench
from grammar.spec.grammar_file import learned_types


@pytest.mark.parametrize(
    ("room_type", "least", "pooled", "raised"), [("bathroom", 3, 5.0, 2.5), ("hallway", 2, 5.0, 1.5), ("kitchen", 3, 0.0, 1.5)]
)
def test_folds_are_learned_as_the_shipped_grammar_was(room_type: str, least: int, pooled: float, raised: float) -> None:
    options = realism_bench.shipped_options(room_type)
    assert (options.least, options.pooled, options.truncation.raised) == (least, pooled, raised)
    assert (options.contrastive.iterations, options.truncation.iterations, options.truncation.rooms) == (0, 2, 60)


def test_each_learned_grammar_says_how_it_was_made() -> None:
    assert learned_types()
    assert all(realism_bench.shipped_options(room_type).alpha == 2.0 for room_type in learned_types())

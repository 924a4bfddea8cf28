"""The simulated cluster against runs whose times are known."""

import numpy as np
import pytest

from benchmarks.cost_bench import Cluster, Dataset, shard_seconds, simulate


def dataset(**changes: float) -> Dataset:
    values = {"rooms": 1000, "rooms_per_shard": 10, "room_s": 6.0, "room_cv": 0.0, "room_bytes": 0.0}
    return Dataset(**{**values, **changes})  # type: ignore[arg-type]


@pytest.mark.parametrize(("nodes", "workers", "rounds"), [(1, 1, 100), (5, 2, 10), (3, 10, 4), (50, 4, 1)])
@pytest.mark.parametrize("shares", [False, True])
def test_equal_shards_take_rounds(nodes: int, workers: int, rounds: int, shares: bool) -> None:
    """A hundred shards of a minute each."""
    outcome = simulate(dataset(), Cluster(nodes=nodes, workers=workers, start_s=5.0, shares=shares), np.random.default_rng(0))
    assert outcome.seconds == pytest.approx(5.0 + 60.0 * rounds)
    assert outcome.busy == pytest.approx(6000.0 / (nodes * workers * outcome.seconds))
    assert (outcome.failures, outcome.lost) == (0, 0.0)


def test_uploads_take_their_share_of_the_network() -> None:
    """Shards of 1 GB through a tenth of 1 GB/s: ten seconds each."""
    outcome = simulate(dataset(room_bytes=1e8), Cluster(nodes=1, workers=10, start_s=0.0, node_bytes_s=1e9), np.random.default_rng(0))
    assert outcome.seconds == pytest.approx(10 * 70.0)
    assert outcome.mean_bytes_s == pytest.approx(1e11 / 700.0)
    assert outcome.peak_bytes_s == pytest.approx(1e10 / 60.0)


def test_times_of_rooms_have_the_mean_and_the_spread_asked_for() -> None:
    """Shards of 10 rooms: mean 60, standard deviation 6 * 0.5 * sqrt(10)."""
    seconds = shard_seconds(dataset(rooms=200_000, room_cv=0.5), np.random.default_rng(1))
    assert len(seconds) == 20_000
    assert seconds.mean() == pytest.approx(60.0, rel=0.005)
    assert seconds.std() == pytest.approx(3.0 * 10**0.5, rel=0.03)


def test_failures_cost_what_they_interrupt() -> None:
    """One node, one worker, 100 shards of a minute, a failure every 1,000 s: of each, on average, half a shard and the repair."""
    outcomes = [
        simulate(dataset(), Cluster(nodes=1, workers=1, start_s=0.0, between_failures_h=1000 / 3600, repair_s=60.0), rng)
        for rng in np.random.default_rng(2).spawn(200)
    ]
    failures = np.mean([outcome.failures for outcome in outcomes])
    lost_s = np.mean([outcome.lost * 6000.0 for outcome in outcomes])
    assert lost_s / failures == pytest.approx(30.0, rel=0.1)
    assert np.mean([outcome.seconds for outcome in outcomes]) == pytest.approx(6000.0 + failures * 90.0, rel=0.02)


def test_whoever_is_free_takes_the_next_shard_where_shares_are_not_fixed() -> None:
    times = {
        shares: [
            simulate(dataset(room_cv=2.0), Cluster(nodes=10, workers=1, shares=shares), rng).seconds
            for rng in np.random.default_rng(3).spawn(20)
        ]
        for shares in (False, True)
    }
    assert np.mean(times[False]) < np.mean(times[True])


def test_a_shard_that_is_lost_at_the_end_is_made_by_a_node_that_is_idle() -> None:
    """Two nodes, one shard of a minute each; the one that fails is away for a day."""
    small = dataset(rooms=20)
    for rng in np.random.default_rng(4).spawn(50):
        outcome = simulate(small, Cluster(nodes=2, workers=1, start_s=0.0, between_failures_h=0.2, repair_s=86_400.0), rng)
        if outcome.failures == 1:
            assert outcome.seconds <= 120.0 + 60.0

"""Rates of a renderer."""

import pytest

from scene_synth_ros.render.frame_report import WINDOW_S, Rates, Throughput


def test_even_frames_have_their_rate() -> None:
    throughput = Throughput()
    for index in range(21):
        throughput.take(index * 0.1, 1000, 3000)
    assert throughput.rates(2.0) == pytest.approx(Rates(10.0, 10_000.0, 30_000.0))


def test_a_stall_lowers_the_rate_until_nothing_is_left() -> None:
    throughput = Throughput()
    for index in range(11):
        throughput.take(index * 0.1, 1, 2)
    assert throughput.rates(2.0).frames == pytest.approx(5.0)
    assert throughput.rates(1.0 + 2 * WINDOW_S) == Rates(0.0, 0.0, 0.0)


def test_one_frame_has_no_rate() -> None:
    throughput = Throughput()
    throughput.take(0.0, 5, 5)
    assert throughput.rates(1.0) == Rates(0.0, 0.0, 0.0)

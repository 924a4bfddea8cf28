"""Log time against clock time, by hand-computed answers."""

from fractions import Fraction

from hypothesis import given
from hypothesis import strategies as st

from scene_synth_ros.replay.player import Timeline

S = 1_000_000_000


def test_due_times_scale_with_the_rate():
    timeline = Timeline(2.0)
    timeline.begin(100 * S, 7 * S)
    assert timeline.due_ns(104 * S) == 9 * S
    assert timeline.due_ns(99 * S) == 6.5 * S
    assert timeline.position_ns(8 * S) == 102 * S


def test_a_change_of_rate_goes_on_from_the_present_position():
    timeline = Timeline(1.0)
    timeline.begin(0, 0)
    timeline.set_rate(0.5, 10 * S)
    assert timeline.position_ns(10 * S) == 10 * S
    assert timeline.due_ns(12 * S) == 14 * S


def test_nothing_is_due_while_paused_and_the_pause_is_not_made_up_for():
    timeline = Timeline(4.0)
    timeline.begin(0, 0)
    timeline.pause(1 * S)
    assert timeline.paused and timeline.due_ns(5 * S) is None and timeline.position_ns(50 * S) == 4 * S
    timeline.pause(30 * S)
    timeline.set_rate(2.0, 40 * S)
    timeline.resume(100 * S)
    assert timeline.due_ns(6 * S) == 101 * S
    timeline.resume(100 * S + 1)
    assert timeline.due_ns(6 * S) == 101 * S


def test_paused_from_the_start():
    timeline = Timeline(1.0, paused=True)
    timeline.begin(5 * S, 0)
    assert timeline.due_ns(5 * S) is None
    timeline.resume(9 * S)
    assert timeline.due_ns(6 * S) == 10 * S


@given(st.floats(0.001, 1000.0), st.integers(0, 2**61), st.integers(0, 10**13), st.integers(0, 10**15))
def test_no_drift_over_hours_at_any_rate(rate, start_ns, elapsed_ns, clock_ns):
    timeline = Timeline(rate)
    timeline.begin(start_ns, clock_ns)
    exact = clock_ns + Fraction(elapsed_ns) / Fraction(rate)
    assert abs(timeline.due_ns(start_ns + elapsed_ns) - exact) <= 1 + Fraction(elapsed_ns) / Fraction(rate) / 2**52

"""When a rate counts as held no longer, and held again; the line that says so."""

from collections.abc import Sequence

import pytest

from scene_synth_ros.render.rate_watch import FrameTime, Quality, RateWatch, held_line, late_line

PERIOD_S = 0.2
LIVE = Quality(samples=2, denoised=False, width=640, height=480)


def news(watch: RateWatch, seconds: Sequence[float], layers: Sequence[str] = ("color",)) -> list[int]:
    """Return which of some frames were news."""
    return [index for index, taken in enumerate(seconds) if watch.take(layers, PERIOD_S, FrameTime(taken))]


def test_two_late_frames_after_the_first_are_news_once() -> None:
    watch = RateWatch()
    assert news(watch, [0.42] * 50) == [2]
    assert watch.late == ("color",)
    assert watch.finding is not None
    assert (watch.finding.wanted_hz, watch.finding.held_hz) == (pytest.approx(5.0), pytest.approx(1 / 0.42))


def test_frames_without_a_period_do_not_count() -> None:
    watch = RateWatch()
    assert [watch.take(["color"], period_s, FrameTime(0.42)) for period_s in (0.0, 0.2, 0.0, 0.2)] == [False, False, False, True]


@pytest.mark.parametrize(
    "seconds",
    [
        [60.0] + [0.1] * 20,  # the first frame prepares what the others use
        [0.1, 3.0] + [0.1] * 20,
        [0.1] * 9 + [3.0] + [0.1] * 9,
        [0.1] * 9 + [0.3, 0.3] + [0.1] * 9,
    ],
)
def test_a_hiccup_is_no_news(seconds: list[float]) -> None:
    assert news(RateWatch(), seconds) == []


def test_a_rate_is_held_again_after_five_easy_frames_only() -> None:
    watch = RateWatch()
    news(watch, [0.3] * 5)
    assert news(watch, [0.19, 0.21] * 20) == []
    assert news(watch, [0.15] * 20) == [4]
    assert watch.late is None
    assert held_line(watch.finding) == "color: 5 Hz held"


def test_every_set_of_layers_is_judged_anew() -> None:
    watch = RateWatch()
    news(watch, [0.4] * 5)
    assert news(watch, [0.3] * 5, ["depth", "color"]) == [2]
    assert watch.late == ("color", "depth")
    assert news(watch, [0.02] * 20, ["depth"]) == [5]
    assert news(watch, [0.02] * 20, []) == []


def line(frame: FrameTime) -> str:
    watch = RateWatch()
    assert [watch.take(["color"], PERIOD_S, frame) for _ in range(3)] == [False, False, True]
    return late_line(watch.finding, LIVE, True)


def test_a_line_names_the_rate_the_cause_and_the_setting() -> None:
    assert line(FrameTime(0.42, 0.4)) == (
        "color: 5 Hz asked for, 2.4 reached; a frame takes 0.42 s to render: "
        "render.samples_per_pixel 1, camera.width 576, camera.height 432 of the renderer would about hold it, or grammar_node rate_hz 2"
    )
    assert line(FrameTime(9.0, 0.4)).endswith("a frame takes 9 s to render: grammar_node rate_hz 0.1 would about hold")


def test_a_recorder_and_subscribers_are_told_apart_from_rendering() -> None:
    assert line(FrameTime(0.1, 0.09, waiting_s=0.3)).endswith(
        "a recorder takes frames no faster, 0.3 of 0.4 s a frame are waiting for it: grammar_node rate_hz 2 would about hold"
    )
    assert "publishing takes 0.15 of 0.25 s a frame, fewer or faster subscribers would help: grammar_node" in line(
        FrameTime(0.1, 0.09, publishing_s=0.15)
    )


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        ([0.201] * 4, "5 Hz asked for, 4.9 reached; a frame takes 0.201 s to render"),
        ([0.21, 0.21] + [0.19] * 5, "5 Hz only just reached; a frame takes 0.19 s to render"),
    ],
)
def test_a_rate_that_is_nearly_held_is_told_as_it_is(seconds: list[float], words: str) -> None:
    watch = RateWatch()
    news(watch, [0.1, *seconds])
    assert watch.late == ("color",)
    assert late_line(watch.finding, LIVE, True).startswith(f"color: {words}")


def test_frames_that_are_late_in_turns_are_told_as_late() -> None:
    watch = RateWatch()
    turns = [FrameTime(0.15, publishing_s=0.06), FrameTime(0.06, publishing_s=0.15), FrameTime(0.06, publishing_s=0.06, waiting_s=0.1)]
    for frame in [FrameTime(0.1), *turns]:
        watch.take(["color"], PERIOD_S, frame)
    assert watch.late == ("color",) and watch.finding.held_hz == pytest.approx(1 / 0.21)

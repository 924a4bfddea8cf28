"""When sampling ends: rounds, noise of known pictures."""

import numpy as np
import pytest
from box_room import VIEW, furnished_room

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.path.stopping import is_clean, next_round, relative_noise, variance_of_mean


def rounds(config, seconds_per_sample):
    done = 0
    while count := next_round(config, done, done * seconds_per_sample):
        done += count
        yield done


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({"samples_per_pixel": 20}, [20]),
        ({"samples_per_pixel": 20, "noise_target": 0.1}, [1, 2, 4, 8, 16, 20]),
        ({"samples_per_pixel": 100, "time_budget_s": 10.5}, [1, 2, 4, 8, 10]),
        ({"samples_per_pixel": 3, "time_budget_s": 10.5}, [1, 2, 3]),
        ({"samples_per_pixel": 100, "time_budget_s": 0.1}, [1]),
    ],
)
def test_rounds_double_until_samples_or_time_end(settings, expected):
    assert list(rounds(RenderConfig(**settings), 1.0)) == expected


def test_noise_of_normal_samples_is_their_standard_error():
    rng = np.random.default_rng(1)
    halves = rng.normal(8 * 5.0, np.sqrt(8) * 2.0, (2, 200, 200, 3)).astype(np.float32)
    assert relative_noise(halves[0], halves.sum(axis=0), 16, 1e9) == pytest.approx(2.0 / np.sqrt(16) / 5.0, rel=0.01)


def test_noise_beyond_white_does_not_count():
    first, both = np.full((4, 4, 3), 20.0, np.float32), np.full((4, 4, 3), 100.0, np.float32)
    assert relative_noise(first, both, 4, 5.0) == 0.0
    assert relative_noise(np.zeros((1, 1, 3), np.float32), np.zeros((1, 1, 3), np.float32), 4, 5.0) == 0.0


def test_only_halves_are_judged():
    still = np.ones((2, 2, 3), np.float32)
    config = RenderConfig(noise_target=0.01)
    assert [n for n in range(1, 20) if is_clean(config, still * (n // 2), still * n, n, 10.0)] == [4, 8, 16]
    assert not is_clean(RenderConfig(), still, 2 * still, 4, 10.0)


def test_the_variance_layer_is_that_of_the_mean() -> None:
    """Over frames with noise of their own the colour spreads as the layer says, or a little less, as samples are stratified."""
    flat, camera = furnished_room(), CameraConfig(width=16, height=12)
    with Renderer(flat, camera, RenderConfig(samples_per_pixel=8, max_depth=3, threads=2), 3) as renderer:
        frames = [renderer.render(VIEW, index, ("color", "variance", "samples")) for index in range(60)]
    spread = np.var([frame.radiance for frame in frames], axis=0, ddof=1)
    told = np.mean([frame.layers["variance"] for frame in frames], axis=0)
    assert 0.3 < float(np.median((spread / np.where(told > 0, told, np.inf))[told > 0])) < 1.1
    assert (frames[0].layers["samples"] == 8).all() and frames[0].layers["samples"].dtype == np.uint16


def test_one_sample_tells_no_variance() -> None:
    mean = np.ones((2, 2, 3), np.float32)
    assert np.isnan(variance_of_mean(mean, mean, 1)).all()
    two = variance_of_mean(np.full((1, 1, 3), 2.0, np.float32), np.full((1, 1, 3), 5.0, np.float32), 2)  # samples 1 and 3
    assert (two == 1.0).all()  # their variance is 2, that of their mean 1

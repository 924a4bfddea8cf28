"""Settings that would hold a rate, from frames of known cost."""

import pytest

from renderer import CameraConfig
from scene_synth_ros.render.rate_watch import FrameTime, Quality, is_resizable, predicted_s, proposed_rate_hz, proposed_settings

LIVE = Quality(samples=2, denoised=False, width=640, height=480)
CACHED = Quality(samples=0, denoised=False, width=640, height=480, spacing_m=0.04)


@pytest.mark.parametrize(
    ("measured", "quality", "period_s", "settings"),
    [
        # 16 samples of 25 ms and 20 ms besides; 180 ms leave room for 6 of them.
        (FrameTime(0.42, 0.40), LIVE._replace(samples=16), 0.2, "render.samples_per_pixel 6"),
        # 16 at most, ended at 4 by a noise target: what counts is the 4 that were taken.
        (FrameTime(0.42, 0.40), LIVE._replace(samples=4), 0.25, "render.samples_per_pixel 2"),
        # one sample and the rest take 0.22 s, of 0.18 that are left: 0.818 of the pixels.
        (FrameTime(0.42, 0.40), LIVE, 0.2, "render.samples_per_pixel 1, camera.width 576, camera.height 432"),
        # the denoiser alone takes longer than the period.
        (FrameTime(0.55, 0.13, 0.4), LIVE._replace(samples=1, denoised=True), 0.2, "render.denoise none"),
        # of 0.15 s 0.09 are left: 0.6 of the pixels, 0.49 of which are 448x336 and 0.64 512x384.
        (FrameTime(0.15, 0.14), LIVE._replace(samples=1), 0.1, "camera.width 448, camera.height 336"),
        # depth and the like take no samples.
        (FrameTime(0.015), LIVE._replace(samples=0), 0.01, "camera.width 448, camera.height 336"),
        # nearly all of 0.12 s is spent on new points of the cache, and a quarter of them at twice their spacing: 0.02 + 0.025 s.
        (FrameTime(0.12, filling_s=0.1), CACHED, 0.06, "render.cache_spacing_m 0.08"),
        # looking up alone takes too long: 0.49 of the pixels.
        (FrameTime(0.1, filling_s=0.001), CACHED, 0.06, "camera.width 448, camera.height 336"),
        (FrameTime(0.42, 0.40), LIVE, 0.005, ""),
        (FrameTime(0.15, 0.14), Quality(1, False, 848, 480), 0.1, "camera.width 636, camera.height 360"),
    ],
)
def test_what_is_proposed_loses_least(measured: FrameTime, quality: Quality, period_s: float, settings: str) -> None:
    assert proposed_settings(measured, quality, period_s) == settings


def test_a_lens_in_pixels_is_not_resized() -> None:
    assert proposed_settings(FrameTime(0.15, 0.14), LIVE._replace(samples=1), 0.1, resizable=False) == ""
    assert is_resizable(CameraConfig()) and not is_resizable(CameraConfig(focal_x_px=500.0))


def test_time_goes_with_pixels_and_samples() -> None:
    measured = FrameTime(0.5, 0.4, 0.05, publishing_s=0.05)
    clean = LIVE._replace(denoised=True)
    assert predicted_s(measured, clean, clean) == pytest.approx(0.55)
    assert predicted_s(measured, clean, clean._replace(samples=1, width=320)) == pytest.approx(0.175)
    assert predicted_s(measured, clean, LIVE) == pytest.approx(0.5)


@pytest.mark.parametrize(("seconds", "rate_hz"), [(0.42, 2.0), (0.3, 3.0), (0.25, 3.5), (0.033, 27.0), (2.0, 0.4), (60.0, 0.1)])
def test_rates_are_round_and_lower_than_reached(seconds: float, rate_hz: float) -> None:
    assert proposed_rate_hz(FrameTime(seconds)) == rate_hz

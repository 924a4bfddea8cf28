"""Matched images: known shifts, then devices in scenes with known depth."""

import numpy as np
import pytest
from sensor_scenes import EYE, WIDE, plate, read, wall

from renderer import CameraConfig, DepthSensorConfig, Renderer, RenderError
from renderer.core.kernel import from_python
from renderer.sensors.block_matcher import census, make_match_scratch, match_rows
from renderer.sensors.devices import DEVICES
from renderer.sensors.virtual_images import pattern

D435 = DEVICES["realsense_d435"][1]


def match(left, right, device=D435, workers=1):
    """Return the disparity of two images."""
    height, width = left.shape
    words, result = np.zeros((2, height, width), np.uint32), np.zeros((height, width), np.float32)
    for image, word in zip((left, right), words, strict=True):
        census(image, device, word, 0, 1)
    for begin in range(0, height, workers):
        match_rows(words[0], words[1], left, device, make_match_scratch(width, device), result, begin, min(begin + workers, height))
    return result


def texture(seed, height=60, width=200):
    """Return a smooth random image up to 1023."""
    rng = np.random.default_rng(seed)
    spectrum = np.fft.rfft2(rng.standard_normal((height, width)))
    spectrum *= np.exp(-40.0 * (np.fft.fftfreq(height)[:, None] ** 2 + np.fft.rfftfreq(width) ** 2))
    image = np.fft.irfft2(spectrum, (height, width))
    return spectrum, (512 + 160 * image / image.std()).clip(0, 1023).astype(np.float32)


@pytest.mark.parametrize("shift", [7, 40])
def test_a_whole_shift_is_found_exactly(shift):
    _, left = texture(1)
    found = match(left, np.roll(left, -shift, axis=1))[20:-20, shift + 40 : -40]
    assert np.isfinite(found).mean() > 0.98 and np.abs(found - shift)[np.isfinite(found)].max() <= 2.0 / 32.0


def test_parts_of_a_pixel_are_interpolated_in_steps():
    spectrum, left = texture(2)
    for part in (0.25, 0.5, 0.75):
        moved = np.fft.irfft2(spectrum * np.exp(2j * np.pi * np.fft.rfftfreq(200) * (9.0 + part)), left.shape)
        right = (512 + 160 * moved / np.fft.irfft2(spectrum, left.shape).std()).clip(0, 1023).astype(np.float32)
        found = match(left, right)[20:-20, 60:-40]
        assert np.nanmedian(found) == pytest.approx(9.0 + part, abs=0.07)
        steps = found[np.isfinite(found)] * 32.0
        assert np.array_equal(steps, np.rint(steps))


def test_without_contrast_or_without_a_partner_there_is_no_disparity():
    rng = np.random.default_rng(3)
    flat = (300.0 + rng.standard_normal((60, 200))).astype(np.float32)
    assert np.isnan(match(flat, flat)).all()
    _, left = texture(4)
    _, other = texture(5)
    assert np.isnan(match(left, other)[20:-20, 140:-40]).mean() > 0.85


def test_rows_are_split_at_will():
    _, left = texture(6)
    right = np.roll(left, -5, axis=1)
    assert match(left, right, workers=1).tobytes() == match(left, right, workers=60).tobytes() == match(left, right, workers=7).tobytes()


def test_the_pattern_has_as_many_dots_as_told_and_a_mean_of_one():
    evaluate = from_python(pattern)
    half_width, half_height, count = np.tan(np.radians(43.0)), np.tan(np.radians(28.5)), 400
    u, v = np.meshgrid((np.arange(count) + 0.5) / count * 0.4 - 0.2, (np.arange(count) + 0.5) / count * 0.4 - 0.2)
    image = np.vectorize(lambda x, y: evaluate(x, y, 5000.0, 0.002))(u, v)
    assert image.mean() == pytest.approx(1.0, abs=0.06)
    inner = image[1:-1, 1:-1]
    around = [image[1 + i : count - 1 + i, 1 + j : count - 1 + j] for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]
    peaks = np.logical_and.reduce([inner > other for other in around]).sum()
    assert peaks == pytest.approx(5000 * 0.16 / (4.0 * half_width * half_height), rel=0.15)  # dots that touch are one peak
    assert evaluate(half_width + 0.01, 0.0, 5000.0, 0.002) == evaluate(0.0, half_height + 0.01, 5000.0, 0.002) == 0.0


@pytest.mark.parametrize("distance", [0.7, 1.5, 2.6])
def test_the_d435_reads_a_bare_wall_to_a_tenth_of_a_pixel(distance):
    sensed, true = read([wall(distance, tilt=0.2)], WIDE, model="realsense_d435")
    disparity = WIDE.focal_length_px * 0.05
    inner = np.s_[20:-20, 60:-20]
    error = (disparity / sensed - disparity / true)[inner]
    good = np.isfinite(error)
    assert good.mean() > 0.95 and abs(np.median(error[good])) < 0.05
    assert 0.02 < 1.4826 * np.median(np.abs(error[good])) < 0.14


def test_the_d435_is_blind_where_one_camera_sees_nothing_and_too_near():
    sensed, true = read([wall(2.0), plate(0.8, (0.0, -0.3), (0.4, 0.3))], WIDE, model="realsense_d435")
    shadow = WIDE.focal_length_px * 0.05 * (1.0 / 0.8 - 1.0 / 2.0)  # 8.8 pixels left of the plate, hidden from the right camera
    band = np.abs(sensed - true)[100:140, int(159 - shadow) : 159]
    assert (np.isnan(band) | (band > 0.3)).mean() > 0.8  # lost, or taken for the plate's
    nearest = WIDE.focal_length_px * 0.05 / 126.0
    sensed, true = read([wall(0.7 * nearest)], WIDE, model="realsense_d435")
    assert np.isnan(sensed).mean() > 0.9 and not (np.abs(sensed - true) < 0.1 * true).any()


def test_passive_stereo_needs_texture_where_the_d435_does_not():
    blind, _ = read([wall(1.5)], WIDE, model="stereo")
    seen, _ = read([wall(1.5)], WIDE, model="realsense_d435")
    assert np.isfinite(blind).mean() < 0.01 and np.isfinite(seen).mean() > 0.75


def test_a_distorted_lens_reads_the_same_wall():
    camera = CameraConfig(model="brown_conrady", width=320, height=240, horizontal_fov_rad=1.2, distortion=(-0.1, 0.02))
    sensed, true = read([wall(1.2, tilt=0.3)], camera, model="realsense_d435")
    error = np.abs(sensed - true)[20:-20, 60:-20]
    assert np.isfinite(error).mean() > 0.9 and np.nanmedian(error) < 0.01


def test_a_fisheye_is_refused():
    camera = CameraConfig(model="kannala_brandt", width=64, height=64, horizontal_fov_rad=3.0)
    with pytest.raises(RenderError, match=r"^depth_sensor\.model: expected a camera whose lens maps a plane, got a fisheye"):
        read([wall(1.2)], camera, model="kinect_v2")
    sensed, true = read([wall(1.2)], camera, model="ideal")
    np.testing.assert_array_equal(sensed, true)


@pytest.mark.parametrize("model", [name for name in DEVICES if name != "ideal"])
def test_bytes_depend_on_scene_and_frame_and_not_on_threads(model):
    pieces = [wall(1.6, tilt=0.3), plate(1.0, (-0.1, -0.2), (0.2, 0.1)), plate(1.3, (0.3, -0.1), (0.5, 0.4), color=(0.1, 0.2, 0.3))]
    camera = CameraConfig(width=150, height=101, horizontal_fov_rad=1.2)
    one = read(pieces, camera, model=model, threads=1)[0]
    assert one.tobytes() == read(pieces, camera, model=model, threads=3)[0].tobytes()
    assert one.tobytes() != read(pieces, camera, model=model, frame=1)[0].tobytes() or model == "stereo"


def test_an_ideal_sensor_reads_the_truth_and_traces_nothing_of_its_own(monkeypatch):
    monkeypatch.setattr(Renderer, "_read_depth", None)
    sensed, true = read([wall(1.6), plate(1.0, (-0.1, -0.2), (0.2, 0.1))], WIDE)
    np.testing.assert_array_equal(sensed, true)
    assert DepthSensorConfig().model == "ideal" and EYE.stamp_ns == 0

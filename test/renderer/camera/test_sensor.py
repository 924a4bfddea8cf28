"""The sensor against its own laws: the photon transfer curve, means kept, steps and saturation, vignetting by angle."""

import math

import numpy as np
import pytest
from box_room import VIEW, box, furnished_room, pose, scene

from renderer import CameraConfig, RenderConfig, Renderer, SensorConfig
from renderer.camera.cameras import pose_camera
from renderer.camera.sensor import expose, vignetting
from renderer.core.errors import RenderError
from renderer.exposure import exposed, sensor_ev100

SHAPE = (200, 200, 3)
WHITE, WELL = 400.0, 4000.0


def read(electrons, **settings):
    """Electrons that are read of an even image."""
    sensor = SensorConfig(full_well_e=WELL, **settings)
    image = np.full(SHAPE, electrons * WHITE / WELL, np.float32)
    return expose(image, WHITE, sensor, np.uint32(7)).astype(np.float64) * WELL / WHITE


@pytest.mark.parametrize("electrons", [0.4, 3.0, 30.0, 59.0, 61.0, 300.0, 2500.0])
def test_shot_noise_is_poissons(electrons):
    got = read(electrons)
    n = got.size
    assert got.mean() == pytest.approx(electrons, abs=5 * math.sqrt(electrons / n))
    assert got.var() == pytest.approx(electrons, rel=5 * math.sqrt((2 + 1 / electrons) / n))
    skew = ((got - got.mean()) ** 3).mean() / got.std() ** 3
    assert skew == pytest.approx(1 / math.sqrt(electrons), abs=0.06)
    assert np.array_equal(np.rint(got), np.round(got, 2))  # whole electrons


def test_the_photon_transfer_curve():
    """Variance = mean + read noise^2 + step^2 / 12."""
    noise, bits = 12.0, 8
    step = WELL / (255 - round(0.1 * 255))
    for electrons in (50.0, 500.0, 2000.0):
        got = read(electrons, read_noise_e=noise, bits=bits, black_level=0.1)
        assert got.mean() == pytest.approx(electrons, abs=1.0)
        assert got.var() == pytest.approx(electrons + noise**2 + step**2 / 12, rel=0.03)
        codes = got / step
        assert np.abs(codes - np.rint(codes)).max() < 1e-3


def test_dark_noise_survives_above_the_black_level_and_is_cut_without_it():
    above, cut = (read(0.0, read_noise_e=30.0, bits=10, black_level=level) for level in (0.1, 0.0))
    assert above.mean() == pytest.approx(0.0, abs=0.5) and above.min() < -60.0
    assert cut.min() == 0.0 and cut.mean() == pytest.approx(30.0 / math.sqrt(2 * math.pi), rel=0.05)


def test_wells_fill_up():
    assert (read(3 * WELL, bits=8) == pytest.approx(WELL)) and read(3 * WELL).max() == pytest.approx(WELL)


def test_an_ideal_sensor_changes_nothing():
    image = np.random.default_rng(0).uniform(0, 1e4, (5, 7, 3)).astype(np.float32)
    assert expose(image, WHITE, SensorConfig(), np.uint32(1)) is image


def test_noise_belongs_to_frame_and_pixel():
    image = np.full((20, 30, 3), 100.0, np.float32)
    sensor = SensorConfig(full_well_e=WELL, read_noise_e=3.0)
    first, again, other = (expose(image, WHITE, sensor, np.uint32(key)) for key in (5, 5, 6))
    assert np.array_equal(first, again) and not np.array_equal(first, other)
    brighter = image.copy()
    brighter[3, 4] *= 2
    changed = expose(brighter, WHITE, sensor, np.uint32(5)) != first
    assert changed[3, 4].all() and changed.sum() == 3
    assert np.corrcoef(first[:, :-1, 0].ravel(), first[:, 1:, 0].ravel())[0, 1] == pytest.approx(0.0, abs=0.15)
    assert np.corrcoef(first[..., 0].ravel(), first[..., 1].ravel())[0, 1] == pytest.approx(0.0, abs=0.15)


@pytest.mark.parametrize("model", ["pinhole", "kannala_brandt"])
def test_a_simple_lens_darkens_by_the_cosines_fourth_power(model):
    camera = CameraConfig(model=model, width=64, height=48, horizontal_fov_rad=1.4)
    share = vignetting(pose_camera(camera, VIEW), 1.0, 0.0)
    off = math.hypot(31.5, 23.5) / camera.focal_length_px
    angle = math.atan(off) if model == "pinhole" else off
    assert share[0, 0] == pytest.approx(math.cos(angle) ** 4, rel=1e-4)
    assert share[24, 32] == pytest.approx(1.0, abs=1e-3)


def test_corners_lose_what_is_asked():
    view = pose_camera(CameraConfig(width=640, height=480), VIEW)
    share = vignetting(view, 0.0, 0.3)
    assert share[0, 0] == pytest.approx(0.7, abs=2e-3) and share[240, 320] == pytest.approx(1.0, abs=1e-4)
    assert vignetting(view, 0.0, 0.0) is None


def test_an_even_room_through_lens_and_sensor_is_darker_in_the_corners_and_layers_stay():
    room = scene(box((-2, -2, 0), (2, 2, 2), inside=True, color=(0, 0, 0), emission=(20.0, 20.0, 20.0)))
    camera, config = CameraConfig(width=64, height=48), RenderConfig(samples_per_pixel=2, max_depth=2, threads=1)
    pictures = []
    for sensor in (SensorConfig(), SensorConfig(vignetting=1.0, full_well_e=1e5, bits=12)):
        with Renderer(room, camera, config, 5, sensor=sensor) as renderer:
            pictures.append(renderer.render(pose((0, 0, 1), (1, 0.2, 1)), 0, ("color", "color_sensed", "depth")))
    ideal, real = pictures
    assert all(np.array_equal(ideal.layers[name], real.layers[name]) for name in ("color", "depth"))
    assert np.array_equal(ideal.radiance, real.radiance)
    assert np.array_equal(ideal.layers["color"], ideal.layers["color_sensed"])
    color = real.layers["color_sensed"].astype(int)
    assert abs(color[22:26, 30:34].mean() - ideal.layers["color"].mean()) < 2 and color[:3, :3].mean() < color[22:26, 30:34].mean() - 15


def test_bytes_do_not_depend_on_threads():
    camera = CameraConfig(width=48, height=32)
    noisy = SensorConfig(full_well_e=2000.0, read_noise_e=4.0, bits=10, black_level=0.05, bayer="rggb", red_shift_px=1.0, jpeg_quality=80)
    shown = []
    for threads in (1, 3):
        with Renderer(
            furnished_room(), camera, RenderConfig(samples_per_pixel=2, max_depth=3, threads=threads), 5, sensor=noisy
        ) as renderer:
            shown.append(renderer.render(VIEW, 4, ("color", "color_sensed")).layers)
    assert np.array_equal(shown[0]["color_sensed"], shown[1]["color_sensed"])
    assert not np.array_equal(shown[0]["color_sensed"], shown[0]["color"])


def test_speed_aperture_and_time_make_an_exposure_value():
    """ISO 100, f/1 and 1 s are EV 0 by definition; f/8 and 1/125 s at ISO 200 are EV 11.97."""
    assert sensor_ev100(CameraConfig(f_stop=1.0, shutter_s=1.0), SensorConfig(iso=100.0)) == 0.0
    fixed = sensor_ev100(CameraConfig(f_stop=8.0, shutter_s=1 / 125), SensorConfig(iso=200.0))
    assert fixed == pytest.approx(math.log2(64 * 125 / 2))
    assert exposed(RenderConfig(auto_exposure=True), None, fixed).ev100 == fixed
    assert sensor_ev100(CameraConfig(), SensorConfig()) is None
    with pytest.raises(RenderError, match=r"sensor.iso: expected camera.f_stop and camera.shutter_s above 0"):
        sensor_ev100(CameraConfig(f_stop=2.0), SensorConfig(iso=100.0))

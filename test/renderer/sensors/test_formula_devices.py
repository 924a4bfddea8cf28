"""Devices whose noise is a formula: its deviation on planes, steps, ranges, shadows, holes, edges, mirrors and glass."""

import math
from typing import get_args

import numpy as np
import pytest
from sensor_scenes import NARROW, WIDE, incidence, plate, read, wall

from renderer import DepthSensorConfig
from renderer.core.kernel import from_python
from renderer.sensors.devices import DEVICES, Device, device_of
from renderer.sensors.surfaces_seen import axial_deviation
from scene_description.strict import field_types, split_annotation

FORMULA_DEVICES = ("kinect_v1", "kinect_v2", "azure_kinect")


def nguyen(z, angle):
    return 0.0012 + 0.0019 * (z - 0.4) ** 2 + 0.0001 / np.sqrt(z) * (angle / (np.pi / 2 - angle)) ** 2


def fankhauser(z, angle):
    return 1e-3 * (1.5 - 0.5 * z + 0.3 * z**2 + 0.1 * z**1.5 * (angle / (np.pi / 2 - angle)) ** 2)


def azure(z, angle):
    bound = 0.0005 + 0.0165 * (z / 3.86) ** 2 + 1e-4 * z**1.5 * (angle / (np.pi / 2 - angle)) ** 2
    return bound * math.sqrt(0.15 / 0.5)


PUBLISHED = {"kinect_v1": nguyen, "kinect_v2": fankhauser, "azure_kinect": azure}


@pytest.mark.parametrize("model", FORMULA_DEVICES)
def test_the_deviation_is_the_published_one(model):
    deviation = from_python(axial_deviation)
    for z in (0.6, 1.0, 2.5, 3.8):
        for angle in (0.0, 0.5, 1.2):
            assert deviation(device_of(DepthSensorConfig(model=model))[1], z, angle, 0.5) == pytest.approx(PUBLISHED[model](z, angle))
    assert deviation(DEVICES["azure_kinect"][1], 3.86, 0.0, 0.15) == pytest.approx(0.017)


@pytest.mark.parametrize("model", FORMULA_DEVICES)
@pytest.mark.parametrize("tilt_deg", [0, 35, 60])
@pytest.mark.parametrize("distance", [0.8, 2.0, 3.3])
def test_planes_are_read_with_the_published_deviation(model, tilt_deg, distance):
    tilt = math.radians(tilt_deg)
    sensed, true = read([wall(distance, tilt=tilt)], model=model)
    inner = np.s_[10:-10, 60:-60]
    sensed, true, angle = sensed[inner], true[inner], incidence(sensed.shape, NARROW, tilt)[inner]
    assert np.isfinite(sensed).mean() > 0.99
    error = ((sensed - true) / PUBLISHED[model](true, angle))[np.isfinite(sensed)]
    assert abs(error.mean()) < 0.05 and error.std() == pytest.approx(1.0, abs=0.05)


def test_kinect_v1_counts_inverse_depth_in_steps():
    sensed, _ = read([wall(2.5, tilt=0.6)], WIDE, model="kinect_v1")
    count = 351.3 / sensed[np.isfinite(sensed)]
    assert np.abs(count - np.rint(count)).max() < 1e-3 and len(np.unique(np.rint(count))) > 20


def test_a_figure_of_the_configuration_replaces_the_devices_own():
    assert set(Device._fields) == {name for name in DepthSensorConfig.__dataclass_fields__ if name != "model"}
    assert get_args(split_annotation(field_types(DepthSensorConfig)["model"])[0]) == tuple(DEVICES)
    _, device = device_of(DepthSensorConfig(model="kinect_v1", max_range_m=3.0, inverse_depth_step_per_m=0.0))
    assert device == DEVICES["kinect_v1"][1]._replace(max_range_m=3.0, inverse_depth_step_per_m=0.0)
    sensed, _ = read([wall(3.3)], model="kinect_v1", max_range_m=3.0)
    assert np.isposinf(sensed).all()


@pytest.mark.parametrize("model", FORMULA_DEVICES)
def test_beyond_the_range_are_infinities(model):
    device = DEVICES[model][1]
    assert np.isneginf(read([wall(0.8 * device.min_range_m)], model=model)[0]).all()
    assert np.isposinf(read([wall(1.2 * device.max_range_m, color=(0.9, 0.9, 0.9))], model=model)[0]).mean() > 0.99
    assert np.isposinf(read([wall(2.0, portal=True, transmission=0.9)], model=model)[0]).all()  # light leaves by a window


@pytest.mark.parametrize("model", FORMULA_DEVICES)
def test_dark_and_oblique_surfaces_are_lost(model):
    for share, least, most in ((3.0, 0.99, 1.0), (1.0, 0.35, 0.65), (0.3, 0.0, 0.01)):
        dark = 4.0 * share * 0.02 - 0.01  # gloss of 4 % returns 0.01 from a rough surface
        sensed, _ = read([wall(2.0, color=(dark,) * 3)], model=model, signal_min=0.02)
        assert least <= np.isfinite(sensed).mean() <= most, share
    steep, _ = read([wall(2.0, tilt=math.radians(86.0))], model=model, signal_min=0.0)  # 86 degrees in the middle, more on its left
    assert not np.isfinite(steep[:, 100:160]).any()


def test_the_projectors_shadow_is_as_wide_as_geometry_says():
    # Seen from the camera, shadow lies left of the plate, as the projector is on its right: f b (1 / z1 - 1 / z2) pixels.
    pieces = [wall(2.0), plate(1.0, (0.0, -0.2), (0.2, 0.2))]
    sensed, _ = read(pieces, WIDE, model="kinect_v1", lateral_noise_px=0.0, lateral_grazing_px=0.0, window_agreement=0.0)
    holes = np.flatnonzero(np.isnan(sensed[120]))
    width = WIDE.focal_length_px * 0.075 * (1.0 / 1.0 - 1.0 / 2.0)
    assert len(holes) == pytest.approx(width, abs=1.5) and holes.max() == 159 and holes.max() - holes.min() == len(holes) - 1
    lone, _ = read(pieces, WIDE, model="kinect_v1", lateral_noise_px=0.0, lateral_grazing_px=0.0, window_agreement=0.8)
    assert np.isnan(lone[120]).sum() > len(holes)  # where the window sees too little of the wall


def test_edges_waver_by_the_lateral_noise():
    pieces = [wall(2.0), plate(1.9, (0.0, -2.0), (3.0, 2.0))]
    sensed, _ = read(pieces, WIDE, model="kinect_v1", window_agreement=0.0, noise_floor_m=0.0, noise_growth_per_m=0.0)
    near = np.where(np.isfinite(sensed), sensed < 1.95, np.nan)
    share = np.nanmean(near[:, 150:170], axis=0)  # the edge lies between columns 159 and 160
    # Rounded to whole pixels, a normal number of 0.8 + 0.035 theta / (pi / 2 - theta) px crosses n pixels as often as this.
    beyond = [0.5 * math.erfc((n - 0.5) / 0.8 / math.sqrt(2.0)) for n in (1, 2)]
    np.testing.assert_allclose(share[10:12], [1 - beyond[0], 1 - beyond[1]], atol=0.09)
    assert share[12:].min() > 0.97


@pytest.mark.parametrize("model", FORMULA_DEVICES)
def test_a_mirror_shows_the_room_behind_the_device_and_glass_what_lies_behind_it(model):
    behind = wall(-0.8, color=(0.9, 0.9, 0.9))
    mirror = plate(1.2, (-1.0, -1.0), (1.0, 1.0), color=(0.95,) * 3, metallic=1.0, roughness=0.02)
    sensed, true = read([behind, mirror], model=model)
    assert np.nanmedian(true) == pytest.approx(1.2) and np.nanmedian(sensed) == pytest.approx(3.2, rel=0.01)
    glass = plate(1.2, (-1.0, -1.0), (1.0, 1.0), transmission=1.0, roughness=0.0, ior=1.5, color=(1.0,) * 3)
    sensed, true = read([wall(2.5), glass], model=model)
    assert np.nanmedian(true) == pytest.approx(1.2) and np.nanmedian(sensed) == pytest.approx(2.5, rel=0.01)


def test_gloss_head_on_saturates_and_gloss_aslant_returns_nothing():
    steel = {"color": (0.6, 0.6, 0.6), "metallic": 1.0, "roughness": 0.3}
    assert np.isnan(read([wall(0.6, **steel)], model="kinect_v2", signal_max=20.0)[0][110:130, 150:170]).all()
    assert np.isnan(read([wall(2.0, tilt=0.9, **steel)], model="kinect_v2")[0][:, :120]).mean() > 0.99
    assert np.isfinite(read([wall(2.0, **steel)], model="kinect_v2")[0]).mean() > 0.99

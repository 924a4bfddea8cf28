"""The guide: its bins are sampled as their density says, means stay what they are, and noise is less."""

import math

import numpy as np
import pytest
from box_room import box, pose, quad, scene
from impatience import prepared_impatiently

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.core import lanes as ln
from renderer.core import sampling
from renderer.core.kernel import from_python
from renderer.core.lanes import LANES_SIZE
from renderer.core.ray_packet import LANES, aligned_floats
from renderer.path import guide as gd
from renderer.path.guide import EDGE, WEIGHTS, Guide

sample_guide, mix_guide_pdf = from_python(gd.sample_guide), from_python(gd.mix_guide_pdf)
sample_hemisphere, invert_hemisphere = from_python(sampling.sample_cosine_hemisphere), from_python(sampling.invert_cosine_hemisphere)
VIEW = pose((0.5, 0.6, 1.0), (3.0, 2.4, 1.2))


def one_cell(bins):
    """A guide of one cell whose normal is z, of these bins with a mean of 1."""
    levels = [bins]
    while len(levels[0]) > 2:
        half = len(levels[0]) // 2
        levels.insert(0, levels[0].reshape(half, 2, half, 2).sum(axis=(1, 3)))
    weights = np.concatenate([level.ravel() for level in levels]).astype(np.float32)
    assert len(weights) == WEIGHTS
    return Guide(np.zeros(1, np.int32), np.zeros(1, np.int32), np.eye(3, dtype=np.float32).ravel(), weights, np.ones(1, np.float32))


def skewed_bins():
    bins = 0.1 + np.random.default_rng(3).gamma(0.5, size=(EDGE, EDGE))
    return bins / bins.mean()


def lanes_with(**fields):
    """Lanes whose shading frame is that of the world, with these numbers or rows of 16."""
    lanes = aligned_floats(LANES_SIZE)
    lanes[:] = 0.0
    for name, value in {"TANGENT_X": 1.0, "BITANGENT_Y": 1.0, "NS_Z": 1.0, **fields}.items():
        lanes[getattr(ln, name) : getattr(ln, name) + LANES] = value
    return lanes


def field(lanes, place):
    return lanes[place : place + LANES].astype(np.float64)


def directions(lanes):
    return np.stack([field(lanes, place) for place in (ln.WI_X, ln.WI_Y, ln.WI_Z)], axis=-1)


def density(guide, way):
    """The pdf of unit directions (n, 3) where all rays are sampled from the bins."""
    found = []
    for some in np.array_split(way.astype(np.float32), -(-len(way) // LANES)):
        padded = np.resize(some, (LANES, 3))
        lanes = lanes_with(SHARE=1.0, WI_X=padded[:, 0], WI_Y=padded[:, 1], WI_Z=padded[:, 2])
        mix_guide_pdf(guide, lanes)
        found.append(field(lanes, ln.PDF)[: len(some)])
    return np.concatenate(found)


def test_hemisphere_and_square_map_onto_each_other():
    for u, v in np.random.default_rng(1).random((200, 2)).astype(np.float32):
        x, y, _ = sample_hemisphere(u, v)
        assert invert_hemisphere(x, y) == pytest.approx((u, v), abs=3e-6)


def test_directions_are_sampled_as_often_as_their_bins_weigh():
    """Chi-square over 256 bins, 4 deviations of its own above the mean at most."""
    bins, generator = skewed_bins(), np.random.default_rng(5)
    guide, packets, counts = one_cell(bins), 2000, np.zeros((EDGE, EDGE))
    for _ in range(packets):
        u, v = generator.random((2, LANES), np.float32)
        lanes = lanes_with(SHARE=1.0, U_GUIDE=0.5, U_BSDF_0=u, U_BSDF_1=v)
        sample_guide(guide, lanes)
        for x, y, _ in directions(lanes):
            s, t = invert_hemisphere(np.float32(x), np.float32(y))
            counts[int(s * EDGE), int(t * EDGE)] += 1
    expected = bins / bins.sum() * packets * LANES
    freedom = EDGE * EDGE - 1
    assert ((counts - expected) ** 2 / expected).sum() < freedom + 4.0 * math.sqrt(2.0 * freedom)


def test_the_density_integrates_to_one_over_the_sphere_and_is_none_below():
    way = np.random.default_rng(7).normal(size=(40_000, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    pdf = density(one_cell(skewed_bins()), way)
    assert (pdf[way[:, 2] < 0.0] == 0.0).all()
    error = 4.0 * math.pi * pdf.std() / math.sqrt(len(pdf))
    assert 4.0 * math.pi * pdf.mean() == pytest.approx(1.0, abs=4.0 * error)


def test_of_two_ways_to_sample_the_density_is_the_mean():
    """A lane without a share keeps its own, even an infinite one."""
    way = np.array([[0.3, -0.4, math.sqrt(0.75)]])
    guide = one_cell(skewed_bins())
    lanes = lanes_with(
        SHARE=np.arange(LANES) % 2 * 0.25, PDF=np.where(np.arange(LANES) % 2, 2.0, np.inf), WI_X=0.3, WI_Y=-0.4, WI_Z=way[0, 2]
    )
    mix_guide_pdf(guide, lanes)
    pdf = field(lanes, ln.PDF)
    assert np.isinf(pdf[::2]).all()
    np.testing.assert_allclose(pdf[1::2], 0.75 * 2.0 + 0.25 * density(guide, way)[0], rtol=1e-5)


def images(flat, samples, *, guiding, threads=2, frame=0, depth=32, **other):
    config = RenderConfig(samples_per_pixel=samples, max_depth=depth, guiding=guiding, threads=threads)
    with Renderer(flat, CameraConfig(width=40, height=24, horizontal_fov_rad=1.2), config, 5, **other) as renderer:
        return renderer.render(VIEW, frame, ("radiance", "variance")).layers


def lamp_behind_a_board():
    """A room whose lamp lights a wall behind a board, so that all that is seen comes by way of it; with matt and glossy things."""
    walls = box((0, 0, 0), (4, 3, 2.5), inside=True, color=(0.7, 0.6, 0.5), roughness=1.0)
    board = box((0.3, 2.0, 0.0), (3.0, 2.05, 2.2), color=(0.6, 0.6, 0.6), roughness=1.0)
    lamp = quad((1.0, 2.3, 0.3), (0.1, 0, 0), (0, 0, 0.1), emission=(4000.0, 4000.0, 4000.0))
    table = box((2.0, 1.0, 0.0), (2.8, 1.6, 0.8), color=(0.5, 0.3, 0.2), roughness=0.3, ior=1.5)
    return scene(walls, board, lamp, table)


def test_a_guided_furnace_sums_to_one():
    room = scene(box((0, 0, 0), (4, 3, 2.5), inside=True, emission=(0.5,) * 3, color=(0.5,) * 3))
    assert images(room, 64, guiding=True)["radiance"].mean() == pytest.approx(1.0, abs=5e-3)


def test_a_guided_room_has_the_same_mean_with_less_noise():
    """Within 4 standard errors, less than 2 % of it; with a fifth of the samples the guided picture has less variance than the other."""
    flat = lamp_behind_a_board()
    pictures = [images(flat, samples, guiding=guiding) for samples, guiding in ((1000, False), (200, True))]
    (plain, plain_error), (guided, error) = (green_mean(picture) for picture in pictures)
    assert math.hypot(plain_error, error) < 0.02 * plain
    assert abs(guided - plain) < 4.0 * math.hypot(plain_error, error)
    assert error < plain_error


def green_mean(picture):
    """The mean of green, and its standard error."""
    return picture["radiance"][:, :, 1].mean(), math.sqrt(picture["variance"][:, :, 1].sum()) / picture["variance"][:, :, 1].size


def test_bytes_depend_on_neither_threads_nor_pieces_nor_whose_guide_it_is():
    flat = lamp_behind_a_board()
    one = images(flat, 4, guiding=True, threads=1)["radiance"]
    np.testing.assert_array_equal(images(flat, 4, guiding=True, threads=2, paths_per_piece=512)["radiance"], one)
    config = RenderConfig(samples_per_pixel=1, guiding=True, threads=2)
    with Renderer(flat, CameraConfig(width=8, height=8), config, 1) as other:
        other.prepare(VIEW)
        np.testing.assert_array_equal(images(flat, 4, guiding=True, like=other)["radiance"], one)


def test_a_guide_that_was_cancelled_is_finished_later():
    flat = lamp_behind_a_board()
    expected = images(flat, 2, guiding=True)["radiance"]
    config = RenderConfig(samples_per_pixel=2, max_depth=32, guiding=True, threads=1)
    with Renderer(flat, CameraConfig(width=40, height=24, horizontal_fov_rad=1.2), config, 5) as renderer:
        assert prepared_impatiently(renderer, VIEW, 100) > 2
        np.testing.assert_array_equal(renderer.render(VIEW, 0, ("radiance",)).layers["radiance"], expected)


def test_a_scene_without_surfaces_large_enough_for_cells_is_not_guided():
    tiny = quad((1.0, 1.0, 1.0), (1e-3, 0, 0), (0, 1e-3, 0), color=(0.5,) * 3)
    plain, guided = (images(scene(tiny), 2, guiding=guiding)["radiance"] for guiding in (False, True))
    np.testing.assert_array_equal(guided, plain)

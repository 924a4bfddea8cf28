"""Final gathering: light is that of the path tracer, with less noise and fewer rays; what is close by, glossy or unknown is traced on."""

import math

import numpy as np
import pytest
from box_room import box, pose, quad, scene
from impatience import prepared_impatiently

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.kernel import from_python
from renderer.core.ray_packet import LANES
from renderer.path import final_gathering as fg
from renderer.path.light_nodes import CORNERS, NOTHING_KNOWN, KnownLight
from renderer.path.queues import WAVE
from renderer.path.records import make_scratch

gather_known_light, end_gathered_paths = from_python(fg.gather_known_light), from_python(fg.end_gathered_paths)
VIEW = pose((0.5, 0.6, 1.0), (3.0, 2.4, 1.2))
CAMERA = CameraConfig(width=40, height=24, horizontal_fov_rad=1.2)
UNLIMITED = np.float32(np.inf)


def config(samples, *, final_gathering=True, threads=2, **changed):
    return RenderConfig(
        samples_per_pixel=samples, final_gathering=final_gathering, cache_spacing_m=0.06, cache_rays=64, threads=threads, **changed
    )


def rendered(flat, settings, **other):
    with Renderer(flat, CAMERA, settings, 5, **other) as renderer:
        renderer.prepare(VIEW)
        return renderer.render(VIEW, 0, ("radiance", "variance"))


def lamp_behind_a_board():
    """A room whose lamp lights a wall behind a board, so that all that is seen comes by way of it; with matt and glossy things."""
    walls = box((0, 0, 0), (4, 3, 2.5), inside=True, color=(0.7, 0.6, 0.5), roughness=1.0)
    board = box((0.3, 2.0, 0.0), (3.0, 2.05, 2.2), color=(0.6, 0.6, 0.6), roughness=1.0)
    lamp = quad((1.0, 2.3, 0.3), (0.1, 0, 0), (0, 0, 0.1), emission=(4000.0, 4000.0, 4000.0))
    table = box((2.0, 1.0, 0.0), (2.8, 1.6, 0.8), color=(0.5, 0.3, 0.2), roughness=0.3, ior=1.5)
    return scene(walls, board, lamp, table)


def green_mean(frame):
    """The mean of green, and its standard error."""
    layers = frame.layers
    return layers["radiance"][:, :, 1].mean(), math.sqrt(layers["variance"][:, :, 1].sum()) / layers["variance"][:, :, 1].size


def test_white_things_vanish_in_a_room_that_glows():
    """What glows reflects 0.03 of the light: everything has the luminance 1 / 0.97, matt, glossy, coated and of metal."""
    walls = box((0, 0, 0), (4, 3, 2.5), inside=True, color=(1.0,) * 3, glow_cd_m2=1.0)
    matt = box((2.0, 1.0, 0.0), (2.8, 1.6, 0.8), color=(1.0,) * 3, roughness=1.0)
    glossy = box((1.2, 1.6, 0.0), (1.7, 2.2, 0.9), color=(1.0,) * 3, roughness=0.4, ior=1.5, clearcoat=1.0)
    metal = box((3.0, 1.9, 0.0), (3.4, 2.3, 1.2), color=(1.0,) * 3, roughness=0.6, metallic=1.0)
    image = rendered(scene(walls, matt, glossy, metal), config(64)).layers["radiance"]
    assert image.mean() == pytest.approx(1 / 0.97, rel=3e-3)
    assert np.abs(image - 1 / 0.97).max() < 0.1


def test_a_gathered_room_has_the_same_mean_with_less_noise_and_fewer_rays():
    """The mean within 2 % and 4 standard errors, which are less than 2 % of it; a sample's variance less than half, its rays too."""
    flat = lamp_behind_a_board()
    plain, gathered = rendered(flat, config(1000, final_gathering=False)), rendered(flat, config(200))
    (mean, error), (near, near_error) = green_mean(plain), green_mean(gathered)
    assert math.hypot(error, near_error) < 0.02 * mean
    assert near == pytest.approx(mean, rel=0.02, abs=4.0 * math.hypot(error, near_error))
    assert 200 * near_error**2 < 0.5 * 1000 * error**2
    assert gathered.rays / 200 < 0.5 * plain.rays / 1000


def test_bytes_depend_on_neither_threads_nor_pieces_nor_who_has_gathered_before():
    flat = lamp_behind_a_board()
    one = rendered(flat, config(4, threads=1)).layers["radiance"]
    np.testing.assert_array_equal(rendered(flat, config(4), paths_per_piece=512).layers["radiance"], one)
    with Renderer(flat, CameraConfig(width=8, height=8), config(1), 5) as other:
        other.prepare(VIEW)
        np.testing.assert_array_equal(rendered(flat, config(4), like=other).layers["radiance"], one)


def test_light_that_is_cancelled_while_it_is_gathered_is_finished_later():
    flat = lamp_behind_a_board()
    expected = rendered(flat, config(2)).layers["radiance"]
    with Renderer(flat, CAMERA, config(2, threads=1), 5) as renderer:
        assert prepared_impatiently(renderer, VIEW, 1000) > 2
        np.testing.assert_array_equal(renderer.render(VIEW, 0, ("radiance",)).layers["radiance"], expected)


def hits(**fields):
    """The memory of a thread whose packet has hit the front of one triangle, a metre away, by rays that have spread by 0.6."""
    scratch = make_scratch(0)
    scratch.lane_slot[:] = np.arange(LANES)
    real, integer = scratch.rays.real, scratch.rays.integer
    integer[ray.PRIM_ID : ray.PRIM_ID + LANES] = 0
    real[ray.BARY_U : ray.BARY_U + LANES] = real[ray.BARY_V : ray.BARY_V + LANES] = 1.0 / 3.0
    real[ray.TFAR : ray.TFAR + LANES] = 1.0
    scratch.lanes[:] = 0.0
    matt = {"DIFFUSE_R": 0.5, "DIFFUSE_G": 0.4, "DIFFUSE_B": 0.3, "PR_DIFFUSE": 1.0}
    path = {"BETA_R": 2.0, "BETA_G": 1.0, "BETA_B": 1.0, "SPREAD": 0.6, "HIT": 1.0, "COS_FRONT": 1.0, "U_LOBE": 0.5}
    for name, value in {**matt, **path, **fields}.items():
        scratch.lanes[getattr(ln, name) : getattr(ln, name) + LANES] = value
    return scratch


def known_light(worth=1.0):
    """Three nodes at the corners of one triangle, of illuminance 1, 2 and 3 times pi; rays are to have spread over 0.5 m."""
    atlas = NOTHING_KNOWN.atlas._replace(cells=np.array([[0, 1, 2, CORNERS]], np.int32), back=np.full(3, -1, np.int32))
    light = np.column_stack([np.repeat(np.arange(1.0, 4.0)[:, None], 3, axis=1), np.full(3, worth)]).astype(np.float32)
    return KnownLight(atlas, light, np.float32(0.5))


def gathered(scratch, known, kinds=0):
    """What pixels have got, (16, 3), and how many paths go on."""
    going = gather_known_light(known, kinds, UNLIMITED, scratch)
    return scratch.light[: 3 * WAVE].reshape(3, WAVE)[:, :LANES].T.copy(), going


def test_what_is_known_ends_the_path():
    scratch = hits()
    light, going = gathered(scratch, known_light())
    np.testing.assert_allclose(light, np.tile([2.0 * 0.5 * 2.0, 0.4 * 2.0, 0.3 * 2.0], (LANES, 1)), rtol=1e-6)
    assert going == 0
    assert (scratch.lanes[ln.HIT : ln.HIT + LANES] == 0.0).all()


@pytest.mark.parametrize(
    ("fields", "worth"),
    [
        ({"SPREAD": 0.4}, 1.0),
        ({"OUTSIDE": 1.0}, 1.0),
        ({"COS_FRONT": -1.0}, 1.0),
        ({"PR_DIFFUSE": 0.0}, 1.0),
        ({"DIFFUSE_TRANSMISSION": 0.5}, 1.0),
        ({}, 0.3),
    ],
    ids=["close by", "outside", "from behind", "mirrors", "a sheet", "within things"],
)
def test_what_is_not_known_is_traced_on(fields, worth):
    scratch = hits(**fields)
    light, going = gathered(scratch, known_light(worth))
    assert (light == 0.0).all()
    assert going == LANES


def test_a_path_goes_on_by_its_other_lobes_as_often_as_it_would_have_been_sent_to_them():
    """A quarter of a surface is gloss: every path brings the matt light and samples lamps by its gloss, a quarter go on."""
    u = (np.arange(LANES) + 0.5) / LANES
    scratch = hits(GLOSSY=1.0, E_MEAN=1.0, PR_DIFFUSE=0.75, PR_SPECULAR=0.25, SHEEN_WEIGHT=0.1, U_LOBE=u)
    light, others = gathered(scratch, known_light(), kinds=1)
    assert others == LANES
    np.testing.assert_allclose(light[:, 1], 0.8, rtol=1e-6)
    fields = {name: scratch.lanes[getattr(ln, name) : getattr(ln, name) + LANES] for name in ("HIT", "BETA_G", "PR_SPECULAR", "PR_DIFFUSE")}
    assert {name: set(values.tolist()) for name, values in fields.items()} == {
        "HIT": {1.0},
        "BETA_G": {1.0},
        "PR_SPECULAR": {0.25},
        "PR_DIFFUSE": {0.0},
    }
    end_gathered_paths(scratch.lanes)
    np.testing.assert_array_equal(fields["HIT"] > 0.0, u >= 0.75)
    np.testing.assert_allclose(scratch.lanes[ln.U_LOBE : ln.U_LOBE + LANES], u - 0.75, rtol=1e-5)


def test_what_is_known_is_limited_as_any_indirect_light_is():
    """A spot of a floor shines by a lamp just above it; no sample of the walls that see it brings more than the limit to its pixel."""
    walls = box((0, 0, 0), (4, 3, 2.5), inside=True, color=(0.7,) * 3, roughness=1.0)
    cover = box((1.9, 1.4, 0.4), (2.1, 1.6, 0.45), color=(0.0,) * 3, roughness=1.0)
    lamp = quad((1.95, 1.45, 0.39), (0, 0.1, 0), (0.1, 0, 0), emission=(3e5,) * 3, color=(0.0,) * 3)
    limit, view = 1.0 / 8.0, pose((0.5, 0.6, 1.0), (0.0, 2.4, 2.2))
    with Renderer(scene(walls, cover, lamp), CAMERA, config(1, clamp=limit), 5) as renderer:
        seen = renderer.render(view, 0, ("radiance", "direct")).layers
    kept = (seen["radiance"] - seen["direct"])[..., 1]
    shared = kept / np.median(kept)
    assert shared.max() < 3.0

"""Tiles and their look-up: exact at texel centres, the mean far away, colours and slopes as written; never a NaN."""

import numpy as np
import pytest

from renderer.core.kernel import from_python
from renderer.geometry.shapes import block
from renderer.textures import look_up
from renderer.textures.apply import AppliedTexture, applied_texture, mapped_once
from renderer.textures.look_up import Textures, TextureSample, build_textures
from renderer.textures.pattern import Pattern, Picture
from renderer.textures.tile import ImageMaps, forget_tiles, generated_tile, image_tile, pattern_tile, picture_tile, tile_key
from scene_description import Material, Texture

evaluate_texture = from_python(look_up.evaluate_texture)

BASE = (0.4, 0.2, 0.1)


def tables(*textures: AppliedTexture) -> Textures:
    mesh = block((0, 0, 0), (1, 1, 1))
    return build_textures(np.arange(len(textures), dtype=np.int32), textures, mesh.vertices, mesh.uvs, mesh.faces)


def looked(
    textures: Textures, u: float, v: float, detail: float = 0.0, row: int = 0, roughness: float = 0.5, trilinear: bool = False
) -> TextureSample:
    color, (x, y, level) = tuple(np.float32(c) for c in BASE), (np.float32(value) for value in (u, v, detail))
    return evaluate_texture(textures, row, x, y, level, color, np.float32(roughness), np.float32(1.0), trilinear)


def checks(count: int = 8) -> np.ndarray:
    return ((np.arange(count)[:, None] + np.arange(count)) % 2).astype(np.float32)


def test_a_pattern_mixes_its_colours_by_its_weights() -> None:
    half = np.full((4, 4), 0.5, np.float32)
    tile = pattern_tile(Pattern((half, 0.25 * np.ones((4, 4), np.float32)), np.full((4, 4), 1.2, np.float32)), (1.0, 1.0))
    got = looked(tables(AppliedTexture(tile, colors=((0.1, 0.8, 0.3), (0.9, 0.0, 0.2)))), 0.3, 0.6)
    expected = 1.2 * (0.25 * np.array(BASE) + 0.5 * np.array((0.1, 0.8, 0.3)) + 0.25 * np.array((0.9, 0.0, 0.2)))
    np.testing.assert_allclose(got[:3], expected, atol=0.006)
    assert got.roughness == pytest.approx(0.5, abs=0.005) and got.metallic == 1.0
    plain = looked(tables(AppliedTexture(tile, colors=((0.1, 0.8, 0.3), (0.9, 0.0, 0.2)), contrast=0.0)), 0.3, 0.6)
    np.testing.assert_allclose(plain[:3], BASE, atol=1e-5)


def test_texels_lie_where_their_coordinates_say_and_repeat() -> None:
    weights = np.zeros((4, 8), np.float32)
    weights[1, 5] = 1.0
    textures = tables(AppliedTexture(pattern_tile(Pattern((weights,)), (1.0, 1.0)), colors=((1.0, 1.0, 1.0),)))
    for shift in (-3.0, 0.0, 7.0):
        assert looked(textures, 5.5 / 8 + shift, 1.5 / 4 - shift).red == pytest.approx(1.0, abs=0.01)
        assert looked(textures, 4.5 / 8 + shift, 1.5 / 4).red == pytest.approx(BASE[0], abs=0.01)
        assert looked(textures, 5.0 / 8 + shift, 1.5 / 4).red == pytest.approx(0.5 * (1.0 + BASE[0]), abs=0.01)


def test_far_away_everything_is_the_mean() -> None:
    textures = tables(AppliedTexture(pattern_tile(Pattern((checks(),)), (1.0, 1.0)), colors=((0.0, 0.0, 0.0),)))
    near = [looked(textures, u, 0.0625).red for u in np.arange(16) / 16 + 1 / 32]
    assert min(near) < 0.11 and max(near) > 0.29
    for detail in (3.0, 8.0, 1e9):
        far = [looked(textures, u, v, detail).red for u, v in np.random.default_rng(1).random((40, 2))]
        np.testing.assert_allclose(far, 0.5 * BASE[0], atol=0.003)


def test_between_two_levels_the_mean_is_the_trilinear_one() -> None:
    weights = np.zeros((64, 64), np.float32)
    weights[:32] = 1.0
    textures = tables(AppliedTexture(pattern_tile(Pattern((weights,)), (1.0, 1.0)), colors=((0.0, 0.0, 0.0),)))
    places = np.random.default_rng(2).random((4000, 2))
    got = np.mean([looked(textures, u, 0.49 + 0.001 * v, 4.5).red for u, v in places])
    ends = [np.mean([looked(textures, u, 0.49 + 0.001 * v, d).red for u, v in places[:400]]) for d in (4.0, 5.0)]
    assert got == pytest.approx(0.5 * (ends[0] + ends[1]), abs=0.005)


@pytest.mark.parametrize(("way", "share"), [(0.0, 0.0), (0.2, 0.0), (0.4, 0.3), (0.6, 0.7), (0.8, 1.0)])
def test_one_sample_of_a_pixel_mixes_both_levels_half_way_between_them(way: float, share: float) -> None:
    textures = tables(AppliedTexture(tile_key("weave", 3, 1.0, (BASE,)), (0.1, 0.2), shift=0.4))
    for u, v in np.random.default_rng(4).random((20, 2)):
        fine, coarse = (np.array(looked(textures, u, v, level)) for level in (2.0, 3.0))
        got = looked(textures, u, v, 2.0 + way, trilinear=True)
        np.testing.assert_allclose(got[5:7], (fine + share * (coarse - fine))[5:7], atol=0.02 * np.ptp([fine[5:7], coarse[5:7]]) + 1e-6)


def test_heights_become_slopes_and_slopes_that_average_out_become_roughness() -> None:
    u = (np.arange(64) + 0.5) / 64
    height = np.broadcast_to(0.05 * np.sin(2 * np.pi * u), (64, 64)).astype(np.float32)
    tile = pattern_tile(Pattern((), None, None, height), (2.0, 2.0))
    textures = tables(AppliedTexture(tile, (2.0, 2.0)))
    for place in (0.0, 0.2, 0.5, 0.83):
        got = looked(textures, place, 0.4)
        assert got.slope_u == pytest.approx(0.05 * 2 * np.pi * np.cos(2 * np.pi * place) / 2.0, abs=0.004)
        assert abs(got.slope_v) < 0.002 and got.spread < 0.003
    far = looked(textures, 0.3, 0.4, 6.0)
    assert abs(far.slope_u) < 0.002
    assert far.spread == pytest.approx(np.sqrt(0.5 * 0.5) * 0.05 * np.pi, abs=0.004)  # rms of one of two axes


def test_images_keep_their_colours_and_stand_upright() -> None:
    color = np.zeros((4, 4, 3), np.uint8)
    color[0] = (255, 0, 0)
    color[1:] = (0, 128, 0)
    tile = image_tile(ImageMaps(color, np.full((4, 4), 128, np.uint8), np.full((4, 4), 255, np.uint8)))
    textures = tables(AppliedTexture(tile))
    upper, lower = looked(textures, 0.5, 0.875), looked(textures, 0.5, 0.125)
    np.testing.assert_allclose(upper[:3], (1.0, 0.0, 0.0), atol=1e-4)
    np.testing.assert_allclose(lower[:3], (0.0, 0.2158605, 0.0), atol=1e-4)
    assert upper.roughness == pytest.approx(0.25, abs=0.002) and upper.metallic == pytest.approx(1.0)
    odd = image_tile(ImageMaps(np.full((5, 7, 3), 77, np.uint8)))
    assert odd.levels[0].shape == (4, 8, 8) and odd.levels[-1].shape == (1, 1, 8)
    assert (odd.levels[0][..., :3] == 77).all()


NO_IMAGES = (
    ImageMaps(),
    ImageMaps(np.zeros((4, 4), np.uint8)),
    ImageMaps(np.zeros((4, 4, 3), np.float32)),
    ImageMaps(np.zeros((0, 4, 3), np.uint8)),
)


@pytest.mark.parametrize("maps", NO_IMAGES)
def test_what_is_no_image_is_refused(maps: ImageMaps) -> None:
    with pytest.raises(ValueError, match=r"texture.*expected"):
        image_tile(maps)


def test_a_normal_map_tilts_as_gltf_says() -> None:
    normal = np.full((4, 4, 3), 0, np.uint8)
    normal[...] = np.round((np.array([0.6, 0.0, 0.8]) + 1.0) * 127.5)
    textures = tables(AppliedTexture(image_tile(ImageMaps(normal=normal))))
    tile = image_tile(ImageMaps(normal=normal))
    got = looked(tables(AppliedTexture(tile)), 0.4, 0.4)
    assert got.slope_u == pytest.approx(-0.75, abs=0.02) and got.slope_v == pytest.approx(0.0, abs=0.02)
    assert looked(textures, 0.4, 0.4).red == pytest.approx(1.0)


def test_look_ups_are_finite_wherever_rays_land() -> None:
    rng = np.random.default_rng(5)
    generated = [AppliedTexture(tile_key(name, 3, 1.0, (BASE,)), (0.1, 0.2), shift=0.4) for name in ("weave", "quilted", "stripes")]
    textures = tables(*generated)
    for u, v, detail in zip(rng.normal(0, 1e3, 300), rng.normal(0, 1e4, 300), rng.uniform(-5, 40, 300), strict=True):
        got = looked(textures, u, v, detail, int(abs(u)) % 3)
        assert np.isfinite(got).all() and 0.0 <= min(got[:3]) and max(got[:3]) <= 1.0


def test_tiles_are_shared_and_pictures_fill_their_side() -> None:
    weave = Material(id="a", family="cloth", base_color=BASE, texture=Texture(generator="weave", scale_m=0.1, seed=5))
    other = Material(id="b", family="cloth", base_color=(0.1, 0.1, 0.1), texture=Texture(generator="weave", scale_m=0.3, seed=5))
    board = block((0, 0, 0), (0.02, 1.2, 0.8))
    assert weave.texture is not None and other.texture is not None
    first, second = applied_texture(weave, weave.texture, board)[1], applied_texture(other, other.texture, board)[1]
    assert first.tile is second.tile and first.size == (0.1, 0.1) and second.size == (0.3, 0.3)
    assert len(tables(first, second).texels) == first.tile.size_bytes // 8
    mapped, extent = mapped_once(board)
    assert extent == pytest.approx((1.2, 0.8))
    np.testing.assert_allclose([mapped.uvs.min(axis=0), mapped.uvs.max(axis=0)], [(0, 0), (1, 1)], atol=1e-6)
    upright = mapped.vertices[np.argmax(mapped.uvs.sum(axis=1))]
    assert upright[1] > 1.1 and upright[2] > 0.7  # seen from the front (+x), u runs to the left (+y is on the right), v up


def test_a_picture_keeps_its_lower_row_below() -> None:
    rgb = np.zeros((2, 2, 3), np.float32)
    rgb[0] = 1.0
    textures = tables(AppliedTexture(picture_tile(Picture(rgb))))
    assert looked(textures, 0.5, 0.25).red == pytest.approx(1.0) and looked(textures, 0.5, 0.75).red == pytest.approx(0.0)


def test_tiles_do_not_depend_on_what_was_drawn_before() -> None:
    """Kept tiles are shared, also between colours unless the picture is painted in them; drawn anew they have the same bytes."""
    names = ("planks", "rug", "art", "floral", "desktop", "spines")
    first = {name: generated_tile(tile_key(name, 5, 0.7, (BASE,))) for name in names}
    assert generated_tile(tile_key("rug", 5, 0.7, ((0.9, 0.1, 0.1),))) is first["rug"]
    assert generated_tile(tile_key("art", 5, 0.7, ((0.9, 0.1, 0.1),))) is not first["art"]
    forget_tiles()
    for name in reversed(names):
        again = generated_tile(tile_key(name, 5, 0.7, (BASE,)))
        assert again is not first[name] and again.steepest == first[name].steepest
        assert all(a.tobytes() == b.tobytes() for a, b in zip(again.levels, first[name].levels, strict=True))

"""Metered exposure against ISO 2720, on scenes of known luminance."""

import math

import pytest
from box_room import box, pose, quad, scene

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.exposure import METER_CONSTANT, LightReading, exposed, meter
from renderer.film.tone import MOST_BLACK, Exposure, white_luminance
from renderer.film.white_balance import white_of_kelvin
from scene_description.color_temperature import D65_XY, color_of_temperature

VIEW = pose((0.0, 0.0, 1.0), (1.0, 0.2, 1.0))
CAMERA = CameraConfig(width=320, height=240)


def metered(luminance: float, views: int = 1) -> float:
    shining = box((-2, -2, 0), (2, 2, 2), inside=True, color=(0.0, 0.0, 0.0), emission=(luminance,) * 3)
    return meter(scene(shining), CAMERA, RenderConfig(threads=1), 5, [VIEW] * views).ev100


@pytest.mark.parametrize("ev100", [-1.0, 3.0, 6.5, 12.0])
@pytest.mark.parametrize("views", [1, 2, 9])
def test_an_even_room_is_metered_as_the_standard_says(ev100: float, views: int) -> None:
    assert metered(METER_CONSTANT / 100.0 * 2.0**ev100, views) == ev100


@pytest.mark.parametrize(
    "camera",
    [
        CameraConfig(width=64, height=64, model="kannala_brandt", horizontal_fov_rad=3.3),
        CameraConfig(width=64, height=64, model="kannala_brandt", horizontal_fov_rad=6.2),  # sees nothing in its corners
        CameraConfig(width=64, height=32, model="equirectangular", horizontal_fov_rad=6.2),
        CameraConfig(width=1, height=8192),
    ],
    ids=("fisheye", "beyond_its_circle", "panorama", "tall"),
)
def test_every_lens_and_shape_of_image_is_metered(camera: CameraConfig) -> None:
    luminance = METER_CONSTANT / 100.0 * 2.0**5
    shining = box((-2, -2, 0), (2, 2, 2), inside=True, color=(0.0, 0.0, 0.0), emission=(luminance,) * 3)
    assert meter(scene(shining), camera, RenderConfig(threads=1), 5, [VIEW]).ev100 == 5.0


def test_a_fisheye_is_metered_by_what_it_sees_beside_itself() -> None:
    """A dark wall ahead, all around bright: a fisheye of half a turn sees more of the latter."""
    dark = quad((1.0, -1.5, 0.0), (0, 0, 2), (0, 3, 0), color=(0.0, 0.0, 0.0))
    room = scene(box((-2, -2, 0), (2, 2, 2), inside=True, color=(0.0, 0.0, 0.0), emission=(50.0, 50.0, 50.0)), dark)
    narrow, wide = (
        meter(room, camera, RenderConfig(threads=1), 5, [VIEW]).ev100
        for camera in (CameraConfig(width=64, height=64), CameraConfig(width=64, height=64, model="kannala_brandt", horizontal_fov_rad=3.1))
    )
    assert wide > narrow + 1.0


def test_steps_are_eighths_and_the_next_one_begins_half_way() -> None:
    base = METER_CONSTANT / 100.0 * 2.0**5
    assert metered(base * 2.0**0.05) == 5.0
    assert metered(base * 2.0**0.07) == 5.125


def test_a_dark_room_has_an_exposure_too() -> None:
    assert math.isfinite(metered(0.0))


@pytest.mark.parametrize("kelvin", [2700.0, 4000.0, 6504.0, 9000.0])
def test_lamplight_on_coloured_walls_is_metered_as_its_own_colour(kelvin: float) -> None:
    red, green, blue = (4000.0 * part for part in color_of_temperature(kelvin))
    lamp = box((-0.2, -0.2, 1.7), (0.2, 0.2, 1.8), emission=(red, green, blue))
    walls = box((-2, -2, 0), (2, 2, 2), inside=True, color=(0.08, 0.05, 0.06))  # dark, so that little light comes from walls again
    white = meter(scene(walls, lamp), CAMERA, RenderConfig(threads=1), 5, [VIEW]).white_xy
    assert white == pytest.approx(white_of_kelvin(kelvin), abs=0.012)


def test_a_room_is_metered_the_same_whatever_the_threads() -> None:
    lamp = box((-0.2, -0.2, 1.7), (0.2, 0.2, 1.8), emission=(9000.0, 5000.0, 2000.0))
    room = scene(box((-2, -2, 0), (2, 2, 2), inside=True), lamp)
    first, second = (meter(room, CAMERA, RenderConfig(threads=threads), 5, [VIEW, VIEW]) for threads in (1, 3))
    assert first == second


def test_a_room_is_metered_the_same_whatever_its_pictures_lose() -> None:
    """Walls that glow with 1 cd/m2 and reflect four fifths: 1 / (1 - 0.8) = 5 in every direction, 2.3 EV more than what they emit."""
    room = scene(box((-2, -2, 0), (2, 2, 2), inside=True, color=(0.8, 0.8, 0.8), emission=(1.0, 1.0, 1.0)))
    quick = RenderConfig(threads=1, max_depth=2, clamp=0.5, caustic_blur=1.0)
    first, second = (meter(room, CAMERA, config, 5, [VIEW]).ev100 for config in (quick, RenderConfig(threads=1)))
    assert first == second == pytest.approx(math.log2(100.0 / METER_CONSTANT * 5.0), abs=1 / 8)


def test_what_is_not_metered_is_as_configured() -> None:
    metered = LightReading(3.0, (0.45, 0.41), deviate=1.0)
    fixed = RenderConfig(exposure_ev100=7.0, white_balance="none")
    assert exposed(fixed, metered) == Exposure(7.0, D65_XY)
    warm = RenderConfig(auto_exposure=True, exposure_compensation_ev=1.0, white_balance="kelvin", white_balance_k=3000.0)
    assert exposed(warm, metered) == Exposure(2.0, white_of_kelvin(3000.0))
    auto = exposed(RenderConfig(), metered)
    assert auto.ev100 == RenderConfig().exposure_ev100
    assert D65_XY[0] < auto.white_xy[0] < 0.45  # some of the tint stays


@pytest.mark.parametrize(("luminance", "stops"), [(0.1, -2.889), (1.0, -1.211), (10.0, 0.0), (100.0, 0.511), (1000.0, 0.759)])
def test_a_dark_room_looks_darker_by_its_key(luminance: float, stops: float) -> None:
    """The key is 1.03 - 2 / (2 + log10(L + 1)); of L = 10 cd/m2 it changes nothing, and half of it changes half of the stops."""
    metered = LightReading(math.log2(luminance * 100.0 / METER_CONSTANT), D65_XY)
    plain, whole, half = (exposed(RenderConfig(auto_exposure=True, exposure_key=key), metered).ev100 for key in (0.0, 1.0, 0.5))
    assert plain - whole == pytest.approx(stops, abs=1 / 16 + 0.001)
    assert plain - half == pytest.approx(0.5 * stops, abs=1 / 16 + 0.001)


def test_rooms_are_compensated_by_a_draw_of_their_own() -> None:
    """A draw of 1.5 deviations of 0.8 EV is 1.2 EV, the nearest eighth 1.25; without a deviation all rooms are alike."""
    shell = scene(box((-1, -1, 0), (1, 1, 2), inside=True, color=(0.0, 0.0, 0.0), emission=(1.0, 1.0, 1.0)))
    one, other, again = (meter(shell, CameraConfig(width=8, height=8), RenderConfig(threads=1), key, [VIEW]) for key in (5, 6, 5))
    assert one == again and one.deviate != other.deviate
    drawn, plain = (RenderConfig(auto_exposure=True, exposure_scatter_ev=scatter) for scatter in (0.8, 0.0))
    brighter = one._replace(deviate=1.5)
    assert exposed(plain, brighter).ev100 - exposed(drawn, brighter).ev100 == pytest.approx(1.25)
    assert exposed(plain, one) == exposed(plain, other)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_as_much_of_the_black_is_taken_away_as_is_asked_for(share: float) -> None:
    """Of a metered black of 0.004, with an exposure two stops longer 0.016, the most there is."""
    metered = LightReading(6.0, D65_XY, black=0.004)
    shown = exposed(RenderConfig(auto_exposure=True, exposure_compensation_ev=2.0, black_share=share), metered)
    assert shown.ev100 == 4.0 and shown.black == pytest.approx(0.016 * share)


@pytest.mark.parametrize(("held_back", "lighter"), [(0.0, 0.0), (1.0, 1.0), (3.0, 1.4)])
def test_windows_hold_a_room_back_less_where_exposures_are_merged(held_back: float, lighter: float) -> None:
    metered = LightReading(6.0, D65_XY, held_back_ev=held_back)
    plain, merged = (exposed(RenderConfig(auto_exposure=True, local_tone_stops=stops), metered).ev100 for stops in (0.0, 4.0))
    assert plain - merged == pytest.approx(lighter)


def test_a_bright_wall_holds_a_room_back() -> None:
    """A wall of 4,096 cd/m2 stays 0.7 stops above white, 1.2 * 2^EV, at EV 11; the log-average, at most half of 12 stops, asks for less."""
    shell = box((-2, -2, 0), (2, 2, 2), inside=True, color=(0.0, 0.0, 0.0), emission=(1.0, 1.0, 1.0))
    wall = quad((1.9, -2, 0), (0, 0, 2), (0, 4, 0), color=(0.0, 0.0, 0.0), emission=(4096.0, 4096.0, 4096.0))
    view = pose((0.0, 0.0, 1.0), (1.0, 1.2, 1.0))
    bright, even = (meter(scene(*parts), CAMERA, RenderConfig(threads=1), 5, [view]) for parts in ((shell, wall), (shell,)))
    assert bright.ev100 == pytest.approx(12.0 - math.log2(1.2) - 0.7, abs=1 / 16)
    assert even.held_back_ev == 0.0 and even.ev100 == 3.0
    assert 2.0 <= bright.held_back_ev < bright.ev100 - even.ev100


def test_no_photographer_bleaches_a_window_or_the_middle_of_a_room() -> None:
    """A wall 1,000 times as bright as the rest: 97 % stay within 3 stops of white, unless what is configured shows them brighter."""
    shell = box((-2, -2, 0), (2, 2, 2), inside=True, color=(0.0, 0.0, 0.0), emission=(1.0, 1.0, 1.0))
    wall = quad((1.9, -2, 0), (0, 0, 2), (0, 4, 0), color=(0.0, 0.0, 0.0), emission=(1000.0, 1000.0, 1000.0))
    bright = meter(scene(shell, wall), CAMERA, RenderConfig(threads=1), 5, [pose((0.0, 0.0, 1.0), (1.0, 1.2, 1.0))])
    even = meter(scene(shell), CAMERA, RenderConfig(threads=1), 5, [VIEW])
    bold, plain, high = (
        RenderConfig(auto_exposure=True, exposure_scatter_ev=scatter, exposure_compensation_ev=ev)
        for scatter, ev in ((3.0, 1.0), (0.0, 1.0), (0.0, 6.0))
    )
    for metered, luminance, stops in ((bright, 1000.0, 3.0), (even, 1.0, -0.3)):
        lively = metered._replace(deviate=2.0)
        assert math.log2(luminance / white_luminance(exposed(bold, lively).ev100)) == pytest.approx(stops, abs=1 / 16)
        assert exposed(plain, lively).ev100 == metered.ev100 - 1.0
        assert exposed(high, lively).ev100 == metered.ev100 - 6.0


def test_a_bright_part_of_the_view_is_not_burnt_out() -> None:
    """A wall a thousand times as bright as the rest, over more than the share that may be lost, stays within 0.7 stops of white."""
    shell = box((-2, -2, 0), (2, 2, 2), inside=True, color=(0.0, 0.0, 0.0), emission=(1.0, 1.0, 1.0))
    wall = quad((1.9, -2, 0), (0, 0, 2), (0, 4, 0), color=(0.0, 0.0, 0.0), emission=(1000.0, 1000.0, 1000.0))
    aside = pose((0.0, 0.0, 1.0), (1.0, 1.2, 1.0))
    ev100 = meter(scene(shell, wall), CAMERA, RenderConfig(threads=1), 5, [aside]).ev100
    assert ev100 == pytest.approx(math.log2(1000.0 / 1.2) - 0.7, abs=1 / 16)


def test_one_bright_view_is_not_bleached_by_dark_ones() -> None:
    """One of three views sees nothing but a wall 64 times as bright as the rest: its middle stays 3.15 stops under white."""
    shell = box((-2, -2, 0), (2, 2, 2), inside=True, color=(0.0, 0.0, 0.0), emission=(1.0, 1.0, 1.0))
    wall = quad((1.9, -2, 0), (0, 0, 2), (0, 4, 0), color=(0.0, 0.0, 0.0), emission=(64.0, 64.0, 64.0))
    away, towards = pose((0.0, 0.0, 1.0), (-1.0, 0.2, 1.0)), pose((1.5, 0.0, 1.0), (1.9, 0.0, 1.0))
    ev100 = meter(scene(shell, wall), CAMERA, RenderConfig(threads=1), 5, [away, away, towards]).ev100
    assert math.log2(64.0 / white_luminance(ev100)) == pytest.approx(-3.15, abs=1 / 16)


def test_black_is_what_the_darkest_of_the_view_has_less_than_and_never_much() -> None:
    """Half of what is seen has 0.01 of the light of the rest: 0.8 of that is black, or 0.016 of white where that is less."""
    shell = box((-2, -2, 0), (2, 2, 2), inside=True, color=(0.0, 0.0, 0.0), emission=(0.5, 0.5, 0.5))
    wall = quad((1.9, -2, 0), (0, 0, 2), (0, 4, 0), color=(0.0, 0.0, 0.0), emission=(50.0, 50.0, 50.0))
    metered = meter(scene(shell, wall), CAMERA, RenderConfig(threads=1), 5, [pose((0.0, 0.0, 1.0), (1.0, 1.2, 1.0))])
    white = white_luminance(metered.ev100)
    assert metered.black == pytest.approx(0.8 * 0.5 / white, rel=2.0 ** (1 / 16) - 1.0 + 1e-6)
    by_hand = exposed(RenderConfig(exposure_ev100=metered.ev100 + 1.0), metered)
    assert by_hand.black == pytest.approx(0.5 * metered.black)
    assert exposed(RenderConfig(exposure_ev100=metered.ev100 - 4.0), metered).black == MOST_BLACK


def test_looked_up_light_is_metered_by_the_nodes_that_every_view_needs() -> None:
    """In a furnace of 100 cd/m2; none of the finer nodes is computed for the meter, so that a view has as many to compute after it."""
    room = scene(box((-2, -2, 0), (2, 2, 2), inside=True, color=(0.5, 0.5, 0.5), emission=(50.0,) * 3))
    config = RenderConfig(threads=1, integrator="cached", cache_spacing_m=0.1)
    with Renderer(room, CAMERA, config, 5) as renderer, Renderer(room, CAMERA, config, 5) as unmetered:
        reading = meter(room, CAMERA, config, 5, [VIEW], like=renderer)
        assert reading.ev100 == pytest.approx(math.log2(100.0 * 100.0 / METER_CONSTANT), abs=1 / 16)
        assert renderer.prepare(VIEW) == unmetered.prepare(VIEW) > 0


def test_noise_of_paths_makes_no_room_brighter() -> None:
    """A small lamp behind a screen: single pixels of few samples, nearly black or far too bright, have a log-average 1.2 EV lower."""
    shell = box((-2, -2, 0), (2, 2, 2), inside=True, color=(0.7, 0.7, 0.7))
    lamp = box((1.7, 1.7, 0.1), (1.75, 1.75, 0.15), emission=(90000.0,) * 3)
    room = scene(shell, lamp, quad((1.2, 0.6, 0.0), (0.0, 1.4, 0.0), (0.0, 0.0, 1.6)))
    path = [pose((-1.8, -1.8, 1.0), (1.0, 1.0, 1.0))]
    traced, looked_up = (meter(room, CAMERA, RenderConfig(threads=2, integrator=name), 5, path) for name in ("path", "cached"))
    assert abs(traced.ev100 - looked_up.ev100) <= 0.375

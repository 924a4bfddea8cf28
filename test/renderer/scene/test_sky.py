"""What stands outside is drawn for light that a window lets in, once, and for nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from sample_scene import sample_scene

from renderer import GEOMETRIC_LAYERS, CameraConfig, RenderConfig, Renderer
from renderer.core.color import LUMINANCE
from renderer.core.equirectangular import map_directions, pixel_solid_angles
from renderer.scene import sky
from renderer.scene.flatten import flatten
from renderer.surroundings.panorama import COLUMNS, ROWS
from renderer.textures import tile
from scene_description.types import Daylight, Surroundings, Texture

TINY = CameraConfig(width=16, height=12)
QUICK = RenderConfig(samples_per_pixel=1, threads=1)


def suburban():
    scene = sample_scene()
    day = Daylight(sun_direction=(0.0, -0.8, 0.6), cloud_cover=0.2)
    return replace(scene, environment=replace(scene.environment, daylight=day, surroundings=Surroundings(setting="suburb", seed=4)))


@pytest.fixture
def drawn(monkeypatch):
    """Return a list that grows by one whenever surroundings are drawn."""
    calls = []
    draw = sky.surroundings_map
    monkeypatch.setattr(sky, "surroundings_map", lambda *arguments: calls.append(1) or draw(*arguments))
    sky._surroundings_table.cache_clear()
    return calls


@pytest.fixture
def tiles(monkeypatch):
    """Return a list that grows by one whenever a texture is drawn."""
    calls = []
    draw = tile._drawn
    monkeypatch.setattr(tile, "_drawn", lambda *key: calls.append(key) or draw(*key))
    tile.forget_tiles()
    return calls


def test_basic_ground_truth_draws_nothing_and_colour_of_two_renderers_draws_once(drawn, tiles):
    scene = suburban()
    papered = [replace(material, texture=Texture(generator="weave", scale_m=0.1, seed=5)) for material in scene.materials]
    scene = replace(scene, materials=tuple(papered))
    flat = flatten(scene)
    assert flat.outside == scene.environment
    with Renderer(flat, TINY, QUICK, 1) as renderer, Renderer(flat, TINY, QUICK, 1, like=renderer) as second:
        basic = renderer.render(scene.camera_path[0], 0, GEOMETRIC_LAYERS)
        assert not drawn and not tiles and basic.rays == 16 * 12
        one, two = (each.render(scene.camera_path[0], 0, ("color",)) for each in (renderer, second))
        assert len(drawn) == 1 and len(tiles) == len(set(tiles)) > 0 and one.radiance.tobytes() == two.radiance.tobytes() and one.rays > 0
    assert sky.sky_of(flat).table.tobytes() != flat.sky.table.tobytes() and len(drawn) == 1


def test_a_room_without_windows_has_nothing_outside(drawn):
    scene = suburban()
    doors = tuple(opening for opening in scene.room.openings if opening.category != "window")
    assert len(doors) < len(scene.room.openings)
    flat = flatten(replace(scene, room=replace(scene.room, openings=doors)))
    assert flat.outside is None and sky.sky_of(flat) is flat.sky and not drawn


def luminance_above(table: np.ndarray) -> float:
    """Return the mean luminance of a map's upper quarter by solid angle."""
    rows = len(table) // 4
    return float(np.average((table[:rows] @ LUMINANCE).mean(axis=1), weights=pixel_solid_angles(*table.shape[:2])[:rows]))


def test_half_of_the_world_is_drawn_for_windows_in_one_wall_and_the_rest_is_sky_and_ground(drawn):
    flat = flatten(suburban())
    panes = flat.parts.portal[flat.face_part]
    a, b, c = (flat.mesh.vertices[flat.mesh.faces[panes, k]] for k in range(3))
    inward = np.cross(b - a, c - a)[0].astype(float)
    inward /= np.linalg.norm(inward)
    shown, facing = sky.shown_columns(flat), -map_directions(1, COLUMNS)[0] @ inward
    assert shown[facing > 0.0].all() and 0.5 < shown.mean() < 0.52
    environment = flat.outside
    here = sky.sky_of(flat).table
    around = sky._surroundings_table(environment, np.ones(COLUMNS, np.bool_).tobytes())
    assert here.shape == around.shape == (ROWS, COLUMNS, 3) and np.array_equal(here[:, shown], around[:, shown])
    # above the houses and hills the sky is the same but for clouds
    assert luminance_above(here) == pytest.approx(luminance_above(flat.sky.table), rel=0.15)
    below, behind = here[3 * ROWS // 4 :, ~shown, 1], around[3 * ROWS // 4 :, ~shown, 1]
    assert below.std() < 1e-3 * below.mean() < behind.std()


def test_a_slanted_pane_shows_everything_and_rooms_of_one_environment_share_what_is_outside(drawn):
    flat = flatten(suburban())
    panes = np.unique(flat.mesh.faces[flat.parts.portal[flat.face_part]])
    vertices = flat.mesh.vertices.copy()
    vertices[panes, 1] += np.float32(0.2) * vertices[panes, 2]
    vertices[panes, 0] += np.float32(0.2) * vertices[panes, 2]
    assert sky.shown_columns(flat._replace(mesh=flat.mesh._replace(vertices=vertices))).all()
    again = flatten(suburban())
    assert sky.sky_of(again).table is sky.sky_of(flat).table and len(drawn) == 1

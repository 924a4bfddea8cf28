"""No surface stays black that light falls on: whole models in lit rooms, and hits that no node knows."""

import numpy as np
import pytest
from box_room import box, pose, quad, scene
from cached_rooms import CACHED, look_up
from model_rooms import furnace, lit_room, views

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.cached_frames import strays
from renderer.cached_frames.strays import make_strays, none_lit, places_of, share_strays
from renderer.core import lanes as ln
from renderer.core.kernel import from_python
from renderer.core.ray_packet import LANES
from renderer.irradiance_cache.nodes import make_node_light
from renderer.path.records import make_scratch

add_stray = from_python(strays.add_stray)
CAMERA = CameraConfig(width=96, height=72)
FINE = RenderConfig(integrator="cached", cache_spacing_m=0.03, threads=2)
TRACED = RenderConfig(samples_per_pixel=4, threads=2)


def pictures(flat, view, *configs):
    found = []
    for config in configs:
        with Renderer(flat, CAMERA, config, 5) as renderer:
            found.append(renderer.render(view, 0, ("radiance",)).radiance)
    return found


@pytest.mark.parametrize(
    ("generator", "style"),
    [
        ("armchair", "wing"),
        ("book_stack", "askew"),
        ("bed", "platform"),
        ("waste_bin", "open"),
        ("bookshelf", "cubes"),
    ],
)
def test_no_pixel_of_a_model_is_black_where_light_falls(generator, style):
    flat = lit_room(generator, style)
    for view in views(generator):
        cached, traced = pictures(flat, view, FINE, TRACED)
        assert not ((cached == 0.0).all(axis=-1) & (traced > 0.0).any(axis=-1)).any()


@pytest.mark.parametrize(("generator", "style"), [("bookshelf", "cubes"), ("washbasin", "vessel")])
def test_white_things_vanish_in_a_room_that_glows(generator, style):
    """What glows reflects 0.03 of the light: everything has the luminance 1 / 0.97, and what loses light is darker."""
    for view in views(generator):
        (cached,) = pictures(furnace(generator, style), view, FINE)
        assert np.quantile(cached, 0.02) > 0.9 / 0.97 and cached.mean() == pytest.approx(1 / 0.97, rel=0.01)


def test_a_body_turned_inside_out_is_lit_like_any_other():
    """Its faces look inward, so that one sees them from behind."""
    room = (
        box((-2, -2, 0), (2, 2, 2.5), inside=True, object_id=0),
        quad((-1, -1, 2.4), (0, 2, 0), (2, 0, 0), emission=(1e3,) * 3, object_id=2),
    )
    view, found = pose((1.5, 1.2, 1.4), (0, 0, 0.4)), []
    for inside in (False, True):
        found.append(look_up(scene(*room, box((-0.4, -0.4, 0), (0.4, 0.4, 0.8), inside=inside, object_id=3)), view).radiance)
    np.testing.assert_allclose(found[1], found[0], rtol=0.1)


@pytest.mark.parametrize(
    ("apart_m", "turn", "part", "shared"),
    [(0.02, 0.0, 3, True), (0.04, 0.0, 3, False), (0.02, 0.6, 3, False), (0.02, 0.3, 3, True), (0.02, 0.0, 4, False)],
    ids=["close", "apart", "turned", "turned a little", "of another part"],
)
def test_strays_close_to_each_other_have_their_light_in_common(apart_m, turn, part, shared):
    trace = make_scratch(0)
    found, lanes = make_strays(2, 48), trace.lanes
    found.server[:] = -1
    lanes[ln.P_X + 5], lanes[ln.NG_X + 5], lanes[ln.NG_Z + 5] = apart_m, np.sin(turn), np.cos(turn)
    lanes[ln.NG_Z + 2] = 1.0
    trace.parts[2], trace.parts[5] = 3, part
    for k in (2, 5):
        add_stray(trace, k, 1, 16, np.float32(0.03), found)
    assert (found.counts.tolist(), found.server[1, [18, 21]].tolist()) == (([0, 1], [0, 0]) if shared else ([0, 2], [0, 1]))
    places = places_of(share_strays(found, none_lit(5), np.float32(0.03)))
    np.testing.assert_array_equal(places.position, lanes.reshape(-1, LANES)[ln.P_X // LANES :][:3].T[[2, 5][: len(places.face)]])


def test_strays_of_other_rows_and_of_edges_have_their_light_in_common_too():
    apart_m, up = np.float32(0.03), (0.0, 0.0, 1.0)
    picture, edges = make_strays(3, 16), make_strays(3, 16)
    of_picture = (picture, 0, 0.0, 1), (picture, 2, 0.02, 1), (picture, 2, 0.02, 0)
    for strays_, row, x, part in (*of_picture, (edges, 1, -0.02, 1), (edges, 1, 0.5, 1)):
        i = strays_.counts[row]
        strays_.places[row, i], strays_.part[row, i], strays_.face[row, i] = (x, 0.0, 0.0, *up), part, 7
        strays_.counts[row] = i + 1
    lit = share_strays(picture, none_lit(2), apart_m)
    assert (picture.lit_by[0, 0], picture.lit_by[2, :2].tolist(), lit.part.tolist()) == (0, [0, 1], [1, 0])
    lit = share_strays(edges, lit._replace(light=make_node_light(2)), apart_m)
    assert (edges.lit_by[1, :2].tolist(), lit.part.tolist(), len(places_of(lit).face)) == ([0, 2], [1, 0, 1], 1)


def test_hits_between_nodes_within_something_are_lit_and_counted():
    """A post with a square hole that is less wide than nodes are apart stands on the floor: all nodes of that cell lie within its walls."""
    # Nodes of the floor, 4 m wide, lie 0.09875 m apart from its middle on.
    walls = [((-0.3, -0.3), (0.3, 0.03)), ((-0.3, 0.07), (0.3, 0.3)), ((-0.3, 0.03), (0.03, 0.07)), ((0.07, 0.03), (0.3, 0.07))]
    posts = [box((*low, 0), (*high, 0.03), object_id=3 + i, name=f"{3 + i}/post") for i, (low, high) in enumerate(walls)]
    lamp = quad((-1, -1, 2.4), (0, 2, 0), (2, 0, 0), emission=(1e3,) * 3, object_id=2)
    flat = scene(box((-2, -2, 0), (2, 2, 2.5), inside=True, object_id=0), lamp, *posts)
    view = pose((0.051, 0.05, 0.2), (0.05, 0.05, 0))
    with Renderer(flat, CameraConfig(width=32, height=24, horizontal_fov_rad=0.15), CACHED, 5) as renderer:
        image = renderer.render(view, 0, ("radiance",)).radiance
        assert 1 <= renderer.cached().strays <= 4  # what is seen is 3 cm wide, and those closer together than 3 cm are one
    assert image.min() > 0.2 * image.max() > 0.0


def test_what_no_node_knows_is_not_black_in_a_mirror():
    """A sheet is covered but for a hole that lies between its nodes; a mirror above shows the sheet in the hole."""
    walls = [((-0.3, -0.3), (0.3, -0.02)), ((-0.3, 0.02), (0.3, 0.3)), ((-0.3, -0.02), (-0.02, 0.02)), ((0.02, -0.02), (0.3, 0.02))]
    posts = [box((*low, 0), (*high, 0.05), object_id=3 + i, name=f"{3 + i}/post") for i, (low, high) in enumerate(walls)]
    sheet = quad((-0.15, -0.15, 0.01), (0.3, 0, 0), (0, 0.3, 0), object_id=7)
    mirror = quad((-0.05, -0.05, 0.5), (0, 0.1, 0), (0.1, 0, 0), object_id=8, metallic=1.0, roughness=0.0, color=(1, 1, 1))
    lamp = quad((-1, -1, 2.4), (0, 2, 0), (2, 0, 0), emission=(1e3,) * 3, object_id=2)
    flat = scene(box((-2, -2, 0), (2, 2, 2.5), inside=True, object_id=0), lamp, *posts, sheet, mirror)
    camera, view = CameraConfig(width=8, height=6, horizontal_fov_rad=0.02), pose((-0.006, 0, 0.2), (0, 0, 0.5))
    with Renderer(flat, camera, CACHED, 5) as renderer:
        image = renderer.render(view, 0, ("radiance",)).radiance
        store = renderer.cached()._store
        upper = (flat.face_part[store.coarse.face] == len(flat.part_names) - 2) & (store.coarse.normal[:, 2] > 0.0)
        assert upper.any() and not store.geometry.known[upper].any()
    assert (image > 0.0).all()

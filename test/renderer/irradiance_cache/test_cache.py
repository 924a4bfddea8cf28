"""The cache of a room: which parts are solids, and that a node is a function of the scene and its number alone."""

import numpy as np
import pytest
from box_room import DARK, box, furnished_room, pierced, quad, scene
from cached_rooms import COARSE, filled, nodes_of, solved

from renderer import RenderCancelled
from renderer.core.sampling import even_points

FLOOR = quad((-3, -3, 0), (6, 0, 0), (0, 6, 0), object_id=0)


def has_backs(*pieces):
    flat = scene(FLOOR, *pieces)
    with solved(flat) as cache:
        front = [nodes_of(cache, part, flat) for part in range(1, len(pieces) + 1)]
        return [bool((cache.atlas.back[nodes] >= 0).any()) for nodes in front]


def test_solids_that_lack_a_hidden_side_are_found():
    block = box((0, 0, 0), (1, 1, 1))
    hanging = box((-2, -2, 1), (-1, -1, 2))
    assert (
        has_backs(
            block,
            hanging._replace(faces=hanging.faces[:-2]),
            block._replace(faces=block.faces[:-2], vertices=block.vertices + np.array([1.5, 0, 0])),
        )
        == [False] * 3
    )
    assert has_backs(quad((0, 0, 1), (1, 0, 0), (0, 1, 0)), hanging._replace(faces=hanging.faces[:2])) == [True, True]
    turned = hanging._replace(faces=hanging.faces[:-2, ::-1])
    assert has_backs(turned) == [True], "a bin that is open at the top and seen from within"


def test_the_rooms_own_shell_is_never_seen_from_behind():
    flat = scene(FLOOR)
    with solved(flat) as cache:
        assert (cache.atlas.back == -1).all()


def test_one_that_another_renderer_took_over_before_it_was_solved_is_solved_alike():
    """Both solve it by the same photons and links; neither finds what the other has added."""
    sunny = DARK._replace(sun=np.array([0.0, 0.6, 0.8, 1e-5, 1e9, 8e8, 6e8], np.float32))
    pane = quad((-0.5, 0, 1.0), (1, 0, 0), (0, 0, 1), portal=True, transmission=0.8, ior=1.0, object_id=1)
    shell = pierced(box((-2, -3, 0), (2, 0, 2.5), inside=True, object_id=0, color=(0.5, 0.5, 0.5)), (-0.5, 1.0), (0.5, 2.0))
    floor = quad((-2, -3, 0.01), (4, 0, 0), (0, 3, 0), object_id=2, color=(0.3, 0.3, 0.3), roughness=0.2, ior=1.5)
    with solved(scene(shell, pane, floor, sky=sunny), is_solved=False) as cache:
        other = cache.shared(cache._scene)
        cache.solve()
        other.solve()
    assert cache.source.caustics[:, 1].max() > 1.0
    for field in ("luminance", "even", "around", "leaving"):
        assert getattr(cache, field).tobytes() == getattr(other, field).tobytes(), field
    assert cache.source.caustics.tobytes() == other.source.caustics.tobytes()


@pytest.mark.parametrize("threads", [2, 4])
def test_threads_change_no_byte(threads):
    one, many = filled(furnished_room()), filled(furnished_room(), threads=threads)
    for field in ("luminance", "even", "rows"):
        assert getattr(one, field).tobytes() == getattr(many, field).tobytes(), field
    for ours, theirs in zip(one.light, many.light, strict=True):
        assert ours.tobytes() == theirs.tobytes()


def test_nodes_do_not_depend_on_when_they_are_computed_nor_with_which():
    whole = filled(furnished_room())
    count = len(whole.atlas.face)
    parts = np.random.default_rng(3).integers(0, 5, count)
    with solved(furnished_room()) as cache:
        done = sum(cache.fill(parts == part) for part in (3, 0, 4, 2, 1))
        assert done == count and cache.fill(np.ones(count, np.bool_)) == 0
    assert cache.rows.tobytes() == whole.rows.tobytes()
    for ours, theirs in zip(cache.light, whole.light, strict=True):
        assert ours.tobytes() == theirs.tobytes()


def test_a_cancelled_filling_is_taken_up_again():
    whole = filled(furnished_room())
    with solved(furnished_room()) as cache:
        everything = np.ones(len(cache.atlas.face), np.bool_)
        with pytest.raises(RenderCancelled):
            cache.fill(everything, lambda: True)
        cache.fill(everything)
    assert cache.rows.tobytes() == whole.rows.tobytes()


def test_another_key_is_other_noise_of_the_same_light():
    flat = furnished_room()
    one, other = filled(flat), filled(flat, key=6)
    assert not np.array_equal(one.rows, other.rows)
    weight = one.light.valid
    assert np.average(other.rows[:, 1], weights=weight) == pytest.approx(np.average(one.rows[:, 1], weights=weight), rel=0.02)


def test_nodes_within_things_are_not_valid():
    """The floor beneath a block sees the block's inside; beside it it sees the room."""
    flat = scene(FLOOR, box((-1, -1, -0.01), (1, 1, 1)), box((-3, -3, 0), (3, 3, 3), inside=True, object_id=0))
    cache = filled(flat)
    nodes = nodes_of(cache, 0, flat)
    x, y = np.abs(cache.atlas.position[nodes, :2]).T
    beneath, beside = np.maximum(x, y) < 0.95, np.maximum(x, y) > 1.05
    assert beneath.any() and (cache.light.valid[nodes][beneath] == 0).all() and (cache.light.valid[nodes][beside] > 0.5).all()


def test_points_of_a_pattern_are_even():
    points = even_points(64)
    assert points.shape == (64, 2) and len(np.unique(points, axis=0)) == 64
    counts = np.histogram2d(*points.T, bins=4, range=[[0, 1], [0, 1]])[0]
    assert counts.min() >= 3 and counts.max() <= 5
    assert points.mean(axis=0) == pytest.approx(0.5, abs=0.02)
    assert even_points(COARSE.coarse_rays).dtype == np.float32

"""Which light is seen, against the objects that are seen and against a scene description's lights."""

from dataclasses import replace

import numpy as np
from box_room import furnished_room, pose, quad, scene
from sample_scene import sample_scene

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.scene.flatten import flatten
from scene_description.light_labels import SKY_ID, light_ids, light_labels

CAMERA = CameraConfig(width=161, height=122)


def layers(flat, view, camera=CAMERA):
    with Renderer(flat, camera, RenderConfig(threads=2), 0) as renderer:
        return renderer.render(view, 0, ("instance", "range", "light_seen")).layers


def test_lamps_and_panes_are_seen_where_they_are():
    flat = furnished_room()
    ids = {"9/pane": 2, "2/lamp": 3}
    seen = layers(
        flat._replace(light_id=np.array([ids.get(name, 0) for name in flat.part_names], np.uint16)), pose((3.4, 0.4, 1.6), (1.3, 3.2, 1.6))
    )
    expected = np.select([seen["instance"] == 9, seen["instance"] == 2], [2, 3], 0)
    assert np.array_equal(seen["light_seen"], expected) and set(np.unique(expected)) == {0, 2, 3}


def test_the_sky_is_seen_beyond_the_scene_and_nothing_beyond_the_lens():
    lamp = quad((2.0, -0.5, -0.5), (0, 0, 1), (0, 1, 0), emission=(5.0, 5.0, 5.0))
    flat = scene(lamp)._replace(light_id=np.array([7], np.uint16))
    front, back = (layers(flat, pose((x, 0.0, 0.0), (2.0, 0.0, 0.0))) for x in (0.0, 4.0))
    ids = {
        name: set(np.unique(picture["light_seen"][np.isfinite(picture["range"])])) for name, picture in (("front", front), ("back", back))
    }
    assert sorted(ids.values(), key=min) == [{0}, {7}], "lamps shine to one side"
    assert (front["light_seen"][np.isinf(front["range"])] == SKY_ID).all()
    fisheye = CameraConfig(model="kannala_brandt", width=96, height=96, horizontal_fov_rad=2.0, distortion=(0.0, 0.0, 0.0, 0.0))
    seen = layers(flat, pose((0.0, 0.0, 0.0), (2.0, 0.0, 0.0)), fisheye)
    assert (seen["light_seen"][np.isnan(seen["range"])] == 0).all()


def test_lights_are_numbered_and_told_by_the_description():
    description = sample_scene()
    table, ids = light_labels(description), light_ids(description)
    assert table[0]["name"] == "none" and (table[SKY_ID]["name"], table[SKY_ID]["kind"]) == ("sky", "sky")
    assert sorted(table) == [0, SKY_ID, *sorted(ids.values())]
    lamp = description.lights[0]
    number = ids[f"{lamp.object}/{lamp.part}"]
    assert (table[number]["kind"], table[number]["object"], table[number]["part"]) == ("lamp", lamp.object, lamp.part)
    off = replace(description, lights=tuple(replace(light, on=False) for light in description.lights))
    assert f"{lamp.object}/{lamp.part}" not in light_ids(off)
    assert all(
        table[ids[f"{opening.id}/pane"]]["kind"] == "window" for opening in description.room.openings if opening.category == "window"
    )
    flat = flatten(description)
    shining = (flat.parts.emission > 0).any(axis=1) | flat.parts.portal | (flat.materials.glow_cd_m2[flat.parts.material] > 0)
    assert np.array_equal(flat.light_id > 0, shining)
    assert np.array_equal(flat.light_id[shining], [ids[name] for name, lit in zip(flat.part_names, shining, strict=True) if lit])


def test_what_is_seen_of_a_described_room_is_in_its_table():
    description = sample_scene()
    seen = layers(flatten(description), description.camera_path[0])["light_seen"]
    assert set(np.unique(seen)) <= set(light_labels(description))

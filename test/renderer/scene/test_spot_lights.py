"""Bare bulbs and spots against point sources: illuminance by distance and angle, flux, cones, tables; old scenes have none."""

import math
from dataclasses import replace

import numpy as np
import pytest
from box_room import box, emitter_column, pose, quad, scene
from sample_scene import sample_scene

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.core.kernel import from_python
from renderer.geometry.mesh import Mesh, signed_volume, surface_area
from renderer.path.lights import EMITTER_NORMAL, build_lights
from renderer.scene import spot_lights
from renderer.scene.flatten import flatten
from renderer.scene.spot_lights import (
    STEPS,
    intensity_profile,
    luminaire_emission,
    luminaire_mesh,
    profile_integral,
    profile_row,
)
from scene_description import FieldError, Luminaire, scene_from_json, scene_to_json

profile_toward = from_python(spot_lights.profile_toward)

HEIGHT = 2.0
BULB = Luminaire(
    kind="point", position_m=(0.0, 0.0, HEIGHT), flux_lm=1000.0, color_temperature_k=3000.0, color=(1.0, 1.0, 1.0), radius_m=0.02
)
SPOT = replace(BULB, kind="spot", beam_rad=0.3, field_rad=0.5)


def lit_scene(luminaire):
    """A matt grey floor under one luminaire, nothing else."""
    floor = quad((-5, -5, 0), (10, 0, 0), (0, 10, 0), color=(0.5, 0.5, 0.5), roughness=1.0)
    mesh, profile = luminaire_mesh(luminaire), intensity_profile(luminaire)
    emission = tuple(luminaire_emission(luminaire, mesh, profile))
    flat = scene(floor, _piece(mesh, emission))
    return flat._replace(
        absorbs=np.array([False, True]),
        part_profile=np.array([-1, 0], np.int32),
        profiles=profile_row(luminaire, profile)[None],
    )


def _piece(mesh: Mesh, emission):
    return box((0, 0, 0), (1, 1, 1))._replace(vertices=mesh.vertices, faces=mesh.faces.astype(np.int64), emission=emission)


def level(luminaire, x, samples=256, depth=2):
    """Mean luminance of the floor near (x, 0)."""
    camera = CameraConfig(width=8, height=8, horizontal_fov_rad=0.02)
    config = RenderConfig(samples_per_pixel=samples, max_depth=depth, threads=1)
    with Renderer(lit_scene(luminaire), camera, config, 2) as renderer:
        seen = renderer.render(pose((x + 0.3, -0.3, 0.5), (x, 0.0, 0.0)), 0, ("color",)).radiance
    return float(seen[..., 1].mean(dtype=np.float64))


@pytest.mark.parametrize("depth", [2, 3])
def test_a_bulb_lights_by_the_inverse_square_and_the_cosine(depth):
    """E = flux / (4 pi d^2) cos; ratios, as the floor's own gloss is the same."""
    straight = level(BULB, 0.0, depth=depth)
    for x in (1.0, 2.5):
        distance = math.hypot(x, HEIGHT)
        expected = (HEIGHT / distance) ** 3
        assert level(BULB, x, depth=depth) / straight == pytest.approx(expected, rel=0.06)
    assert straight == pytest.approx(1000.0 / (4 * math.pi * HEIGHT**2) * 0.5 / math.pi, rel=0.12)


def test_a_spot_is_full_in_its_beam_dark_beyond_its_field_and_falls_between():
    inside, edge, outside = (level(SPOT, HEIGHT * math.tan(angle), 512) for angle in (0.15, 0.4, 0.56))
    intensity = 1000.0 / profile_integral(intensity_profile(SPOT))
    assert inside == pytest.approx(intensity / HEIGHT**2 * math.cos(0.15) ** 3 * 0.5 / math.pi, rel=0.12)
    assert edge / inside == pytest.approx(0.5 * (math.cos(0.4) / math.cos(0.15)) ** 3, rel=0.12)
    assert outside == 0.0


@pytest.mark.parametrize("luminaire", [BULB, SPOT, replace(SPOT, intensities=(1.0, 0.8, 0.1, 0.0, 0.3))])
def test_the_flux_is_what_leaves_the_ball(luminaire):
    """Sum over faces and directions of luminance times cosine, worked out by Monte Carlo of another kind."""
    mesh, profile = luminaire_mesh(luminaire), intensity_profile(luminaire)
    emission = luminaire_emission(luminaire, mesh, profile)[1]
    row = profile_row(luminaire, profile)[None]
    corners = mesh.vertices.astype(np.float64)[mesh.faces]
    cross = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    ways = np.random.default_rng(0).normal(size=(20_000, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    shown = np.maximum(ways @ cross.T, 0.0).sum(axis=1)
    shares = np.array([profile_toward(row, 0, *way.astype(np.float32)) for way in ways])
    assert 4 * math.pi * (shown * shares).mean() * emission == pytest.approx(1000.0, rel=0.06)


def test_the_ball_is_closed_and_round():
    mesh = luminaire_mesh(BULB)
    assert signed_volume(mesh) == pytest.approx(4 / 3 * math.pi * 0.02**3, rel=0.05) and len(mesh.faces) == 320
    assert surface_area(mesh) == pytest.approx(4 * math.pi * 0.02**2, rel=0.03)


def test_faces_that_look_away_from_the_beam_are_no_lights():
    lights = build_lights(lit_scene(SPOT))
    assert 0 < len(lights.part) < 320
    assert len(build_lights(lit_scene(BULB)).part) == 320
    assert emitter_column(lights, EMITTER_NORMAL)[:, 2].max() < math.sin(SPOT.field_rad) + 0.05


def test_integrals_of_known_profiles():
    assert profile_integral(np.ones(STEPS)) == pytest.approx(4 * math.pi, rel=1e-5)
    down = np.maximum(np.cos(np.linspace(0, math.pi, STEPS)), 0.0)
    assert profile_integral(down) == pytest.approx(math.pi, rel=1e-3)


def test_scenes_carry_luminaires_and_old_ones_have_none():
    plain = sample_scene()
    old = scene_to_json(plain).replace(',"luminaires":[]', "")
    assert scene_from_json(old) == plain
    with_spot = replace(plain, luminaires=(SPOT, replace(BULB, on=False)))
    assert scene_from_json(scene_to_json(with_spot)) == with_spot
    flat = flatten(with_spot)
    assert flat.part_names[-2:] == ("0/luminaire_0", "0/luminaire_1")
    assert flat.parts.emission[-2].min() > 0 and not flat.parts.emission[-1].any()
    assert flat.part_profile[-2:].tolist() == [0, 1] and (flat.part_profile[:-2] == -1).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"direction": (0.0, 0.0, -0.5)}, r"luminaires\[0\].direction: expected a unit vector"),
        ({"beam_rad": 0.7}, r"luminaires\[0\].beam_rad: expected at most field_rad"),
        ({"intensities": (0.0, 0.0)}, r"luminaires\[0\].intensities: expected two numbers or more"),
        ({"color": (0.0, 0.0, 0.0)}, r"luminaires\[0\].color: expected a colour that shines"),
    ],
)
def test_faulty_luminaires_are_refused(change, message):
    with pytest.raises(FieldError, match=message):
        scene_from_json(scene_to_json(replace(sample_scene(), luminaires=(replace(SPOT, **change),))))

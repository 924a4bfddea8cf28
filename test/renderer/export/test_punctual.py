"""Lights without size: cones against profiles with known answers, flux by quadrature."""

import math
from dataclasses import replace

import numpy as np
import pytest
from sample_scene import sample_scene

from renderer.export.punctual import Cone, cone_solid_angle, fit_cone, punctual_lights
from renderer.export.scene_glb import split_parts
from renderer.scene.flatten import flatten
from renderer.scene.spot_lights import STEPS, intensity_profile
from scene_description import Luminaire

ANGLES = np.linspace(0.0, math.pi, STEPS)
SPOT = Luminaire(kind="spot", position_m=(1.0, 1.0, 2.4), flux_lm=500.0, color_temperature_k=3000.0, color=(0.5, 0.4, 0.25))


def falloff(cone, angles):
    """Intensity of KHR_lights_punctual over that on the axis."""
    inner, outer = math.cos(cone.inner_rad), math.cos(cone.outer_rad)
    return np.clip((np.cos(angles) - outer) / (inner - outer), 0.0, 1.0) ** 2


@pytest.mark.parametrize(("inner", "outer"), [(0.2, 0.5), (0.0, 0.5 * math.pi), (0.7, 0.9)])
@pytest.mark.parametrize("forward", [1, -1])
def test_a_profile_that_is_a_cone_is_found_again(inner, outer, forward):
    found = fit_cone(falloff(Cone(inner, outer, 1), ANGLES)[::forward])
    assert found == pytest.approx((inner, outer, forward), abs=0.01)


def test_what_shines_all_around_is_a_point():
    assert fit_cone(np.ones(STEPS)) is None
    assert fit_cone(np.linspace(1.0, 0.8, STEPS)) is None


def test_flux_is_the_integral_of_the_falloff():
    cone, fine = Cone(0.3, 0.8, 1), np.linspace(0.0, math.pi, 100_001)
    flux = 2.0 * math.pi * (falloff(cone, fine) * np.sin(fine)).sum() * (fine[1] - fine[0])
    assert cone_solid_angle(cone) == pytest.approx(flux, rel=1e-6) and cone_solid_angle(None) == 4.0 * math.pi


def test_a_spot_keeps_nearly_all_light_where_it_was():
    """Of a spot that is full to 25 degrees and ends at 40, at most 1.5 % of the flux goes elsewhere."""
    profile = intensity_profile(replace(SPOT, beam_rad=math.radians(25.0), field_rad=math.radians(40.0)))
    fitted = falloff(fit_cone(profile), ANGLES)
    weight = np.sin(ANGLES)
    assert 0.5 * np.abs(profile / (profile @ weight) - fitted / (fitted @ weight)) @ weight < 0.015


def test_every_lamp_that_is_on_is_a_light_and_no_other():
    up = replace(SPOT, direction=(0.0, 0.0, 1.0))
    scene = replace(sample_scene(), luminaires=(SPOT, replace(SPOT, on=False), up, replace(SPOT, kind="point"), replace(SPOT, flux_lm=0.0)))
    flat = flatten(scene)
    lights = {(light.object, light.part): light for light in punctual_lights(scene, flat, split_parts(flat))}
    assert list(lights) == [(5, "shade"), (0, "luminaire_0"), (0, "luminaire_2"), (0, "luminaire_3")]
    assert [light.flux_lm for light in lights.values()] == [400.0, 500.0, 500.0, 500.0]
    assert [light.cone is None for light in lights.values()] == [True, False, False, True]
    assert lights[0, "luminaire_0"].direction == (0.0, 0.0, -1.0) and lights[0, "luminaire_2"].direction == (0.0, 0.0, 1.0)
    assert lights[0, "luminaire_0"].color == (1.0, 0.8, 0.5) and lights[0, "luminaire_0"].position_m == (1.0, 1.0, 2.4)

"""Lamps: how much they shine, in which colour, and whether they are on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from grammar.counterfactual.change import ChangeError
from grammar.counterfactual.factor import Factor, Outcome, Work
from grammar.counterfactual.targets import OBJECTS, chosen_lamps
from grammar.counterfactual.values import number, truth
from scene_description import Light, Luminaire
from scene_description.color_temperature import color_of_temperature

_MOST_LM = 1e6
_COLDEST_K, _HOTTEST_K = 1667.0, 20000.0
"""Where the chromaticity of black bodies is known, and what scene descriptions hold."""

Lamp = Light | Luminaire


def _each(work: Work, changed: Callable[[Lamp], dict[str, object]]) -> Outcome:
    """Return the scene with some fields of the targeted lamps replaced."""
    scene = work.scene
    lights, luminaires = chosen_lamps(scene, work.change)
    new_lights = tuple(replace(lamp, **changed(lamp)) if k in lights else lamp for k, lamp in enumerate(scene.lights))  # type: ignore[arg-type]
    new_luminaires = tuple(
        replace(lamp, **changed(lamp)) if k in luminaires else lamp  # type: ignore[arg-type]
        for k, lamp in enumerate(scene.luminaires)
    )
    touched = tuple(sorted({scene.lights[k].object for k in lights}))
    return Outcome(replace(scene, lights=new_lights, luminaires=new_luminaires), objects=touched)


def _chosen(work: Work) -> list[Lamp]:
    lights, luminaires = chosen_lamps(work.scene, work.change)
    return [*(work.scene.lights[k] for k in lights), *(work.scene.luminaires[k] for k in luminaires)]


def scale_intensity(work: Work) -> Outcome:
    """Multiply the luminous flux of lamps."""
    factor = number(work.change, 0.0, 1e6)
    brightest = max(lamp.flux_lm for lamp in _chosen(work))
    if factor * brightest > _MOST_LM:
        raise ChangeError(
            f"{work.change}: value: expected at most {_MOST_LM / brightest:g}, which makes a lamp shine 1e6 lm, got {factor:g}"
        )
    return _each(work, lambda lamp: {"flux_lm": lamp.flux_lm * factor})


def set_temperature(work: Work) -> Outcome:
    """Give lamps the colour of a black body; their flux, which is photometric, stays."""
    kelvin = number(work.change, _COLDEST_K, _HOTTEST_K, "K")
    return _each(work, lambda lamp: {"color_temperature_k": kelvin, "color": color_of_temperature(kelvin)})


def switch(work: Work) -> Outcome:
    """Switch lamps on or off."""
    on = truth(work.change)
    return _each(work, lambda lamp: {"on": on})


def _shared(read: Callable[[Lamp], object]) -> Callable[[Work], object]:
    """Return a function that returns what all targeted lamps have in common, or None."""

    def current(work: Work) -> object:
        values = {read(lamp) for lamp in _chosen(work)}
        return values.pop() if len(values) == 1 else None

    return current


_LAMPS = (*OBJECTS, "luminaire")

FACTORS = (
    Factor(
        name="light_intensity",
        label="lamp intensity",
        unit=None,
        value="factor on the luminous flux of the lamps, 0 or more; 1: as it is",
        attribute="illumination",
        touches="light",
        targets=_LAMPS,
        make=scale_intensity,
        current=lambda work: 1.0 if _chosen(work) else None,
    ),
    Factor(
        name="color_temperature_k",
        label="colour temperature of lamps",
        unit="K",
        value="correlated colour temperature of the lamps, 1667 to 20000 K, at the same flux",
        attribute="illumination",
        touches="light",
        targets=_LAMPS,
        make=set_temperature,
        current=_shared(lambda lamp: lamp.color_temperature_k),
    ),
    Factor(
        name="lamp_on",
        label="lamps on",
        unit=None,
        value="true: the lamps are on; false: they are off",
        attribute="illumination",
        touches="light",
        targets=_LAMPS,
        make=switch,
        current=_shared(lambda lamp: lamp.on),
    ),
)

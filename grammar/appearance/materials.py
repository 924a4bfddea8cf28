"""Named materials as ranges, and one material drawn from them; colours in OKLCH.

Colours are converted to linear Rec. 709 RGB (B. Ottosson, "A perceptual color space for image processing", 2020).
"""

import math
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

import kernel_cache.elementary as el
from scene_description import Limits, Material, Texture
from scene_description.products import matmul
from scene_description.types import Color

Share = Annotated[float, Limits(ge=0.0, le=1.0)]
Range = tuple[Share, Share]
Hue = Annotated[float, Limits(ge=-360.0, le=720.0, unit="deg")]
Change = Annotated[float, Limits(ge=-1.0, le=1.0)]
Metres = Annotated[float, Limits(ge=0.001, le=100.0, unit="m")]
Relief = Annotated[float, Limits(ge=0.0, le=0.1, unit="m")]
Glow = Annotated[float, Limits(ge=0.0, le=1e5, unit="cd/m2")]
PaletteHue = Literal["main", "second", "accent", "either", "own"]

_EITHER: tuple[PaletteHue, ...] = ("main", "second", "accent")
"""Hues that a material which follows the palette without saying how has, one as often as another."""
_MAX_TEXTURE_SEED = 2**31 - 1
_HUE_JITTER_DEG = 8.0
_LMS_FROM_OKLAB = np.array([[1.0, 0.3963377774, 0.2158037573], [1.0, -0.1055613458, -0.0638541728], [1.0, -0.0894841775, -1.2914855480]])
_RGB_FROM_LMS = np.array(
    [
        [4.0767416621, -3.3077115913, 0.2309699292],
        [-1.2684380046, 2.6097574011, -0.3413193965],
        [-0.0041960863, -0.7034186147, 1.7076147010],
    ]
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ColorRange:
    """A further colour of a texture: as the material's own, changed by ``lighter``, or with lightness, chroma and hue of its own."""

    lighter: tuple[Change, Change] = (0.0, 0.0)
    lightness: Range | None = None
    chroma: Range | None = None
    hue_deg: tuple[Hue, Hue] | None = None
    hue: PaletteHue = "own"


@dataclass(frozen=True, slots=True, kw_only=True)
class TextureRange:
    """A texture of the renderer's: ranges of its scale, contrast and relief, its further colours, and the turns it may have."""

    generator: str
    scale_m: tuple[Metres, Metres]
    contrast: Range = (0.45, 0.55)
    relief_m: tuple[Relief, Relief] = (0.0, 0.0)
    colors: Annotated[tuple[ColorRange, ...], Limits(max_length=3)] = ()
    turns_deg: Annotated[tuple[Hue, ...], Limits(min_length=1, max_length=8)] = (0.0,)


@dataclass(frozen=True, slots=True, kw_only=True)
class MaterialRange:
    """A named material: ranges that its colour (OKLCH) and surface are drawn from; ``hue`` follows the room's palette.

    ``odds``: how often it is taken among those of its family.
    """

    family: str
    lightness: Range
    chroma: Range
    hue_deg: tuple[Hue, Hue] | None = None
    hue: PaletteHue = "own"
    roughness: Range
    metallic: Range = (0.0, 0.0)
    transmission: Range = (0.0, 0.0)
    diffuse_transmission: Range = (0.0, 0.0)
    clearcoat: Range = (0.0, 0.0)
    clearcoat_roughness: Range = (0.05, 0.1)
    sheen: Range = (0.0, 0.0)
    ior: Annotated[float, Limits(ge=1.0, le=3.0)] = 1.5
    glow_cd_m2: tuple[Glow, Glow] = (0.0, 0.0)
    texture: TextureRange | None = None
    odds: Annotated[float, Limits(ge=1e-6, le=1e6)] = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Palette:
    """The main and the second hue of a room, and that of its accents, in degrees."""

    main_deg: float
    second_deg: float
    accent_deg: float


def linear_rgb(lightness: float, chroma: float, hue_deg: float) -> Color:
    """Return the linear Rec. 709 RGB of an OKLCH colour; chroma is lowered until the colour lies in the gamut."""
    angle = math.radians(hue_deg)
    for shrink in np.linspace(1.0, 0.0, 21):
        a, b = shrink * chroma * math.cos(angle), shrink * chroma * math.sin(angle)
        rgb = matmul(_RGB_FROM_LMS, el.power(matmul(_LMS_FROM_OKLAB, np.array([lightness, a, b])), 3))
        if rgb.min() >= 0.0 and rgb.max() <= 1.0:
            break
    red, green, blue = (float(value) for value in np.round(np.clip(rgb, 0.0, 1.0), 6))
    return (red, green, blue)


def draw_material(rng: np.random.Generator, kind: MaterialRange, identifier: str, palette: Palette, wear: float = 0.0) -> Material:
    """Draw one material from its ranges; ``wear``: how much of the room's wear it shows."""
    lightness, chroma, roughness, metallic, transmission, coat, coat_roughness, sheen = (
        float(rng.uniform(*bounds))
        for bounds in (
            kind.lightness,
            kind.chroma,
            kind.roughness,
            kind.metallic,
            kind.transmission,
            kind.clearcoat,
            kind.clearcoat_roughness,
            kind.sheen,
        )
    )
    hue = _hue(rng, kind.hue, kind.hue_deg, palette, 0.0)
    return Material(
        id=identifier,
        family=kind.family,
        base_color=linear_rgb(lightness, chroma, hue),
        roughness=round(roughness, 4),
        metallic=round(metallic, 4),
        transmission=round(transmission, 4),
        clearcoat=round(coat, 4),
        clearcoat_roughness=round(coat_roughness, 4),
        sheen=round(sheen, 4),
        ior=kind.ior,
        diffuse_transmission=round(float(rng.uniform(*kind.diffuse_transmission)), 4) if kind.diffuse_transmission[1] > 0.0 else 0.0,
        wear=wear,
        texture=None if kind.texture is None else _texture(rng, kind.texture, (lightness, chroma, hue), palette),
        glow_cd_m2=round(float(rng.uniform(*kind.glow_cd_m2)), 2) if kind.glow_cd_m2[1] > 0.0 else 0.0,
    )


def _texture(rng: np.random.Generator, kind: TextureRange, base: tuple[float, float, float], palette: Palette) -> Texture:
    low, high = kind.scale_m
    return Texture(
        generator=kind.generator,
        scale_m=round(low * math.pow(high / low, float(rng.random())), 5),
        seed=int(rng.integers(_MAX_TEXTURE_SEED)),
        colors=tuple(_further(rng, color, base, palette) for color in kind.colors),
        contrast=round(float(rng.uniform(*kind.contrast)), 4),
        relief_m=round(float(rng.uniform(*kind.relief_m)), 7),
        rotation_rad=round(math.radians(kind.turns_deg[int(rng.integers(len(kind.turns_deg)))]), 6),
    )


def _further(rng: np.random.Generator, kind: ColorRange, base: tuple[float, float, float], palette: Palette) -> Color:
    lightness, chroma, hue = base
    lightness += float(rng.uniform(*kind.lighter))
    if kind.lightness is not None:
        lightness = float(rng.uniform(*kind.lightness))
    if kind.chroma is not None:
        chroma = float(rng.uniform(*kind.chroma))
    hue = _hue(rng, kind.hue, kind.hue_deg, palette, hue)
    return linear_rgb(min(max(lightness, 0.0), 1.0), chroma, hue)


def _hue(rng: np.random.Generator, kind: PaletteHue, bounds: tuple[float, float] | None, palette: Palette, own: float) -> float:
    if bounds is not None:
        return float(rng.uniform(*bounds))
    if kind == "own":
        return own
    if kind == "either":
        kind = _EITHER[int(rng.integers(len(_EITHER)))]
    hue = {"main": palette.main_deg, "second": palette.second_deg, "accent": palette.accent_deg}[kind]
    return hue + float(rng.uniform(-_HUE_JITTER_DEG, _HUE_JITTER_DEG))

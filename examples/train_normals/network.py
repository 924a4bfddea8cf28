"""A small U-Net (Ronneberger, Fischer and Brox, MICCAI 2015) from a colour image to surface normals, in plain JAX."""

from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

WIDTHS = (16, 24, 40, 64, 96)
"""Channels at each resolution: after the first convolution, which halves the image, and after each further halving."""

Parameters = dict[str, jax.Array]


def initial_parameters(seed: int) -> Parameters:
    """Return weights drawn after He et al. (ICCV 2015) and biases of zero; (3, 3, in, out) and (out,) float32."""
    rng = np.random.default_rng(seed)
    sizes = {"first": (5, WIDTHS[0])}
    for level, (before, after) in enumerate(pairwise(WIDTHS)):
        sizes |= {f"down{level}": (before, after), f"on{level}": (after, after), f"up{level}": (before + after, before)}
    sizes["last"] = (WIDTHS[0], 3)
    parameters = {}
    for name, (before, after) in sizes.items():
        scale = (2.0 / (9.0 * before)) ** 0.5 * (0.1 if name == "last" else 1.0)
        parameters[name] = jnp.asarray(rng.normal(0.0, scale, (3, 3, before, after)), jnp.float32)
        parameters[f"{name}_bias"] = jnp.zeros(after, jnp.float32)
    return parameters


def normals_of(parameters: Parameters, color: jax.Array) -> jax.Array:
    """Return unit normals (n, h, w, 3) float32 of pictures (n, h, w, 3) in [0, 1], whose sides are multiples of 32.

    Each pixel is given its place in the image besides its colour, as what is a wall, a floor or a ceiling depends on it.
    """
    count, height, width, _ = color.shape
    y, x = jnp.meshgrid(jnp.linspace(-1.0, 1.0, height), jnp.linspace(-1.0, 1.0, width), indexing="ij")
    place = jnp.broadcast_to(jnp.stack([x, y], axis=-1), (count, height, width, 2))
    maps = [_convolved(parameters, "first", jnp.concatenate([2.0 * color - 1.0, place], axis=-1), step=2)]
    for level in range(len(WIDTHS) - 1):
        smaller = _convolved(parameters, f"down{level}", maps[-1], step=2)
        maps.append(smaller + _convolved(parameters, f"on{level}", smaller))
    coarse = maps.pop()
    for level in reversed(range(len(WIDTHS) - 1)):
        coarse = _convolved(parameters, f"up{level}", jnp.concatenate([maps.pop(), _twice(coarse, "nearest")], axis=-1))
    return _unit(_twice(_convolved(parameters, "last", coarse, active=False), "bilinear"))


def _convolved(parameters: Parameters, name: str, image: jax.Array, *, step: int = 1, active: bool = True) -> jax.Array:
    out = lax.conv_general_dilated(image, parameters[name], (step, step), "SAME", dimension_numbers=("NHWC", "HWIO", "NHWC"))
    out = out + parameters[f"{name}_bias"]
    return jax.nn.relu(out) if active else out


def _twice(image: jax.Array, method: str) -> jax.Array:
    count, height, width, channels = image.shape
    return jax.image.resize(image, (count, 2 * height, 2 * width, channels), method)


def _unit(vectors: jax.Array) -> jax.Array:
    return vectors * lax.rsqrt(jnp.sum(vectors * vectors, axis=-1, keepdims=True) + 1e-8)

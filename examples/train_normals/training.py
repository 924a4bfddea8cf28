"""Training and use of the network: the same number of steps whatever the number of rooms, seeded."""

from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax
from numpy.typing import NDArray

from examples.train_normals.network import Parameters, initial_parameters, normals_of
from examples.train_normals.pictures import Views

BATCH, PEAK_RATE = 8, 3e-3


class Examples(NamedTuple):
    """What is trained on: pictures, several for one truth or one, (versions, n, h, w, 3) uint8, and normals (n, h, w, 3) float32."""

    pictures: NDArray[np.uint8]
    normals: NDArray[np.float32]


def gather_examples(rooms: Sequence[Views], fields: Sequence[str]) -> Examples:
    """Return all views of the rooms; ``fields``: which pictures of a view are drawn from, "color" and "noisy"."""
    pictures = np.stack([np.concatenate([getattr(room, field) for room in rooms]) for field in fields])
    return Examples(pictures, np.concatenate([room.normals for room in rooms]).astype(np.float32))


def train(examples: Examples, *, steps: int, seed: int) -> Parameters:
    """Return the parameters after so many steps of Adam (Kingma and Ba, ICLR 2015) whose rate falls as a cosine."""
    rule, step = _rule_and_step(steps)
    parameters = initial_parameters(seed)
    state = rule.init(parameters)
    for color, normals in _batches(examples, steps, np.random.default_rng(seed)):
        parameters, state = step(parameters, state, color, normals)
    return parameters


@lru_cache(maxsize=4)
def _rule_and_step(steps: int) -> tuple[optax.GradientTransformation, Callable[..., Any]]:
    """Return the rule of Adam and the compiled step, one for all trainings of so many steps."""
    rule = optax.adam(optax.warmup_cosine_decay_schedule(0.0, PEAK_RATE, max(1, steps // 20), steps))

    @jax.jit
    def step(parameters, state, color, normals):  # type: ignore[no-untyped-def]
        gradient = jax.grad(loss)(parameters, color, normals)
        change, state = rule.update(gradient, state)
        return optax.apply_updates(parameters, change), state

    return rule, step


def loss(parameters: Parameters, color: jax.Array, normals: jax.Array) -> jax.Array:
    """Return the mean of 1 - cos of the angle over the pixels that have a normal."""
    known = jnp.sum(normals * normals, axis=-1) > 0.5
    cosine = jnp.sum(normals_of(parameters, color / 255.0) * normals, axis=-1)
    return jnp.sum(jnp.where(known, 1.0 - cosine, 0.0)) / jnp.maximum(jnp.sum(known), 1)


def predict(parameters: Parameters, pictures: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return the normals (n, h, w, 3) of pictures (n, h, w, 3) uint8."""
    return np.asarray(_predict(parameters, pictures))


@jax.jit
def _predict(parameters: Parameters, pictures: jax.Array) -> jax.Array:
    return normals_of(parameters, pictures / 255.0)


def _batches(examples: Examples, steps: int, rng: np.random.Generator) -> Iterator[tuple[NDArray[np.float32], NDArray[np.float32]]]:
    """Yield pictures and normals; each batch is mirrored left to right by chance, which turns x of the normals about."""
    versions, count = examples.pictures.shape[:2]
    for _ in range(steps):
        chosen = rng.integers(count, size=BATCH)
        color, normals = examples.pictures[rng.integers(versions, size=BATCH), chosen].astype(np.float32), examples.normals[chosen]
        if rng.random() < 0.5:
            color, normals = color[:, :, ::-1], normals[:, :, ::-1] * np.array([-1.0, 1.0, 1.0], np.float32)
        yield color, normals

"""Colour and its parts by sampling paths: rounds of samples into a film, until there are enough."""

import time
from collections.abc import Callable, Collection, Iterator

import numpy as np

from renderer.camera.cameras import PosedCamera
from renderer.core.embree import SceneHandle
from renderer.film.layers import COLOR_LAYERS
from renderer.film.tone import white_luminance
from renderer.ground_truth.hit_view import TracedScene
from renderer.path.config import RenderConfig
from renderer.path.film_sums import share_clipped
from renderer.path.guide import Guide
from renderer.path.integrator import trace_paths
from renderer.path.light_nodes import KnownLight
from renderer.path.queues import WAVE, WAVE_EDGE
from renderer.path.records import Film, Transport, Work
from renderer.path.stopping import is_clean, next_round

PATHS_PER_PIECE = 8192
"""How much colour a thread computes at a time, some 10 ms: threads end together, small images have work for all, and stopping is prompt."""


class FilmExposer:
    """Exposes films of one scene by tracing paths.

    ``tree``: the scene's triangles as light is traced through them; ``guide``, ``known``: of its paths.
    """

    def __init__(
        self, scene: TracedScene, tree: SceneHandle, config: RenderConfig, paths_per_piece: int, guide: Guide, known: KnownLight
    ) -> None:
        self._scene, self._tree, self._config, self._paths_per_piece = scene, tree, config, paths_per_piece
        self._lit = scene.lit._replace(tree=tree, guide=guide, known=known)

    def expose(
        self,
        view: PosedCamera,
        frame_key: np.uint32,
        ev100: float,
        layers: Collection[str],
        aov: bool,
        cancelled: Callable[[], bool] | None,
    ) -> tuple[Film, int]:
        """Return the means of the samples, and how many there are; without colour paths end where they hit first.

        ``ev100``: exposure that white is taken from; ``aov``: whether the denoiser's guides are asked for, beside ``layers``.

        Raises:
            RenderCancelled: ``cancelled`` returned True.
        """
        size, config, white = (view.height, view.width), self._config, white_luminance(ev100)
        in_color = any(name in COLOR_LAYERS for name in layers)
        film = Film(
            np.zeros((*size, 3), np.float32),
            np.zeros((*size, 3) if "albedo" in layers else (0, 0, 3), np.float32),
            np.zeros((*size, 6) if aov else (0, 0, 6), np.float32),
            np.zeros((*size, 3) if "variance" in layers else (0, 0, 3), np.float32),
            np.zeros((*size, 3) if config.clamp or "direct" in layers or "indirect" in layers else (0, 0, 3), np.float32),
            np.zeros((*size, 2) if "shadow" in layers else (0, 0, 2), np.float32),
            np.zeros((*size, 3) if config.clamp else (0, 0, 3), np.float32),
        )
        transport = Transport(
            frame_key,
            config.max_depth if in_color else min(config.max_depth, 2 if "shadow" in layers else 1),
            np.float32(config.clamp * white or np.inf),
            np.float32(config.caustic_blur),
            np.float32(np.inf) if config.blur_textures else np.float32(1.0) / view.focal_px,
        )

        scene, lit = self._scene, self._lit

        def trace(worker: int, work: Work) -> None:
            trace_paths(lit, view, transport, work, scene.scratch[worker], film)

        # Rounds of samples, until there are enough.
        began, done = time.monotonic(), 0
        while count := next_round(config, done, time.monotonic() - began):
            before = film.light.copy() if config.noise_target else film.light
            for pieces in self._color_pieces(view, done, done + count):
                scene.workers.run(trace, pieces, cancelled)
            done += count
            if is_clean(config, before, film.light, done, white):
                break
        # Sums become means.
        for image in film:
            image *= np.float32(1.0 / done)
        if config.clamp:
            share_clipped(film)
        return film, done

    def _color_pieces(self, view: PosedCamera, begin: int, end: int) -> Iterator[list[Work]]:
        """Yield rounds of pieces for samples [begin, end); pieces of one round share no pixel, so they may run at the same time."""
        tiles = -(-view.width // WAVE_EDGE) * -(-view.height // WAVE_EDGE)
        chunk = min(end - begin, max(1, self._paths_per_piece // WAVE))
        step = max(1, self._paths_per_piece // (WAVE * chunk))
        for first in range(begin, end, chunk):
            last = min(first + chunk, end)
            yield [Work(tile, min(tile + step, tiles), first, last) for tile in range(0, tiles, step)]

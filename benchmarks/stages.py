"""Processor time of the stages of a frame: the kernels that Python calls are timed, in whatever thread they run.

Time of a thread does not count what other programs take, so a table of stages is of use on a busy machine too.
"""

from __future__ import annotations

import importlib
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any
from unittest import mock

STAGES = {
    "primary rays: hit record, depth, normals, ids": (("renderer.renderer", "trace_geometry"),),
    "which nodes the view reads": (("renderer.irradiance_cache.cached_integrator", "want_nodes"),),
    "light of new nodes": tuple(
        ("renderer.irradiance_cache.cache", name) for name in ("widen", "light_nodes", "gather_nodes", "smooth_nodes")
    ),
    "shading: materials, light, sun and mirror rays": (("renderer.irradiance_cache.cached_integrator", "shade_hits"),),
    "mirror images shared by neighbours": (("renderer.irradiance_cache.cached_integrator", "mix_mirrored"),),
    "edges": (("renderer.irradiance_cache.cached_integrator", "smooth_edges"),),
    "exposure and tone": (("renderer.renderer", "to_display"),),
}
"""Stage -> (module, name) of what it calls, as the callers know it."""

REST = "Python and numpy"
"""What a frame takes beyond its stages."""


@contextmanager
def timed_stages() -> Iterator[dict[str, float]]:
    """Time what renderers do within the context; yield seconds of processor by stage, all threads together, which grow as it is used."""
    seconds, lock = dict.fromkeys(STAGES, 0.0), threading.Lock()

    def timed(stage: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def act(*arguments: Any, **named: Any) -> Any:
            began = time.thread_time()
            found = call(*arguments, **named)
            spent = time.thread_time() - began
            with lock:
                seconds[stage] += spent
            return found

        return act

    with ExitStack() as stack:
        for stage, calls in STAGES.items():
            for module, name in calls:
                place = importlib.import_module(module)
                stack.enter_context(mock.patch.object(place, name, timed(stage, getattr(place, name))))
        yield seconds

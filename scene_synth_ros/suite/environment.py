"""Environment variables: for a while, and what processes of this package tell each other by them."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Mapping

SUPERVISED = "SCENE_SYNTH_SUPERVISED"
"""Set in nodes that ``scene_synth run`` has started: it watches them, and ends them itself when the run is over."""
RUN = "SCENE_SYNTH_RUN"
"""The token of the command or launch that has started a node, by which the nodes of a run know each other."""


@contextlib.contextmanager
def environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables of this process, which its children inherit; afterwards they are as before."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value

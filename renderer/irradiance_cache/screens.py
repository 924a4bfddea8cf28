"""Lights behind slats, bars and leaves: from nearly everywhere a part of them is hidden, so that nodes ask for more of their points."""

import numpy as np
from numpy.typing import NDArray

from renderer.core import lanes as ln
from renderer.core.kernel import entry
from renderer.core.lanes import count_chosen
from renderer.core.ray_packet import LANES
from renderer.irradiance_cache.node_direct import number_runs, sample_group
from renderer.irradiance_cache.nodes import stand_on
from renderer.irradiance_cache.specular import pass_glass
from renderer.path.direct_light import weigh_lights
from renderer.path.light_nodes import Atlas
from renderer.path.records import LitScene, Scratch

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
_PROBES, _LEAST_SEEN, _MOSTLY = 256, 8, 0.5
_LEAST_ABLE, _FEW = 8, 2
"""Of 16 points on a light so many are to face a node, and so few are seen, or hidden, where what hides it is large."""


def find_screened(scene: LitScene, atlas: Atlas, nodes: NDArray[np.int64], key: np.uint32, scratch: Scratch) -> NDArray[np.bool_]:
    """Return which groups of lights, (g,), are hidden in part from most of the ``nodes`` that see any of them; some nodes are asked."""
    counts = np.zeros((len(scene.lights.groups.area), 2), np.int64)
    _count_screened(scene, atlas, key, nodes[:: max(len(nodes) // _PROBES, 1)], scratch, counts)
    seen, in_part = counts.T
    return (seen >= _LEAST_SEEN) & (in_part > _MOSTLY * seen)


@entry
def _count_screened(
    scene: LitScene, atlas: Atlas, key: np.uint32, nodes: NDArray[np.int64], scratch: Scratch, counts: NDArray[np.int64]
) -> None:
    """Add to ``counts`` (g, 2) how many nodes see some of each group of lights, and how many of these some but not nearly all."""
    lanes = scratch.lanes
    for i in range(len(nodes)):
        stand_on(atlas, nodes[i], scratch)
        weigh_lights(scene.lights, scratch)
        if lanes[ln.IMPORTANCE] <= _ZERO:
            continue
        for k in range(LANES):
            lanes[ln.IMPORTANCE + k] = lanes[ln.GROUP_IMPORTANCE + k] = _ONE
        for group in range(len(counts)):
            if scratch.importances[group * LANES] <= _ZERO:
                continue
            number_runs(0, nodes[i], key, lanes)
            sample_group(scene, group, _ZERO, scratch)
            able = count_chosen(lanes, ln.LIGHT_PDF)
            if able < _LEAST_ABLE:
                continue
            pass_glass(scene, scratch)
            seen = count_chosen(lanes, ln.LIGHT_PDF)
            counts[group, 0] += seen > 0
            counts[group, 1] += _FEW <= seen <= able - _FEW

"""What stands behind the window panes that rays meet: only where nothing does, a pane shows the sky."""

from __future__ import annotations

import numpy as np

from renderer.core import embree as ray
from renderer.core import lanes as ln
from renderer.core.embree import LANES, PASS_PANES, SceneHandle, occluded16
from renderer.core.kernel import inlined
from renderer.path.records import Scratch

_ZERO, _ONE, _INFINITE = np.float32(0.0), np.float32(1.0), np.float32(np.inf)


@inlined
def look_through_panes(scene: SceneHandle, scratch: Scratch) -> None:
    """Fill OPEN of the lanes that hit a pane from inside: their rays go on through it, and through any other, to the sky or not.

    Frames, sills and the reveals of walls are what they meet.  The packet of the shadow rays serves, as none is traced meanwhile.
    """
    lanes, rays, packet = scratch.lanes, scratch.rays, scratch.shadow_rays.packet
    count = 0
    for k in range(LANES):
        count += 1 if lanes[ln.THIN + k] > _ZERO else 0
    if count == 0:
        return
    for k in range(LANES):
        for axis in range(0, 3 * LANES, LANES):
            packet.real[ray.ORG_X + axis + k] = lanes[ln.P_X + axis + k]
            packet.real[ray.DIR_X + axis + k] = rays.real[ray.DIR_X + axis + k]
        packet.real[ray.TNEAR + k], packet.real[ray.TFAR + k] = _ZERO, _INFINITE
        packet.integer[ray.MASK + k] = PASS_PANES
        looks = (lanes[ln.THIN + k] > _ZERO) & (lanes[ln.COS_FRONT + k] > _ZERO) & (rays.alive[k] != 0)
        packet.alive[k] = -1 if looks else 0
    occluded16(packet.alive.ctypes.data, scene.address, packet.real.ctypes.data, scene.incoherent)
    for k in range(LANES):
        # Embree sets the end of a blocked ray to minus infinity.
        lanes[ln.OPEN + k] = _ONE if (packet.alive[k] != 0) & (packet.real[ray.TFAR + k] > _ZERO) else _ZERO

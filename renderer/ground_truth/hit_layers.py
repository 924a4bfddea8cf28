"""Which function computes which layer of the hit record: a row of ``renderer.film.layers.ROWS`` of the group "hit" has one here."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

from numpy.typing import NDArray

from renderer.ground_truth import materials, motion, normals, positions
from renderer.ground_truth.boundaries import boundaries
from renderer.ground_truth.coverage import coverage
from renderer.ground_truth.hit_view import HitView
from renderer.ground_truth.lights_seen import light_seen
from renderer.ground_truth.opaque import opaque_images

FUNCTIONS: dict[str, Callable[[HitView], NDArray[Any]]] = {
    **{
        function.__name__: function
        for function in (
            positions.position,
            positions.position_camera,
            positions.uv,
            positions.object_coordinates,
            normals.normals_world,
            normals.shading_normals,
            normals.shading_normals_world,
            materials.part,
            materials.material,
            materials.base_color,
            materials.roughness,
            materials.metallic,
            materials.emission,
            materials.glass,
            materials.mirror,
            motion.flow,
            motion.flow_backward,
            motion.occlusion,
            motion.occlusion_backward,
            light_seen,
            boundaries,
            coverage,
        )
    },
    "depth_opaque": lambda view: view.shared(opaque_images).depth,
    "normals_opaque": lambda view: view.shared(opaque_images).normals,
    "semantic_opaque": lambda view: view.shared(opaque_images).semantic,
    "instance_opaque": lambda view: view.shared(opaque_images).instance,
}
"""By the layer's name."""


def hit_layers(view: HitView, names: Collection[str]) -> dict[str, NDArray[Any]]:
    """Return the named layers that follow from the hit record, C-contiguous."""
    return {name: FUNCTIONS[name](view) for name in FUNCTIONS if name in names}

"""The triangles of one scene as rays are traced through them, shared by renderers that see the same ones."""

import threading

import numpy as np

from renderer.core.embree import EmbreeScene, SceneHandle
from renderer.scene.flat_scene import FlatScene


class SceneTrees:
    """Embree's trees of a scene; who shares them closes them once, and the last one releases their memory.

    Threading: guards itself.

    ``portable``: as of ``RenderConfig``.

    Raises:
        RenderError: Embree is missing or reports a fault.
    """

    def __init__(self, flat: FlatScene, *, portable: bool) -> None:
        self._mesh, self._panes, self._portable = flat.mesh, flat.parts.portal[flat.face_part], portable
        self._steady = flat.steady
        self._lock, self._holders = threading.Lock(), 1
        self._precise = self._build(watertight=True)
        self._for_light: EmbreeScene | None = None

    def _build(self, *, watertight: bool) -> EmbreeScene:
        mesh = self._mesh
        steady = watertight and self._steady
        return EmbreeScene(mesh.vertices, mesh.faces, panes=self._panes, watertight=watertight, portable=self._portable, steady=steady)

    @property
    def precise(self) -> SceneHandle:
        """The tree through which no ray slips; valid until all have closed."""
        return self._precise.handle

    def for_light(self) -> SceneHandle:
        """Return the tree that is faster for light, built when it is first asked for; valid until all have closed.

        Portable it is the precise one: which rays slip through the other's edges depends on the processor.
        """
        if self._portable:
            return self.precise
        with self._lock:
            if self._for_light is None:
                self._for_light = self._build(watertight=False)
            return self._for_light.handle

    def shared(self, flat: FlatScene, *, portable: bool) -> "SceneTrees | None":
        """Return these trees for one more renderer; None if they are of other triangles or panes, steady where it is not, or released."""
        mesh, panes = flat.mesh, flat.parts.portal[flat.face_part]
        pairs = ((mesh.vertices, self._mesh.vertices), (mesh.faces, self._mesh.faces), (panes, self._panes))
        if (portable, flat.steady) != (self._portable, self._steady) or not all(
            ours is theirs or np.array_equal(ours, theirs) for ours, theirs in pairs
        ):
            return None
        with self._lock:
            if self._holders == 0:
                return None
            self._holders += 1
        return self

    def close(self) -> None:
        """Let go; to be called once by each that holds them."""
        with self._lock:
            self._holders -= 1
            if self._holders == 0:
                self._precise.close()
                if self._for_light is not None:
                    self._for_light.close()

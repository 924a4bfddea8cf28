"""Hits by embreex's own calls, in a process of their own: two of Embree's devices in one process keep a processor busy until it ends."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np


def reference_hits(corners: np.ndarray, origins: np.ndarray, directions: np.ndarray, *, robust: bool = False) -> dict[str, np.ndarray]:
    """Return ``primID``, ``tfar``, ``u`` and ``v`` of the rays (n, 3), float32, among triangles (m, 3, 3); ``primID`` is -1 for none."""
    with tempfile.TemporaryDirectory() as folder:
        given, found = Path(folder, "rays.npz"), Path(folder, "hits.npz")
        np.savez(given, corners=corners.astype(np.float32), origins=origins.astype(np.float32), directions=directions.astype(np.float32))
        paths = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
        subprocess.run([sys.executable, __file__, given, found, "robust" if robust else ""], check=True, env=paths, timeout=300)
        with np.load(found) as hits:
            return dict(hits)


def _trace(given: str, found: str, robust: str) -> None:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    rays, scene = np.load(given), EmbreeScene(robust=bool(robust))
    TriangleMesh(scene, rays["corners"])
    hits = scene.run(rays["origins"], rays["directions"], output=1)
    np.savez(found, **{name: hits[name] for name in ("primID", "tfar", "u", "v")})


if __name__ == "__main__":
    _trace(*sys.argv[1:])

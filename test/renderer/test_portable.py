"""The portable mode hits the same as the native one; in a process of its own, as two of Embree's devices in one keep a processor busy."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from box_room import VIEW, furnished_room

from renderer import GEOMETRIC_LAYERS, CameraConfig, RenderConfig, Renderer


def render(*, portable: bool) -> dict[str, np.ndarray]:
    with Renderer(furnished_room(), CameraConfig(width=160, height=120), RenderConfig(portable=portable, threads=2), 0) as renderer:
        return renderer.render(VIEW, 0, GEOMETRIC_LAYERS).layers


def test_the_portable_mode_renders_the_same_geometry(tmp_path: Path) -> None:
    paths = {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])}
    script = f"import numpy, test_portable; numpy.savez({str(tmp_path / 'portable.npz')!r}, **test_portable.render(portable=True))"
    subprocess.run([sys.executable, "-c", script], check=True, env=os.environ | paths, timeout=300)
    native, portable = render(portable=False), np.load(tmp_path / "portable.npz")
    assert np.array_equal(native["instance"], portable["instance"])
    np.testing.assert_allclose(native["depth"], portable["depth"], rtol=1e-5)

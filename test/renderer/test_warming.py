"""Kernels that are compiled in a process of their own are those that frames call."""

import subprocess
import sys

from renderer import warming
from renderer.cached_frames.corners import look_between
from renderer.cached_frames.edges import smooth_edges
from renderer.cached_frames.lone_pixels import lift_lone
from renderer.cached_frames.reconstruction import mix_gloss, sum_across
from renderer.cached_frames.shading import shade_hits
from renderer.cached_frames.wanted import want_nodes, want_shown
from renderer.warming import warm_up, warm_up_frames

KERNELS = (want_nodes, want_shown, shade_hits, sum_across, mix_gloss, look_between, smooth_edges, lift_lone)


def test_a_picture_of_nothing_needs_the_kernels_of_a_room_with_nodes():
    warm_up(("color",), integrator="cached")
    of_a_room = [len(kernel.signatures) for kernel in KERNELS]
    warm_up_frames()
    assert [len(kernel.signatures) for kernel in KERNELS] == of_a_room


def test_they_are_compiled_beside_the_others_where_they_are_not_kept(monkeypatch):
    """And what the other process does is waited for, before they are called."""
    begun: list[subprocess.Popen[bytes]] = []

    class Watched(subprocess.Popen[bytes]):
        def __init__(self, command: list[str], **settings: int) -> None:
            super().__init__(command, **settings)
            begun.append(self)

    monkeypatch.setattr(subprocess, "Popen", Watched)
    warm_up(("depth",), integrator="cached")
    warm_up(("color",), integrator="path")
    warm_up(("color",), integrator="cached")
    assert not begun, "they are kept"
    monkeypatch.setattr(warming, "is_kept", lambda kernel: False)
    warm_up(("depth",), integrator="cached")
    warm_up(("color",), integrator="path")
    assert not begun, "nobody asks for them"
    warm_up(("color",), integrator="cached")
    assert [process.returncode for process in begun] == [0]


def test_kernels_of_what_scans_are_ready_before_a_room_comes():
    """In a process that has swept nothing yet; after that a sweep and a scan need no other kernel."""
    asked = """
from renderer.lidar.config import ScanConfig
from renderer.lidar.sweep_config import LidarConfig
from renderer.warming import warm_up
warm_up(("depth",), scan=ScanConfig(enabled=True, beams=8), lidar=LidarConfig(enabled=True, columns=8))
from renderer.lidar import echoes, lidar, reading, returns
print([len(kernel.signatures) for kernel in (echoes.trace_echoes, lidar._aim, reading.read_beams, returns.read_returns)])
"""
    told = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "[1, 1, 1, 1]"

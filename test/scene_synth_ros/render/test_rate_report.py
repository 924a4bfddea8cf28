"""What a renderer tells of its rate: once in the log, all the while on ``/diagnostics``."""

from types import SimpleNamespace

import numpy as np
import pytest

from renderer import CameraConfig, RenderConfig
from renderer.film.frame import Frame
from scene_synth_ros.render.frame_report import RateReport
from scene_synth_ros.render.renderer_config import RendererNodeConfig

COLOR = Frame({"color": np.zeros((480, 640, 3), np.uint8)}, None, samples=2, sampling_s=0.4)
LINE = (
    "color: 5 Hz asked for, 2.4 reached; a frame takes 0.42 s to render: "
    "render.samples_per_pixel 1, camera.width 576, camera.height 432 of the renderer would about hold it, or grammar_node rate_hz 2"
)


@pytest.fixture
def log() -> list[tuple[str, str]]:
    return []


@pytest.fixture
def settings() -> dict[str, object]:
    return {"": RendererNodeConfig(realtime=True), "camera": CameraConfig(), "render": RenderConfig()}


@pytest.fixture
def report(log: list[tuple[str, str]], settings: dict[str, object]) -> RateReport:
    logger = SimpleNamespace(info=lambda line: log.append(("info", line)), warning=lambda line: log.append(("warning", line)))
    return RateReport(SimpleNamespace(get_logger=lambda: logger), settings)


def take(report: RateReport, seconds: float, count: int) -> None:
    for _ in range(count):
        report.take(COLOR._replace(sampling_s=seconds - 0.02), seconds, 0.2)


def test_a_rate_is_told_once_when_lost_and_once_when_held_again(report: RateReport, log: list[tuple[str, str]]) -> None:
    take(report, 0.42, 30)
    assert log == [("warning", LINE)]
    assert report.now()[1] == LINE
    take(report, 0.1, 30)
    assert log[1:] == [("info", "color: 5 Hz held")]
    assert report.now()[1] == ""


def test_a_cache_that_is_filled_too_slowly_is_proposed_coarser(report, log, settings) -> None:
    settings["render"] = RenderConfig(integrator="cached", cache_spacing_m=0.04)
    looked_up = Frame({"color": np.zeros((480, 640, 3), np.uint8)}, None, sampling_s=0.2, filling_s=0.16)
    for _ in range(3):
        report.take(looked_up, 0.22, 0.2)  # 0.06 s and, at 5 cm, 0.16 * (4 / 5) ** 2 = 0.10 s of the 0.18 that are left
    assert log[0][1].endswith("render.cache_spacing_m 0.05 of the renderer would about hold it, or grammar_node rate_hz 4")


def test_without_real_time_there_is_no_rate_to_hold(report: RateReport, settings: dict[str, object]) -> None:
    take(report, 0.42, 5)
    settings[""] = RendererNodeConfig(realtime=False)
    assert report.now() == (None, "")


def test_waiting_for_a_recorder_is_not_taken_for_rendering(report: RateReport, log: list[tuple[str, str]]) -> None:
    report.waiting_s = 0.5
    take(report, 0.1, 3)
    assert "a recorder takes frames no faster" in log[0][1] and "samples" not in log[0][1]

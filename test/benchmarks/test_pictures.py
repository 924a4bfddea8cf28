"""Statistics of pictures and of views against known answers."""

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("cv2")
pytest.importorskip("flip_evaluator")

from benchmarks.pictures import __main__ as command
from benchmarks.pictures.__main__ import PHOTOGRAPHS, tabulate, view_rows
from benchmarks.pictures.statistics import FIGURES, figures
from benchmarks.pictures.views import View, largest_plane


def noisy(deviation, mean=128.0, shape=(96, 128)):
    noise = np.random.default_rng(1).normal(0.0, deviation, shape)
    return np.clip(np.rint(mean + noise)[..., None], 0, 255).astype(np.uint8).repeat(3, axis=2)


def test_an_even_picture_is_flat_and_grey():
    found = figures(np.full((96, 128, 3), 90, np.uint8))
    assert [found[f"luma, percentile {p}"] for p in (1, 50, 99)] == pytest.approx([90.0] * 3)
    assert found["flat tiles, %"] == found["flat pixels, %"] == 100.0
    assert [found[name] for name in ("colourfulness", "contrast", "grain", "edges, %", "corners")] == pytest.approx([0.0] * 5, abs=1e-9)


def test_figures_are_their_definitions():
    picture = noisy(40.0)
    assert figures(picture)["contrast"] == pytest.approx(picture[..., 0].std() / 255.0)
    halves = np.zeros((64, 64, 3), np.uint8)
    halves[:, 32:] = (255, 255, 255)
    found = figures(halves)
    assert found["luma <= 25, %"] == found["all channels >= 254, %"] == found["a channel >= 250, %"] == 50.0
    assert found["edges, %"] == pytest.approx(100.0 * 2 / 64), "two columns beside the step"
    red = np.full((32, 32, 3), (200, 0, 0), np.uint8)
    assert figures(red)["colourfulness"] == pytest.approx(0.3 * np.hypot(200, 100))


def test_grain_is_what_a_plane_leaves_and_the_spectrum_of_white_noise_is_level():
    ramp = np.linspace(40.0, 200.0, 128)[None]
    found = figures(noisy(2.0, ramp))
    assert 1.6 < found["grain"] < 2.1 and found["flat tiles, %"] == 0.0
    assert figures(noisy(20.0, shape=(256, 256)))["slope of the spectrum"] == pytest.approx(0.0, abs=0.15)


def test_the_table_has_every_figure_and_ranges_are_judged():
    row = {name: PHOTOGRAPHS["mean"][name] for name in FIGURES} | {"contrast": 0.1}
    rows = {entry.name: entry for entry in tabulate([row])}
    assert list(rows) == list(FIGURES) and rows["contrast"].met is False and rows["colourfulness"].met and rows["grain"].met is None


def test_the_largest_plane_is_found_among_others():
    focal, shape = 50.0, (48, 64)
    depth, normals = np.full(shape, 2.0), np.zeros((*shape, 3))
    normals[..., 2] = -1.0
    assert largest_plane(depth, normals, focal) == 1.0
    depth[:, 40:] = 3.0
    assert largest_plane(depth, normals, focal) == pytest.approx(40 / 64)
    slanted = np.array([1.0, 0.0, -1.0]) / np.sqrt(2.0)
    across = (np.arange(64) - 31.5) / focal
    depth[:] = 2.0 / (1.0 - across)[None]
    normals[:] = slanted
    normals[:12] = (0.0, 1.0, 0.0)
    assert largest_plane(depth, normals, focal) == pytest.approx(0.75)


def test_views_count_by_frame():
    good, bad = View(0.3, 0.0, 5, 2.0), View(0.7, 0.2, 2, 1.0)
    rows = view_rows({"hallway": [[good, bad]], "office": [[good, good]]})
    values = [row.value for row in rows]
    assert values[:5] == [25.0] * 5 and values[5:10] == [0.0] * 5 and values[10:] == [50.0] * 5


def test_a_page_shows_the_pictures_with_their_seed(tmp_path, monkeypatch):
    (tmp_path / "gallery.md").write_text("# Gallery\n<!-- photographs -->\n<!-- end of photographs -->\n")
    monkeypatch.setattr(command, "DOCS", tmp_path)
    monkeypatch.setattr(command, "render_pictures", lambda *_: iter([("living_room_0", noisy(20.0))]))
    monkeypatch.setattr("sys.argv", ["pictures", "--page", "--seed", "17"])
    command.main()
    page = (tmp_path / "gallery.md").read_text()
    assert "Seed 17" in page and "![living room 0](pictures/living_room_0.jpg)" in page
    assert Image.open(tmp_path / "pictures" / "living_room_0.jpg").size == (128, 96)

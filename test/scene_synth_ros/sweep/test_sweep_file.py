"""Sweep files that do not fit are refused in one line: file, key, expected, got, and what was perhaps meant."""

from pathlib import Path

import pytest

from scene_description.share import config_path
from scene_synth_ros.sweep.sweep_file import Span, SweepError, read_sweep

GOOD = """
base: {room_types: [bedroom], seeds: [3]}
run: {frames: 2}
design: grid
factors:
  light_intensity: {values: [1, 2]}
  fov: {parameter: camera.horizontal_fov_rad, range: [0.8, 1.2]}
"""


def written(folder: Path, text: str) -> Path:
    (folder / "s.yaml").write_text(text, encoding="utf-8")
    return folder / "s.yaml"


def test_a_name_says_what_its_factor_is_unless_that_is_said(tmp_path: Path) -> None:
    lamps, fov = read_sweep(written(tmp_path, GOOD)).factors
    assert (lamps.spec.factor, lamps.values) == ("light_intensity", (1, 2))
    assert (fov.spec.parameter, fov.span) == ("camera.horizontal_fov_rad", Span(0.8, 1.2))


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("design: grid", "desing: grid", "desing: expected one of title, .* got an unknown key; did you mean 'design'"),
        ("design: grid", "design: random", "design: expected one of 'grid', .* got 'random'"),
        ("frames: 2", "frames: 0", r"run.frames: expected an integer in \[1, 100000\], got 0"),
        ("seeds: [3]", "seed: [3]", "base.seed: expected one of room_types, .* got an unknown key; did you mean 'seeds'"),
        ("room_types: [bedroom], ", "", "base: expected room_types, scenes or both, got neither"),
        ("seeds: [3]", "grammar: {cluter: 2}", "base.grammar.cluter: .* did you mean 'clutter'"),
        ("light_intensity:", "light_intensty:", "factors.light_intensty: expected a factor of scenes, .* did you mean 'light_intensity'"),
        ("camera.horizontal_fov_rad", "camera.fov_rad", "factors.fov: expected a parameter of the renderer, got 'camera.fov_rad'"),
        ("values: [1, 2]", "values: 1", "factors.light_intensity.values: expected a list of 1 to 1000 values, got 1"),
        ("values: [1, 2]", "target: {object: all}", "factors.light_intensity: expected values or a range, got neither"),
        ("range: [0.8, 1.2]", "range: [1.2, 0.8]", "factors.fov.range: expected the lesser number first"),
        ("range: [0.8, 1.2]", "range: [0, 1.2], scale: log", "factors.fov.range: expected numbers above 0"),
        ("range: [0.8, 1.2]", "values: [1.0], target: {object: all}", "factors.fov.target: expected nothing beside a parameter"),
        ("factors:", "factors: [", "line 7, column 3: expected YAML, got"),
    ],
)
def test_what_does_not_fit_is_told_in_one_line(old: str, new: str, told: str, tmp_path: Path) -> None:
    assert old in GOOD
    with pytest.raises(SweepError, match=rf"^{tmp_path}/s.yaml: {told}") as refusal:
        read_sweep(written(tmp_path, GOOD.replace(old, new)))
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("file", sorted(config_path("sweeps").glob("*.yaml")), ids=lambda file: file.stem)
def test_shipped_sweeps_fit(file: Path) -> None:
    assert read_sweep(file).title.lower().replace(" ", "_") == file.stem

"""What a report takes of the file of a sweep, and of one that is damaged."""

import json
from pathlib import Path

from evaluation_files import write

from scene_synth_ros.report.sweep_file import read_sweep
from scene_synth_ros.sweep.sweep_json import find_sweep


def test_a_sweep_is_found_beside_its_variants(tmp_path: Path) -> None:
    base = {"room_type": "office", "seed": 4, "index": 2}
    variants = [{"id": "0001", "bag": "variants/0001", "base": base, "factors": {"light": 1}, "command": "scene_synth sweep x"}]
    factors = [{"name": "light", "label": "light", "unit": None, "values": [1, [2, 3]], "base": 1}]
    content = {"schema": "scene_synth_sweep/1", "spec": {"design": "grid"}, "factors": factors, "variants": variants}
    path = write(tmp_path / "sweep.json", content)
    assert find_sweep(tmp_path / "variants" / "0001") == path == find_sweep(tmp_path / "bag")
    sweep, note = read_sweep(path)
    assert (sweep.design, note, sweep.commands, sweep.bases) == ("grid", "", {"0001": "scene_synth sweep x"}, {"0001": ("office", 4, 2)})
    assert (sweep.factors["light"].unit, sweep.factors["light"].values, sweep.factors["light"].base) == ("", (1, "[2, 3]"), 1)
    for text in ("{", json.dumps(content | {"factors": [5]}), json.dumps(content | {"schema": "x"}), json.dumps(content | {"variants": 5})):
        path.write_text(text, encoding="utf-8")
        sweep, note = read_sweep(path)
        assert not sweep.commands and note.startswith("sweep.json: ") and note.endswith("labels and commands of the variants are missing")

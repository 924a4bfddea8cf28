"""What the bytes of a dataset depend on: known again, told apart in one line, whole."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from dataset_plans import tiny_parameters, tiny_plan

from grammar import synthesize
from scene_description.share import config_path
from scene_synth_ros.offline.rules import rules_of, sample_room
from scene_synth_ros.shards import provenance as module
from scene_synth_ros.shards.plan import make_plan
from scene_synth_ros.shards.provenance import ProvenanceError, admit, read_provenance

PLAN = tiny_plan(3, 2)
OWN = PLAN.provenance[0]


def test_it_is_read_as_it_was_written_and_is_small() -> None:
    text = json.dumps(OWN.to_mapping())
    assert read_provenance(json.loads(text)) == OWN == PLAN.own_provenance() and len(text) < 1500
    assert set(OWN.program) == {"kernel_cache", "scene_description", "grammar", "renderer", "scene_synth_ros"}, "evaluation makes no byte"
    assert {"python", "numba", "llvmlite", "numpy", "scipy", "embreex", "pillow", "libjpeg of pillow", "zstd"} <= set(OWN.versions)


def test_the_number_of_rooms_does_not_count_and_whatever_decides_their_bytes_does() -> None:
    assert tiny_plan(9, 3).provenance == PLAN.provenance
    other = tiny_plan(3, 2, "renderer_node.streams.uv:=true").provenance[0]
    assert OWN.difference(other) == "parameters (configuration)"


@pytest.mark.parametrize(
    ("can", "word", "features"),
    [
        ((True, True), "portable:=true", "AVX2"),
        ((True, True), "portable:=false", "AVX-512 of Zilog"),
        ((True, False), "portable:=false", "AVX2 of Zilog"),
        ((True, True), "denoise:=auto", "a name and a digest"),
        ((False, False), "portable:=true", "a name and a digest"),
    ],
)
def test_of_the_processor_counts_what_changes_bytes(
    can: tuple[bool, bool], word: str, features: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "COMMON", can[0])
    monkeypatch.setattr(module, "AVX512", can[1])
    monkeypatch.setattr(module, "maker", lambda: "Zilog")
    monkeypatch.setattr(module, "_processor", lambda: "a name and a digest")
    assert tiny_plan(3, 2, f"renderer_node.render.{word}").provenance[0].processor == {"features": features}


def test_every_file_of_the_configuration_that_a_room_is_made_by_counts() -> None:
    opened: set[Path] = set()
    root = config_path("categories.yaml").parent
    listening = [True]

    def hear(event: str, arguments: tuple[object, ...]) -> None:
        if listening and event == "open" and isinstance(arguments[0], str | Path) and root in Path(arguments[0]).parents:
            opened.add(Path(arguments[0]))

    sys.addaudithook(hear)  # which cannot be taken away
    settings = PLAN.settings_of(0)
    rules_of.__globals__["_rules"].cache_clear()
    synthesize._shipped.cache_clear()
    sample_room(rules_of(settings), settings, 0)
    listening.clear()
    known = [config_path(name) for name in module._CONFIGURATION]
    assert opened and not [path for path in opened if not any(path == one or one in path.parents for one in known)]


def test_files_of_the_user_and_of_the_packages_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    grammar, base, folder = tmp_path / "bedroom.yaml", tmp_path / "mine.yaml", tmp_path / "models"
    grammar.write_text("extends: mine.yaml\n")
    base.write_text("extends: bedroom.yaml\n".replace("bedroom", "office"))
    folder.mkdir()
    (folder / "catalog.yaml").write_text("models: []\n")
    words = {"parameters": {"grammar_node": {"grammar_file": str(grammar), "catalog_dir": str(folder)}}}
    before = module.provenance_of(words, portable=True, denoised=False)
    assert {"grammar_file", "catalog_dir 0"} < set(before.configuration)
    base.write_text("extends: office.yaml\nroom_type: office\n")
    (folder / "catalog.yaml").write_text("models: [] \n")
    source = Path(module.__file__).parents[2]
    monkeypatch.setattr(module, "_digest_of_folder", lambda path, *kinds: "new" if path in (source / "renderer", folder) else "old")
    for cached in (module._own_files, module._program):
        cached.cache_clear()
    after = module.provenance_of(words, portable=True, denoised=False)
    for cached in (module._own_files, module._program, module._shipped):
        cached.cache_clear()
    assert after.configuration["grammar_file"] != before.configuration["grammar_file"]
    assert after.configuration["catalog_dir 0"] == after.program["renderer"] == "new"


def test_another_is_refused_in_a_line_that_names_what_differs_or_recorded() -> None:
    other = replace(OWN, versions={**OWN.versions, "numba": "0.1"}, program={**OWN.program, "grammar": "x"}, processor={"features": "z80"})
    assert admit((OWN,), [OWN], "d", accept=False) == (OWN,)
    line = r"^d: .*: grammar \(program\); numba 0.1 here, .* there; features z80 here, .* --accept-mixed"
    with pytest.raises(ProvenanceError, match=line):
        admit((OWN,), [OWN, other], "d", accept=False)
    assert admit((OWN,), [other, OWN, other], "d", accept=True) == (OWN, other)
    many = replace(OWN, program=dict.fromkeys(OWN.program, "x"))
    assert OWN.difference(many).endswith("; 1 more")


def test_a_plan_tells_what_began_it() -> None:
    assert make_plan(tiny_parameters(3)).provenance == (OWN,)

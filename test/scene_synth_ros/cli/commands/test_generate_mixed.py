"""``scene_synth generate`` on what is there already: made by something else, changed by hand, or to be extended."""

import json
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from dataset_plans import TINY, digests

from scene_description.share import config_path
from scene_synth_ros.cli.command_line import main
from scene_synth_ros.cli.commands import generate_command
from scene_synth_ros.dataset import open_dataset
from scene_synth_ros.shards import provenance
from scene_synth_ros.shards.make_shard import make_shard
from scene_synth_ros.shards.plan import DatasetPlan
from scene_synth_ros.shards.store import LocalStore

pytestmark = pytest.mark.slow

WORDS = ["--frames", "1", "--seed", "7", "--params", "ground_truth", *(word for own in TINY[:2] for word in ("-p", own))]


@pytest.fixture(autouse=True)
def here(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Make shards in this process, and let it forget what it has read of the user's files before and after."""

    def run_here(plan: DatasetPlan, store: LocalStore, shards: list[int], **_: object) -> None:
        for shard in shards:
            make_shard(plan, shard, store)

    monkeypatch.setattr(generate_command, "run_shards", run_here)
    provenance._own_files.cache_clear()
    yield
    provenance._own_files.cache_clear()


def generate(*words: object) -> int:
    with pytest.raises(SystemExit) as end:
        main(["generate", *map(str, words)])
    return int(end.value.code or 0)


def test_a_grammar_that_changed_since_is_noticed_by_whatever_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    grammar, out = Path(shutil.copy(config_path("grammars/bedroom.yaml"), tmp_path / "mine.yaml")), tmp_path / "rooms"
    assert generate("--rooms", 2, "--shard-rooms", 1, *WORDS, "--grammar", grammar, "--out", out, "--shard", "0/2") == 0
    before = digests(out)
    grammar.write_text(grammar.read_text().replace("mean: 3.9", "mean: 4.1"))
    provenance._own_files.cache_clear()
    capsys.readouterr()
    for words in (["--resume"], ["--shard", "1/2"], ["--finish"], ["--resume", "--ray"]):
        assert generate("--out", out, *words) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert "expected shards of one program" in line and "got others: grammar_file (configuration); go on" in line
    assert digests(out) == before
    assert generate("--out", out, "--resume", "--accept-mixed") == 0
    plan, card = json.loads((out / "dataset.json").read_text()), (out / "README.md").read_text()
    digest = [one["configuration"]["grammar_file"] for one in plan["provenance"]]
    assert len(set(digest)) == 2
    made = [json.loads((out / "shards" / name).read_text())["provenance"] for name in ("00000.json", "00001.json")]
    assert made == plan["provenance"]
    assert "by several programs or kinds of machine" in card and "1 by another: grammar_file (configuration)." in card
    assert generate("--out", out, "--finish") == 0, "what was accepted stays so"


def test_more_rooms_extend_a_dataset_whose_shards_and_splits_stay(tmp_path: Path) -> None:
    types, out, whole = ["-p", "grammar_node.scene.room_type:=hallway,storage"], tmp_path / "rooms", tmp_path / "whole"
    assert generate("--rooms", 3, "--shard-rooms", 2, *WORDS, *types, "--out", out) == 0
    before, splits = digests(out), split(out)
    assert generate("--rooms", 2, "--out", out, "--resume") == generate("--rooms", 7, "--frames", 2, "--out", out, "--resume") == 2
    assert generate("--rooms", 5, *WORDS, *types, "--out", out, "--resume") == 0
    assert generate("--rooms", 7, "--out", out, "--resume") == 0, "by its own plan"
    after = digests(out)
    assert all(after[name] == before[name] for name in before if name.startswith("shards/"))
    assert [len(json.loads((out / "shards" / f"0000{k}.json").read_text())["rooms"]) for k in range(4)] == [2, 1, 2, 2]
    assert generate("--rooms", 7, "--shard-rooms", 2, *WORDS, *types, "--out", whole) == 0
    assert scenes(out) == scenes(whole) and len(open_dataset(out, layers=("depth",))) == 7
    extended = split(out)
    assert all(extended[room] == name for room, name in splits.items()) and len(extended) == 7
    assert generate("--rooms", 6, *WORDS, *types, "--out", out, "--resume") == 2


def split(folder: Path) -> dict[int, str]:
    """Return room -> split."""
    with pytest.raises(SystemExit) as end:
        main(["split", str(folder), "--shares", "a=0.5,b=0.5"])
    assert not end.value.code
    found = json.loads((folder / "splits.json").read_text())["splits"]
    return {row["room"]: name for name, rows in found.items() for row in rows}


def scenes(folder: Path) -> list[str]:
    manifest = json.loads((folder / "manifest.json").read_text())
    return [row["scene_sha256"] for shard in manifest["shards"] for row in shard["rooms"]]


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a dataset of two rooms, a shard each."""
    out = tmp_path_factory.mktemp("mixed") / "one"
    assert generate("--rooms", 2, *WORDS, "--out", out, "--workers", 1) == 0
    return out


def cut(folder: Path) -> None:
    os.truncate(folder / "shards" / "00001" / "00001_0.mcap", 2000)


def edit_fact(folder: Path) -> None:
    path = folder / "shards" / "00001.json"
    document = json.loads(path.read_text())
    document["rooms"][0]["floor_area_m2"] = 99999.0
    path.write_text(json.dumps(document, indent=1) + "\n")


@pytest.mark.parametrize(
    ("damage", "says"), [(cut, "shards/00001/00001_0.mcap: expected "), (edit_fact, "shards/00001.json: expected a completion file as")]
)
def test_what_was_cut_or_edited_since_is_not_taken_and_is_made_again(
    damage: Callable[[Path], None], says: str, dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = Path(shutil.copytree(dataset, tmp_path / "rooms"))
    damage(out)
    assert generate("--out", out, "--finish") == 2
    assert says in capsys.readouterr().err and "99999" not in (out / "README.md").read_text()
    assert generate("--out", out, "--resume") == 0
    assert says in capsys.readouterr().out and digests(out) == digests(dataset)


def test_a_plan_that_was_edited_is_refused(dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = Path(shutil.copytree(dataset, tmp_path / "rooms"))
    plan = json.loads((out / "dataset.json").read_text())
    for change, says in (({"rooom": 3}, "rooom: expected one of"), ({"seed": 8}, "got others: parameters (configuration)")):
        (out / "dataset.json").write_text(json.dumps(plan | change))
        assert generate("--out", out, "--resume") == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert says in line


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--threads", "99"], "--threads: expected 1 to "),
        (["-p", "grammar_node.rooms:=9"], "-p grammar_node.rooms: expected this or --rooms, which sets it, got both"),
        (["-p", "grammar_node.seed:=9"], "-p grammar_node.seed: expected this or --seed"),
    ],
)
def test_words_that_contradict_each_other_or_the_machine_are_refused(
    words: list[str], says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert generate("--rooms", 2, *WORDS, *words, "--out", tmp_path / "rooms") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert says in line and not (tmp_path / "rooms").exists()

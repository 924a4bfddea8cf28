"""The plan of a dataset: what it keeps, how it is cut, what it refuses."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from dataset_plans import tiny_parameters, tiny_plan

from scene_synth_ros.shards.plan import PlanError, default_rooms_per_shard, make_plan, read_plan
from scene_synth_ros.shards.run_shards import begin_dataset, read_size
from scene_synth_ros.shards.store import LocalStore
from scene_synth_ros.suite.parameters import ParameterError

PLAN = tiny_plan(10, 4, "grammar_node.rate_hz:=5.0")


def test_a_plan_is_read_as_it_was_written() -> None:
    assert read_plan(PLAN.to_json(), "x") == PLAN
    assert json.loads(PLAN.to_json())["shards"] == 3 and json.loads(PLAN.to_json())["parameters"]["grammar_node"]["rate_hz"] == 5.0


def test_rooms_are_cut_in_order_and_each_shard_is_a_run_of_its_own() -> None:
    assert [list(PLAN.rooms_of(shard)) for shard in range(PLAN.shards)] == [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9]]
    last = PLAN.settings_of(2)
    assert (last.run.first_index, last.run.rooms, last.run.seed, last.run.frames_per_room) == (8, 2, 7, 2)
    assert '"first_index": 8' in last.recorder[""].custom_data[0]
    with pytest.raises(PlanError, match="shard 3: expected 0 to 2"):
        PLAN.rooms_of(3)


def test_an_extended_dataset_keeps_its_shards_and_adds_others() -> None:
    once = PLAN.extended(15)
    assert [list(once.rooms_of(shard)) for shard in (1, 2, 3, 4)] == [[4, 5, 6, 7], [8, 9], [10, 11, 12, 13], [14]]
    twice = once.extended(23)
    assert (twice.shards, twice.extended_from, list(twice.rooms_of(6))) == (7, (10, 15), [19, 20, 21, 22])
    assert all(twice.rooms_of(shard) == once.rooms_of(shard) for shard in range(once.shards))
    assert once.settings_of(2) == PLAN.settings_of(2) and read_plan(twice.to_json(), "x") == twice
    whole = replace(PLAN, rooms=8)
    assert whole.extended(10) == PLAN, "whole shards leave no trace"


@pytest.mark.parametrize(("rooms", "expected"), [(1, 1), (40, 1), (100, 3), (1000, 16), (10**6, 16)])
def test_shards_are_small_in_small_datasets(rooms: int, expected: int) -> None:
    assert default_rooms_per_shard(rooms) == expected


@pytest.mark.parametrize(
    ("own", "error"),
    [
        ("grammar_node.first_index:=3", "first_index: expected 0, got 3"),
        ("recorder_node.split.rooms:=2", "split: expected none"),
        ("renderer_node.camera.width:=no", "camera.width: expected"),
        ("grammar_node.clock:=wall", "clock: expected simulated"),
    ],
)
def test_what_makes_no_dataset_is_refused(own: str, error: str) -> None:
    with pytest.raises((PlanError, ParameterError), match=error):
        make_plan(tiny_parameters(2, own, *(["grammar_node.lock_step:=false"] if "wall" in own else [])))


@pytest.mark.parametrize(
    ("change", "error"),
    [
        (lambda d: d.update(schema="other"), "expected a plan with schema"),
        (lambda d: d.update(rooms="many"), "rooms: expected"),
        (lambda d: d.update(rooms_per_shard=0), r"rooms_per_shard: expected an integer in \[1, "),
        (lambda d: d.update(rooom_type="office"), "rooom_type: expected one of .*, got an unknown key; it is not what scene_synth"),
        (lambda d: d.update(shards=9), "shards: expected 3, as rooms and rooms_per_shard have it, got 9"),
        (lambda d: d.update(extended_from=[8, 4]), "extended_from: expected rising numbers of rooms"),
        (lambda d: d.update(provenance=[]), "provenance: expected of what began the dataset, got none"),
        (lambda d: d["provenance"][0].pop("versions"), r"provenance\[0\].versions: expected a value"),
        (lambda d: d["parameters"].pop("renderer_node"), "expected renderer_node, too"),
    ],
)
def test_a_file_that_is_no_plan_is_refused_with_its_field(change, error: str) -> None:  # type: ignore[no-untyped-def]
    document = json.loads(PLAN.to_json())
    change(document)
    with pytest.raises(PlanError, match=error):
        read_plan(json.dumps(document).encode(), "x")


@pytest.mark.parametrize(
    ("other", "difference"),
    [
        (replace(PLAN, seed=8), "seed: 8 here, 7 there"),
        (tiny_plan(10, 4), "parameter grammar_node.rate_hz: 10.0 here, 5.0 there"),
        (tiny_plan(10, 4, "grammar_node.rate_hz:=5.0", "renderer_node.streams.uv:=true"), "streams.uv: True here, its default there"),
    ],
)
def test_a_folder_goes_on_by_its_own_plan_only(tmp_path: Path, other, difference: str) -> None:  # type: ignore[no-untyped-def]
    store = LocalStore(tmp_path)
    begin_dataset(PLAN, store, "d", resume=False)
    begin_dataset(PLAN, store, "d", resume=True)
    with pytest.raises(PlanError, match="say --resume"):
        begin_dataset(PLAN, store, "d", resume=False)
    with pytest.raises(PlanError, match=difference):
        begin_dataset(other, store, "d", resume=True)


def test_a_folder_goes_on_with_more_rooms_but_not_with_fewer(tmp_path: Path) -> None:
    store = LocalStore(tmp_path)
    begin_dataset(PLAN, store, "d", resume=False)
    store.write("manifest.json", b"of ten rooms")
    begin_dataset(PLAN.extended(12), store, "d", resume=True)
    assert store.names("") == ["dataset.json"] and read_plan(store.read("dataset.json") or b"", "d").rooms == 12
    with pytest.raises(PlanError, match="rooms: 10 here, 12 there"):
        begin_dataset(PLAN, store, "d", resume=True)


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(PlanError, match="holds thesis"):
        begin_dataset(PLAN, LocalStore(tmp_path), "d", resume=True)


@pytest.mark.parametrize(("text", "size"), [("1GB", 10**9), ("1.5 MiB", 1572864), ("300", 300), ("2kb", 2000)])
def test_sizes(text: str, size: int) -> None:
    assert read_size(text) == size


@pytest.mark.parametrize("text", ["", "1 PB", "-1GB", "0", "GB", "1IB"])
def test_no_sizes(text: str) -> None:
    with pytest.raises(PlanError, match="expected a number of bytes"):
        read_size(text)

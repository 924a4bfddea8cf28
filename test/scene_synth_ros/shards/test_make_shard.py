"""Shards made in this process: what a live run has, room by room, whatever fails."""

import hashlib
import json
import os
import shutil
from pathlib import Path

import pytest
from dataset_plans import FRAMES, digests, messages_of, tiny_parameters, tiny_plan

from grammar import GrammarError
from grammar.synthesize import SceneSynthesizer
from scene_description import scene_to_json
from scene_synth_ros.bags.bag_writer import BagWriteError
from scene_synth_ros.offline.offline_bag import OfflineBag
from scene_synth_ros.offline.offline_renderer import OfflineRenderer
from scene_synth_ros.offline.settings import read_settings
from scene_synth_ros.shards import make_shard as module
from scene_synth_ros.shards.completion import document_bytes, faults_of, make_manifest, read_completion, survey
from scene_synth_ros.shards.make_shard import MAX_ATTEMPTS, RoomsAhead, make_shard
from scene_synth_ros.shards.store import LocalStore
from scene_synth_ros.synthesize.room_schedule import RoomSchedule

PLAN = tiny_plan(3, 2)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> LocalStore:
    """Return a dataset of three rooms in shards of two and one, the last made first."""
    made = LocalStore(tmp_path_factory.mktemp("dataset"))
    for shard in (1, 0):
        make_shard(PLAN, shard, made)
    return made


def bag(store: LocalStore, shard: int) -> Path:
    return store.root / "shards" / f"{shard:05d}"


@pytest.mark.slow
def test_shards_have_the_messages_and_stamps_of_one_run_of_all_rooms(store: LocalStore, tmp_path: Path) -> None:
    """Rooms follow each other as the grammar node sends them; a live run tells ``/tf_static`` once, each shard at its own begin."""
    settings = read_settings(tiny_parameters(3))
    synthesizer, run = SceneSynthesizer.from_config(), RoomSchedule(settings.run, 0.0)
    with OfflineBag(tmp_path / "live", settings, synthesizer.floor_map) as live:
        while (order := run.order(0.0)) is not None:
            live.add_room(synthesizer.synthesize(settings.grammar["scene"], settings.run.seed, order.index, order.times))
            run.sent(FRAMES, 0.0)
    first = messages_of(bag(store, 0))
    assert messages_of(tmp_path / "live")[: len(first)] == first
    made = [messages_of(bag(store, shard), without="/tf_static") for shard in (0, 1)]
    assert made[0] + made[1] == messages_of(tmp_path / "live", without="/tf_static")
    assert [sum(topic == "/tf_static" for topic, _, _ in messages_of(bag(store, shard))) for shard in (0, 1)] == [1, 1]


def test_the_completion_file_tells_rooms_files_and_topics(store: LocalStore) -> None:
    completion = read_completion(store, PLAN, 0)
    assert completion is not None and completion["failed"] == [] and not list(faults_of(store, completion))
    assert [(row["index"], row["scene_id"], row["frames"]) for row in completion["rooms"]] == [(0, "hallway-7-0", 2), (1, "hallway-7-1", 2)]
    assert [row["name"] for row in completion["files"]] == ["00000/00000_0.mcap", "00000/metadata.yaml"]
    assert completion["messages"] == len(messages_of(bag(store, 0))) and "/synth/camera/depth/image_raw" in completion["layers"]
    assert all(row["objects"]["light_switch"] == 1 and 2.0 < row["floor_area_m2"] < 60.0 for row in completion["rooms"])


def test_the_manifest_waits_for_every_shard(store: LocalStore, tmp_path: Path) -> None:
    manifest = make_manifest(PLAN, store)
    assert manifest is not None and (manifest["rooms"], manifest["frames"]) == (3, 6)
    one = LocalStore(tmp_path)
    make_shard(PLAN, 1, one)
    assert survey(PLAN, one) == ([0], [], list(PLAN.provenance)) and make_manifest(PLAN, one) is None
    one.remove("shards/00001")
    assert survey(PLAN, one).missing == [0, 1], "a completion file without its bag is of no use"
    one.write("shards/00001.json", b"{}")
    assert read_completion(one, PLAN, 1) is None


def test_what_was_changed_by_hand_or_cut_does_not_count(store: LocalStore, tmp_path: Path) -> None:
    changed = LocalStore(shutil.copytree(store.root, tmp_path / "changed"))
    completion = read_completion(changed, PLAN, 0)
    assert completion is not None
    completion["rooms"][0]["floor_area_m2"] = 1000.0
    changed.write("shards/00000.json", document_bytes(completion))
    os.truncate(bag(changed, 1) / "00001_0.mcap", 2000)
    assert read_completion(changed, PLAN, 0) is None
    found = survey(PLAN, changed)
    size = (bag(store, 1) / "00001_0.mcap").stat().st_size
    assert found.missing == [0, 1] and found.faults == [
        "shards/00000.json: expected a completion file as it was written, got an edited or damaged one, or one of another plan",
        f"shards/00001/00001_0.mcap: expected {size} bytes, got 2000",
    ]


class Failing:
    """Lets room 1 fail with an error so many times where it is ``sampled``, or in the second frame where it is ``rendered``."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.where, self.times, self.error = "", 0, Exception()
        sample, frame = RoomsAhead._sample, OfflineRenderer.frame

        def sample_or_fail(rooms: RoomsAhead, index: int) -> object:
            self.fail("sampled", index == 1)
            return sample(rooms, index)

        def frame_or_fail(renderer: OfflineRenderer, index: int) -> object:
            self.fail("rendered", renderer._work.scene.index == index == 1)
            return frame(renderer, index)

        monkeypatch.setattr(RoomsAhead, "_sample", sample_or_fail)
        monkeypatch.setattr(OfflineRenderer, "frame", frame_or_fail)

    def fail(self, where: str, here: bool) -> None:
        if here and where == self.where and self.times:
            self.times -= 1
            raise self.error


@pytest.fixture
def failing(monkeypatch: pytest.MonkeyPatch) -> Failing:
    return Failing(monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize("where", ["sampled", "rendered"])
def test_a_file_that_cannot_be_read_for_a_moment_leaves_no_trace(store: LocalStore, tmp_path: Path, failing: Failing, where: str) -> None:
    failing.where, failing.times, failing.error = where, MAX_ATTEMPTS - 1, OSError(5, "Input/output error")
    make_shard(PLAN, 0, LocalStore(tmp_path))
    again, first = digests(tmp_path), digests(store.root)
    assert failing.times == 0 and again == {name: first[name] for name in again} and len(again) == 3


def test_a_file_that_cannot_be_read_time_and_again_ends_the_shard(tmp_path: Path, failing: Failing) -> None:
    failing.where, failing.times, failing.error = "sampled", 100, OSError(5, "Input/output error")
    with pytest.raises(OSError, match="Input/output"):
        make_shard(PLAN, 0, LocalStore(tmp_path))
    assert failing.times == 100 - MAX_ATTEMPTS and list((tmp_path / "shards").iterdir()) == []


@pytest.mark.parametrize(
    ("where", "error", "says"),
    [
        ("sampled", GrammarError("no layout\nfits"), "no layout fits"),
        ("rendered", ZeroDivisionError("in a frame"), "fault of the program: ZeroDivisionError: in a frame"),
    ],
)
def test_a_room_that_would_fail_every_time_is_tried_once_and_listed_and_the_others_are_as_ever(
    store: LocalStore, tmp_path: Path, failing: Failing, where: str, error: Exception, says: str
) -> None:
    failing.where, failing.times, failing.error = where, 100, error
    told: list[str] = []
    completion = make_shard(PLAN, 0, LocalStore(tmp_path), lambda progress: told.append(progress.what))
    assert failing.times == 99 and told.count("failed") == 1
    (row,) = completion["failed"]
    assert (row["index"], row["attempts"]) == (1, 1) and row["error"].startswith(says)
    assert [room["index"] for room in completion["rooms"]] == [0]
    whole = messages_of(bag(store, 0))
    begin_of_1 = [log for topic, log, _ in whole if topic == "/synth/scene"][1]
    assert messages_of(tmp_path / "shards" / "00000") == [message for message in whole if message[1] < begin_of_1]
    assert survey(PLAN, LocalStore(tmp_path)).missing == [1], "a shard with a failed room is done"


def test_a_shard_of_which_no_room_can_be_made_has_no_bag(tmp_path: Path) -> None:
    completion = make_shard(PLAN, 1, LocalStore(tmp_path), given_up={2: "a process that made it ended by SIGSEGV"})
    assert completion["files"] == [] and completion["failed"][0]["error"].endswith("SIGSEGV")
    assert [path.name for path in (tmp_path / "shards").iterdir()] == ["00001.json"] and survey(PLAN, LocalStore(tmp_path)).missing == [0]


def test_a_disk_that_refuses_ends_the_shard_and_nothing_of_it_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise BagWriteError("no space left on device")

    monkeypatch.setattr(module.OfflineBag, "add_room", refuse)
    with pytest.raises(BagWriteError, match="no space left"):
        make_shard(PLAN, 1, LocalStore(tmp_path))
    assert list((tmp_path / "shards").iterdir()) == []


def test_a_scene_is_hashed_as_it_is_published(store: LocalStore) -> None:
    """Room 2 sampled by itself, with the stamps of its place in the run."""
    settings = PLAN.settings_of(1)
    order = RoomSchedule(settings.run, 0.0).order(0.0)
    assert order is not None and order.index == 2 and order.times.first_index == 2 * FRAMES
    scene = SceneSynthesizer.from_config().synthesize(settings.grammar["scene"], 7, 2, order.times)
    (row,) = json.loads((store.root / "shards" / "00001.json").read_text())["rooms"]
    assert row["scene_sha256"] == hashlib.sha256(scene_to_json(scene).encode()).hexdigest()

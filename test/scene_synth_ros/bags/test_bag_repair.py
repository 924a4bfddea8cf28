"""Bags cut at any byte and damaged at any place are read and repaired without a traceback, and lose no more than they must."""

import hashlib
import random
import shutil
import subprocess
from pathlib import Path

import pytest
from bag_samples import TOPICS, frame_messages, text, write_bag
from hypothesis import given, settings
from hypothesis import strategies as st
from scene_synth_ros_suite import command, environment

from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.bags.bag_reader import BagReader, BagReadError
from scene_synth_ros.bags.bag_repair import repair_bag, replace_bag
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.cli.command_line import main

FRAMES, CHUNK = 40, 6000
CUTS = 50


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole") / "bag"
    write_bag(folder, frames=FRAMES, chunk_size=CHUNK)
    return folder


@pytest.fixture(scope="module")
def uncompressed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("uncompressed") / "bag"
    write_bag(folder, frames=FRAMES, chunk_size=CHUNK, compression="none")
    return folder


def content(bag: Path) -> list[tuple[str, int, bytes]]:
    with BagReader(bag) as reader:
        return [(message.topic, message.log_ns, message.data) for message in reader.messages(file_order=True)]


def cut_bag(whole: Path, folder: Path, size: int, *, active: bool) -> Path:
    """Return a copy of a bag as a killed recorder (``active``) or a broken copy leaves it."""
    folder.mkdir()
    name = "bag_0.mcap.active" if active else "bag_0.mcap"
    (folder / name).write_bytes((whole / "bag_0.mcap").read_bytes()[:size])
    if not active:
        shutil.copy(whole / "metadata.yaml", folder)
    return folder


@pytest.mark.parametrize(("kind", "active"), [("whole", True), ("whole", False), ("uncompressed", True)])
def test_a_bag_cut_at_any_byte_loses_at_most_the_chunk_that_was_cut_and_the_frame_it_was_cut_in(
    request: pytest.FixtureRequest, tmp_path: Path, kind: str, active: bool
) -> None:
    whole: Path = request.getfixturevalue(kind)
    data = (whole / "bag_0.mcap").read_bytes()
    expected = content(whole)
    draw = random.Random(20 + active)
    for number in range(CUTS):
        size = draw.randrange(1, len(data))
        folder = cut_bag(whole, tmp_path / f"cut{number}", size, active=active)
        before = hashlib.sha256((next(folder.glob("*.mcap*"))).read_bytes()).digest()
        try:
            report = repair_bag(folder, tmp_path / f"new{number}")
        except BagReadError as error:
            assert size < 4 * CHUNK, f"cut at {size}: {error}"
            assert "\n" not in str(error)
            continue
        found = content(report.bag)
        assert found == expected[: len(found)]
        uncompressed = sum(len(message[2]) for message in expected[len(found) :])
        share_left = 1.0 - size / len(data)
        assert uncompressed <= share_left * sum(len(message[2]) for message in expected) + 3.5 * CHUNK, f"cut at {size}"
        inspected = inspect_bag(report.bag)
        assert inspected.faults == (), f"cut at {size}"
        assert not {stamp for _, stamp, _ in found} & {stamp for _, stamp, _ in expected[len(found) :]}, "whole frames, or nothing of them"
        assert bool(report.cut) == (found != content(folder))
        assert inspected.message_count == report.message_count == len(found)
        assert hashlib.sha256((next(folder.glob("*.mcap*"))).read_bytes()).digest() == before
        inspect_bag(folder)


def test_a_repaired_bag_in_place_has_the_name_of_the_old_one(whole: Path, tmp_path: Path) -> None:
    size = (whole / "bag_0.mcap").stat().st_size * 3 // 4
    folder = cut_bag(whole, tmp_path / "bag", size, active=True)
    replace_bag(folder, repair_bag(folder, tmp_path / "fresh").bag)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bag"]
    assert sorted(path.name for path in folder.iterdir()) == ["fresh_0.mcap", "metadata.yaml"]
    found = content(folder)
    assert found == content(whole)[: len(found)] and len(found) > 100
    single = tmp_path / "single.mcap"
    single.write_bytes((whole / "bag_0.mcap").read_bytes()[:size])
    replace_bag(single, repair_bag(single, tmp_path / "again").bag)
    assert content(single) == found
    with BagReader(single) as reader:
        assert reader.summary.finished


def test_every_file_of_a_split_bag_is_saved(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag", chunk_size=CHUNK) as writer:
        for topic, (type_name, qos) in TOPICS.items():
            writer.add_topic(topic, type_name, [qos])
        for index in range(FRAMES):
            for position, (topic, stamp, data) in enumerate(frame_messages(index)):
                if index and index % 10 == 0 and not position:
                    writer.split(stamp)
                writer.write(topic, data, stamp, stamp)
    last = tmp_path / "bag" / "bag_3.mcap"
    expected = content(tmp_path / "bag")
    last.write_bytes(last.read_bytes()[: last.stat().st_size // 2])
    report = repair_bag(tmp_path / "bag", tmp_path / "new")
    assert sorted(path.name for path in report.bag.iterdir()) == ["metadata.yaml", *(f"new_{n}.mcap" for n in range(4))]
    found = content(report.bag)
    assert found == expected[: len(found)] and len(found) > 0.75 * len(expected)
    assert any("bag_3.mcap" in fault for fault in report.faults)


@settings(max_examples=80, deadline=None)
@given(data=st.data())
def test_no_damage_makes_a_traceback(whole: Path, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    original = (whole / "bag_0.mcap").read_bytes()
    damaged = bytearray(original)
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(damaged) - 1))
        kind = data.draw(st.sampled_from(["flip", "zero", "cut", "insert"]))
        if kind == "flip":
            damaged[place] ^= data.draw(st.integers(1, 255))
        elif kind == "zero":
            damaged[place : place + 64] = bytes(len(damaged[place : place + 64]))
        elif kind == "cut":
            del damaged[max(place, 1) :]
        else:
            damaged[place:place] = data.draw(st.binary(min_size=1, max_size=40))
    folder = tmp_path_factory.mktemp("damaged")
    (folder / "bag_0.mcap").write_bytes(damaged)
    try:
        inspect_bag(folder)
        report = repair_bag(folder, folder.with_name(f"{folder.name}_new"))
    except BagReadError as error:
        assert "\n" not in str(error)
        return
    known = set(content(whole))
    assert [message for message in content(report.bag) if message not in known] == []
    shutil.rmtree(report.bag)


def test_the_command_says_what_it_saved_and_refuses_what_is_no_bag(whole: Path, tmp_path: Path) -> None:
    folder = cut_bag(whole, tmp_path / "cut", (whole / "bag_0.mcap").stat().st_size // 2, active=True)

    def run(*words: object) -> subprocess.CompletedProcess[str]:
        return subprocess.run(command(*words), env=environment(), capture_output=True, text=True, timeout=300, check=False)

    done = run("repair", folder)
    assert done.returncode == 0, done.stderr
    assert f"{tmp_path}/cut_repaired: whole, with the " in done.stdout
    assert "cut away: the frame at 1700000002." in done.stdout
    inspected = run("inspect", tmp_path / "cut_repaired")
    assert (inspected.returncode, inspected.stdout.splitlines()[-1]) == (0, "no faults")
    again = run("repair", folder)
    assert again.returncode == 2 and "exists already; choose another folder" in again.stderr
    (tmp_path / "junk.mcap").write_bytes(b"junk" * 1000)
    junk = run("repair", tmp_path / "junk.mcap")
    assert junk.returncode == 2 and "no MCAP file" in junk.stderr
    assert "Traceback" not in done.stderr + again.stderr + junk.stderr
    assert not list(tmp_path.glob(".*"))


def test_a_bag_cut_in_its_first_frame_has_nothing_to_save_and_leaves_no_folder(tmp_path: Path) -> None:
    write_bag(tmp_path / "bag", frames=1, chunk_size=10, compression="none")
    data = (tmp_path / "bag" / "bag_0.mcap").read_bytes()
    place = data.index(frame_messages(0)[3][2][:60])  # colour is there, its camera info and depth are not
    (tmp_path / "cut.mcap").write_bytes(data[: data.index(frame_messages(0)[4][2][:60], place + 1)])
    assert content(tmp_path / "cut.mcap")
    with pytest.raises(BagReadError, match="no whole frame is left, there is nothing to save; the frame at 1700000000"):
        repair_bag(tmp_path / "cut.mcap", tmp_path / "new")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bag", "cut.mcap"]


def files_of(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("beside", ["x.mcap", "x_repaired", ".x.mcap.active.repairing", "x_repaired.repairing", ".x_repaired.partial"])
def test_a_file_repaired_in_place_touches_nothing_beside_it(
    whole: Path, tmp_path: Path, beside: str, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = tmp_path / "x.mcap.active"
    bag.write_bytes((whole / "bag_0.mcap").read_bytes()[:50_000])
    if "repair" in beside:
        (tmp_path / beside).mkdir()
    (tmp_path / beside / "mine" if "repair" in beside else tmp_path / beside).write_bytes(b"mine")
    before = files_of(tmp_path)
    with pytest.raises(SystemExit) as status:
        main(["repair", str(bag), "--in-place"])
    told = capsys.readouterr().err.strip()
    if beside in ("x.mcap", "x_repaired"):
        assert status.value.code == 2 and f"{tmp_path / beside}: exists already; " in told.splitlines()[-1]
        assert files_of(tmp_path) == before
    else:
        assert not status.value.code, told
        after = files_of(tmp_path)
        assert {name: data for name, data in after.items() if name != "x.mcap"} == {k: v for k, v in before.items() if k != bag.name}


def test_a_folder_repaired_in_place_touches_nothing_beside_it(whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = cut_bag(whole, tmp_path / "bag", 50_000, active=True)
    (tmp_path / ".bag.old").mkdir()
    before = files_of(tmp_path)
    with pytest.raises(SystemExit) as status:
        main(["repair", str(folder), "--in-place"])
    assert status.value.code == 2 and f"{tmp_path / '.bag.old'}: exists already; " in capsys.readouterr().err.strip().splitlines()[-1]
    assert files_of(tmp_path) == before and sorted(path.name for path in tmp_path.iterdir()) == [".bag.old", "bag"]


def stamps_of(bag: Path) -> dict[str, list[int]]:
    """Return stream of the camera -> log times of its messages."""
    found: dict[str, list[int]] = {topic: [] for topic in TOPICS if topic.startswith("/synth/camera/") and "labels" not in topic}
    for topic, log_ns, _ in content(bag):
        if topic in found:
            found[topic].append(log_ns)
    return found


@pytest.mark.parametrize("indexed", [True, False])
@pytest.mark.parametrize("flips", [1, 2, 4, 8])
def test_damage_within_a_bag_leaves_whole_frames_and_what_is_beside_them(whole: Path, tmp_path: Path, flips: int, indexed: bool) -> None:
    data = bytearray((whole / "bag_0.mcap").read_bytes())
    draw = random.Random(flips)
    for place in draw.sample(range(1000, len(data) - 12_000), flips):
        data[place] ^= 0xFF
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "bag_0.mcap").write_bytes(data if indexed else data[:-100])
    report = repair_bag(tmp_path / "bag", tmp_path / "new")
    times = list(stamps_of(report.bag).values())
    assert all(own == times[0] for own in times) and FRAMES - 4 * flips <= len(times[0]) < FRAMES
    assert report.cut and all(line.startswith("the frame at 17000000") for line in report.cut)
    damaged = set(content(tmp_path / "bag"))
    lost = damaged - set(content(report.bag))
    assert {topic for topic, _, _ in lost} <= set(stamps_of(report.bag)) | {"/synth/camera/semantic/labels"}


@pytest.mark.parametrize("last", [1, 3])
def test_half_a_frame_at_the_end_of_a_finished_bag_is_a_fault_and_is_cut_away(tmp_path: Path, last: int) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        for topic, (type_name, qos) in TOPICS.items():
            writer.add_topic(topic, type_name, [qos])
        for index in range(5):
            for topic, stamp, data in frame_messages(index)[: last if index == 4 else None]:
                writer.write(topic, data, stamp, stamp)
    assert [fault for fault in inspect_bag(tmp_path / "bag").faults if "1 of 5 frames of its camera are missing" in fault]
    report = repair_bag(tmp_path / "bag", tmp_path / "new")
    assert len(report.cut) == 1 and f"only {last} messages" in report.cut[0]
    assert inspect_bag(report.bag).faults == () and {len(times) for times in stamps_of(report.bag).values()} == {4}


def test_a_frame_that_lacks_only_its_labels_is_cut_away_where_the_others_have_theirs(tmp_path: Path) -> None:
    labels, image = "/synth/camera/semantic/labels", "/synth/camera/semantic/image_raw"
    for name, every in {"every": 1, "once": 100}.items():
        with BagWriter(tmp_path / name) as writer:
            for topic, (type_name, qos) in {**TOPICS, image: TOPICS["/synth/camera/color/image_raw"]}.items():
                writer.add_topic(topic, type_name, [qos])
            for index in range(5):
                messages = [message for message in frame_messages(index) if message[0] != labels]
                color = next(data for topic, _, data in messages if topic == "/synth/camera/color/image_raw")
                messages.append((image, messages[-1][1], color))
                if index % every == 0 and index != 4:
                    messages.append((labels, messages[-1][1], text({"0": "void"})))
                for topic, stamp, data in messages:
                    writer.write(topic, data, stamp, stamp)
        report = repair_bag(tmp_path / name, tmp_path / f"{name}_new")
        assert {len(times) for times in stamps_of(report.bag).values()} == {4 if name == "every" else 5}
        assert len(report.cut) == (name == "every")


def test_streams_of_others_at_their_own_rates_stay_as_they_are(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        for topic, (type_name, qos) in TOPICS.items():
            writer.add_topic(topic, type_name, [qos])
        for index in range(12):
            for topic, stamp, data in frame_messages(index):
                late = {"color": 3, "depth": 8}.get(topic.split("/")[3] if topic.startswith("/synth/camera") else "", 5)
                if index % 2 or "depth" not in topic:
                    writer.write(topic, data, stamp + late, stamp + late)
    before = content(tmp_path / "bag")
    report = repair_bag(tmp_path / "bag", tmp_path / "new")
    assert content(report.bag) == before and report.cut == ()

"""Messages are found by topic and stamp, in bags of the recorder by their index, in others by reading."""

from collections import Counter
from pathlib import Path

import pytest
from dataset_bags import OURS
from room_bag import CAMERA, PERIOD_NS, START_NS, RoomBag, write_room_bag

from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.bags.indexed_bag import IndexedBag, MessageReadError, open_bag
from scene_synth_ros.dataset import open_dataset
from scene_synth_ros.mcap.message_places import BlockCache
from scene_synth_ros.mcap.stored_file import LocalFile, Span, StoredFile

DEPTH, SCENE = f"{CAMERA}/depth/image_raw", "/synth/scene"


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> RoomBag:
    return write_room_bag(tmp_path_factory.mktemp("indexed") / "bag", records=OURS, chunk_size=9000, layers=("depth", "semantic"))


def copied(bag: RoomBag, folder: Path, delay_ns: int = 0, split_at_ns: int = -1, ours: bool = True) -> Path:
    """Write a bag again, in two files or with later log times; the scenes are latched."""
    with BagReader(bag.path) as reader, BagWriter(folder, chunk_size=9000) as writer:
        if ours:
            writer.set_record("scene_synth", OURS["scene_synth"])
        last: dict[str, bytes] = {}
        for message in reader.messages(file_order=True):
            writer.add_topic(message.topic, message.type_name)
            if message.log_ns >= split_at_ns >= 0:
                writer.split(message.log_ns)
                writer.write(SCENE, last[SCENE], message.log_ns, message.publish_ns)
                split_at_ns = -1
            writer.write(message.topic, message.data, message.log_ns + delay_ns, message.publish_ns)
            last[message.topic] = message.data
    return folder


def test_messages_are_those_that_reading_in_order_finds(bag: RoomBag) -> None:
    with BagReader(bag.path) as reader:
        messages = {(message.topic, message.log_ns): message.data for message in reader.messages()}
    opened = open_bag(bag.path)
    assert {key: bytes(opened.read(*key)) for key in reversed(list(messages))} == messages
    assert opened.stamps(DEPTH).tolist() == sorted(bag.images) and opened.counts(DEPTH) == dict.fromkeys(sorted(bag.images), 1)
    assert ("/nothing", START_NS) not in opened and (DEPTH, START_NS + 1) not in opened and (DEPTH, START_NS) in opened
    with pytest.raises(MessageReadError, match=rf"topic {DEPTH}: expected a message of stamp 5 ns, got none"):
        opened.read(DEPTH, 5)


def test_log_times_of_other_recorders_are_not_taken_for_stamps(bag: RoomBag, tmp_path: Path) -> None:
    opened = open_bag(copied(bag, tmp_path / "late", delay_ns=7, ours=False))
    assert opened.stamps(DEPTH).tolist() == sorted(bag.images) and not opened.unstamped
    assert [bytes(opened.read(DEPTH, stamp)) for stamp in bag.images] == [
        bytes(open_bag(bag.path).read(DEPTH, stamp)) for stamp in bag.images
    ]


def test_what_a_second_file_repeats_is_no_new_room(bag: RoomBag, tmp_path: Path) -> None:
    folder = copied(bag, tmp_path / "split", split_at_ns=START_NS + PERIOD_NS)
    assert len(list(folder.glob("*.mcap"))) == 2
    opened = open_bag(folder)
    assert opened.counts(SCENE) == {START_NS: 2, START_NS + 3 * PERIOD_NS: 1}
    data = open_dataset(folder, layers=("depth",))
    assert [(frame.room, frame.number) for frame in data] == [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)]
    assert [room.frames for room in data.rooms] == [3, 3]


def test_of_images_nothing_is_read_until_one_is_asked_for(bag: RoomBag) -> None:
    class Counted(BlockCache):
        def read(self, file: StoredFile, block: Span) -> bytes:
            read[block] += 1
            return super().read(file, block)

    read: Counter[Span] = Counter()
    opened = IndexedBag([LocalFile(next(bag.path.glob("*.mcap")))], Counted(2**20), lambda line: None)
    assert len(opened.stamps(DEPTH)) == 6 and not read
    opened.read(DEPTH, START_NS)
    assert read.total() == 1


def test_damaged_messages_are_told_and_left_out(bag: RoomBag, tmp_path: Path) -> None:
    folder = copied(bag, tmp_path / "damaged")
    file = next(folder.glob("*.mcap"))
    octets = bytearray(file.read_bytes())
    octets[len(octets) // 2] ^= 0xFF
    file.write_bytes(octets)
    told: list[str] = []
    opened = open_bag(folder, told.append)
    whole = [stamp for stamp in bag.images if len(opened.read_all([DEPTH, f"{CAMERA}/semantic/image_raw"], stamp)) == 2]
    assert len(whole) == 5 and len(told) == 1 and str(file) in told[0] and "chunk: " in told[0]

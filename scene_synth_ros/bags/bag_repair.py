"""Makes a whole bag of what can be read of a cut or damaged one."""

import os
import shutil
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from scene_description.whole import WholeFolder
from scene_synth_ros.bags.bag_manifest import MANIFEST_NAME
from scene_synth_ros.bags.bag_metadata import WRITABLE_VERSIONS
from scene_synth_ros.bags.bag_reader import BagMessage, BagReader, BagReadError
from scene_synth_ros.bags.bag_writer import BagWriteError, BagWriter
from scene_synth_ros.bags.whole_frames import WholeFrames
from scene_synth_ros.mcap.file import MAX_TIME_NS

REPAIR_RECORD = "scene_synth.repair"
_OWN_RECORDS = ("rosbag2",)


@dataclass(frozen=True, slots=True, kw_only=True)
class RepairReport:
    """What a repair has done: the new bag, messages saved by topic, what was wrong with the old one, torn frames that were cut away."""

    bag: Path
    saved: dict[str, int]
    faults: tuple[str, ...]
    cut: tuple[str, ...] = ()

    @property
    def message_count(self) -> int:
        """How many messages were saved."""
        return sum(self.saved.values())


def repaired_name(bag: Path) -> Path:
    """Return where the repaired bag of ``bag`` goes by default: ``<bag>_repaired`` beside it."""
    name = bag.name
    for suffix in (".active", ".mcap"):
        name = name.removesuffix(suffix)
    return bag.with_name(f"{name}_repaired")


def repair_bag(bag: Path, out: Path, *, compression: str = "zstd", progress: Callable[[int], None] = lambda _: None) -> RepairReport:
    """Write everything that can be read of a bag, file by file, into a new bag; the old one is only read, twice.

    Frames of which something is missing are left out, so that the new bag has whole frames only.

    ``out`` must not exist, and has another name until it is whole; ``progress`` is told how many messages are saved.

    Raises:
        BagReadError: there is nothing to read.
        BagWriteError: the new bag cannot be written; nothing of it is left.
        FileExistsError: ``out`` exists.
    """
    bag = Path(os.path.abspath(bag))
    if out.exists():
        raise BagWriteError(f"{out}: exists already; choose another folder or remove it")
    with WholeFolder(out) as unfinished, BagReader(bag) as reader:
        if not reader.summary.topics:
            raise BagReadError(f"{bag}: no whole chunk is left, there is nothing to save{_first(reader.summary.faults)}")
        whole = WholeFrames(reader.summary.topics)
        whole.note(reader.messages(file_order=True))
        whole.judge()
        saved = _copy(reader, whole, unfinished, compression, progress)
        if not sum(saved.values()):
            raise BagReadError(f"{bag}: no whole frame is left, there is nothing to save{_first(whole.cut or reader.faults)}")
        return RepairReport(bag=out, saved=saved, faults=tuple(reader.faults), cut=tuple(whole.cut))


def refuse_taken_place(bag: Path) -> None:
    """Refuse to put a repaired bag in the place of one beside which something has a name that is needed for that.

    Raises:
        BagWriteError: something has.
    """
    needed = _aside(bag) if bag.is_dir() else _finished(bag)
    if needed != bag and os.path.lexists(needed):
        raise BagWriteError(f"{needed}: exists already; move it away, or repair with --out in place of --in-place")


def _aside(bag: Path) -> Path:
    """Return where a folder waits while another gets its name."""
    return bag.with_name(f".{bag.name}.old")


def _finished(bag: Path) -> Path:
    return bag.with_name(bag.name.removesuffix(".active"))


def replace_bag(bag: Path, repaired: Path) -> None:
    """Put a repaired bag in the place of the old one, folder or single file.

    Raises:
        BagWriteError: a name that is needed is taken; both bags stay.
    """
    refuse_taken_place(bag)
    if bag.is_dir():
        bag.rename(_aside(bag))
        repaired.rename(bag)
        shutil.rmtree(_aside(bag))
    else:
        (file,) = repaired.glob("*.mcap")
        file.rename(_finished(bag))
        if _finished(bag) != bag:
            bag.unlink()
        shutil.rmtree(repaired)


def _first(lines: Sequence[str]) -> str:
    return f"; {lines[0]}" if lines else ""


def _copy(reader: BagReader, whole: WholeFrames, out: Path, compression: str, progress: Callable[[int], None]) -> dict[str, int]:
    def is_damaged(file: Path) -> bool:
        return any(fault.startswith(f"{file.name}: ") for fault in reader.faults)

    summary = reader.summary
    version = summary.metadata.version if summary.metadata is not None and summary.metadata.version in WRITABLE_VERSIONS else 9
    saved: Counter[str] = Counter({topic.name: 0 for topic in summary.topics})
    with BagWriter(out, metadata_version=version, compression=compression, custom_data=summary.custom_data) as writer:
        for topic in summary.topics:
            if topic.serialization_format == "cdr" and topic.type_name:
                writer.add_topic(topic.name, topic.type_name, topic.qos, summary.definitions[topic.type_name])
        for name, record in summary.records.items():
            if name not in _OWN_RECORDS:
                writer.set_record(name, record)
        for name, data in summary.attachments.items():
            if name != MANIFEST_NAME:
                writer.set_attachment(name, data)
        for file, messages in reader.messages_by_file():
            begun = bool(sum(saved.values()))
            for position, message in enumerate(whole.of_file(messages, partial(is_damaged, file))):
                if begun and not position:
                    writer.split(min(message.log_ns, MAX_TIME_NS - 1), {topic.name for topic in summary.topics})
                _write(writer, message, saved)
                if not sum(saved.values()) % 1000:
                    progress(sum(saved.values()))
        writer.set_record(REPAIR_RECORD, {"faults": "; ".join(reader.faults)[:5000], "cut": "; ".join(whole.cut)[:5000]})
    return dict(saved)


def _write(writer: BagWriter, message: BagMessage, saved: Counter[str]) -> None:
    """Write one message; those that no bag can hold (damaged times, topics without a type) are left out."""
    if message.topic not in writer.counts or not (message.log_ns < MAX_TIME_NS and message.publish_ns < MAX_TIME_NS):
        return
    writer.write(message.topic, message.data, message.log_ns, message.publish_ns)
    saved[message.topic] += 1

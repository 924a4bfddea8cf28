"""``scene_synth split``: which rooms and frames of a dataset are for training, validation and testing."""

import argparse
import dataclasses
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tqdm import tqdm

from scene_description.whole import write_whole
from scene_synth_ros.bags.dataset_files import SPLITS_NAME
from scene_synth_ros.cli.lines import counted
from scene_synth_ros.cli.options import UsageError, add_number, add_readers, add_source, names_in
from scene_synth_ros.splits.assignment import Ranges, Shares, SplitError, read_ranges, read_shares
from scene_synth_ros.splits.balance import class_balance, frame_weights
from scene_synth_ros.splits.filters import EVERYTHING, FILTERS, Asked, Interval, read_interval
from scene_synth_ros.splits.near_views import Nearness, read_nearness
from scene_synth_ros.splits.split_dataset import Splits, layers_of, split_dataset
from scene_synth_ros.splits.split_file import SplitBalance, splits_json

RARE = 0.1
"""Share of the frames that see a class below which it is rare."""
SHARES = "train=0.8,val=0.1,test=0.1"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add_source(parser)
    parser.add_argument("--out", type=Path, metavar="FILE", help=f"where the splits go (default: {SPLITS_NAME} in the source's folder)")
    parser.add_argument("--shares", default=SHARES, metavar="NAME=SHARE,...", help="of the rooms of every type (default: %(default)s)")
    parser.add_argument("--ranges", metavar="NAME=A:B,...", help="rooms from index A to before B, in place of shares; others are left out")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="draws another assignment of rooms (default: %(default)s)")
    parser.add_argument("--room-types", default="", metavar="TYPE,...", help="rooms of these types only")
    parser.add_argument(
        "--sees", action="append", default=[], metavar="CATEGORY,...", help="frames that see one of these; given again, also one of those"
    )
    share = "of the image that an object covers at least to be seen"
    add_number(parser, "--image-share", 0.0, 1.0, default=0.0, metavar="X", help=share)
    add_number(parser, "--visible-fraction", 0.0, 1.0, default=0.0, metavar="X", help="of an object that nothing hides, at least")
    parser.add_argument("--objects", metavar="LOW:HIGH", help="frames that see so many objects")
    parser.add_argument("--brightness", metavar="LOW:HIGH", help="frames whose mean luma is within, 0 to 1")
    parser.add_argument("--ev100", metavar="LOW:HIGH", help="frames whose exposure value is within")
    parser.add_argument(
        "--near", metavar="METRES:DEGREES", help="leave out views nearly equal to one before in their room: so near, and pictures alike"
    )
    balance = "write weights that balance classes: of classes for a loss, of frames for a sampler, more for frames with a class that less"
    balance += f" than SHARE of the frames see (default: {RARE})"
    add_number(parser, "--balance", 0.0, 1.0, nargs="?", const=RARE, metavar="SHARE", help=balance)
    parser.add_argument("--camera", metavar="NAME", help="by whose frames filters judge (default: the first)")
    add_readers(parser, "read frames")


def run(arguments: argparse.Namespace) -> int:
    """Write the splits and print what they hold; return 0."""
    rule = read_rule(arguments)
    asked, near = read_asked(arguments), read_nearness(arguments.near) if arguments.near else None
    out = arguments.out or default_out(arguments.source)
    if not out.absolute().parent.is_dir():
        raise UsageError(f"--out {out}: expected a file in a folder that exists")
    if out.is_dir():
        raise UsageError(f"--out {out}: expected a file, got a folder; name a file in it")
    from scene_synth_ros.dataset import open_dataset

    recorded = open_dataset(arguments.source, layers=None, camera=arguments.camera).layers
    if arguments.balance is not None and "semantic" not in recorded:
        raise SplitError("--balance: needs the layer semantic, got none; record it: -p renderer_node.streams.semantic:=true")
    layers, wanted = layers_of(asked, near, recorded, classes=arguments.balance is not None)
    data = open_dataset(arguments.source, layers=layers or None, camera=arguments.camera)
    with tqdm(total=len(data) if wanted else 0, unit=" frames", disable=None if wanted else True, leave=False) as line:
        found = split_dataset(data, rule, asked, near, wanted, threads=arguments.threads, progress=line.update)
    if not any(found.frames.values()):
        left_out = ", ".join(f"{name} leaves out {left.frames}" for name, left in found.left_out.items())
        raise SplitError(
            "; ".join((f"{data.source}: expected frames that stay, got none of {len(data)}: {left_out}", *unseen(asked, found)))
        )
    balance = balances(found, arguments.balance) if arguments.balance is not None else None
    told = {"rule": told_rule(rule), "filters": told_filters(asked, near), "left_out": found.left_out}
    text = splits_json(found.rooms, **told, balance=balance)
    write_whole(out, text)
    for note in (*data.notes, *unseen(asked, found)):
        sys.stderr.write(f"scene_synth split: {note}\n")
    sys.stdout.write(summary(found, out) + balance_lines(balance or {}))
    return 0


def balances(found: Splits, rare: float) -> dict[str, SplitBalance]:
    """Return the weights of each split that has frames; ``rare``: share of the frames that see a class below which it is rare."""
    weights = {name: frame_weights(frames, rare) for name, frames in found.classes.items()}
    return {name: SplitBalance(weights[name], class_balance(frames, weights[name])) for name, frames in found.classes.items()}


def balance_lines(balance: Mapping[str, SplitBalance]) -> str:
    """Return a line for each split about the class that the fewest of its frames see."""
    lines = []
    for name, of in balance.items():
        rarest = min(of.classes, key=lambda key: (of.classes[key].frames, key), default=None)
        if rarest is not None:
            one = of.classes[rarest]
            share, most = one.frames / len(of.weights), max(of.weights)
            lines.append(f"  {name}: rarest class {rarest}, in {share:.2%} of frames, {one.drawn:.2%} as drawn; weights up to {most:.3g}\n")
    return "".join(lines)


def read_rule(arguments: argparse.Namespace) -> Shares | Ranges:
    """Return which room goes where.

    Raises:
        SplitError: the words do not fit.
        UsageError: both ways are asked for.
    """
    if arguments.ranges and arguments.shares != SHARES:
        raise UsageError("--ranges: expected either ranges or shares, got both")
    return read_ranges(arguments.ranges) if arguments.ranges else read_shares(arguments.shares, arguments.seed)


def read_asked(arguments: argparse.Namespace) -> Asked:
    """Return what is asked of frames.

    Raises:
        SplitError: an interval is none.
        UsageError: shares are given, and nothing that is to be seen.
    """
    sees = tuple(names_in(text) for text in arguments.sees)
    if (arguments.image_share or arguments.visible_fraction) and not sees and not arguments.objects:
        raise UsageError("--image-share, --visible-fraction: expected --sees or --objects with them, which say what is to be seen")
    return Asked(
        room_types=names_in(arguments.room_types),
        sees=sees,
        image_share=arguments.image_share,
        visible_fraction=arguments.visible_fraction,
        objects=_interval("--objects", arguments.objects, 0.0),
        brightness=_interval("--brightness", arguments.brightness, 0.0, 1.0),
        exposure_ev100=_interval("--ev100", arguments.ev100),
    )


def default_out(source: str) -> Path:
    """Return the file in the source's folder.

    Raises:
        UsageError: the source is no local folder.
    """
    if not Path(source).is_dir():
        raise UsageError(f"--out: expected a file, because {source} is no folder on this machine that {SPLITS_NAME} could go to")
    return Path(source) / SPLITS_NAME


def told_rule(rule: Shares | Ranges) -> dict[str, Any]:
    """Return the rule as the file tells it."""
    if isinstance(rule, Ranges):
        return {"ranges": {name: list(span) for name, span in rule.of.items()}}
    return {"shares": dict(rule.of), "seed": rule.seed}


def told_filters(asked: Asked, near: Nearness | None) -> dict[str, Any]:
    """Return what was asked of frames as the file tells it: only what was asked; null where an interval is open."""
    told: dict[str, Any] = {}
    for item in dataclasses.fields(Asked):
        value = getattr(asked, item.name)
        if value != item.default:
            told[item.name] = _finite(value) if item.default == EVERYTHING else value
    return told if near is None else told | {"near": dataclasses.asdict(near)}


def unseen(asked: Asked, found: Splits) -> tuple[str, ...]:
    """Return a line about the categories of ``--sees`` that no frame sees; none where each is seen."""
    missing = sorted({name for group in asked.sees for name in group if not found.seen[name]})
    return (f"--sees {','.join(missing)}: no frame sees one; frames see {', '.join(sorted(found.seen))}",) if missing else ()


def summary(found: Splits, out: Path) -> str:
    """Return the table of what each split holds, and what each filter left out."""
    lines = [f"{out}"]
    for name, rooms in found.rooms.items():
        types = ", ".join(f"{kind} {count}" for kind, count in sorted(found.types[name].items()))
        lines.append(f"  {name}: {counted(len(rooms), 'room')}, {counted(found.frames[name], 'frame')}{f' ({types})' if types else ''}")
    order = ["ranges", "room_types", *FILTERS, "near"]
    for name, left in sorted(found.left_out.items(), key=lambda item: order.index(item[0])):
        rooms_too = f"{counted(left.rooms, 'room')} with " if left.rooms else ""
        lines.append(f"  left out by {name}: {rooms_too}{counted(left.frames, 'frame')}, {left.alone} of them by it alone")
    return "\n".join(lines) + "\n"


def _interval(option: str, words: str | None, lowest: float = EVERYTHING[0], highest: float = EVERYTHING[1]) -> Interval:
    return EVERYTHING if words is None else read_interval(option, words, lowest, highest)


def _finite(interval: Interval) -> list[float | None]:
    return [value if abs(value) != float("inf") else None for value in interval]

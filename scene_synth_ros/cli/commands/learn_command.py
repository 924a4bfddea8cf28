"""``scene_synth learn``: a grammar's numbers from furnished rooms, without ROS."""

import argparse
import math
import multiprocessing
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from grammar import Categories, read_categories, read_grammar
from grammar.learning import (
    CategoryMap,
    ContrastiveOptions,
    LayoutFile,
    LearnedGrammar,
    LearnOptions,
    ObservedRoom,
    SampledCounts,
    TruncationOptions,
    curve_csv,
    grammar_yaml,
    learn,
    mixed,
    read_category_map,
    read_layouts,
    room_sampler,
    split_houses,
    truncation_csv,
)
from grammar.learning.learn import PARTS
from grammar.learning.truncation import kept_round
from grammar.spec.energy_terms import TERMS
from grammar.spec.grammar_file import room_types
from grammar.spec.rules import Grammar
from scene_description.share import config_path
from scene_description.whole import whole_file, write_whole
from scene_synth_ros.cli.options import UsageError, add_number

_SHOWN_LINES, _SHOWN_REASONS = 8, 4


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    defaults = LearnOptions()
    parser.add_argument(
        "layouts",
        nargs="+",
        metavar="LAYOUTS.jsonl[:WEIGHT]",
        help="files of furnished rooms, one a line; a room counts by its file's weight",
    )
    parser.add_argument("--room", default="bedroom", metavar="TYPE", help="room type (default: %(default)s)")
    parser.add_argument("--base", type=Path, metavar="YAML", help="grammar to start from (default: the one of that room type)")
    parser.add_argument("--out", type=Path, required=True, metavar="YAML", help="new file for the learned grammar")
    hold_out = "share of the houses left for judging (default: %(default)s)"
    add_number(parser, "--hold-out", 0.0, 0.9, default=0.2, metavar="SHARE", help=hold_out)
    parser.add_argument("--names", type=Path, metavar="YAML", help="table of category names (default: learning/category_map.yaml)")
    for option, low, high, default, what in (
        ("--alpha", 0.0, 1e6, defaults.alpha, "pseudo-counts of the base grammar"),
        ("--least", 1, 10**6, defaults.least, "observations below which nothing is learned"),
        ("--pooled", 0.0, 1e6, defaults.pooled, "pseudo-counts of other room types in sizes and places; 0: none"),
        ("--iterations", 0, 10**5, defaults.contrastive.iterations, "of the contrastive divergence; 0: keep the weights"),
        ("--corrections", 0, 1000, 3, "rounds that correct the odds for rooms that find no valid layout; 0: none"),
        ("--rooms", 1, 10**6, defaults.truncation.rooms, "rooms sampled in each of these rounds"),
        ("--raised", 1.0, 100.0, defaults.truncation.raised, "times as often as seen that sizes which seldom pass are drawn, at most"),
        ("--workers", 1, 256, 1, "processes that sample them; changes nothing else"),
        ("--seed", 0, 2**63, 1, "of the chains"),
    ):
        add_number(parser, option, low, high, default=default, help=f"{what} (default: %(default)s)")
    parser.add_argument(
        "--keep", nargs="*", choices=PARTS, default=[], metavar="PART", help=f"parts that stay as in the base: {', '.join(PARTS)}"
    )
    parser.add_argument("--curve", type=Path, metavar="CSV", help="new file for the learning curve")
    parser.add_argument("--correction-curve", type=Path, metavar="CSV", help="new file for the curve of the corrections")
    parser.add_argument("--note", action="append", default=[], help="line for the header: source, licence (may be repeated)")
    parser.add_argument("--bad-lines", action="store_true", help="print everything that was left out, with its line")


def run(arguments: argparse.Namespace) -> int:
    """Learn and write the grammar; print what it rests on."""
    _check_new({"--out": arguments.out, "--curve": arguments.curve, "--correction-curve": arguments.correction_curve})
    categories = read_categories(config_path("categories.yaml"))
    base_path = arguments.base or config_path(f"grammars/{arguments.room}.yaml")
    base = read_grammar(base_path, categories)
    names = read_category_map(arguments.names or config_path("learning/category_map.yaml"))
    names = replace(names, catalogue=frozenset(categories))
    sources = [_source(text) for text in arguments.layouts]
    files = [read_layouts(path, names, arguments.room) for path, _ in sources]
    rooms, held = split_houses(_mixed(files, sources), arguments.hold_out)
    kept = {room.house for room in held}
    elsewhere = [room for room in _elsewhere(sources, names, arguments) if room.house not in kept]
    for file in files:
        _print_file(file, arguments.bad_lines)
    options = learn_options(arguments)
    rng = np.random.default_rng(np.random.SeedSequence(arguments.seed))
    with ProcessPoolExecutor(arguments.workers, multiprocessing.get_context("spawn")) as pool:
        sampler = _Sampler(pool, categories, arguments.seed, arguments.workers)
        learned = learn(base, categories, rooms, options, rng, sampler, elsewhere, _print_stage)
    extends = _extended_name(base_path, arguments.out)
    header = _header(arguments, files, learned, len(held), extends)
    text = grammar_yaml(learned.grammar, header, learned.counts, base if extends else None, extends)
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(arguments.out) as out:
        out.write_text(text, encoding="utf-8")
        read_grammar(out, categories)
    if arguments.curve is not None:
        write_whole(arguments.curve, curve_csv(learned.curve))
    if arguments.correction_curve is not None:
        write_whole(arguments.correction_curve, truncation_csv(learned.truncation_curve))
    _print_summary(learned, len(held), _left_out(files, learned), arguments.out)
    return 0


def learn_options(arguments: argparse.Namespace) -> LearnOptions:
    """Return how the command's arguments ask to learn."""
    return LearnOptions(
        alpha=arguments.alpha,
        least=arguments.least,
        pooled=arguments.pooled,
        keep=frozenset(arguments.keep),
        contrastive=ContrastiveOptions(iterations=arguments.iterations),
        truncation=TruncationOptions(iterations=arguments.corrections, rooms=arguments.rooms, raised=arguments.raised),
    )


def _check_new(files: Mapping[str, Path | None]) -> None:
    """Refuse files that exist, and two options that name one file."""
    taken: set[Path] = set()
    for option, path in files.items():
        if path is None:
            continue
        if path.exists():
            raise UsageError(f"{option}: expected a new file, got {path}, which exists")
        if path.resolve() in taken:
            raise UsageError(f"{option}: expected a file of its own, got {path}, which another option names")
        taken.add(path.resolve())


def _print_stage(name: str) -> None:
    sys.stdout.write(f"learning: {name}\n")
    sys.stdout.flush()


def _source(text: str) -> tuple[Path, float]:
    """Return the file and the weight of an argument ``FILE`` or ``FILE:WEIGHT``."""
    head, colon, tail = text.rpartition(":")
    if not colon or Path(text).exists():
        return Path(text), 1.0
    try:
        weight = float(tail)
    except ValueError:
        return Path(text), 1.0
    if not (head and 0.0 < weight < math.inf):
        raise UsageError(f"LAYOUTS: expected FILE or FILE:WEIGHT with a positive weight, got {text}")
    return Path(head), weight


def _mixed(files: Sequence[LayoutFile], sources: Sequence[tuple[Path, float]]) -> list[ObservedRoom]:
    return mixed([(file.rooms, weight) for file, (_, weight) in zip(files, sources, strict=True)])


def _elsewhere(sources: Sequence[tuple[Path, float]], names: CategoryMap, arguments: argparse.Namespace) -> list[ObservedRoom]:
    """Return the rooms of all other types that have a grammar."""
    types = [name for name in room_types() if name != arguments.room] if arguments.pooled > 0.0 else []
    return [room for name in types for room in _mixed([read_layouts(path, names, name) for path, _ in sources], sources)]


class _Sampler:
    """Samples rooms in several processes, with the same outcome as in one."""

    def __init__(self, pool: ProcessPoolExecutor, categories: Categories, seed: int, workers: int) -> None:
        self._pool, self._categories, self._seed, self._workers = pool, categories, seed, workers

    def __call__(self, grammar: Grammar, stream: int, indices: Sequence[int]) -> list[SampledCounts]:
        if self._workers == 1:
            found = _sample_part(self._categories, self._seed, grammar, stream, indices)
        else:
            parts = [indices[k :: self._workers] for k in range(self._workers)]
            jobs = [self._pool.submit(_sample_part, self._categories, self._seed, grammar, stream, part) for part in parts]
            done = [job.result() for job in jobs]
            found = [done[i % self._workers][i // self._workers] for i in range(len(indices))]
        sys.stdout.write(f"corrections: round {stream + 1}, {len(indices)} rooms sampled\n")
        sys.stdout.flush()
        return found


def _sample_part(categories: Categories, seed: int, grammar: Grammar, stream: int, indices: Sequence[int]) -> list[SampledCounts]:
    return room_sampler(categories, seed)(grammar, stream, indices)


def _extended_name(base: Path, out: Path) -> str:
    """Return the name by which a new file can extend the base, "" where it would be another file: then it repeats all of the base."""
    beside, shipped = out.with_name(base.name), config_path("grammars") / base.name
    reached = beside if beside.exists() else shipped
    return base.name if reached.exists() and reached.samefile(base) else ""


def _header(arguments: argparse.Namespace, files: Sequence[LayoutFile], learned: LearnedGrammar, held: int, extends: str) -> list[str]:
    used = " ".join(text.rpartition("/")[2] for text in arguments.layouts)
    base = f" --base {arguments.base.name}" if arguments.base else ""
    base += f" --keep {' '.join(arguments.keep)}" if arguments.keep else ""
    command = f"scene_synth learn {used} --room {arguments.room}{base} --hold-out {arguments.hold_out:g} --alpha {arguments.alpha:g}"
    return [
        f"A grammar of {arguments.room}s whose numbers were learned from furnished rooms.",
        f"Made by: {command} --least {arguments.least} --iterations {arguments.iterations} --corrections {arguments.corrections}",
        f"  --rooms {arguments.rooms} --raised {arguments.raised:g} --pooled {arguments.pooled:g} --seed {arguments.seed}",
        f"Source: {learned.rooms} rooms with {learned.objects} objects; {held} more rooms, of other houses, were held out.",
        _left_out(files, learned),
        *sorted({reason for file in files for reason in file.reasons() if reason.startswith("name:")}),
        *arguments.note,
        '"learned from n": n observations made it (nodes: expected number; weights: rooms).'
        + ("" if extends else '  "base": the data does not cover it, so it is'),
        f"What is not here is as in {extends}, with which the learning began."
        if extends
        else "as in the grammar that the learning began with.  The other sections are the base's too.",
    ]


def _left_out(files: Sequence[LayoutFile], learned: LearnedGrammar) -> str:
    """Return which share of the objects could not be read, and which of those that were taught nothing; and which these were most."""
    lost = sum((file.lost_objects() for file in files), Counter[str]())
    read = sum(len(room.objects) for file in files for room in file.rooms)
    reading = _share(lost, read, "of the objects in reading")
    unmatched = _share(learned.unmatched, learned.objects, "of those learned from match no symbol")
    sizes = _share(learned.unsound, learned.objects - sum(learned.unsound.values()), "have a size that is none of theirs")
    return f"Left out: {reading}; {unmatched}; {sizes}"


def _share(lost: Mapping[str, int], others: int, what: str) -> str:
    """Return which share is lost, and the reasons or categories of most of it."""
    count, most = sum(lost.values()), Counter(lost).most_common(_SHOWN_REASONS)
    named = f": {', '.join(f'{name} ({number})' for name, number in most)}" if most else ""
    return f"{count / max(count + others, 1):.1%} {what}{named}"


def _print_file(file: LayoutFile, every: bool) -> None:
    left_out = sum(not item.reason.startswith("name:") for item in file.skipped)
    sys.stdout.write(f"{file.name}: {len(file.rooms)} rooms, {file.other_rooms} of other types, {left_out} things left out\n")
    for reason, count in file.reasons().most_common():
        lines = [item.line for item in file.skipped if item.reason == reason]
        shown = sorted(set(lines))[: None if every else _SHOWN_LINES]
        more = ", ..." if len(shown) < len(set(lines)) else ""
        sys.stdout.write(f"  {reason}: {count} (lines {', '.join(map(str, shown))}{more})\n")


def _print_summary(learned: LearnedGrammar, held: int, left_out: str, out: Path) -> None:
    sys.stdout.write(f"{learned.rooms} rooms with {learned.objects} objects learned from, {held} rooms held out\n{left_out}\n")
    for symbol, count in sorted(learned.added.items()):
        sys.stdout.write(f"  new in the graph: {symbol} ({learned.grammar.objects[symbol].category}, asked for by {count} objects)\n")
    for category, count in sorted(learned.unmatched.items()):
        sys.stdout.write(f"  not in the grammar, or of no size that it has: {category} ({count})\n")
    if learned.curve:
        first, last = learned.curve[0], learned.curve[-1]
        sys.stdout.write(f"contrastive divergence over {learned.weight_rooms} rooms, {len(learned.curve)} iterations\n")
        sys.stdout.write(f"  {'term':20s}{'weight':>10s}{'learned':>10s}{'data':>9s}{'model at first':>16s}{'at last':>9s}\n")
        for t, name in enumerate(TERMS):
            row = (first.weights[t], getattr(learned.grammar.weights, name), last.data[t], first.model[t], last.model[t])
            sys.stdout.write(f"  {name:20s}{row[0]:10.4g}{row[1]:10.4g}{row[2]:9.4f}{row[3]:16.4f}{row[4]:9.4f}\n")
    for trial in learned.truncation_curve:
        sys.stdout.write(
            f"corrections: round {trial.iteration + 1}, KL of all categories {trial.category_kl:.4f}, {trial.objects:.2f} objects a room, "
            f"{trial.failed} rooms failed\n"
        )
    if learned.truncation_curve:
        sys.stdout.write(f"kept: what round {kept_round(learned.truncation_curve) + 1} was sampled with\n")
    sys.stdout.write(f"wrote {out}\n")

"""Realism: rooms of the learned grammars, of those written by hand and of chance against real rooms that were held out.

python -m benchmarks.realism_bench LAYOUTS.jsonl [--types TYPE ...] [--folds N] [--rooms N] [--counted N] [--learned-only] [--seed N]
    [--workers N] [--write]
python -m benchmarks.realism_bench LAYOUTS.jsonl --classifier [--types TYPE ...] [--folds N] [--rooms N] [--grammar YAML] [--by-hand]
    [--seed N] [--workers N] [--write]
python -m benchmarks.realism_bench --recovery [--rooms N]

For each room type with a learned grammar: (1) ``--counted`` rooms of the shipped one against the counts of the rooms that it was learned
from; (2) cross-validation by house: each fold's grammar is learned from four fifths of the houses, as the header of the shipped one says,
and judged by the rest.  Figures are means over the folds; the divergence is over all categories that were observed.  "by chance" has the
objects of the shipped grammar at uniform places that are valid (no overlaps, in the room, supported, doors free).  The real rooms that
were learned from stand beside them: what a perfect learner could be expected to reach.  A random forest, taught with the rooms that the
grammar learned from and sampled ones, tells those held out from other sampled ones.  Beside medians of real rooms stands how far they
scatter from draw to draw of the houses.  ``--learned-only`` leaves out the rooms written by
hand and those by chance.

``--classifier``: how well a random forest tells sampled rooms from real ones, as the area under its curve; 0.5 is chance.  The forest is
judged by houses that it has not seen.  Beside the area over all features are those over each group of them, and the features that tell
most. "real against real" tells the rooms of half of the houses from the rest: what a perfect learner could reach.  "not taught" are the
rooms that ``--hold-out 0.2`` of the shipped grammars kept back, which is the stricter measure, of few rooms; ``--folds 5`` has it over
all rooms.

``--recovery``: how well numbers of a known grammar come back from rooms that were sampled from it.
"""

import argparse
import multiprocessing
import re
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from realism_figures import UNITS, Figures, by_chance, compare
from recovery import recover
from room_features import GROUPS, folds_of, real_against_real, schema_of, table, told_apart, told_of_unseen

from benchmarks.room_measures import as_furnished, measure_room
from benchmarks.seeds import add_seed
from benchmarks.table import DOCS, Row, at_most, render_table, side_by_side, write_section
from grammar import Categories, Grammar, RequestError, SceneRequest, read_categories, read_grammar, read_room_type, sample_room
from grammar.geometry.arrays import Floats
from grammar.learning import (
    CategoryMap,
    LearnOptions,
    ObservedRoom,
    SampledCounts,
    learn,
    read_category_map,
    read_layouts,
    room_sampler,
    split_houses,
)
from grammar.learning.truncation import category_kl, frequencies
from grammar.learning.write_layouts import layout_from_objects
from grammar.spec.grammar_file import learned_types, room_types
from scene_description.share import config_path
from scene_synth_ros.cli.commands.learn_command import add_arguments, learn_options

SHARE = 0.2
_TREES = 150
LIMIT = 0.8
"""Of the area under the classifier's curve."""
_SHOWN = 8
ROOMS, CLASSIFIED, RECOVERED = 200, 240, 2000
"""Rooms that are sampled unless told otherwise: of each fold, for the classifier, of the known grammar."""
_MEDIANS = {
    "area_m2": "m2", "proportion": "", "covered": "", "bare_wall_m": "m", "doors": "", "windows": "", "objects": ""
}  # fmt: skip
"""Measures of rooms whose medians, and means of counts, are laid beside those of the real rooms -> unit."""
_COUNTS = ("doors", "windows", "objects")
_BOUNDS = ("5 % of resampled houses", "95 %")
NOT_MEASURED = "not measured: give a file, python -m benchmarks.realism_bench LAYOUTS.jsonl"


class Sampled(NamedTuple):
    """Rooms, seconds that each took, and how many requests found none."""

    rooms: list[ObservedRoom]
    seconds: list[float]
    failed: int


class Sampling(NamedTuple):
    """Who samples: a pool of so many processes, from the stream of random numbers of a seed."""

    pool: ProcessPoolExecutor
    workers: int
    seed: int


def measure(
    layouts: Path | None, types: Sequence[str], counts: tuple[int, int, int], learned_only: bool, workers: int, seed: int
) -> list[Row]:
    """Compare; without layouts, which do not come with the program, one row says that nothing was compared.

    ``counts``: folds, rooms that are sampled in each, and rooms that are counted.
    """
    if layouts is None:
        return [Row(NOT_MEASURED, 0.0, "rooms")]
    rows: list[Row] = []
    folds, rooms, counted = counts
    with ProcessPoolExecutor(workers, multiprocessing.get_context("spawn")) as pool:
        for room_type in types or learned_types():
            table = _Table(layouts, room_type, Sampling(pool, workers, seed))
            found = [*(table.counts(counted) if counted else ()), *(table.folds(folds, rooms, learned_only) if folds else ())]
            sys.stdout.write(render_table(room_type, found) + "\n")
            sys.stdout.flush()
            rows.extend(row._replace(name=f"{room_type}: {row.name}") for row in found)
    return rows


class _Table:
    """The rows of one room type."""

    def __init__(self, layouts: Path, room_type: str, sampling: Sampling) -> None:
        self._categories, names = read_categories(config_path("categories.yaml")), _names()
        self._base = read_room_type(room_type, self._categories)
        self._seen = read_layouts(layouts, names, room_type).rooms
        self._options = shipped_options(room_type)
        types = [name for name in room_types() if name != room_type] if self._options.pooled > 0.0 else []
        self._elsewhere = [room for name in types for room in read_layouts(layouts, names, name).rooms]
        self._sampling = sampling

    def counts(self, count: int) -> list[Row]:
        """Compare the shipped grammar's categories with those of the rooms that it was learned from."""
        taught, _ = split_houses(self._seen, SHARE)
        wanted = Counter(thing.category for room in taught for thing in room.objects)
        known = set(wanted)
        drawn = self._sampled(read_room_type(self._base.room_type, self._categories, "learned"), count, 0)
        have = Counter(thing.category for room in drawn.rooms for thing in room.objects)
        kl = category_kl(frequencies(wanted, known), frequencies(have, known))
        return [
            at_most("sampled rooms against the counts learned from, KL", kl, "nat", 0.01),
            at_most("rooms that were not to be had", float(drawn.failed), "rooms", 0.0),
            Row("seconds for a room, p50", float(np.median(drawn.seconds)), "s"),
            Row("seconds for a room, p99", float(np.quantile(drawn.seconds, 0.99)), "s"),
        ]

    def folds(self, folds: int, rooms: int, learned_only: bool) -> list[Row]:
        """Cross-validate."""
        others: dict[str, Sequence[ObservedRoom]] = {}
        if not learned_only:
            others["by hand"] = self._sampled(self._base, rooms, 1).rooms
            chance = by_chance(read_room_type(self._base.room_type, self._categories, "learned"))
            others["by chance"] = self._sampled(chance, rooms, 0).rooms
        schema, every = schema_of(self._seen), []
        told: dict[str, list[float]] = {name: [] for name in ("learned", *others) if name != "by chance"}
        sums: dict[str, list[Figures]] = {name: [] for name in ("learned", *others, "real, learned from")}
        for fold in range(folds):
            taught, held = split_houses(self._seen, SHARE, fold)
            if not held:
                continue
            kept = {room.house for room in held}
            elsewhere = [room for room in self._elsewhere if room.house not in kept]
            rng = np.random.default_rng([1, fold])
            result = learn(self._base, self._categories, taught, self._options, rng, self._counted, elsewhere)
            known = set(result.wanted) | {thing.category for room in held for thing in room.objects}
            drawn = self._sampled(result.grammar, rooms, 2 + fold).rooms
            every.extend(drawn)
            for name, found in {"learned": drawn, **others, "real, learned from": taught}.items():
                sums[name].append(compare(self._base, known, held, found))
                if name in told:
                    told[name].append(told_of_unseen(*(table(schema, part)[1] for part in (taught, held, found)), 2, _TREES))
        rows = [Row("real rooms in the file, of which a fifth is held out", float(len(self._seen)), "rooms")]
        for index, (label, unit) in enumerate(UNITS.values()):
            rows.extend(Row(f"{label}; {name}", _mean([f[index] for f in figures]), unit) for name, figures in sums.items())
        rows.extend(self._medians(every))
        limit, _ = real_against_real(self._seen, folds, np.random.default_rng(1))
        rows.extend(Row(f"random forest, area under the curve; {name}", _mean(found), "AUC") for name, found in told.items())
        return [*rows, Row("random forest, area under the curve; real rooms, houses split in two", limit, "AUC")]

    def _medians(self, drawn: Sequence[ObservedRoom]) -> list[Row]:
        """Return medians of measures of the rooms of all folds beside those of all real rooms; of counts the means."""
        recorded, rows = {item.category for room in self._seen for item in room.objects}, []
        for name, rooms in (("learned", drawn), ("real", self._seen)):
            kept = (replace(room, objects=tuple(item for item in room.objects if item.category in recorded)) for room in rooms)
            measured = [measure_room(as_furnished(room, self._categories)) for room in kept]
            for field, unit in _MEDIANS.items():
                values = np.array([getattr(one, field) for one in measured], np.float64)
                what, middle = ("mean", np.mean) if field in _COUNTS else ("median", np.median)
                rows.append(Row(f"{field}, {what}; {name}", float(middle(values)), unit))
                if name == "real":
                    bounds = np.quantile(_resampled(rooms, values, middle), (0.05, 0.95)).tolist()
                    rows.extend(Row(f"{field}, {what}; real, {at}", bound, unit) for at, bound in zip(_BOUNDS, bounds, strict=True))
        return sorted(rows, key=lambda row: [*_MEDIANS].index(row.name.split(",")[0]))

    def _counted(self, grammar: Grammar, stream: int, indices: Sequence[int]) -> list[SampledCounts]:
        """Sample the rooms of a correction in the processes of the pool."""
        pool, workers, _ = self._sampling
        parts = [indices[k::workers] for k in range(workers)]
        jobs = [pool.submit(_count, self._categories, grammar, stream, part) for part in parts]
        return [room for job in jobs for room in job.result()]

    def _sampled(self, grammar: Grammar, count: int, stream: int) -> Sampled:
        return sample_layouts(grammar, count, stream, self._sampling)


def _names() -> CategoryMap:
    """Return the table of names as the command takes it, which knows all categories."""
    catalogue = frozenset(read_categories(config_path("categories.yaml")))
    return replace(read_category_map(config_path("learning/category_map.yaml")), catalogue=catalogue)


def shipped_options(room_type: str) -> LearnOptions:
    """Return how the shipped grammar of a room type was learned: by the command in its header."""
    text = config_path(f"learned/{room_type}.yaml").read_text(encoding="utf-8")
    command = re.search(r"^# Made by: scene_synth learn (.*\n#   .*)$", text, re.MULTILINE)
    if command is None:
        raise ValueError(f"config/learned/{room_type}.yaml: expected '# Made by: scene_synth learn ...' in its header, got none")
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    return learn_options(parser.parse_args([*command.group(1).replace("#", " ").split(), "--out", "-"]))


def _resampled(rooms: Sequence[ObservedRoom], values: Floats, middle: Callable[[Floats], Floats]) -> list[float]:
    """Return the median or mean of as many houses drawn with replacement, 1000 times (bootstrap: Efron, Annals of Statistics 1979)."""
    by_house = [values[[room.house == house for room in rooms]] for house in sorted({room.house for room in rooms})]
    rng = np.random.default_rng(1)
    return [float(middle(np.concatenate([by_house[k] for k in rng.integers(len(by_house), size=len(by_house))]))) for _ in range(1000)]


def _count(categories: Categories, grammar: Grammar, stream: int, indices: Sequence[int]) -> list[SampledCounts]:
    return room_sampler(categories, 1)(grammar, stream, indices)


def sample_layouts(grammar: Grammar, count: int, stream: int, sampling: Sampling) -> Sampled:
    """Sample rooms of a grammar in several processes; which rooms they are depends on the seed and the stream only."""
    pool, workers, seed = sampling
    parts = [range(count)[k::workers] for k in range(workers)]
    jobs = [pool.submit(_sample, grammar, (seed, stream), part) for part in parts]
    found = [job.result() for job in jobs]
    return Sampled([r for part in found for r in part.rooms], [s for part in found for s in part.seconds], sum(p.failed for p in found))


def _sample(grammar: Grammar, stream: tuple[int, int], indices: Sequence[int]) -> Sampled:
    found, seconds, failed = [], [], 0
    categories = read_categories(config_path("categories.yaml"))
    for index in indices:
        began = time.process_time()
        try:
            room = sample_room(grammar, categories, SceneRequest(room_type=grammar.room_type), np.random.default_rng([*stream, index]))
        except RequestError:
            failed += 1
            continue
        seconds.append(time.process_time() - began)
        found.append(layout_from_objects(f"{stream[1]}-{index}", grammar.room_type, room.room, room.objects))
    return Sampled(found, seconds, failed)


def _mean(values: Sequence[float]) -> float:
    known = [value for value in values if not np.isnan(value)]
    return float(np.mean(known)) if known else float("nan")


def measure_classifier(arguments: argparse.Namespace) -> list[Row]:
    """Sample rooms of each type and tell them from the real ones of the file."""
    layouts, types, folds, grammar, by_hand = (getattr(arguments, name) for name in ("layouts", "types", "folds", "grammar", "by_hand"))
    if layouts is None:
        return [Row(NOT_MEASURED, 0.0, "rooms")]
    categories, names, rooms = read_categories(config_path("categories.yaml")), _names(), arguments.rooms or CLASSIFIED
    rows: list[Row] = []
    for room_type in types or learned_types():
        real = read_layouts(layouts, names, room_type).rooms
        source = "by_hand" if by_hand else "learned"
        judged = read_grammar(grammar, categories) if grammar else read_room_type(room_type, categories, source)
        found = judge(real, _sampled(judged, rooms, arguments.workers, arguments.seed), folds)
        sys.stdout.write(render_table(f"{room_type}: {len(real)} real rooms", found) + "\n")
        sys.stdout.flush()
        rows.extend(row._replace(name=f"{room_type}: {row.name}") for row in found)
    return rows


def judge(real: Sequence[ObservedRoom], drawn: Sequence[ObservedRoom], folds: int) -> list[Row]:
    """Return the table of one room type."""
    schema = schema_of(real)
    names, data = table(schema, real)
    _, other = table(schema, drawn)
    where = folds_of(real, folds), np.arange(len(other)) % folds
    told = told_apart(names, data, other, where)
    rows = [at_most("all features; sampled rooms", told.auc, "AUC", LIMIT)]
    mean, deviation = real_against_real(real, folds, np.random.default_rng(1))
    rows.append(Row("all features; real against real, houses split in two", mean, "AUC"))
    rows.append(Row("deviation over such splits", deviation, "AUC"))
    taught, unseen = split_houses(real, SHARE)
    parts = [table(schema, part)[1] for part in (taught, unseen)]
    rows.append(Row("rooms that the grammar was not taught", told_of_unseen(*parts, other, folds), "AUC"))
    for group in GROUPS:
        chosen = [k for k, name in enumerate(names) if name.startswith(f"{group}:")]
        part = told_apart([names[k] for k in chosen], data[:, chosen], other[:, chosen], where)
        rows.append(Row(f"{group} alone", part.auc, "AUC"))
    best = sorted(told.importance.items(), key=lambda pair: -pair[1])[:_SHOWN]
    return [*rows, *(Row(f"share of {name}", share, "") for name, share in best)]


def _sampled(grammar: Grammar, count: int, workers: int, seed: int) -> list[ObservedRoom]:
    with ProcessPoolExecutor(workers, multiprocessing.get_context("spawn")) as pool:
        return sample_layouts(grammar, count, 0, Sampling(pool, workers, seed)).rooms


def measure_recovery(rooms: int = RECOVERED) -> list[Row]:
    """Sample rooms of a known grammar, learn from them and compare."""
    return [
        Row(f"{name}: {truth:g} came back within {error:.3f}", value, "", f"+- {error:.3f}", abs(value - truth) <= error)
        for name, truth, value, error in recover(rooms)
    ]


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.realism_bench")
    parser.add_argument("layouts", type=Path, nargs="?")
    parser.add_argument("--types", nargs="+", default=())
    for option, default in (("folds", 5), ("counted", 1000), ("workers", 1)):
        parser.add_argument(f"--{option}", type=int, default=default)
    parser.add_argument("--rooms", type=int, help=f"to sample (default: {ROOMS}; classifier {CLASSIFIED}, recovery {RECOVERED})")
    parser.add_argument("--classifier", action="store_true", help="tell sampled rooms from real ones")
    parser.add_argument("--grammar", type=Path, help="with --classifier: of the sampled rooms")
    parser.add_argument("--by-hand", action="store_true", help="with --classifier: rooms of the grammars written by hand")
    parser.add_argument("--learned-only", action="store_true", help="of the folds: no rooms written by hand or by chance beside them")
    add_seed(parser)
    parser.add_argument("--recovery", action="store_true", help="learn a known grammar back")
    parser.add_argument("--write", action="store_true", help="renew the table of docs/learning.md")
    arguments = parser.parse_args()
    if arguments.recovery:
        sys.stdout.write(render_table("Recovered parameters", measure_recovery(arguments.rooms or RECOVERED)) + "\n")
        return
    sys.stdout.write(f"seed {arguments.seed}\n")
    if arguments.classifier:
        section, rows = "classifier", measure_classifier(arguments)
    else:
        counts = arguments.folds, arguments.rooms or ROOMS, arguments.counted
        section = "realism"
        rows = measure(arguments.layouts, arguments.types, counts, arguments.learned_only, arguments.workers, arguments.seed)
    if arguments.layouts is None:
        sys.stdout.write(render_table(section.capitalize(), rows) + "\n")
    elif arguments.write:
        chosen = [row for row in rows if row.unit == "AUC"] if arguments.classifier else rows
        write_section(DOCS / "learning.md", section, side_by_side(chosen))


if __name__ == "__main__":
    main()

"""How well a random forest tells sampled rooms from real ones: the area under its curve, by groups of features; 0.5 is chance.

python -m benchmarks.classifier_bench LAYOUTS.jsonl [--types TYPE ...] [--rooms N] [--folds N] [--grammar YAML]
    [--by-hand] [--workers N] [--write]

The forest is judged by houses that it has not seen.  Beside the area over all features are those over each group of them, and the features
that tell most.  "real against real" tells the rooms of half of the houses from the rest: what a perfect learner could reach.  "not taught"
are the rooms that ``--hold-out 0.2`` of the shipped grammars kept back, which is the stricter measure, of few rooms;
``benchmarks.realism_bench --folds 5`` has it over all rooms.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from room_features import GROUPS, folds_of, real_against_real, schema_of, table, told_apart, told_of_unseen

from benchmarks.realism_bench import SHARE, sample_layouts
from benchmarks.table import DOCS, Row, at_most, render_table, side_by_side, write_section
from grammar import Grammar, read_categories, read_grammar, read_room_type
from grammar.learning import ObservedRoom, read_category_map, read_layouts, split_houses
from grammar.spec.grammar_file import learned_types
from scene_description.share import config_path

LIMIT = 0.8
SECTION = "classifier"
"""Name of the part of docs/learning.md that ``--write`` renews."""

_SHOWN = 8


def measure(
    layouts: Path | None = None,
    types: Sequence[str] = (),
    rooms: int = 240,
    folds: int = 5,
    grammar: Path | None = None,
    by_hand: bool = False,
    workers: int = 1,
) -> list[Row]:
    """Sample rooms of each type and tell them from the real ones of the file."""
    if layouts is None:
        return [Row("not measured: give a file, python -m benchmarks.classifier_bench LAYOUTS.jsonl", 0.0, "rooms")]
    categories, names = read_categories(config_path("categories.yaml")), read_category_map(config_path("learning/category_map.yaml"))
    rows: list[Row] = []
    for room_type in types or learned_types():
        real = read_layouts(layouts, names, room_type).rooms
        source = "by_hand" if by_hand else "learned"
        judged = read_grammar(grammar, categories) if grammar else read_room_type(room_type, categories, source)
        found = judge(real, _sampled(judged, rooms, workers), folds)
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


def _sampled(grammar: Grammar, count: int, workers: int) -> list[ObservedRoom]:
    with ProcessPoolExecutor(workers, multiprocessing.get_context("spawn")) as pool:
        return sample_layouts(grammar, count, 0, pool, workers).rooms


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m benchmarks.classifier_bench")
    parser.add_argument("layouts", type=Path, nargs="?")
    parser.add_argument("--types", nargs="+", default=())
    for option, default in (("rooms", 240), ("folds", 5), ("workers", 1)):
        parser.add_argument(f"--{option}", type=int, default=default)
    parser.add_argument("--grammar", type=Path)
    parser.add_argument("--by-hand", action="store_true")
    parser.add_argument("--write", action="store_true", help="renew the table of docs/learning.md")
    arguments = parser.parse_args()
    found_rows = measure(**{name: value for name, value in vars(arguments).items() if name != "write"})
    if arguments.write and arguments.layouts is not None:
        areas = [row for row in found_rows if row.unit == "AUC"]
        write_section(DOCS / "learning.md", SECTION, side_by_side(areas))
    if arguments.layouts is None:
        sys.stdout.write(render_table("Told apart", found_rows) + "\n")

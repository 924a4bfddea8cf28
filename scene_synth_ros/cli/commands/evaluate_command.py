"""``scene_synth evaluate``: how good an algorithm's estimates are, judged by the truth of a bag, a dataset or a sweep."""

import argparse
import itertools
import os
import shlex
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from evaluation.confidence import LEVEL, Interval
from evaluation.evaluation_file import (
    Evaluation,
    FactorValue,
    SummaryRow,
    TaskRow,
    TruthRecord,
    common_truth,
    read_evaluation,
    write_evaluation,
)
from evaluation.gate import compare, gate_table
from evaluation.summary import NYU40_NAMES, WITHOUT_ESTIMATE, Gathered, make_evaluation
from evaluation.tables import summary_csv
from evaluation.tasks import TASKS
from scene_synth_ros.cli.lines import aligned, counted, say_progress
from scene_synth_ros.cli.options import UsageError, add_number, add_workers, refuse_no_file
from scene_synth_ros.evaluate.algorithm import Algorithm
from scene_synth_ros.evaluate.errors import Notes
from scene_synth_ros.evaluate.judged_bag import JudgedBag, Plan
from scene_synth_ros.evaluate.task_streams import TASK_STREAMS
from scene_synth_ros.evaluate.topics import parse_mapping
from scene_synth_ros.evaluate.truth_bags import TruthBag, truth_bags
from scene_synth_ros.workers.pool import Do, in_order, terminable

_WAYS = ("room_type", "class", "distance")
_NO_ESTIMATE = "{} frames without an estimate"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument(
        "truth", type=Path, metavar="TRUTH", help="bag with the truth, a dataset: all its shards, or a sweep: all its variants"
    )
    parser.add_argument(
        "--task", action="append", default=[], metavar="TASK", help=f"what is judged, of {', '.join(TASKS)}; may be repeated"
    )
    parser.add_argument(
        "--estimates",
        type=Path,
        metavar="BAG",
        help="bag with the estimates, of a sweep or dataset a folder with one for each variant or shard",
    )
    parser.add_argument(
        "--topic", action="append", default=[], metavar="TASK:=TOPIC",
        help="topic of a task's estimates; without --estimates it is one of the truth's bag; of transforms /tf@FRAME",
    )  # fmt: skip
    parser.add_argument("--algorithm", metavar="FILE.py:NAME", help="Python callable or class that gives the estimates")
    parser.add_argument("--estimates-out", type=Path, metavar="DIR", help="write the algorithm's estimates as a bag with the same stamps")
    parser.add_argument("--camera", default="", metavar="NAME", help="camera whose truth counts (default: the one that has it)")
    parser.add_argument(
        "--by",
        action="append",
        default=[],
        metavar="WAY",
        help="print the scores by room_type, class, distance, a factor of the sweep, or all",
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the evaluation: evaluation.json")
    parser.add_argument("--csv", type=Path, metavar="FILE", help="write the scores as a table for a spreadsheet")
    parser.add_argument("--baseline", type=Path, metavar="FILE", help="an earlier evaluation.json: exit status 1 where this is worse")
    add_number(
        parser, "--equivalence", 0.0, 1.0, metavar="SHARE",
        help="with --baseline: ask for proof that no metric changed by more than this share of its baseline",
    )  # fmt: skip
    parser.add_argument("--title", default="", help="title of the evaluation (default: the name of the truth)")
    add_workers(parser, default=1, help="processes that share shards or variants (default: %(default)s)")
    add_number(parser, "--seed", 0, default=0, metavar="S", help="seed of the confidence intervals (default: 0)")


def run(arguments: argparse.Namespace) -> int:
    """Judge; return 1 if the gate finds that something is worse."""
    plan = _plan(arguments)
    _check_outputs(arguments)
    baseline = read_evaluation(arguments.baseline) if arguments.baseline is not None else None
    notes = Notes()
    with terminable():
        evaluation = _judge(truth_bags(arguments.truth, notes.add), plan, notes, arguments)
    factors = {row.by for row in evaluation.summary} - {"all", *_WAYS}
    unknown = [way for way in arguments.by if way not in (*_WAYS, "all", *factors)]
    if unknown:
        raise UsageError(f"--by {unknown[0]}: expected one of {', '.join([*_WAYS, *sorted(factors), 'all'])}")
    by = {*_WAYS, *factors} if "all" in arguments.by else set(arguments.by)
    sys.stdout.write("\n".join(table_lines(evaluation, by)) + "\n")
    for line in [*notes.lines(), *(f"{task}: {_NO_ESTIMATE.format(count)}" for task, count in sorted(notes.missing.items()))]:
        sys.stdout.write(f"note: {line}\n")
    if arguments.json is not None:
        write_evaluation(arguments.json, evaluation)
    if arguments.csv is not None:
        arguments.csv.write_text(summary_csv(evaluation), encoding="utf-8")
    if baseline is None:
        return 0
    report = compare(baseline, evaluation, equivalence=arguments.equivalence)
    sys.stdout.write(f"{gate_table(report).rstrip()}\n")
    return 0 if report.passed else 1


def _plan(arguments: argparse.Namespace) -> Plan:
    """Return what is judged.

    Raises:
        SceneSynthError: options that do not exist, or do not go together.
    """
    tasks = list(dict.fromkeys(task for words in arguments.task for task in words.split(",")))
    if not tasks:
        raise UsageError(f"--task: expected at least one of {', '.join(TASKS)}, got none")
    unknown = [task for task in tasks if task not in TASKS]
    if unknown:
        raise UsageError(f"--task {unknown[0]}: expected one of {', '.join(TASKS)}")
    if arguments.algorithm and (arguments.estimates or arguments.topic):
        raise UsageError("--algorithm: expected no --estimates and no --topic beside it, got both; judge one at a time")
    if arguments.estimates_out is not None and not arguments.algorithm:
        raise UsageError("--estimates-out: expected an --algorithm whose estimates are written, got none")
    return Plan(
        tasks=tuple(tasks),
        camera=arguments.camera,
        topics=parse_mapping(arguments.topic),
        estimates=arguments.estimates,
        algorithm=Algorithm(arguments.algorithm) if arguments.algorithm else None,
        estimates_out=arguments.estimates_out,
    )


def _check_outputs(arguments: argparse.Namespace) -> None:
    """Refuse files that could not be written, before hours of work."""
    refuse_no_file("--json", arguments.json)
    refuse_no_file("--csv", arguments.csv)
    if arguments.estimates_out is not None and arguments.estimates_out.exists():
        raise UsageError(f"--estimates-out {arguments.estimates_out}: exists already; choose another folder or remove it")


class _Judged(NamedTuple):
    """What one bag gave."""

    gathered: Gathered
    notes: Notes
    topics: dict[str, str]
    class_names: dict[int, str]
    truth: TruthRecord


def prepare_judging(setup: tuple[Plan, Path]) -> Do:
    """Return what judges a bag, in a worker process too; ``setup`` is what is judged, and the folder that paths are told from."""
    plan, folder = setup

    def judge(task: tuple[str, TruthBag], tell: Callable[[str], None]) -> _Judged:
        of, bag = task
        tell(f"{of}looking for stamps")
        notes, gathered = Notes(), Gathered()
        one = JudgedBag(bag, plan, notes)
        path, done, frames = os.path.relpath(bag.path.absolute(), folder), itertools.count(1), one.frames
        measured = one.measure(lambda: tell(f"{of}frame {next(done)} of {frames}"))
        gathered.add(replace(frame, key=replace(frame.key, bag=path)) for frame in measured)
        return _Judged(gathered, notes, one.topics, one.index.class_names, one.index.truth)

    return judge


def _judge(bags: Sequence[TruthBag], plan: Plan, notes: Notes, arguments: argparse.Namespace) -> Evaluation:
    """Measure all bags, and sum up."""
    folder = (arguments.json or Path("evaluation.json")).absolute().parent
    kind = "shard" if bags[0].variant is None else "variant"
    tasks = [(f"{kind} {number} of {len(bags)}, " if len(bags) > 1 else "", bag) for number, bag in enumerate(bags, 1)]
    gathered, names = Gathered(), dict[int, str]()
    topics: list[dict[str, str]] = []
    truths: list[TruthRecord] = []
    try:
        for one in in_order(prepare_judging, (plan, folder), tasks, arguments.workers, say_progress):
            gathered.take(one.gathered)
            notes.take(one.notes)
            names = {**one.class_names, **names}
            topics.append(one.topics)
            truths.append(one.truth)
    finally:
        say_progress("")
    judged = plan.algorithm.words if plan.algorithm is not None else ", ".join(sorted({topic for one in topics for topic in one.values()}))
    evaluation = make_evaluation(
        gathered,
        title=arguments.title or arguments.truth.absolute().name,
        algorithm=f"{plan.estimates}: {judged}" if plan.estimates is not None else judged,
        created_with=_command(arguments, plan, topics),
        seed=arguments.seed,
        missing={WITHOUT_ESTIMATE: notes.missing_frames},
        class_names=names or NYU40_NAMES,
    )
    return replace(evaluation, truth=common_truth(truths))


def _command(arguments: argparse.Namespace, plan: Plan, topics: Sequence[Mapping[str, str]]) -> str:
    """Return the command that judges the same: the options that are not at their defaults, each once, and the topics that were found.

    Of topics that were not named, those are told that all bags have; ``topics`` are those of each bag.
    """
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    alike = {task: name for task, name in topics[0].items() if task not in plan.topics and all(one[task] == name for one in topics)}
    of_stream = {TASK_STREAMS[task].name: name for task, name in alike.items()}
    told = {"task": plan.tasks, "topic": [*dict.fromkeys(arguments.topic), *(f"{stream}:={name}" for stream, name in of_stream.items())]}
    truth = str(arguments.truth)
    words = ["scene_synth", "evaluate", f"./{truth}" if truth.startswith("-") else truth]
    for name, given in vars(arguments).items():
        value, option = told.get(name, given), f"--{name.replace('_', '-')}"
        if name in ("command", "truth", "workers") or value == parser.get_default(name):
            continue
        for word in map(str, value if isinstance(value, (list, tuple)) else [value]):
            words += [f"{option}={word}"] if word.startswith("-") else [option, word]
    return shlex.join(words)


def table_lines(evaluation: Evaluation, by: Collection[str]) -> list[str]:
    """Return the lines of all tables.

    ``by``: ways of the summary, room_type, class, distance or names of factors, that get a table each.
    """
    lines: list[str] = []
    for task in evaluation.tasks:
        rows = [row for row in evaluation.summary if row.task == task.name]
        for way in ["all", *dict.fromkeys(row.by for row in rows if row.by in by)]:
            lines += [*_table(task, way, [row for row in rows if row.by == way]), ""]
    return lines[:-1]


def _table(task: TaskRow, way: str, rows: Sequence[SummaryRow]) -> list[str]:
    if way == "all":
        return _whole(task, rows[0]) if rows else [f"{task.name}: no frame with an estimate"]
    head = [f"{task.name} by {way}", "rooms", "frames", *(metric.name for metric in task.metrics)]
    cells = [[_text(row.key), str(row.rooms), str(row.frames), *(_value(row.metrics[m.name]) for m in task.metrics)] for row in rows]
    return aligned([head, *cells])


def _whole(task: TaskRow, row: SummaryRow) -> list[str]:
    size = f"{counted(row.rooms, 'room')}, {counted(row.frames, 'frame')}"
    head = [f"{task.name}, {size}", "value", f"{LEVEL:.0%} interval", "unit", "better"]
    cells = [[m.name, _value(row.metrics[m.name]), _ends(row.metrics[m.name]), m.unit, m.better] for m in task.metrics]
    return aligned([head, *cells])


def _text(key: FactorValue) -> str:
    return f"{key:g}" if isinstance(key, float) else str(key)


def _value(found: Interval) -> str:
    return "-" if found.value is None else f"{found.value:.4g}"


def _ends(found: Interval) -> str:
    return "-" if found.low is None or found.high is None else f"{found.low:.4g} to {found.high:.4g}"

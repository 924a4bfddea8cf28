"""``scene_synth sample``: rooms as JSON and labelled top views, a table of their metrics, records of their chains; without ROS."""

import argparse
import dataclasses
import json
import time
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from grammar import RequestError, SceneRequest
from grammar.checks.metrics import Metric, RoomMetrics, summarise
from grammar.spec.grammar_file import read_grammar
from grammar.synthesize import SceneSynthesizer
from scene_description import from_mapping
from scene_description.strict import field_types, split_annotation
from scene_description.whole import write_whole
from scene_description.yaml_text import load_yaml
from scene_synth_ros.cli.lines import say
from scene_synth_ros.cli.options import add_field, add_number, add_workers
from scene_synth_ros.cli.processes.room_sampling import WRITES, SampleJob, sampled_rooms
from scene_synth_ros.synthesize.catalogs import with_catalog
from scene_synth_ros.synthesize.run_config import RunConfig

ALL = "all"
_PROGRESS_S = 10.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = "constraints (-p NAME:=VALUE):\n" + "\n".join(_constraint_lines())
    parser.add_argument(
        "--room", metavar="TYPE", help="room type; several, with commas between, or 'all', in turn (default: bedroom, or the --grammar's)"
    )
    add_field(parser, "--seed", RunConfig, "seed", default=1, help="seed of the run (default: %(default)s)")
    add_number(parser, "--count", 1, 10**7, default=1, help="number of rooms (default: %(default)s)")
    parser.add_argument(
        "-p", dest="constraints", action="append", default=[], metavar="NAME:=VALUE", help="a constraint, see below; may be repeated"
    )
    parser.add_argument(
        "--grammar",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help="grammar file in place of its room type's; may be repeated",
    )
    parser.add_argument("--catalog", default="", metavar="DIR", help="folder of the user's models, with catalog.yaml")
    parser.add_argument("--look", action="append", default=[], metavar="TEXT", help="appearance of a target, see docs/looks.md; repeatable")
    add_field(parser, "--frames", RunConfig, "frames_per_room", default=30, help="poses of each camera path (default: %(default)s)")
    add_workers(parser, default=1)
    parser.add_argument("--report", action="store_true", help="print a table of metrics over all rooms, and write report.json with --out")
    parser.add_argument(
        "--chain", action="store_true", help="write a record of each room's chain: energy terms and acceptance by proposals"
    )
    parser.add_argument(
        "--write", default=",".join(WRITES), metavar="KINDS", help="files of each room, a list of json, svg, png (default: %(default)s)"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="new folder for the files; may be missing with --report")


def run(arguments: argparse.Namespace) -> int:
    """Sample; room i becomes ``room_<i>.json``, ``.svg`` and ``.png``.

    Returns:
        0; 1 if a room could not be sampled or the report found a metric out of its limit.
    """
    job, synthesizer = _job(arguments)
    if job.out is not None:
        _make_folder(job.out)
    say(f"sampling {arguments.count} room{'s' if arguments.count > 1 else ''} (the first run compiles kernels)")
    began, rooms, errors = time.monotonic(), [], []
    said = began
    for done in sampled_rooms(job, synthesizer, arguments.count, arguments.workers):
        if done.metrics is None:
            if not arguments.report:
                raise RequestError(f"{done.name}: {done.error}")
            errors.append(f"{done.name}: {done.error}")
            say(errors[-1])
        else:
            rooms.append(done.metrics)
        finished, now = len(rooms) + len(errors), time.monotonic()
        if not arguments.report or arguments.count <= 20:
            if done.text:
                say(done.text)
        elif now - said > _PROGRESS_S or finished == arguments.count:
            said = now
            say(f"{finished} of {arguments.count} rooms, {len(errors)} failures, {now - began:.0f} s")
    if not arguments.report:
        return 0
    return _report(job, arguments, rooms, errors, time.monotonic() - began)


def _report(job: SampleJob, arguments: argparse.Namespace, rooms: list[RoomMetrics], errors: list[str], seconds: float) -> int:
    if not rooms:
        raise RequestError(f"none of {arguments.count} rooms could be sampled; the first: {errors[0]}")
    text, passed = report_text(rooms, len(errors))
    say(text)
    say(f"{len(rooms)} rooms in {seconds:.1f} s with {arguments.workers} processes")
    if job.out is not None:
        command = {
            "room": job.request.room_type.replace(",", ", "),
            "seed": job.seed,
            "count": arguments.count,
            "workers": arguments.workers,
        }
        write_whole(job.out / "report.json", report_json(rooms, errors, command).encode())
        say(f"wrote {job.out / 'report.json'}")
    return 0 if passed else 1


def parse_constraints(texts: list[str], room_type: str) -> SceneRequest:
    """Return the request that ``NAME:=VALUE`` texts make, values in YAML.

    Raises:
        RequestError: a text has another form.
        FieldError: a constraint is unknown or out of range.
    """
    values: dict[str, Any] = {"room_type": room_type}
    for text in texts:
        name, assigned, value = text.partition(":=")
        if not assigned or not name:
            raise RequestError(f"-p {text}: expected NAME:=VALUE, for example max_objects:=12")
        values[name] = load_yaml(value, f"-p {name}", RequestError)
    return from_mapping(SceneRequest, values, "")


def _constraint_lines() -> Iterator[str]:
    defaults = SceneRequest()
    for name, annotation in field_types(SceneRequest).items():
        limits = split_annotation(annotation)[1]
        unit = f" [{limits.unit}]" if limits.unit else ""
        default = getattr(defaults, name)
        shown = "" if dataclasses.is_dataclass(default) or default in ((), {}, None) else f" (default: {default})"
        if name != "room_type":
            yield f"  {name:18s} {limits.description}{unit}{shown}"


def _job(arguments: argparse.Namespace) -> tuple[SampleJob, SceneSynthesizer]:
    """Check the options and read the configuration."""
    writes = tuple(filter(None, arguments.write.split(",")))
    for kind in writes:
        if kind not in WRITES:
            raise RequestError(f"--write: expected a list of {', '.join(WRITES)}, got '{kind}'")
    if arguments.out is None and (not arguments.report or arguments.chain):
        raise RequestError("--out: expected a new folder for the files; only --report without --chain can do without")
    if arguments.out is not None and arguments.out.exists():
        raise RequestError(f"--out {arguments.out}: exists already; choose another folder or remove it")
    synthesizer = with_catalog(SceneSynthesizer.from_config(arguments.grammar), arguments.catalog)
    own = [read_grammar(path, synthesizer.categories).room_type for path in arguments.grammar]
    room = arguments.room or (own[-1] if own else SceneRequest().room_type)
    types = ",".join(sorted(synthesizer.grammars)) if room == ALL else room
    request = parse_constraints(arguments.constraints, types)
    request = dataclasses.replace(request, looks=(*request.looks, *arguments.look))
    if request.room_type != types:
        raise RequestError(f"-p room_type: expected no value, got '{request.room_type}'; use --room")
    synthesizer.check(request)
    job = SampleJob(
        grammar_files=tuple(arguments.grammar),
        catalog=arguments.catalog,
        request=request,
        seed=arguments.seed,
        frames=arguments.frames,
        out=arguments.out,
        writes=writes,
        chain=arguments.chain,
    )
    return job, synthesizer


def _make_folder(path: Path) -> None:
    try:
        path.mkdir(parents=True)
    except OSError as error:
        raise RequestError(f"--out {path}: cannot be made ({error.strerror})") from None


def report_text(rooms: Sequence[RoomMetrics], failures: int) -> tuple[str, bool]:
    """Return the table over at least one room, and whether every metric that has a limit keeps it."""
    metrics = summarise(rooms, failures)
    lines = [f"{'metric':24s}{'value':>12s} {'unit':5s}{'asked':10s}{'':8s}definition"]
    lines.extend(_row(metric) for metric in metrics)
    lines.extend(["", f"{'room type':16s}{'rooms':>6s}{'objects':>9s}{'p50 s':>8s}{'p99 s':>8s}{'attempts':>10s}{'R_walkable':>12s}"])
    for name, group in _by_type(rooms).items():
        row = _type_row(group)
        lines.append(
            f"{name:16s}{len(group):6d}{row['objects']:9.1f}{row['p50_s']:8.3f}{row['p99_s']:8.3f}"
            f"{row['attempts']:10.2f}{row['walkable_least']:12.3f}"
        )
    return "\n".join(lines), all(metric.passed is not False for metric in metrics)


def report_json(rooms: Sequence[RoomMetrics], errors: Sequence[str], command: Mapping[str, Any]) -> str:
    """Return the report as JSON: the command, the metrics with definitions and limits, by room type, and room by room."""
    report = {
        "command": dict(command),
        "metrics": [metric._asdict() for metric in summarise(rooms, len(errors))],
        "room_types": {name: {"rooms": len(group), **_type_row(group)} for name, group in _by_type(rooms).items()},
        "failures": list(errors),
        "rooms": [asdict(room) for room in rooms],
    }
    return json.dumps(report, indent=1) + "\n"


def _row(metric: Metric) -> str:
    verdict = {True: "ok", False: "FAILED", None: ""}[metric.passed]
    return f"{metric.name:24s}{metric.value:12.4f} {metric.unit:5s}{metric.limit:10s}{verdict:8s}{metric.definition}"


def _by_type(rooms: Sequence[RoomMetrics]) -> dict[str, list[RoomMetrics]]:
    groups: dict[str, list[RoomMetrics]] = defaultdict(list)
    for room in rooms:
        groups[room.room_type].append(room)
    return dict(sorted(groups.items()))


def _type_row(rooms: Sequence[RoomMetrics]) -> dict[str, float]:
    seconds = [room.seconds for room in rooms]
    return {
        "objects": float(np.mean([room.objects for room in rooms])),
        "p50_s": float(np.median(seconds)),
        "p99_s": float(np.quantile(seconds, 0.99)),
        "attempts": float(np.mean([room.cost.attempts for room in rooms])),
        "walkable_least": min(room.checks["walkable_share"][0] for room in rooms),
    }

"""The report of evaluations: what is told, what is missing, and the file."""

import dataclasses
import shlex
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from evaluation.evaluation_file import Evaluation, FrameRow, MetricRow, TaskRow, read_evaluation
from evaluation.tasks import TASKS
from renderer import LAYERS
from scene_description import SceneSynthError
from scene_description.whole import write_whole
from scene_synth_ros.pages.document import WebFiles, page_document
from scene_synth_ros.report.design import HOW, Design, find_design, value_text
from scene_synth_ros.report.error_images import ERROR_IMAGES
from scene_synth_ros.report.frame_pictures import Wanted, frame_pictures
from scene_synth_ros.report.places import Places
from scene_synth_ros.report.reactions import KINDS, Part, breakdowns, comparison, ranking, response_curves, rounded
from scene_synth_ros.report.samples import RoomKey, take_samples

FILES = WebFiles("scene_synth_ros.report", "report.html", "report.css", ("charts.js", "curves.js", "bars.js", "frames.js", "report.js"))
MOST_FILES = 6
"""Evaluations in one report: as many as there are colours."""
MAX_PICTURE_BYTES = 50_000_000


class ReportError(SceneSynthError):
    """What no report can be made of; one line."""


class ReportSummary(NamedTuple):
    """What a report shows: evaluations, tasks, factors, frames with pictures; the size of the file; what is missing, lines for people."""

    evaluations: int
    tasks: int
    factors: int
    pictured: int
    size: int
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Shown:
    """A frame that is shown, with the number of its evaluation."""

    number: int
    frame: FrameRow
    metric: MetricRow


def write_report(
    paths: Sequence[Path],
    out: Path,
    *,
    bag_root: Path | None,
    estimates: Path | None,
    worst: int,
    max_size: int,
    progress: Callable[[str], None] = lambda _what: None,
) -> ReportSummary:
    """Write the report of evaluation files.

    The first file is what the others are compared with; ``bag_root`` stands for each file's folder, ``estimates`` for the folder that
    each names.

    Raises:
        ReportError: there are too many files, ``estimates`` is given for several, or one has neither frames nor a summary.
        EvaluationError: a file is no evaluation.
        OSError: a file cannot be read, or the page not be written.
    """
    if not 1 <= len(paths) <= MOST_FILES:
        raise ReportError(f"expected 1 to {MOST_FILES} evaluation files, got {len(paths)}")
    if estimates is not None and len(paths) > 1:
        raise ReportError("--estimates: expected one evaluation beside it, got several; leave it out: each one's own command names its own")
    evaluations = []
    for path in paths:
        progress(f"reading {path.name}")
        evaluations.append(read_evaluation(path))
        if not evaluations[-1].frames and not evaluations[-1].summary:
            raise ReportError(f"{path}: expected frames or a summary, got neither; evaluate bags that hold estimates and truth")
    titles = titles_apart(evaluations, paths)
    evaluations = [dataclasses.replace(one, title=title) for one, title in zip(evaluations, titles, strict=True)]
    places = [Places(one, path, bag_root, estimates) for one, path in zip(evaluations, paths, strict=True)]
    evaluations = [place.with_bases(one) for one, place in zip(evaluations, places, strict=True)]
    data, notes, pictured = _page_data(evaluations, paths, places, worst, max_size, progress)
    document = page_document(FILES, data)
    write_whole(out, document)
    return ReportSummary(len(evaluations), len(data["tasks"]), len(data["factors"]), pictured, len(document), notes)


def titles_apart(evaluations: Sequence[Evaluation], paths: Sequence[Path]) -> list[str]:
    """Return a title of each evaluation that no other has: its own, else its algorithm's name, else its file."""
    titles = [one.title for one in evaluations]
    for others in ([one.algorithm for one in evaluations], list(map(str, paths))):
        counts = Counter(titles)
        titles = [title if title and counts[title] == 1 else other for title, other in zip(titles, others, strict=True)]
    return titles


def _page_data(
    evaluations: Sequence[Evaluation],
    paths: Sequence[Path],
    places: Sequence[Places],
    worst: int,
    max_size: int,
    progress: Callable[[str], None],
) -> tuple[dict[str, Any], tuple[str, ...], int]:
    design = find_design([frame for one in evaluations for frame in one.frames], [sweep for place in places for sweep in place.sweeps()])
    tasks = list(dict.fromkeys(task.name for one in evaluations for task in one.tasks))
    rooms: dict[RoomKey, int] = {}
    parts: dict[str, dict[int, Part]] = {}
    for number, (evaluation, place) in enumerate(zip(evaluations, places, strict=True)):
        for task in evaluation.tasks:
            frames = [frame for frame in evaluation.frames if frame.task == task.name]
            samples = take_samples(frames, [metric.name for metric in task.metrics], design, rooms, place.room)
            parts.setdefault(task.name, {})[number] = Part(evaluation, task, samples)
    shown, pictures = _frames(evaluations, places, worst, max_size, progress)
    notes = (*(note for place in places for note in place.notes()), *pictures.notes)
    progress("drawing intervals")
    data = {
        "title": " and ".join(dict.fromkeys(evaluation.title for evaluation in evaluations)),
        "notes": notes,
        "evaluations": [_told(*one) for one in zip(evaluations, paths, places, strict=True)],
        "how": HOW[design.name] if design.factors else "",
        "design": design.name.replace("_", " ") if design.factors else "",
        "kinds": KINDS,
        "factors": [
            {
                "name": factor.name,
                "label": factor.label,
                "unit": factor.unit,
                "columns": factor.columns,
                "places": [rounded(place) for place in factor.places],
                "base": factor.base,
                "base_value": rounded(factor.base_value),
                "binned": factor.binned,
            }
            for factor in design.factors
        ],
        "tasks": [_task(name, parts[name], design, len(rooms)) for name in tasks],
        "frames": [
            _frame_row(one, places[one.number], design, images) | {"words": words}
            for one, images, words in zip(shown, pictures.frames, pictures.words, strict=True)
        ],
        "legends": pictures.legends,
        "pictures": {name: LAYERS[ERROR_IMAGES[name].layer].picture.words for name in tasks if name in ERROR_IMAGES},
    }
    return data, notes, sum(bool(images) for images in pictures.frames)


def _task(name: str, parts: Mapping[int, Part], design: Design, rooms: int) -> dict[str, Any]:
    metrics: dict[str, MetricRow] = {}
    for part in parts.values():
        for metric in part.task.metrics:
            metrics.setdefault(metric.name, metric)
    return {
        "name": name,
        "estimate": TASKS[name].estimate if name in TASKS else "",
        "metrics": [{"name": metric.name, "unit": metric.unit, "lower": metric.better == "lower"} for metric in metrics.values()],
        "scores": comparison(parts, rooms),
        "curves": {str(number): response_curves(part, design, rooms) for number, part in parts.items()},
        "ranking": {str(number): ranking(part, design, rooms) for number, part in parts.items()},
        "breakdowns": breakdowns(parts),
    }


def _frames(evaluations: Sequence[Evaluation], places: Sequence[Places], worst: int, max_size: int, progress: Callable[[str], None]) -> Any:
    shown, wanted = [], []
    for number, (evaluation, place) in enumerate(zip(evaluations, places, strict=True)):
        for task in evaluation.tasks:
            frames = [frame for frame in evaluation.frames if frame.task == task.name]
            metric = ordering_metric(task, frames)
            if metric is not None:
                chosen = worst_frames(frames, metric, worst)
                shown += [_Shown(number=number, frame=frame, metric=metric) for frame in chosen]
                wanted += [_wanted(frame, place) for frame in chosen]
    return shown, frame_pictures(wanted, max_size, MAX_PICTURE_BYTES, lambda bag: progress(f"reading {bag}"))


def _wanted(frame: FrameRow, place: Places) -> Wanted:
    key, row = frame.key, ERROR_IMAGES.get(frame.task)
    topic = place.topic(frame.task, row.layer) if row else ""
    return Wanted(frame.task, key.stamp_ns, place.bag(key), place.camera(), place.estimates(key) if row else None, topic)


def _told(evaluation: Evaluation, path: Path, place: Places) -> dict[str, Any]:
    """Return what is said of an evaluation."""
    keys = [frame.key for frame in evaluation.frames]
    frames = {(key.bag, key.room, key.stamp_ns) for key in keys}
    types = sorted({key.room_type.replace("_", " ") for key in keys})
    bags = list(dict.fromkeys(key.bag for key in keys))
    facts = [
        ("algorithm", evaluation.algorithm),
        ("file", str(path)),
        ("made with", f"scene_synth_ros {version}" if (version := place.version()) else ""),
        ("bags", f"{len(bags)}: {', '.join(bags[:3])}{', ...' if len(bags) > 3 else ''}" if bags else ""),
        ("rooms", str(len({place.room(key) for key in keys}))),
        ("room types", ", ".join(types)),
        ("frames", str(len(frames))),
        *((key.replace("_", " "), str(count)) for key, count in evaluation.missing.items()),
    ]
    return {"title": evaluation.title, "facts": [fact for fact in facts if fact[1]], "command": evaluation.created_with}


def _frame_row(one: _Shown, place: Places, design: Design, images: Mapping[str, str]) -> dict[str, Any]:
    frame, key = one.frame, one.frame.key
    labels = {factor.name: (factor.label, factor.unit) for factor in design.factors}
    factors = [(*labels[name], value_text(value)) for name, value in key.factors.items() if name in labels]
    return {
        "task": frame.task,
        "evaluation": one.number,
        "metric": one.metric.name,
        "value": rounded(frame.metrics[one.metric.name]),
        "room_type": key.room_type.replace("_", " "),
        "place": f"{key.bag}, room {key.room}, frame {key.frame}",
        "stamp": str(key.stamp_ns),
        "factors": factors,
        "command": command_of(str(place.bag(key)), place.command(key)),
        "images": images,
        "no_estimate": place.no_estimate,
    }


def ordering_metric(task: TaskRow, frames: Sequence[FrameRow]) -> MetricRow | None:
    """Return the first metric of a task that frames have a value of, None where none has."""
    return next((metric for metric in task.metrics if any(frame.metrics.get(metric.name) is not None for frame in frames)), None)


def worst_frames(frames: Sequence[FrameRow], metric: MetricRow, count: int) -> list[FrameRow]:
    """Return the worst frames, the worst first: of each room of each bag its worst, then, where these are too few, the next worst."""
    sign = -1.0 if metric.better == "lower" else 1.0
    known = [(value, frame) for frame in frames if (value := frame.metrics.get(metric.name)) is not None]
    ordered = [frame for _, frame in sorted(known, key=lambda pair: sign * pair[0])]
    seen: dict[tuple[str, int], int] = {}
    turns = []
    for frame in ordered:
        place = frame.key.bag, frame.key.room
        turn = seen[place] = seen.get(place, -1) + 1
        turns.append(turn)
    chosen = sorted(range(len(ordered)), key=lambda k: (turns[k], k))[:count]
    return [ordered[k] for k in sorted(chosen)]


def command_of(bag: str, variant_command: str | None) -> str:
    """Return the shell command that makes a frame again: that of its variant, else the one that renders its bag again."""
    return variant_command or f"scene_synth verify {shlex.quote(bag)}"

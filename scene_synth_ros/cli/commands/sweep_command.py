"""``scene_synth sweep``: variants of rooms that differ in what a file says, and in nothing else; a bag for each."""

import argparse
import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

from tqdm import tqdm

from grammar import GrammarError
from renderer import LAYERS
from scene_description import error_line
from scene_description.yaml_text import flow_yaml
from scene_synth_ros.bags.bag_images import layer_picture, layer_topics, read_pixels
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.cli.lines import aligned, counted, say
from scene_synth_ros.cli.options import UsageError, add_workers
from scene_synth_ros.cli.parameters.run_parameters import RunWords, run_parameters
from scene_synth_ros.cli.parameters.run_profile import NAMESPACE, ProfileError, find_shipped
from scene_synth_ros.cli.pictures.picture_grid import Tile, write_grid
from scene_synth_ros.offline.rules import rules_of
from scene_synth_ros.offline.settings import OfflineSettings, read_settings
from scene_synth_ros.suite.parameters import ParameterError
from scene_synth_ros.sweep.plan import base_rooms, daylight_note, plan_sweep
from scene_synth_ros.sweep.run_sweep import Made, Outcome, run_sweep
from scene_synth_ros.sweep.sweep_file import SweepError, SweepSpec, read_sweep
from scene_synth_ros.sweep.sweep_json import SWEEP_NAME, VariantRow, read_sweep_json
from scene_synth_ros.sweep.variant import BaseRoom, SweepPlan
from scene_synth_ros.workers.pool import terminable

SHIPPED = ("sweeps",)
"""Folders of the configuration that hold sweeps."""
SHOWN = ("color_sensed", "color", "depth")
"""Layers that may be on the contact sheet, the best first."""
COLUMNS = 4
_BAG = Path("bag")
"""Stands for a variant's bag in the parameters of its run, which do not tell where that is."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument(
        "sweep", type=Path, help="what to vary: a YAML file (docs/sweeps.md), or a shipped one by its name, illumination, say"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder of the sweep; what is missing in one that is there is made")
    add_workers(parser, default=1)
    parser.add_argument("--only", nargs="+", default=[], metavar="ID", help="make these variants only")
    parser.add_argument("--plan", action="store_true", help="print the table of variants and make none")
    parser.add_argument("--contact-sheet", type=Path, metavar="FILE", help="draw the first frame of each variant, as PNG or JPEG")


def run(arguments: argparse.Namespace) -> int:
    """Make a sweep; return 0, or 1 if a variant was refused."""
    if arguments.out is None and not arguments.plan:
        raise UsageError("--out: expected a folder for the sweep; only --plan can do without")
    if arguments.contact_sheet and not arguments.contact_sheet.absolute().parent.is_dir():
        raise UsageError(f"--contact-sheet {arguments.contact_sheet}: the folder does not exist")
    plan = read_plan(arguments.sweep, say)
    ids = [variant.id for variant in plan.variants]
    for name in arguments.only:
        if name not in ids:
            raise UsageError(f"--only {name}: expected ids of this sweep, {ids[0]} to {ids[-1]}")
    if arguments.plan:
        sys.stdout.write(_plan_table(plan))
        return 0
    say(f"{counted(len(arguments.only or ids), 'variant')} to make; kernels are compiled on the first run")
    with tqdm(total=len(arguments.only or ids), unit="variant", disable=None, leave=False) as line, terminable():

        def tell(made: Made, done: int, of: int) -> None:
            line.total = of
            line.update()
            line.write(_line(plan, made, done, of), file=sys.stdout)
            sys.stdout.flush()

        outcome = run_sweep(plan, arguments.out, arguments.only, arguments.workers, tell)
    sys.stdout.write(_summary(outcome, arguments.out))
    if arguments.contact_sheet:
        rows = [row for row in read_sweep_json(arguments.out / SWEEP_NAME).variants if not arguments.only or row.id in arguments.only]
        write_grid([_tile(row, arguments.out / row.bag) for row in rows], COLUMNS, arguments.contact_sheet)
        sys.stdout.write(f"contact sheet: {arguments.contact_sheet} ({len(rows)} variants)\n")
    return 1 if any(made.refused for made in outcome.made) else 0


def read_plan(file: Path, tell: Callable[[str], None] = lambda line: None) -> SweepPlan:
    """Return the variants of a sweep file, or of a shipped one by its name; ``tell`` is called with what is done, and to be known, before.

    Raises:
        SweepError: the file does not fit, or a room cannot be had.
        ProfileError: there is no such file.
    """
    path = find_shipped(file, SHIPPED, "a sweep file")
    spec = read_sweep(path)
    sampled = len(spec.base.room_types) * len(spec.base.seeds) * spec.base.count
    tell(f"sampling {counted(sampled, 'base room')} (the first run compiles kernels)" if sampled else "reading the base rooms")
    try:
        rules = rules_of(_settings(spec, {}))
    except (ParameterError, ProfileError, GrammarError) as error:
        raise SweepError(f"{path}: run: {error_line(error)}") from None
    if note := daylight_note(spec, str(file), rules):
        tell(f"note: {note}")
    bases = list(base_rooms(spec, str(path), lambda parameters: _settings(spec, parameters), rules))

    def settings_of(base: BaseRoom, parameters: Mapping[str, object]) -> OfflineSettings:
        grammar = {name: getattr(base.settings.run, name) for name in ("seed", "rooms", "first_index", "frames_per_room")}
        own = {f"grammar_node.{name}": value for name, value in grammar.items()} | {"grammar_node.scene.room_type": base.scene.category}
        return _settings(spec, own | dict(parameters))

    return plan_sweep(spec, str(file), bases, settings_of, rules)


def _settings(spec: SweepSpec, parameters: Mapping[str, object]) -> OfflineSettings:
    """Return the parameters of a run of the sweep, with some of a room or a variant."""
    told = {"rate_hz": spec.run.rate_hz, "frames_per_room": spec.run.frames}
    run = {f"grammar_node.{name}": value for name, value in told.items() if value is not None}
    scene = {f"grammar_node.scene.{name}": value for name, value in spec.grammar.items()}
    own = {name if name.partition(".")[0].endswith("_node") else f"renderer_node.{name}": value for name, value in spec.parameters.items()}
    words = RunWords(
        params=Path(spec.run.params),
        overlay=tuple(map(Path, spec.run.overlays)),
        overrides=tuple(f"{name}:={flow_yaml(value)}" for name, value in (run | scene | own | dict(parameters)).items()),
        record=_BAG,
    )
    return read_settings(run_parameters(words), NAMESPACE)


def _line(plan: SweepPlan, made: Made, done: int, of: int) -> str:
    variant = next(variant for variant in plan.variants if variant.id == made.id)
    values = ", ".join(f"{name} {_short(variant.factors[name])}" for name in variant.changed) or "as it is"
    scene = variant.base.scene
    what = f"refused: {made.refused}" if made.refused else f"{made.frames} frames"
    return f"{made.id} ({done} of {of}): {scene.category} of seed {scene.seed}, {values}: {what}"


def _summary(outcome: Outcome, folder: Path) -> str:
    refused = [made.id for made in outcome.made if made.refused]
    told = [f"{len(outcome.made) - len(refused)} variants made", f"{len(outcome.found)} there already"]
    told += [f"{len(refused)} refused ({', '.join(refused)})"] if refused else []
    return f"{', '.join(told)}; {folder / SWEEP_NAME}\n"


def _tile(variant: VariantRow, bag: Path) -> Tile:
    """Return the first frame of a variant, labelled with what was changed.

    Raises:
        UsageError: its bag holds none of ``SHOWN``.
    """
    with BagReader(bag) as reader:
        topics = layer_topics({topic.name: topic.type_name for topic in reader.summary.topics})
        layer = next((layer for layer in SHOWN if layer in topics), None)
        message = next(iter(reader.messages([topics[layer]])), None) if layer is not None else None
        if layer is None or message is None:
            raise UsageError(f"{bag}: no picture; expected images of {', '.join(SHOWN)}, got {', '.join(topics) or 'none'}")
        return Tile(_label(variant), layer_picture(LAYERS[layer], read_pixels(message)))


def _label(variant: VariantRow) -> str:
    values = ", ".join(f"{name} {_short(variant.factors[name])}" for name in variant.changed)
    values = values or f"{variant.base.room_type} of seed {variant.base.seed}, as it is"
    return f"{variant.id} {values.replace('_', ' ')}"


def _plan_table(plan: SweepPlan) -> str:
    """Return the variants as a table; values that differ from the base room are marked with a star."""
    head = ["id", "room type", "seed", "index", *(factor.name for factor in plan.factors)]
    rows = [head]
    for variant in plan.variants:
        scene = variant.base.scene
        values = (f"{_short(value)}{'*' if name in variant.changed else ''}" for name, value in variant.factors.items())
        rows.append([variant.id, scene.category, str(scene.seed), str(scene.index), *values])
    return "\n".join(aligned(rows, left=len(head))) + "\n"


def _short(value: object) -> str:
    """Return a value of a factor in few characters."""
    if value is None:
        return "-"
    return f"{value:g}" if isinstance(value, float) else value if isinstance(value, str) else json.dumps(value)

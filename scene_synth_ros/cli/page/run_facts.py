"""What a page says of the run that made a bag: seed and room type, versions, and the parameters that are not at their default."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator, Mapping
from typing import Any

from scene_synth_ros.bags.bag_reader import BagSummary
from scene_synth_ros.bags.bag_yaml import BagYamlError, load_yaml
from scene_synth_ros.bags.run_info import PARAMETERS_NAME, RECORD_NAME
from scene_synth_ros.cli.page.bag_index import BagIndex
from scene_synth_ros.messages.stamps import NANOSECONDS
from scene_synth_ros.render.renderer_config import RENDERER_GROUPS
from scene_synth_ros.synthesize.run_config import GRAMMAR_GROUPS

NODE_GROUPS: dict[str, dict[str, type]] = {
    "grammar_node": GRAMMAR_GROUPS,
    "renderer_node": RENDERER_GROUPS,
}
"""How the name of a node begins -> prefix of its parameters -> dataclass that defines them."""

MAX_TEXT, MAX_PARAMETERS, MAX_YAML = 400, 500, 200_000


def run_facts(summary: BagSummary, index: BagIndex) -> list[tuple[str, str]]:
    """Return what is known of the run that made the bag, name -> text; what the bag does not say is left out."""
    record = summary.records.get(RECORD_NAME, {})
    facts = [(name.replace("_", " "), record[name]) for name in ("seed", "room_type") if record.get(name)]
    files = _count(len(summary.files), "file")
    facts.append(("bag", f"{files}, {summary.size / 1e6:.1f} MB{'' if summary.finished else ', unfinished'}"))
    facts.append(("frames", f"{index.frames_found} in {_count(index.rooms_found, 'room')}"))
    if index.period_ns:
        facts.append(("rate", f"{NANOSECONDS / index.period_ns:.4g} Hz"))
    if summary.start_ns is not None and summary.end_ns is not None:
        facts.append(("duration", f"{(summary.end_ns - summary.start_ns) / NANOSECONDS:.3f} s"))
    versions = {name.partition(".")[2]: value[:MAX_TEXT] for name, value in record.items() if name.startswith("version.")}
    facts += [(name, versions.pop(name)) for name in ("system", "processor") if name in versions]
    if versions:
        facts.append(("versions", ", ".join(f"{name} {version}" for name, version in versions.items())))
    return [(name, value[:MAX_TEXT]) for name, value in facts]


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def changed_parameters(summary: BagSummary) -> list[tuple[str, str, str, str]]:
    """Return (node, parameter, value, default) of the parameters in the bag that are not at their default.

    A default is that of this program; a parameter that it does not know is told with the default ``?``.
    """
    text = summary.attachments.get(PARAMETERS_NAME, b"")
    try:
        document = load_yaml(text) if len(text) <= MAX_YAML else None
    except BagYamlError:
        document = None
    return list(_changed(document))[:MAX_PARAMETERS]


def _changed(document: object) -> Iterator[tuple[str, str, str, str]]:
    for node, content in document.items() if isinstance(document, Mapping) else ():
        values = content.get("ros__parameters") if isinstance(content, Mapping) else None
        if not isinstance(values, Mapping):
            continue
        short = str(node).rsplit("/", 1)[-1]
        known = next((_defaults(groups) for name, groups in NODE_GROUPS.items() if short.startswith(name)), {})
        for name, value in values.items():
            default = known.get(str(name), "?")
            if default != value:
                yield str(node)[:MAX_TEXT], str(name)[:MAX_TEXT], _text(value), _text(default)


def _defaults(groups: Mapping[str, type]) -> dict[str, Any]:
    defaults = {}
    for prefix, cls in groups.items():
        for field in dataclasses.fields(cls):
            name = f"{prefix}.{field.name}" if prefix else field.name
            defaults[name] = list(field.default) if isinstance(field.default, tuple) else field.default
    return defaults


def _text(value: object) -> str:
    plain = value if isinstance(value, str) else json.dumps(value, default=str)
    return plain[:MAX_TEXT] if plain else '""'

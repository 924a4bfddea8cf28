"""``scene_synth layers``: the table of layers, which ``docs/layers.md`` is made from."""

import argparse
import sys
from collections.abc import Sequence

from renderer.film.layer import Layer
from renderer.film.layers import LAYERS
from scene_description.share import config_path
from scene_synth_ros.cli.lines import markdown_table
from scene_synth_ros.messages.conversions import layer_encoding
from scene_synth_ros.messages.frame_messages import has_companion
from scene_synth_ros.messages.image_codec import compressed_topic

_GROUPS = {"geometric": "hit record", "hit": "hit record", "sampled": "samples", "color": "light", "sensed": "sensor"}
_NONE = "–"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("--markdown", action="store_true", help="print the page docs/layers.md")


def run(arguments: argparse.Namespace) -> int:
    """Print each layer's name, encoding and meaning, or the whole page."""
    if arguments.markdown:
        sys.stdout.write(layers_page())
    else:
        sys.stdout.writelines(f"{row.name:12} {layer_encoding(row):6} {row.meaning}\n" for row in LAYERS.values())
    return 0


def layers_page() -> str:
    """Return ``docs/layers.md``."""
    pixels = markdown_table(("layer", "pixel", "type", "unit", "frame", "no hit", "from"), map(_pixels, LAYERS.values()))
    places = markdown_table(
        ("layer", "encoding", "`streams.<layer>`", "topics beside", "compressed", "picture", "EXR", "`scene_synth render`", "bags"),
        map(_places, LAYERS.values()),
    )
    page = config_path("templates/layers.md").read_text(encoding="utf-8")
    return page.format(count=len(LAYERS), pixels=pixels, places=places)


def _pixels(row: Layer) -> tuple[str, ...]:
    size = f" x {row.channels}" if row.channels > 1 else ""
    no_hit = _NONE if row.no_hit is None else f"{row.no_hit:g}".replace("inf", "+inf").replace("nan", "NaN")
    return f"`{row.name}`", row.meaning, f"{row.dtype}{size}", row.unit or _NONE, row.frame or _NONE, no_hit, _GROUPS[row.group]


def _places(row: Layer) -> tuple[str, ...]:
    beside = [topic for topic, there in (("image_color", has_companion(row)), ("labels", row.labels is not None)) if there]
    return (
        f"`{row.name}`",
        layer_encoding(row),
        str(row.published).lower(),
        _code(beside),
        f"`{compressed_topic(f'/{row.name}/image_raw').rpartition('/')[2]}`" if row.compression else _NONE,
        row.picture.words,
        _code(row.exr),
        _option(row),
        f"`images.{row.compression}`" if row.compression else _NONE,
    )


def _option(row: Layer) -> str:
    """Return the option of ``scene_synth render`` that asks for a layer; ``--layers`` may name every one."""
    return f"`--layers {row.name}`" if row.option == "layers" else f"`--{row.option}`" if row.option else "always"


def _code(words: Sequence[str]) -> str:
    return ", ".join(f"`{word}`" for word in words) or _NONE

"""``scene_synth layers``: the table of layers, which ``docs/layers.md`` is made from."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from renderer.film.layer import Layer
from renderer.film.layers import LAYERS
from scene_synth_ros.cli.lines import markdown_table
from scene_synth_ros.messages.conversions import layer_encoding
from scene_synth_ros.messages.frame_messages import has_companion
from scene_synth_ros.messages.image_codec import compressed_topic

PAGE = """# Layers

{count} layers. Made by `scene_synth layers --markdown > docs/layers.md` from the table in `renderer/film/layers.py`.

![every layer of one view](layers.jpg)

`.venv/bin/python examples/every_layer.py docs` draws this picture.

## What the pixels hold

{pixels}

- *Hit record*: of the ray through the middle of the pixel, the same for all these layers; they agree at every pixel and carry no noise.
- *Samples*: the mean of the pixel's samples, with their noise and with the blur of lens and shutter. *Light*: the same, of traced paths.
- *Sensor*: what a depth camera reads that is no ideal one: [sensors.md](sensors.md).
- *Frame*: with a rolling shutter every row has a pose of its own ([cameras.md](cameras.md)), from which all layers but a modelled
  `depth_sensed` are seen. *Row*: distances and directions are those of the optical frame at the row's time. *Stamp*: those of the optical
  frame at the frame's stamp, as `pose` and `/tf` tell it; a modelled depth sensor takes all rows then, an ideal one is `depth` itself.
  *Rows of both*: from the pixel, seen at its row's time, to where the row of the other frame that the point falls on sees it at its own.
  *World* and *object*: fixed to the room. With a global shutter row and stamp are one.
- *No hit*: the value where the ray leaves the scene; a dash means that such a pixel is like any other. Where the lens sees nothing, `depth`
  and `range` are NaN, what is computed from the hit record has its value for no hit, all else is 0.

## Where they are found

{places}

- Topics are `<camera>/<layer>/image_raw` and `<camera>/<layer>/camera_info`, all with the frame's stamp. Where viewers cannot show the raw
  image there is a picture beside it on `<camera>/<layer>/image_color` (rgb8), unless `streams.color_companions` is false. What ids mean is
  told on `<camera>/<layer>/labels` (JSON) and on `label_info` (LabelInfo): live where vision_msgs is installed, in bags always.
- *Compressed*: how the compressed form of the raw image ends, as image_transport names it: `<camera>/<layer>/image_raw/compressed`, made
  only while somebody subscribes to it (`compressed.*`).
- `streams.<layer>` says whether a layer is published. A panorama publishes range where depth is asked for. With `streams.depth_encoding`
  16UC1 depth is published in whole millimetres, 0 where there is none.
- `scene_synth render` writes `frame_<n>.npz` with each layer under its name as it is, `frame_<n>_<layer>.png` with the picture, and
  `frame_<n>.exr` with the channels named here; `R`, `G`, `B` are there even without `--radiance`.
- *Bags*: which of the recorder's settings compresses the raw image; pictures follow `images.color`.
"""

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
    return PAGE.format(count=len(LAYERS), pixels=pixels, places=places)


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

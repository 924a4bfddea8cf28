"""One HTML file of a page: style, script and contents in it, nothing loaded from elsewhere.

Whatever a user's file says reaches the page as JSON in which no character can end the element, and the script sets it as text, never as
markup.  A content security policy beside it lets the browser run this script alone and load nothing.
"""

from __future__ import annotations

import base64
import hashlib
import html
import io
import json
import os
import sys
import webbrowser
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from PIL import Image as Picture

_ESCAPED = {ord(character): f"\\u{ord(character):04x}" for character in "<>&\u2028\u2029"}


class WebFiles(NamedTuple):
    """A page's own files, in the folder ``web`` of a package; those that all pages share come before them.

    Attributes:
        package: that has the folder.
        template: HTML with ``{{title}}``, ``{{policy}}``, ``{{style}}``, ``{{data}}`` and ``{{script}}``.
        style: CSS.
        scripts: in this order; they share one scope.
    """

    package: str
    template: str
    style: str
    scripts: tuple[str, ...]


SHARED = WebFiles("scene_synth_ros.pages", "", "base.css", ("base.js", "tables.js"))


def page_document(files: WebFiles, data: Mapping[str, Any]) -> bytes:
    """Return the HTML file that shows ``data``, UTF-8; its key ``title`` is the page's title."""
    style = "".join(web_file(part.package, part.style) for part in (SHARED, files))
    scripts = "".join(web_file(part.package, name) for part in (SHARED, files) for name in part.scripts)
    script = f"(() => {{\n'use strict';\n{scripts}}})();\n"
    sources = {"default": "'none'", "img": "data:", "style": f"'{_digest(style)}'", "script": f"'{_digest(script)}'"}
    policy = "; ".join(f"{kind}-src {source}" for kind, source in sources.items())
    pieces = {
        "title": html.escape(str(data["title"])),
        "policy": html.escape(f"{policy}; base-uri 'none'; form-action 'none'"),
        "style": style,
        "script": script,
        "data": json.dumps(data, allow_nan=False, separators=(",", ":")).translate(_ESCAPED),
    }
    first, *rest = web_file(files.package, files.template).split("{{")
    page = [first]
    for piece in rest:
        name, _, after = piece.partition("}}")
        page += [pieces[name], after]
    return "".join(page).encode("utf-8", "replace")


def web_file(package: str, name: str) -> str:
    """Return the text of a file in the folder ``web`` of a package."""
    return resources.files(package).joinpath("web", name).read_text(encoding="utf-8")


def write_whole(path: Path, document: bytes) -> None:
    """Write a file as a whole: an earlier one stays until all of it is written.

    Raises:
        OSError: it cannot be written.
    """
    partial = path.with_name(f".{path.name}.partial")
    try:
        partial.write_bytes(document)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def open_page(path: Path) -> str:
    """Open a page in the user's browser; return the line that says what to do where that is not possible, else nothing."""
    graphical = not sys.platform.startswith("linux") or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if graphical and webbrowser.open(path.resolve().as_uri()):
        return ""
    return f"{'no browser' if graphical else 'no display'} found; open {path} in a browser\n"


def _digest(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode('ascii')}"


JPEG_QUALITY = 85
PNG_LEVEL = 6
"""Level 9 takes twelve times as long for depth, and saves a fifth."""


def picture_base64(picture: Picture.Image, kind: str) -> str:
    """Return a picture as a file, base64; ``kind`` is PNG or JPEG."""
    out = io.BytesIO()
    picture.save(out, format=kind, quality=JPEG_QUALITY, compress_level=PNG_LEVEL)
    return base64.b64encode(out.getvalue()).decode("ascii")


def data_uri(picture: Picture.Image, kind: str = "PNG") -> str:
    """Return a picture as a ``data:`` address; ``kind`` is PNG or JPEG."""
    return f"data:image/{kind.lower()};base64,{picture_base64(picture, kind)}"

"""Pictures within a page."""

from __future__ import annotations

import base64
import io

from PIL import Image as Picture

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

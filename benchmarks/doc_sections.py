"""Parts of pages that a bench writes: what stands between ``<!-- name -->`` and ``<!-- end of name -->``."""

from __future__ import annotations

import re
from pathlib import Path

DOCS = Path(__file__).resolve().parent.parent / "docs"


def write_section(page: Path, name: str, text: str) -> None:
    """Put ``text`` in the place of what a page has between the marks of ``name``.

    Raises:
        ValueError: the page does not have both marks once.
    """
    begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
    before = page.read_text(encoding="utf-8")
    after, count = re.subn(
        f"({re.escape(begin)}).*?({re.escape(end)})", lambda match: f"{match[1]}\n{text}\n\n{match[2]}", before, flags=re.S
    )
    if count != 1:
        raise ValueError(
            f"{page.name}: expected the marks '{begin.strip()}' and '{end}' once, got {count}; add them where the part shall stand"
        )
    page.write_text(after, encoding="utf-8")

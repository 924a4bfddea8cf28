"""Reads an HTML page as a browser would: its elements, and the text of each script."""

from html.parser import HTMLParser
from pathlib import Path


class HtmlPage(HTMLParser):
    """Elements with their attributes in order, and the text of each script."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag == "script":
            self.scripts.append("")

    def handle_data(self, data: str) -> None:
        if self.tags and self.tags[-1][0] == "script":
            self.scripts[-1] += data


def parse(page: Path) -> HtmlPage:
    """Return what is on a page."""
    parser = HtmlPage()
    parser.feed(page.read_text(encoding="utf-8"))
    return parser

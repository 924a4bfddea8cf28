"""What some tests need that a bare machine lacks: compilers, message packages that these build, a browser.

Tests that need what is missing are skipped, and one line at the end names it; with ``NEEDED_TOOLS=required`` they fail.
"""

import importlib.util
import os
import re
import shutil
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

REQUIRED = os.environ.get("NEEDED_TOOLS") == "required"
_BUILT = re.compile(r"^\s*(?:from|import) (tf2_msgs|vision_msgs)\b", re.MULTILINE)
_BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")


class Tool(NamedTuple):
    """Something that tests need: what it is, whether it is here, and how Debian and Ubuntu install it."""

    name: str
    is_here: bool
    advice: str


def find_chromium() -> str | None:
    """Return the browser's program, or None where there is none."""
    return next((path for path in map(shutil.which, _BROWSERS) if path), None)


@cache
def tools() -> dict[str, Tool]:
    """Return key -> tool."""
    messages = all(importlib.util.find_spec(package) is not None for package in ("tf2_msgs", "vision_msgs"))
    return {
        "compiler": Tool("a C compiler", shutil.which("cc") is not None, "apt install gcc"),
        "messages": Tool("tf2_msgs and vision_msgs", messages, "apt install gcc g++ python3-dev, then make interfaces"),
        "chromium": Tool("Chromium", find_chromium() is not None, "apt install chromium"),
    }


def need(key: str) -> None:
    """Skip the test that runs where a tool is missing, or fail it where tools are required."""
    tool = tools()[key]
    if not tool.is_here:
        (pytest.fail if REQUIRED else pytest.skip)(f"no {tool.name}; {tool.advice}")


def lacks_messages(path: Path) -> bool:
    """Return whether a test file imports message packages that are not here, and may be left out for it."""
    return not REQUIRED and not tools()["messages"].is_here and path.suffix == ".py" and _BUILT.search(path.read_text()) is not None


def missing_line() -> str:
    """Return one line that names the tools that are missing and how to get them; empty where all are here."""
    missing = [tool for tool in tools().values() if not tool.is_here]
    return "; ".join(f"tests that need {tool.name} were skipped ({tool.advice})" for tool in missing)

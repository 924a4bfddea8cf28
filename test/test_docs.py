"""What is made from the code is up to date (run ``make docs``), and what the pages name is there."""

import importlib
import re
import subprocess
import sys
from pathlib import Path

from doc_commands import PAGES

from scene_synth_ros.cli.command_line import COMMANDS
from scene_synth_ros.messages.streams import ROLES

ROOT = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "docs"))
reference_pages = importlib.import_module("reference_pages")
FOLDERS = (
    "docs",
    "config",
    "examples",
    "launch",
    "test",
    "benchmarks",
    "kernel_cache",
    "scene_description",
    "grammar",
    "renderer",
    "evaluation",
    "scene_synth_ros",
)


def test_the_map_of_the_architecture_is_up_to_date() -> None:
    code = "import architecture_map as m; import sys; sys.stdout.write(m.architecture())"
    env = {"PYTHONPATH": f"{ROOT}:{ROOT / 'docs'}", "PATH": ""}
    drawn = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True).stdout
    assert drawn == (ROOT / "docs" / "architecture.svg").read_text(encoding="utf-8"), "run 'make docs'"


def test_the_pages_of_commands_parameters_and_topics_are_up_to_date() -> None:
    assert reference_pages.TOPIC_CONTENT.keys() == ROLES.keys()
    assert reference_pages.COMMAND_PAGES.keys() == COMMANDS.keys()
    for name, page in reference_pages.PAGES.items():
        assert (ROOT / "docs" / name).read_text(encoding="utf-8") == page(), f"docs/{name}: run 'make docs'"


def test_the_index_leads_to_every_page() -> None:
    links = re.findall(r"\]\(([\w.]+\.md)\)", (ROOT / "docs" / "index.md").read_text(encoding="utf-8"))
    pages = {page.name for page in (ROOT / "docs").glob("*.md")} - {"index.md"}
    assert pages <= set(links), f"docs/index.md does not lead to {', '.join(sorted(pages - set(links)))}"


def heading_anchors(page: Path) -> set[str]:
    """Return the names by which links reach the headings of a page, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_relative_links_lead_somewhere() -> None:
    for page in PAGES:
        for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
            if "://" not in target:
                path, _, anchor = target.partition("#")
                file = page.parent / path if path else page
                assert file.exists(), f"{page.name}: no file {path}"
                assert not anchor or anchor in heading_anchors(file), f"{page.name}: no heading {anchor} in {file.name}"


def test_files_and_folders_that_pages_name_exist() -> None:
    for page in PAGES:
        names = re.findall(r"(?<![\w./<)-])[\w*-]+/[\w.*/-]*", page.read_text(encoding="utf-8"))
        named = {name.rstrip(".") for name in names if name.split("/")[0] in FOLDERS or name.endswith(".py")}
        missing = [name for name in sorted(named) if not any([*ROOT.glob(name), *ROOT.glob(f"*/{name}")])]
        assert not missing, f"{page.name} names what is not there: {', '.join(missing)}"

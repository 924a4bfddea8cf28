"""Compiled kernels are fresh: a change of a file that a kernel's file imports compiles it again."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
CALLER = """
from renderer.core.kernel import entry
from renderer.{callee} import share

@entry
def total(count: int) -> float:
    return count * share()
"""
CALLEE = """
from renderer.core.kernel import kernel
{imports}

@kernel
def share() -> float:
    return {value}
"""
ASK = "import renderer.caller as c; value = c.total(2); print(value, sum(c.total._cache_hits.values()))"


def tree(folder: Path) -> Path:
    """A copy of what kernels need, without any kernel but those of the test."""
    shutil.copytree(ROOT / "scene_description", folder / "scene_description", ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("renderer", "renderer/core", "renderer/below"):
        (folder / name).mkdir()
        (folder / name / "__init__.py").write_text("")
    shutil.copy(ROOT / "renderer/core/kernel.py", folder / "renderer/core")
    (folder / "renderer/caller.py").write_text(CALLER.format(callee="below.callee"))
    return folder


def write_callee(folder: Path, value: str, imports: str = "") -> None:
    (folder / "renderer/below/callee.py").write_text(CALLEE.format(value=value, imports=imports))


def ask(folder: Path) -> tuple[float, int]:
    """Value of the calling kernel in a process of its own, and how many kernels it found compiled."""
    env = {name: text for name, text in os.environ.items() if name != "NUMBA_CACHE_DIR"} | {"PYTHONPATH": str(folder)}
    env["PYTHONDONTWRITEBYTECODE"] = "1"  # Python tells two versions of a file of one second and one length not apart
    said = subprocess.run([sys.executable, "-c", ASK], cwd=folder, env=env, check=True, capture_output=True, text=True).stdout
    value, hits = said.split()
    return float(value), int(hits)


def test_a_kernel_is_compiled_again_when_a_file_changes_that_its_file_imports(tmp_path: Path) -> None:
    folder = tree(tmp_path)
    write_callee(folder, "1.5")
    assert ask(folder) == (3.0, 0)
    write_callee(folder, "2.5")
    assert ask(folder) == (5.0, 0)
    write_callee(folder, "VALUE", "from renderer.below.constants import VALUE")
    (folder / "renderer/below/constants.py").write_text("VALUE = 4.0\n")
    assert ask(folder) == (8.0, 0)
    (folder / "renderer/below/constants.py").write_text("VALUE = 5.0\n")
    assert ask(folder) == (10.0, 0)
    (folder / "renderer/other.py").write_text("VALUE = 6.0\n")  # nothing imports it
    assert ask(folder) == (10.0, 1)

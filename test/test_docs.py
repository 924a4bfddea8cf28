"""What is made from the code is up to date: run ``make docs``."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def test_the_map_of_the_architecture_is_up_to_date() -> None:
    code = "import architecture_map as m; import sys; sys.stdout.write(m.architecture())"
    env = {"PYTHONPATH": f"{ROOT}:{ROOT / 'docs'}", "PATH": ""}
    drawn = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True).stdout
    assert drawn == (ROOT / "docs" / "architecture.svg").read_text(encoding="utf-8"), "run 'make docs'"

"""All that is measured of the irradiance cache, one bench after the other, each in a process of its own.

python -m benchmarks.cached_measures [--rooms N] [--references DIR] [--samples N] [--write]

For a machine that does nothing else: rates are by the clock.  A bench that fails does not keep the others from running.
"""

from __future__ import annotations

import argparse
import importlib.util
import shlex
import subprocess
import sys
from pathlib import Path


def commands(rooms: int, references: Path | None, samples: int, write: bool) -> list[list[str]]:
    """Return the modules to run with their arguments, quick ones first."""
    kept = ["--references", str(references)] if references else []
    written = ["--write"] if write else []
    found = [
        ["rate_curves_bench", "--clock", *written],
        ["camera_rate_bench", "--rooms", str(rooms), *kept, "--samples", str(samples), *written],
        ["cache_bench", *kept, *written],
        ["flicker_bench", *kept, *written],
    ]
    if importlib.util.find_spec("open3d") and importlib.util.find_spec("cv2"):
        found.append(["perception_bench", *kept, *written])
    return [*found, ["cached_picture", *kept, "--samples", str(samples)]] if write else found


def main() -> None:
    """Run them; end with status 1 if one failed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cached_measures")
    parser.add_argument("--rooms", type=int, default=2, help="of each type (default: %(default)s)")
    parser.add_argument(
        "--references", type=Path, metavar="DIR", help="path-traced pictures are kept here; without, no errors of all rooms"
    )
    parser.add_argument("--samples", type=int, default=1024, help="of the references of all rooms (default: %(default)s)")
    parser.add_argument("--write", action="store_true", help="put tables and pictures into docs")
    arguments = parser.parse_args()
    failed = []
    for name, *options in commands(arguments.rooms, arguments.references, arguments.samples, arguments.write):
        command = [sys.executable, "-m", f"benchmarks.{name}", *options]
        print(shlex.join(command), flush=True)
        if subprocess.run(command).returncode:
            failed.append(name)
    if failed:
        raise SystemExit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()

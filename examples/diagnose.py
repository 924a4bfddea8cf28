"""Run a worked example of docs/examples.md: rooms and their variants, two algorithms judged on them, and a report.

python examples/diagnose.py rgbd_odometry|stereo_matching|orb_odometry|stereo_study [FOLDER]

Prints the commands that it runs; FOLDER is runs/NAME unless it is given.
A second run makes only the variants that are missing, and judges all anew.
"""

import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

EXAMPLES = {
    "rgbd_odometry": ("rgbd_odometry.py", ("Hybrid", "Color"), "--task poses"),
    "stereo_matching": ("stereo_matching.py", ("SemiGlobal", "Block"), "--task depth --camera left"),
    "orb_odometry": ("orb_odometry.py", ("Orb", "Equalized"), "--task poses"),
    "stereo_study": ("stereo_matching.py", ("SemiGlobal",), "--task depth --camera left"),
}
"""Name of the sweep -> the Python file, its classes, the first of which is the one that is looked into, and what is judged."""
SCENE_SYNTH = (sys.executable, "-m", "scene_synth_ros")


def scene_synth(line):
    """Print and run a command; end with its status where it fails."""
    print(f"scene_synth {line}", flush=True)
    status = subprocess.run([*SCENE_SYNTH, *shlex.split(line)], check=False).returncode
    if status:
        sys.exit(status)


def diagnose(name, folder):
    """Make the bags, the evaluations and the report of an example in a folder."""
    module, algorithms, task = EXAMPLES[name]
    file, out = shlex.quote(os.path.relpath(Path(__file__).with_name(module))), shlex.quote(str(folder))
    scene_synth(f"sweep {name} --out {out} --workers 2")
    evaluations = [f"{out}/evaluation.json", *(f"{out}/evaluation_{other.lower()}.json" for other in algorithms[1:])]
    for algorithm, evaluation in zip(algorithms, evaluations, strict=True):
        estimates = f"{out}/estimates_{algorithm.lower()}"
        shutil.rmtree(folder / f"estimates_{algorithm.lower()}", ignore_errors=True)
        command = f"evaluate {out} {task} --algorithm {file}:{algorithm} --title {algorithm} --json {evaluation} --workers 2"
        scene_synth(f"{command} --estimates-out {estimates}" if "depth" in task else command)
    scene_synth(f"report {' '.join(evaluations)} --out {out}/report.html")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3) or sys.argv[1] not in EXAMPLES:
        sys.exit(f"expected one of {', '.join(EXAMPLES)} and perhaps a folder, got {' '.join(sys.argv[1:]) or 'nothing'}")
    diagnose(sys.argv[1], Path(sys.argv[2] if len(sys.argv) == 3 else f"runs/{sys.argv[1]}"))

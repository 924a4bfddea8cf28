"""The files of ``examples/scale``: they load, and the commands in them are taken by their own parser."""

import argparse
import os
import shlex
import subprocess
from pathlib import Path

import jinja2
import pytest
import yaml

from scene_synth_ros.cli.commands import generate_command
from scene_synth_ros.cli.commands.generate_command import Share, read_share
from scene_synth_ros.cli.parameters.run_profile import find_profile
from scene_synth_ros.shards.open_store import is_url

FOLDER = Path(__file__).parents[1] / "examples" / "scale"


def generate_words(words: list[str]) -> argparse.Namespace:
    """Return what ``generate`` reads of a command line."""
    assert words[:2] == ["scene_synth", "generate"]
    parser = argparse.ArgumentParser()
    generate_command.add_arguments(parser)
    arguments = parser.parse_args(words[2:])
    generate_command._check_options(arguments)
    find_profile(arguments.params)
    return arguments


def test_tasks_of_the_slurm_array_make_all_shares(tmp_path: Path) -> None:
    (tmp_path / "srun").write_text('#!/bin/sh\nprintf "%s\\n" "$@"\n')
    (tmp_path / "srun").chmod(0o755)
    script = FOLDER / "slurm_array.sh"
    (array,) = (line.split("=")[1] for line in script.read_text().splitlines() if line.startswith("#SBATCH --array="))
    first, last = map(int, array.split("-"))
    slurm = {"SLURM_ARRAY_TASK_ID": str(last), "SLURM_ARRAY_TASK_COUNT": str(last - first + 1), "SLURM_CPUS_PER_TASK": "8"}
    env = {**os.environ, **slurm, "PATH": f"{tmp_path}:{os.environ['PATH']}"}
    ran = subprocess.run(["bash", str(script), "/shared/rooms", "500"], env=env, capture_output=True, text=True, check=True)
    processors, *words = ran.stdout.splitlines()
    assert processors == "--cpus-per-task=8", "which srun does not take from the job"
    arguments = generate_words(words)
    assert (arguments.rooms, arguments.out, arguments.workers) == (500, "/shared/rooms", 8)
    assert (first, read_share(arguments.shard)) == (0, Share(last, last + 1))


def test_indices_of_the_kubernetes_job_make_all_shares() -> None:
    job = yaml.safe_load((FOLDER / "kubernetes_job.yaml").read_text())
    spec = job["spec"]
    (container,) = spec["template"]["spec"]["containers"]
    assert (job["apiVersion"], job["kind"], spec["completionMode"]) == ("batch/v1", "Job", "Indexed")
    assert spec["template"]["spec"]["restartPolicy"] == "Never"  # backoffLimitPerIndex asks for it
    assert "JOB_COMPLETION_INDEX" in {variable["name"] for variable in container["env"]}
    words = [word.replace("$(JOB_COMPLETION_INDEX)", "199") for word in container["args"]]
    arguments = generate_words(words)
    assert read_share(arguments.shard) == Share(199, spec["completions"])
    assert is_url(arguments.out)
    assert str(arguments.workers) == container["resources"]["requests"]["cpu"]


def test_tasks_of_the_osmo_workflow_make_all_shares() -> None:
    text = (FOLDER / "osmo_workflow.yaml").read_text()
    defaults = yaml.safe_load(text[text.index("default-values:") :])["default-values"]
    filled = jinja2.Environment(undefined=jinja2.StrictUndefined).from_string(text).render({**defaults, "shares": 3})
    workflow = yaml.safe_load(filled)["workflow"]
    assert set(workflow) == {"name", "resources", "tasks"}
    resources = workflow["resources"]["default"]
    assert resources == {"cpu": defaults["cpus"], "memory": defaults["memory"], "storage": "20Gi"}
    shares = []
    for task in workflow["tasks"]:
        assert set(task) == {"name", "image", "command", "args", "credentials", "exitActions"}
        arguments = generate_words(task["command"] + task["args"])
        assert (arguments.workers, arguments.rooms) == (defaults["cpus"], defaults["rooms"])
        shares.append(read_share(arguments.shard))
    assert shares == [Share(0, 3), Share(1, 3), Share(2, 3)]


@pytest.mark.parametrize("name", ["slurm_array.sh", "kubernetes_job.yaml", "osmo_workflow.yaml"])
def test_the_files_say_how_they_are_started(name: str) -> None:
    lines = [line.lstrip("# ") for line in (FOLDER / name).read_text().splitlines()]
    started = [shlex.split(line) for line in lines if line.split(" ")[0] in ("sbatch", "kubectl", "osmo")]
    assert any(f"examples/scale/{name}" in words for words in started)

"""Writes docs/schemas: a JSON Schema (draft 2020-12) for each document on a topic or in a file.  ``make docs`` runs it."""

import json
import sys
from pathlib import Path
from typing import Any, Literal, TypedDict

from evaluation.evaluation_file import EvaluationFile
from scene_description import SceneDescription
from scene_description.annotations import FrameAnnotations
from scene_description.json_schema import json_schema
from scene_description.labels import LabelDocument
from scene_synth_ros.bags.bag_manifest import TopicDigest
from scene_synth_ros.bags.dataset_files import PLAN_SCHEMA
from scene_synth_ros.messages.frame_settings import FrameSettings
from scene_synth_ros.shards.completion import Completion, Manifest
from scene_synth_ros.shards.plan import DatasetPlan
from scene_synth_ros.suite.status import NodeStatus

FOLDER = Path(__file__).resolve().parent / "schemas"


class BagManifest(TypedDict):
    """The manifest attached to the file of a bag: topic -> how many messages it has there, and their SHA-256."""

    schema: Literal["scene_synth/manifest/1"]
    topics: dict[str, TopicDigest]


class RunningEvaluation(TypedDict):
    """What the evaluator has found so far: the newest room, task -> its counts and metrics, and what was dropped."""

    room: dict[str, Any]
    tasks: dict[str, dict[str, Any]]
    dropped: Any


def schemas() -> dict[str, dict[str, Any]]:
    """Return name of a file in ``docs/schemas`` -> schema."""
    plan = {"schema": Literal[PLAN_SCHEMA], "shards": int}  # type: ignore[valid-type]
    return {
        "scene.json": json_schema(SceneDescription, "a room: topic scene, files of scene_synth sample"),
        "annotations.json": json_schema(FrameAnnotations, "what is told of the objects of a frame: topic <camera>/annotations"),
        "settings.json": json_schema(FrameSettings, "what a frame was rendered with: topic <renderer>/settings"),
        "status.json": json_schema(NodeStatus, "where a node of the run stands: topic status"),
        "labels.json": json_schema(LabelDocument, "what the ids of a layer mean: topics <camera>/<layer>/labels"),
        "evaluation.json": json_schema(EvaluationFile, "an evaluation: files of scene_synth evaluate"),
        "running_evaluation.json": json_schema(RunningEvaluation, "an evaluation as it grows: topic evaluation"),
        "dataset.json": json_schema(DatasetPlan, "the plan of a dataset: dataset.json", plan),
        "completion.json": json_schema(Completion, "a shard that is complete: shards/<number>.json"),
        "manifest.json": json_schema(Manifest, "the manifest of a dataset: manifest.json"),
        "bag_manifest.json": json_schema(BagManifest, "the manifest of a bag's file: attachment manifest.json"),
    }


def schema_text(schema: dict[str, Any]) -> str:
    """Return a schema as the file has it."""
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name, schema in schemas().items():
        (FOLDER / name).write_text(schema_text(schema), encoding="utf-8")
    sys.stdout.write(f"docs/schemas: {len(schemas())} schemas written\n")

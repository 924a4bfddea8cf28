"""The schemas in docs are those of the types, and what the program writes validates by them."""

import dataclasses
import importlib.util
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal, TypedDict

import pytest
from dataset_plans import tiny_plan
from jsonschema import Draft202012Validator, ValidationError
from rclpy.serialization import deserialize_message
from sample_scene import sample_scene
from std_msgs.msg import String

from evaluation.confidence import Interval
from evaluation.evaluation_file import Evaluation, FrameKey, FrameRow, MetricRow, SummaryRow, TaskRow, TruthRecord, evaluation_to_mapping
from scene_description import Limits, scene_to_json
from scene_description.json_schema import json_schema
from scene_description.label_standards import label_standard
from scene_description.labels import instance_labels, material_labels, occlusion_labels, part_labels, semantic_labels
from scene_description.light_labels import light_labels
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.messages.conversions import labels_to_msg
from scene_synth_ros.shards.completion import survey
from scene_synth_ros.shards.make_shard import make_shard
from scene_synth_ros.shards.run_shards import finish_dataset
from scene_synth_ros.shards.store import LocalStore
from scene_synth_ros.suite.status import NodeStatus, status_to_json

DOCS = Path(__file__).resolve().parents[2] / "docs"


def made_schemas() -> tuple[dict[str, dict[str, Any]], Callable[[dict[str, Any]], str]]:
    spec = importlib.util.spec_from_file_location("json_schemas", DOCS / "json_schemas.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # where its types look up what their annotations name
    spec.loader.exec_module(module)
    return module.schemas(), module.schema_text


def validate(name: str, document: object) -> None:
    schema = json.loads((DOCS / "schemas" / f"{name}.json").read_text(encoding="utf-8"))
    Draft202012Validator(schema).validate(document)


def test_the_schemas_are_up_to_date_and_good() -> None:
    made, text = made_schemas()
    assert {path.name for path in (DOCS / "schemas").iterdir()} == made.keys(), "run 'make docs'"
    for name, schema in made.items():
        assert (DOCS / "schemas" / name).read_text(encoding="utf-8") == text(schema), "run 'make docs'"
        Draft202012Validator.check_schema(schema)


class Row(TypedDict):
    """A row."""

    words: list[str]


def test_limits_and_unions_are_told() -> None:
    assert json_schema(Annotated[float | None, Limits(ge=0.0, unit="m", description="How far")], "far") == {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "far",
        "anyOf": [{"type": "number", "minimum": 0.0, "description": "How far [m]"}, {"type": "null"}],
        "description": "How far [m]",
    }
    schema = json_schema(dict[str, Row | Literal["none"]], "rows")
    assert schema["additionalProperties"] == {"anyOf": [{"$ref": "#/$defs/Row"}, {"enum": ["none"]}]}
    assert schema["$defs"]["Row"]["required"] == ["words"] and "additionalProperties" not in schema["$defs"]["Row"]


def test_a_scene_validates_and_what_its_reader_refuses_does_not() -> None:
    validate("scene", json.loads(scene_to_json(sample_scene())))
    for change in ({"extra": 1}, {"seed": -1}, {"camera_path": [{}]}, {"category": 7}, {"id": ""}):
        with pytest.raises(ValidationError):
            validate("scene", json.loads(scene_to_json(sample_scene())) | change)


def test_labels_of_every_layer_validate() -> None:
    scene = sample_scene()
    tables = [make(scene) for make in (instance_labels, part_labels, material_labels, light_labels)]
    for table in (*tables, semantic_labels(), occlusion_labels()):
        validate("labels", json.loads(labels_to_msg(table, 5).data))
    validate("labels", json.loads(labels_to_msg(label_standard("coco").semantic_labels(), 5, "coco").data))


def test_a_status_and_an_evaluation_validate() -> None:
    validate("status", json.loads(status_to_json(NodeStatus(node="/synth/a", role="renderer", state="ready", counts={"/synth/x": 3}))))
    key = FrameKey(bag="b", room=1, room_type="gym", seed=2**63, frame=0, stamp_ns=0, factors={"light": 2, "sun": True, "color": None})
    evaluation = Evaluation(
        title="",
        algorithm="a",
        created_with="c",
        tasks=(TaskRow(name="depth", metrics=(MetricRow(name="rmse", unit="m", better="lower"),)),),
        frames=(FrameRow(key=key, task="depth", metrics={"rmse": None}),),
        summary=(SummaryRow(task="depth", by="light", key=0.5, metrics={"rmse": Interval(value=None)}, rooms=1, frames=1),),
        missing={"frames": 1},
    )
    validate("evaluation", json.loads(json.dumps(evaluation_to_mapping(evaluation))))
    truth = TruthRecord(image_width=64, intrinsics=(1.0, 2.0, 3.0, 4.0), distortion=(0.0,), seed=2**63)
    validate("evaluation", json.loads(json.dumps(evaluation_to_mapping(dataclasses.replace(evaluation, truth=truth)))))


def test_all_that_a_dataset_holds_validates(tmp_path: Path) -> None:
    overrides = ("streams.annotations:=true", "streams.annotation_masks:=true", "streams.part:=true", "scan.enabled:=true", "scan.beams:=8")
    plan, store = tiny_plan(1, 1, *(f"renderer_node.{word}" for word in overrides)), LocalStore(tmp_path)
    validate("dataset", json.loads(plan.to_json()))
    make_shard(plan, 0, store)
    assert finish_dataset(plan, store, survey(plan, store)) is not None
    validate("completion", json.loads((tmp_path / "shards" / "00000.json").read_text()))
    validate("manifest", json.loads((tmp_path / "manifest.json").read_text()))
    kinds = {"scene": "scene", "annotations": "annotations", "settings": "settings", "labels": "labels"}
    validated = set()
    with BagReader(tmp_path / "shards" / "00000") as reader:
        for _, manifest in reader.manifests():
            validate("bag_manifest", json.loads(manifest))
        for message in reader.messages():
            kind = kinds.get(message.topic.rpartition("/")[2])
            if kind is not None and message.type_name == "std_msgs/msg/String":
                validate(kind, json.loads(deserialize_message(message.data, String).data))
                validated.add(kind)
    assert validated == set(kinds)

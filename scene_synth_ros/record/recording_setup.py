"""What the parameters of a recorder make of its recordings and bags; no node here."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.bags.run_info import JPEG_QUALITY, PARAMETERS_NAME, RECORD_NAME, NodeValues, parameters_file, run_record
from scene_synth_ros.record.bag_output import RecordingOptions
from scene_synth_ros.record.recorder_config import RecorderConfig, read_pairs
from scene_synth_ros.record.recording import Recording
from scene_synth_ros.suite.parameters import Parameters

Groups = Mapping[str, Any] | Parameters
"""Prefix -> dataclass, those of ``RECORDER_GROUPS``."""


def recording_options(values: Groups) -> RecordingOptions:
    """Return how bags are written beyond what their writer decides."""
    config: RecorderConfig = values[""]
    return RecordingOptions(
        split=values["split"],
        compression=values["images"],
        snapshot_s=config.snapshot_s,
        snapshot_bytes=round(config.snapshot_mb * 1e6),
        incidental=frozenset() if config.topics or config.extra_topics else frozenset({"/diagnostics"}),
        frame_prefix=config.frame_prefix,
    )


def make_writer(values: Groups, folder: Path) -> BagWriter:
    """Open a bag.

    Raises:
        ParameterError: a note of ``custom_data`` is not KEY=VALUE.
        BagWriteError: the bag cannot be begun.
    """
    config: RecorderConfig = values[""]
    return BagWriter(
        folder,
        metadata_version=config.metadata_version,
        compression=config.compression,
        compression_level=config.compression_level,
        chunk_size=config.chunk_size,
        custom_data=read_pairs(config.custom_data),
    )


def describe_run(recording: Recording, values: Groups, nodes: NodeValues, *, machine: bool = True) -> None:
    """Keep with the bags of a recording what made them: versions, seed, the parameters of all nodes; the ``machine``, too, if asked."""
    record = run_record(nodes, machine=machine) | {JPEG_QUALITY: str(values["images"].jpeg_quality)}
    recording.describe_run(RECORD_NAME, record, PARAMETERS_NAME, parameters_file(nodes))

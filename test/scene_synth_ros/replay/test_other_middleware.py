"""A subscriber of another DDS implementation, Cyclone DDS, gets every image of a replay."""

import os
import sys

import pytest
from bag_samples import write_bag
from scene_synth_ros_suite import Child, claim_domain, stop

pytest.importorskip("cyclonedds")

LISTENER = """
import os, sys, time
from dataclasses import dataclass
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import int32, sequence, uint8, uint32
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32

@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str

@dataclass
class Image(IdlStruct, typename="sensor_msgs::msg::dds_::Image_"):
    header: Header
    height: uint32
    width: uint32
    encoding: str
    is_bigendian: uint8
    step: uint32
    data: sequence[uint8]

frames = int(sys.argv[1])
participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
qos = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepAll)
names = ("color", "depth")
readers = {name: DataReader(participant, Topic(participant, f"rt/synth/camera/{name}/image_raw", Image), qos=qos) for name in names}
stamps = {name: [] for name in names}
print("listening", flush=True)
end = time.monotonic() + 40
while time.monotonic() < end and any(len(known) < frames for known in stamps.values()):
    for name, reader in readers.items():
        images = [sample for sample in reader.take(N=20) if isinstance(sample, Image)]  # others say that the publisher has left
        stamps[name] += [image.header.stamp.sec * 10**9 + image.header.stamp.nanosec for image in images]
    time.sleep(0.002)
for name in names:
    print(name, *stamps[name])
"""


def test_cyclone_dds_gets_every_image_from_the_first_to_the_last(tmp_path):
    frames = 30
    written = write_bag(tmp_path / "bag", frames=frames, size=300)
    environment = {**os.environ, "ROS_DOMAIN_ID": str(claim_domain())}
    listener = Child([sys.executable, "-c", LISTENER, str(frames)], env=environment)
    topics = "topics:=['/synth/camera/color/image_raw', '/synth/camera/depth/image_raw']"  # it begins when both have a subscriber
    words = ["-p", f"bag:={tmp_path / 'bag'}", "-p", "rate:=10.0", "-p", topics, "-p", "wait_for_subscribers_s:=30.0"]
    player = Child([sys.executable, "-m", "scene_synth_ros.replay.replay_node", "--ros-args", *words], env=environment)
    try:
        output, errors = listener.communicate(timeout=180)
        player.communicate(timeout=180)
    finally:
        stop(listener)
        stop(player)
    assert listener.returncode == 0 and player.returncode == 0, errors
    received = dict(line.split(" ", 1) for line in output.splitlines() if " " in line)
    for name in ("color", "depth"):
        sent = [stamp_ns for topic, stamp_ns, _ in written if topic == f"/synth/camera/{name}/image_raw"]
        assert [int(word) for word in received[name].split()] == sent

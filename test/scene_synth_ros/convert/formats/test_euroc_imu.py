"""An inertial measurement unit in EuRoC's form: the numbers of its topics, and places that agree with the camera's."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from imu_frame import CONFIG, SCENE, frame_of

from renderer.body.imu import device_kinematics, read_imu
from renderer.scene.scene_key import scene_key
from scene_description.motion_of_poses import motion_of
from scene_description.poses import world_from_optical
from scene_synth_ros.convert.formats.euroc_imu import room_imu, stamp_name, states_of, write_imu
from scene_synth_ros.convert.writer import ConvertError


def test_readings_are_those_of_the_topic_by_the_devices_clock(tmp_path: Path) -> None:
    imu = room_imu(frame_of(0))
    write_imu(tmp_path / "imu0", imu, "sensor_type: imu\n")
    lines = (tmp_path / "imu0" / "data.csv").read_text().splitlines()
    assert lines[0].startswith("#timestamp [ns],w_RS_S_x [rad s^-1]") and {len(line.split(",")[0]) for line in lines[1:]} == {19}
    start, end = SCENE.camera_path[0].stamp_ns, SCENE.camera_path[-1].stamp_ns
    read = read_imu(motion_of(SCENE), CONFIG, start, end, scene_key(SCENE))
    rows = [line.split(",") for line in lines[1:]]
    assert [int(row[0]) for row in rows] == (read.stamps_ns + 2_000_000).tolist()
    numbers = np.array(rows)[:, 1:].astype(float)
    np.testing.assert_array_equal(numbers, np.hstack([read.rate_rad_s, read.force_m_s2]))
    sensor = yaml.safe_load((tmp_path / "imu0" / "sensor.yaml").read_text())
    assert sensor["rate_hz"] == 200.0 and sensor["gyroscope_noise_density"] == 1.7e-4 and sensor["accelerometer_random_walk"] == 3e-4
    assert "for estimators: 0.0017\n" in (tmp_path / "imu0" / "sensor.yaml").read_text()


def test_the_camera_is_fixed_to_the_device_and_states_lead_to_the_poses() -> None:
    imu = room_imu(frame_of(0))
    mounted = imu.from_camera(frame_of(0))
    for number in range(len(SCENE.camera_path)):
        np.testing.assert_allclose(imu.from_camera(frame_of(number)), mounted, atol=1e-7)
    stamp, state = states_of(imu)[0]
    w, x, y, z = state[3:7]
    body = world_from_optical(tuple(state[:3]), (x, y, z, w))
    np.testing.assert_allclose(body @ mounted, frame_of(0).matrix, atol=1e-9)
    assert stamp == SCENE.camera_path[0].stamp_ns
    speed = device_kinematics(motion_of(SCENE), CONFIG, np.zeros(1)).velocity_m_s[0]
    np.testing.assert_array_equal(state[7:10], speed)


def test_true_biases_are_told() -> None:
    quiet = replace(CONFIG, gyro_noise_rad_s=0.0, accel_noise_m_s2=0.0, scale_error=0.0, misalignment_rad=0.0)
    imu = room_imu(frame_of(0, quiet))
    np.testing.assert_allclose(imu.readings.rate_rad_s - imu.readings.true_rate_rad_s, imu.gyro_bias, atol=1e-15)
    np.testing.assert_allclose(imu.readings.force_m_s2 - imu.readings.true_force_m_s2, imu.accel_bias, atol=1e-14)


def test_a_room_without_a_device_has_none_and_names_sort_by_time() -> None:
    assert room_imu(SimpleNamespace(settings={"camera": {}}, has_scene=True)) is None
    names = [stamp_name(stamp) for stamp in (5, 10**9, 1_795_000_000_000_000_000)]
    assert names == sorted(names) and {len(name) for name in names} == {19}
    assert names[0] == "0000000000000000005"


def test_a_base_that_was_driven_is_refused_as_its_room_does_not_tell_its_motion() -> None:
    frame = SimpleNamespace(settings={"imu": {"enabled": True}, "drive": {"first": 0}}, has_scene=True, scene=SCENE)
    with pytest.raises(
        ConvertError, match=r"expected a robot on its planned path, got one that was driven; take its readings from imu/data"
    ):
        room_imu(frame)

"""What GTSAM and AllanTools say of the device's readings; both are in the extra ``bench-inertial``, and no job of these tests has them.

GTSAM's preintegration takes rates as constant between samples, so it errs in proportion to the interval.
"""

import time
from dataclasses import replace

import numpy as np
import pytest
from handheld_path import CLEAN, handheld

from renderer.body.imu import ImuErrors, device_kinematics, specific_force

SECONDS = 60


def error_m(seed: int, rate_hz: int, at: float) -> float:
    """How far off the place is after a minute, of samples at a share of their interval."""
    gtsam = pytest.importorskip("gtsam")
    motion = handheld(float(SECONDS), seed)
    seen = device_kinematics(motion, CLEAN, (np.arange(SECONDS * rate_hz) + at) / rate_hz)
    ends = device_kinematics(motion, CLEAN, np.array([0.0, SECONDS]))
    none = gtsam.imuBias.ConstantBias()
    summed = gtsam.PreintegratedImuMeasurements(gtsam.PreintegrationParams.MakeSharedU(9.80665), none)
    for force, rate in zip(specific_force(seen), seen.rate_rad_s, strict=True):
        summed.integrateMeasurement(force, rate, 1.0 / rate_hz)
    x, y, z, w = ends.quaternion[0]
    begin = gtsam.NavState(gtsam.Rot3.Quaternion(w, x, y, z), ends.position_m[0], ends.velocity_m_s[0])
    return float(np.linalg.norm(summed.predict(begin, none).position() - ends.position_m[1]))


def test_gtsam_errs_in_proportion_to_the_interval() -> None:
    seed = int(time.time())
    errors = {rate: error_m(seed, rate, 0.5) for rate in (200, 400, 1000)}
    assert errors[400] == pytest.approx(errors[200] / 2, rel=0.15), (seed, errors)
    assert errors[1000] == pytest.approx(errors[200] / 5, rel=0.25), (seed, errors)
    assert error_m(seed, 200, 0.0) > 2.0 * errors[200], (seed, errors)  # half an interval late


def test_the_allan_deviation_by_allantools_is_that_of_the_parameters() -> None:
    allantools = pytest.importorskip("allantools")
    seed, rate, noise, walk = int(time.time()), 10.0, 2e-3, 1e-5
    config = replace(CLEAN, rate_hz=rate, gyro_noise_rad_s=noise, gyro_walk_rad_s2=walk)
    true, taus = np.zeros((round(10_800 * rate), 3)), np.array([0.1, 1.0, 10.0, 100.0])
    axes = np.hstack([ImuErrors(config, seed + number).gyroscope(true) for number in range(16)]).T  # one errs by 5 % at 100 s
    found = np.mean([allantools.oadev(axis, rate=rate, data_type="freq", taus=taus)[1] ** 2 for axis in axes], axis=0)
    np.testing.assert_allclose(np.sqrt(found), np.sqrt(noise**2 / taus + walk**2 * taus / 3), rtol=0.05, err_msg=str(seed))

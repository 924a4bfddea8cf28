"""A minute in the hand, as a curve of its own, and a device that errs in nothing."""

import numpy as np
from scipy.spatial.transform import Rotation

from renderer.body.config import ImuConfig
from scene_description.motion import Harmonic, Motion

CLEAN = ImuConfig(
    gyro_noise_rad_s=0, gyro_walk_rad_s2=0, gyro_bias_rad_s=0, accel_noise_m_s2=0, accel_walk_m_s3=0, accel_bias_m_s2=0, scale_error=0,
    misalignment_rad=0,
)  # fmt: skip


def handheld(seconds: float, seed: int) -> Motion:
    """Sway below 1.6 Hz in curves with knots every tenth of a second, and a tremor at 8 Hz."""
    rng = np.random.default_rng(seed)
    times = (np.arange(round(10 * seconds) + 5) - 2.0) * 0.1
    hertz, phase = rng.uniform(0.2, 1.6, (6, 6, 1)), rng.uniform(0, 2 * np.pi, (6, 6, 1))
    waves = np.sin(2 * np.pi * hertz * times + phase).sum(axis=0)
    places = np.stack([0.3 * np.sin(0.1 * times), 0.2 * times, 1.5 + 0 * times], axis=1) + 0.012 * waves[:3].T
    turns = Rotation.from_euler("xyz", 0.03 * waves[3:].T + np.stack([0 * times, 0 * times, 0.4 * np.sin(0.3 * times)], axis=1)).as_quat()
    turns *= np.sign((turns * turns[:1]).sum(axis=1))[:, None]
    tremor = Harmonic(
        frequency_hz=8.0, shift_m=(1e-4,) * 3, shift_phase_rad=(0.0, 1.0, 2.0), turn=(5e-4,) * 3, turn_phase_rad=(0.0, 2.0, 1.0)
    )
    return Motion(
        kind="handheld",
        spacing_s=0.1,
        positions_m=tuple(map(tuple, places.tolist())),
        turns=tuple(map(tuple, turns.tolist())),
        tremor=(tremor,),
        tremor_from_s=2.0,
    )

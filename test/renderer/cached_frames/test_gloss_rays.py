"""Which rays of their lobes pixels share."""

import numpy as np
import pytest

from renderer.cached_frames.gloss_rays import pixel_noise
from renderer.core.kernel import from_python


def sends_ray(where, x, y):
    return {"metal": (x + y) % 2 == 0, "gloss": (x | y) % 2 == 0, "post": ((x + y) % 2 == 0) & (x // 2 == 12)}[where]


@pytest.mark.parametrize(("where", "error"), [("metal", 0.2), ("gloss", 0.3), ("post", 0.8)])
def test_the_rays_that_pixels_share_find_what_fills_a_tenth_of_their_lobe(where, error):
    """By a tent over 15 x 15 pixels, of which a half or a quarter send rays, or a half of an upright post two pixels wide; rms."""
    (y, x), noise_of = np.mgrid[:64, :64], from_python(pixel_noise)
    noise = [noise_of(int(u), int(v), np.uint32(23)) for u, v in zip(x.ravel(), y.ravel(), strict=True)]
    u, v = np.array(noise, np.float64).reshape(64, 64, 2).transpose(2, 0, 1)
    tent, errors = 8.0 - np.abs(np.arange(-7, 8)), []
    weights = sends_ray(where, x, y).astype(float)
    for middle in np.random.default_rng(3).random((24, 2)):
        away = [np.minimum(np.abs(a - m), 1 - np.abs(a - m)) for a, m in zip((u, v), middle, strict=True)]
        found = weights * (away[0] ** 2 + away[1] ** 2 < 0.1 / np.pi)
        sums = [np.array([np.convolve(line, tent, "same") for line in image]) for image in (found, weights)]
        sums = [np.array([np.convolve(line, tent, "same") for line in image.T]).T[8:-8, 24:26] for image in sums]
        errors.append(sums[0] / sums[1] / 0.1 - 1.0)
    assert 0.01 < np.sqrt(np.mean(np.square(errors))) < error

"""The denoiser: noise falls, edges of the guides stay, bytes do not depend on threads, and one line where it is missing."""

import numpy as np
import pytest
from box_room import VIEW, furnished_room

from renderer import CameraConfig, RenderConfig, Renderer, RenderError
from renderer.film import denoise

CAMERA = CameraConfig(width=96, height=72)


def render(choice, samples=4, threads=2):
    with Renderer(furnished_room(), CAMERA, RenderConfig(samples_per_pixel=samples, threads=threads, denoise=choice), 5) as renderer:
        return renderer.render(VIEW, 0, ("color", "color_noisy"))


def test_noise_falls_and_the_edge_of_the_albedo_stays():
    pytest.importorskip("pyoidn")
    rng = np.random.default_rng(2)
    albedo = np.full((64, 96, 3), 0.2, np.float32)
    albedo[:, 48:] = 0.8
    normals = np.zeros_like(albedo)
    normals[..., 2] = 1.0
    clean = 300.0 * albedo
    noisy = (clean * rng.gamma(4.0, 0.25, clean.shape)).astype(np.float32)
    cleaner = denoise.Denoiser(2)
    result = cleaner.clean(noisy, albedo, normals)
    cleaner.close()
    cleaner.close()
    assert result.dtype == np.float32 and result.shape == clean.shape
    assert np.sqrt(((result - clean) ** 2).mean()) < 0.2 * np.sqrt(((noisy - clean) ** 2).mean())
    assert result[:, 47].mean() < 100.0 < 200.0 < result[:, 48].mean()


def test_fine_texture_of_the_albedo_is_kept():
    """A weave of one pixel that noise of a quarter drowns comes back from the albedo, which is noisy itself."""
    pytest.importorskip("pyoidn")
    rng = np.random.default_rng(2)
    weave = np.where(np.indices((96, 128)).sum(axis=0) % 2, 0.55, 0.45)[..., None].repeat(3, axis=2).astype(np.float32)
    normals = np.zeros_like(weave)
    normals[..., 2] = 1.0
    noisy = (300.0 * weave * rng.gamma(16.0, 1 / 16, weave.shape[:2])[..., None]).astype(np.float32)
    cleaner = denoise.Denoiser(2)
    result = cleaner.clean(noisy, weave + rng.normal(0.0, 0.005, weave.shape).astype(np.float32), normals)
    cleaner.close()
    shown = np.corrcoef(result[..., 1].ravel(), weave[..., 1].ravel())[0, 1]
    assert shown > 0.75 and result.std() > 0.5 * (300.0 * weave).std()


def test_denoised_colour_is_nearer_to_many_samples_and_the_noisy_one_is_kept():
    pytest.importorskip("pyoidn")
    plain, denoised, reference = render("none"), render("oidn"), render("none", 512).radiance
    assert np.array_equal(denoised.layers["color_noisy"], plain.layers["color"])
    errors = [np.abs(frame.radiance - reference).mean() for frame in (denoised, plain)]
    assert errors[0] < 0.5 * errors[1]


def test_images_of_any_size_follow_each_other():
    pytest.importorskip("pyoidn")
    rng = np.random.default_rng(4)
    images = [rng.random((3, *size, 3), np.float32) for size in ((40, 60), (40, 60), (33, 20), (40, 60))]
    alone = []
    for image in images:
        fresh = denoise.Denoiser(2)
        alone.append(fresh.clean(*image))
        fresh.close()
    cleaner = denoise.Denoiser(2)
    together = [cleaner.clean(*image) for image in images]
    cleaner.close()
    assert all(np.array_equal(one, other) for one, other in zip(alone, together, strict=True))
    assert not np.array_equal(together[0], together[1])


def test_threads_change_no_byte():
    pytest.importorskip("pyoidn")
    assert render("oidn", threads=1).radiance.tobytes() == render("oidn", threads=2).radiance.tobytes()


def test_without_the_library_auto_keeps_the_noise_and_oidn_says_what_to_install(monkeypatch):
    monkeypatch.setattr(denoise, "is_installed", lambda: False)
    frame = render("auto")
    assert np.array_equal(frame.layers["color"], frame.layers["color_noisy"])
    with pytest.raises(RenderError, match=r"scene_synth_ros\[denoise\]"):
        render("oidn")

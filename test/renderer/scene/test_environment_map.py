"""Environment maps: both codings read back, faults refused or clamped, nothing outside the folder, energy kept by the split."""

import math
from pathlib import Path

import numpy as np
import pytest
from sample_scene import sample_scene

from renderer.core.errors import FlattenError, MeshFileError
from renderer.core.kernel import from_python
from renderer.files.exr_files import is_installed, write_exr
from renderer.path import infinite_light
from renderer.scene.environment_map import clean_map, load_environment_map, read_rgbe, split_map
from renderer.scene.sky import build_sky
from scene_description import Environment, EnvironmentMap

sky_le = from_python(infinite_light.sky_le)

NEEDS_EXR = pytest.mark.skipif(not is_installed(), reason="the extra exr is not installed")


def encode(image):
    """RGBE codes of an image: mantissas against the power of two above the largest channel."""
    largest = image.max(axis=2)
    exponent = np.where(largest > 0, np.floor(np.log2(np.maximum(largest, 1e-38))) + 1, -128).astype(int)
    codes = np.zeros((*image.shape[:2], 4), np.uint8)
    codes[..., :3] = np.minimum(image / np.ldexp(1.0, exponent - 8)[..., None], 255)
    codes[..., 3] = np.where(largest > 0, exponent + 128, 0)
    return codes


def write_hdr(path: Path, image, packed: bool, header: str = "FORMAT=32-bit_rle_rgbe\n"):
    codes = encode(image)
    height, width = codes.shape[:2]
    body = bytearray()
    for row in codes:
        if not packed:
            body += row.tobytes()
            continue
        body += bytes([2, 2, width >> 8, width & 255])
        for channel in range(4):
            line = row[:, channel]
            at = 0
            while at < width:
                run = 1
                while at + run < width and run < 127 and line[at + run] == line[at]:
                    run += 1
                if run > 2:
                    body += bytes([128 + run, line[at]])
                else:
                    run = min(2, width - at)
                    body += bytes([run, *line[at : at + run]])
                at += run
    path.write_bytes(b"#?RADIANCE\n" + header.encode() + b"\n" + f"-Y {height} +X {width}\n".encode() + bytes(body))


def picture(seed=0, height=16, width=32):
    rng = np.random.default_rng(seed)
    image = np.exp(rng.normal(0, 2, (height, width, 3))).astype(np.float32)
    image[:4, :20] = image[0, 0]  # long runs
    image[5, 5] = 0.0
    return image


@pytest.mark.parametrize("packed", [False, True])
def test_rgbe_reads_back_to_eight_bits(tmp_path, packed):
    image = picture()
    write_hdr(tmp_path / "a.hdr", image, packed)
    error = np.abs(read_rgbe(tmp_path / "a.hdr") - image).max(axis=2)
    assert (error <= image.max(axis=2) / 128).all() and error.max() > 0
    assert (read_rgbe(tmp_path / "a.hdr")[5, 5] == 0).all()


def test_an_exposure_that_was_applied_is_taken_off(tmp_path):
    write_hdr(tmp_path / "a.hdr", picture(), True)
    write_hdr(tmp_path / "b.hdr", picture(), True, "EXPOSURE=4.0\nFORMAT=32-bit_rle_rgbe\n")
    assert read_rgbe(tmp_path / "b.hdr") == pytest.approx(read_rgbe(tmp_path / "a.hdr") / 4.0)


@NEEDS_EXR
def test_exr_reads_back(tmp_path):
    image = picture()
    write_exr(tmp_path / "a.exr", dict(zip("RGB", np.moveaxis(image, 2, 0), strict=True)))
    images = load_environment_map(EnvironmentMap(file="a.exr", luminance_scale=2.0), tmp_path)
    total = images.table + (images.bright if images.bright.size else 0)
    assert total == pytest.approx(2.0 * image, rel=1e-5)


def test_the_split_adds_up_and_smooth_maps_have_no_hot_part():
    image = picture()
    image[3, 25] = 9000.0
    table, bright = split_map(image)
    assert table + bright == pytest.approx(image, rel=1e-5)
    assert bright[3, 25].min() > 0.9 * 9000 and table.max() < 5 * 9000 / 512 * 4
    assert split_map(np.full((8, 16, 3), 3.0, np.float32)).bright.size == 0


def test_turning_by_a_quarter_moves_the_middle_to_the_left(tmp_path):
    image = np.full((16, 32, 3), 0.5, np.float32)
    image[8, 16] = 1.0  # just below the horizon, towards +x
    write_hdr(tmp_path / "a.hdr", image, True)
    environment = sample_scene().environment
    for yaw in (0.0, math.pi / 2, math.pi):
        sky = build_sky(Environment(**plain(environment), map=EnvironmentMap(file="a.hdr", yaw_rad=yaw, luminance_scale=100.0)), tmp_path)
        at = yaw - math.pi / 32
        here = sky_le(sky, np.float32(math.cos(at)), np.float32(math.sin(at)), np.float32(-0.098))
        assert here[0] > 95.0


def plain(environment):
    return {"zenith": environment.zenith, "horizon": environment.horizon, "ground": environment.ground}


def test_faulty_numbers_are_clamped_with_a_warning():
    image = picture(height=64, width=128)
    image[1, 2, 0], image[3, 4], image[5, 6, 1] = np.nan, np.inf, -4.0
    with pytest.warns(RuntimeWarning, match="3 pixels are negative, infinite or no number; clamped"):
        cleaned = clean_map(image, "map.exr")
    assert np.isfinite(cleaned).all() and cleaned.min() >= 0.0
    assert cleaned[3, 4] == pytest.approx(np.nanmax(image[np.isfinite(image)]))


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (np.full((8, 16, 3), np.nan, np.float32), "expected finite luminance, got 100.0% of the pixels"),
        (np.zeros((8, 16, 3), np.float32), "expected a map that shines somewhere"),
    ],
)
def test_absurd_maps_are_refused(image, message):
    with pytest.raises(MeshFileError, match=message):
        clean_map(image, "map.hdr")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"P6\n", "expected a Radiance picture, got another format"),
        (b"#?RADIANCE\n\n-Y 99999 +X 199998\n", "expected at most 8192 x 4096 pixels, got 199998 x 99999"),
        (b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 2 +X 4\n", "expected FORMAT=32-bit_rle_rgbe"),
        (b"#?RADIANCE\n\n-Y 16 +X 32\n" + b"\x02\x02\x00\x20\x7f", "expected 16 lines of 32 pixels, got data that is cut short"),
        (b"#?RADIANCE\n\n-Y 16 +X 32\n" + b"\x02\x02\x00\x20\xff\x01\xff\x01", "cut short or broken"),
        (b"#?RADIANCE\nEXPOSURE=0\n\n-Y 2 +X 4\n", "expected an exposure above 0"),
        (b"#?RADIANCE\nEXPOSURE=much\n\n-Y 2 +X 4\n", "expected a number for EXPOSURE"),
        (b"#?RADIANCE\n\n" + b"x\n" * 2000, "expected a header that ends in"),
    ],
)
def test_broken_pictures_are_refused_in_one_line(tmp_path, content, message):
    (tmp_path / "a.hdr").write_bytes(content)
    with pytest.raises(MeshFileError, match=message) as refused:
        load_environment_map(EnvironmentMap(file="a.hdr"), tmp_path)
    assert "\n" not in str(refused.value)


def test_maps_lie_in_the_folder_and_have_its_form(tmp_path):
    folder = tmp_path / "catalog"
    folder.mkdir()
    write_hdr(tmp_path / "secret.hdr", picture(), True)
    (folder / "link.hdr").symlink_to(tmp_path / "secret.hdr")
    (folder / "a.txt").write_text("no map")
    write_hdr(folder / "square.hdr", picture(width=16), False)
    for file, message in (
        ("../secret.hdr", "expected a path inside the catalogue"),
        ("link.hdr", "expected a path inside the catalogue"),
        ("missing.hdr", "found none"),
        ("a.txt", "expected a file .hdr or .exr"),
        ("square.hdr", "twice as wide as high, got 16 x 16"),
    ):
        with pytest.raises(MeshFileError, match=message):
            load_environment_map(EnvironmentMap(file=file), folder)
    environment = sample_scene().environment
    with pytest.raises(FlattenError, match="environment: expected a catalogue folder"):
        build_sky(Environment(**plain(environment), map=EnvironmentMap(file="a.hdr")))

"""COLMAP's models, read by pycolmap."""

import dataclasses

import cv2
import numpy as np
import pycolmap
import pytest
from convert_bag import BROWN, BROWN_K3, FISHEYE, PANORAMA, PINHOLE, RATIONAL, convert_bag, export

from renderer.camera.cameras import project
from scene_synth_ros.convert.writer import ConvertError


@pytest.mark.parametrize(
    ("camera", "model"),
    [(PINHOLE, "PINHOLE"), (BROWN, "OPENCV"), (BROWN_K3, "FULL_OPENCV"), (RATIONAL, "FULL_OPENCV"), (FISHEYE, "OPENCV_FISHEYE")],
)
def test_points_fall_on_their_pixels(tmp_path, camera, model):
    bag = convert_bag(rooms=1, camera=camera)
    assert export(bag, "colmap", tmp_path / "out") == ()
    found = pycolmap.Reconstruction(tmp_path / "out/room_0000/sparse/0")
    assert [item.model.name for item in found.cameras.values()] == [model] and found.num_images() == 3
    for truth, image in zip(bag.frames["camera"], (found.images[number] for number in (1, 2, 3)), strict=True):
        pixels, points = truth.points()
        ahead = project(camera, truth.pose, points)[:, 2] > 0.05
        told = np.array([image.project_point(point) for point in points[ahead]])
        assert ahead.sum() > 50 and np.abs(told - 0.5 - pixels[ahead]).max() < 0.01
        picture = cv2.imread(str(tmp_path / "out/room_0000/images" / image.name))
        np.testing.assert_array_equal(picture[..., ::-1], truth.layers["color"])


def test_points_have_tracks_of_the_frames_that_see_them(tmp_path):
    bag = convert_bag(left=PINHOLE, right=dataclasses.replace(BROWN, mount_m=(0.12, 0.0, 0.0)))
    export(bag, "colmap", tmp_path / "out")
    for room in (0, 1):
        found = pycolmap.Reconstruction(tmp_path / f"out/room_{room:04d}/sparse/0")
        assert found.num_cameras() == 2 and found.num_images() == 6 and found.compute_mean_track_length() > 2.5
        names = {image.name for image in found.images.values()}
        assert names == {f"{camera}/{number:06d}.png" for camera in ("left", "right") for number in range(3)}
        truths = {
            image: truth
            for image, truth in zip(
                sorted(names), [it for name in ("left", "right") for it in bag.frames[name] if it.room == room], strict=True
            )
        }
        for point in found.points3D.values():
            for element in point.track.elements:
                image = found.images[element.image_id]
                place = image.points2D[element.point2D_idx].xy
                assert np.abs(image.project_point(point.xyz) - place).max() < 1e-6
                truth = truths[image.name]
                column, row = np.rint(place - 0.5).astype(int)
                z = project(truth.config, truth.pose, point.xyz[None])[0, 2]
                assert truth.layers["depth"][row, column] == pytest.approx(z, abs=0.005 + 0.0051 * z)


def test_a_panorama_is_refused(tmp_path):
    bag = convert_bag(rooms=1, frames=1, layers=(), camera=PANORAMA)
    with pytest.raises(ConvertError, match=r"colmap needs depth or depth_sensed, which is not recorded; .*streams.depth:=true$"):
        export(bag, "colmap", tmp_path / "out")

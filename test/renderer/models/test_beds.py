"""Beds: what hangs down covers the rails, and things lie on covers at the height that the categories say."""

import numpy as np
import pytest
from model_sizes import random_cases

from grammar.spec.categories import read_categories
from renderer.models import build_model
from renderer.models.beds import BEDSTEADS, build_bed
from scene_description.share import config_path


@pytest.mark.parametrize("style", [style for style in BEDSTEADS if style != "platform"])  # a platform is wider than what lies on it
@pytest.mark.parametrize("size_m", [(2.1, 1.0, 0.95), (2.2, 1.8, 1.2)])
def test_rails_lie_behind_the_mattress_over_whose_edge_the_duvet_hangs(style: str, size_m: tuple[float, float, float]) -> None:
    bed = build_bed(np.random.default_rng(5), size_m, style)
    mattress, duvet = (bed[part].vertices for part in ("mattress", "duvet"))
    triangles = bed["frame"].vertices[bed["frame"].faces]
    spanning = triangles[np.ptp(triangles[..., 0], axis=1) > 0.5 * size_m[0]]  # of rails, not of the boards at both ends
    edge = np.abs(mattress[:, 1]).max()
    assert 0.002 < edge - np.abs(spanning[..., 1]).max() < 0.03
    assert np.abs(duvet[:, 1]).max() > edge


def test_things_lie_on_the_crests_of_covers() -> None:
    """Crests that reached 31 mm above where things lie pushed clothes and folded blankets off in MuJoCo."""
    (rest,) = read_categories(config_path("categories.yaml"))["bed"].rests
    for style, seed, size in random_cases("bed", tuple(BEDSTEADS), 12):
        bed = build_model("bed", style, seed, size)
        points = np.concatenate([bed[part].vertices for part in ("duvet", "throw")])
        ways = (points[:, axis] / size[axis] + 0.5 for axis in (0, 1))
        over = np.logical_and.reduce([(low < way) & (way < high) for (low, high), way in zip((rest.depth, rest.width), ways, strict=True)])
        above = points[over, 2].max() - (rest.height * size[2] + rest.height_m)
        assert -0.006 < above < 0.009, f"{style} {size}: covers reach {1e3 * above:.0f} mm above what lies on them"

"""Beds: what hangs down covers the rails."""

import numpy as np
import pytest

from renderer.models.beds import BEDSTEADS, build_bed


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

"""Sizes of rooms from a mixture whose components hold furniture by the share of the floor that it covers."""

import numpy as np
import pytest

from grammar.derivation.parse_tree import RejectedError
from grammar.derivation.shell import ROOM_SIZE, draw_room_size, may_be_bare
from grammar.spec.room_rules import RoomSize

SIZES = (
    RoomSize(probability=0.75, mean_m=(3.0, 2.0), sd_m=(1e-6, 1e-6), floor_share=0.5, share_sd=0.05),
    RoomSize(probability=0.25, mean_m=(4.0, 3.0), sd_m=(1e-6, 1e-6), floor_share=0.25, share_sd=0.05),
)


def drawn(covered_m2: float, count: int) -> list[tuple[float, list[float], int]]:
    rng, found = np.random.default_rng(1), []
    for _ in range(count):
        try:
            area, sides, (attribute,), arm = draw_room_size(SIZES, covered_m2, rng)
        except RejectedError:
            continue
        assert (attribute.name, arm) == (ROOM_SIZE, None)
        found.append((area, sides, int(attribute.value.split(",")[0])))
    return found


def test_components_keep_their_odds_where_the_furniture_fits_both() -> None:
    # 3 m2 are half of 6 m2 and a quarter of 12 m2, so nothing is rejected; four standard errors of 2000 draws.
    found = drawn(3.0, 2000)
    assert len(found) == 2000
    assert np.mean([number == 0 for _, _, number in found]) == pytest.approx(0.75, abs=4.0 * 0.0097)
    assert {round(area, 3) for area, _, _ in found} == {6.0, 12.0}
    assert np.mean([sides[0] > sides[1] for _, sides, _ in found]) == pytest.approx(0.5, abs=4.0 * 0.0112)


def test_furniture_of_another_share_is_rejected() -> None:
    # 3.6 m2 are 0.6 of the small room, two deviations too much: exp(-2) of a share of 0.75; and 0.3 of the large one: exp(-1/2) of 0.25.
    found = drawn(3.6, 4000)
    assert np.mean([number == 0 for _, _, number in found]) == pytest.approx(
        0.75 * np.exp(-2.0) / (0.75 * np.exp(-2.0) + 0.25 * np.exp(-0.5)), abs=0.06
    )
    assert len(found) / 4000 == pytest.approx(0.75 * np.exp(-2.0) + 0.25 * np.exp(-0.5), abs=0.03)


def test_halls_of_arms_have_the_area_of_their_arms():
    hall = RoomSize(mean_m=(5.0, 3.0), sd_m=(1e-6, 1e-6), arm_m=1.0, arm_sd_m=1e-6)
    area, sides, (attribute,), arm = draw_room_size((hall,), 0.0, np.random.default_rng(0))
    assert (area, sorted(sides), arm) == (pytest.approx(7.0, abs=1e-4), pytest.approx([3.0, 5.0], abs=1e-4), pytest.approx(1.0, abs=1e-4))
    assert attribute.value.endswith("arms 1.000 m")
    assert may_be_bare(hall) and not may_be_bare(SIZES[0])

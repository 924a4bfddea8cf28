"""Structures whose tables have too many chairs, or one alone where many sit."""

import numpy as np
import pytest
from small_grammar import CATEGORIES, closet, item, small_grammar

from grammar.checks.faults import crowded, lone_chair, oddly_seated
from grammar.derivation.derive import derive
from grammar.spec.request import SceneRequest


def items(table: str, width_m: float, chairs: int, around: str):
    text = closet("table", *["chair"] * chairs) + item("table", table, (0.8, width_m, 0.75))
    text += item("chair", "dining_chair", (0.5, 0.45, 0.9), f", cores: {{table: 1}}, around: [{around}]")
    return derive(small_grammar(text), CATEGORIES, SceneRequest(room_type="closet"), np.random.default_rng(0)).items


MIDDLE = "{side: front, gap_m: -0.2}"
BOTH = "{side: front, gap_m: -0.2, align: 0.6}, {side: front, gap_m: -0.2, align: -0.6}"


@pytest.mark.parametrize(
    ("chairs", "width_m", "around", "expected"),
    [
        (1, 1.2, MIDDLE, False),
        (2, 1.2, MIDDLE, True),
        (2, 1.6, BOTH, False),  # 0.6 (1.6 - 0.45) = 0.69 m apart
        (2, 1.2, BOTH, True),  # 0.45 m
        (3, 1.6, BOTH, True),
        (2, 1.2, "{side: front}, {side: back}", False),
    ],
)
def test_chairs_side_by_side_need_half_a_metre(chairs, width_m, around, expected):
    assert crowded(CATEGORIES, items("desk", width_m, chairs, around)) == expected


def test_one_chair_is_enough_at_a_desk_or_a_small_table_only():
    assert not lone_chair(CATEGORIES, items("desk", 1.6, 1, MIDDLE))
    assert not lone_chair(CATEGORIES, items("dining_table", 0.9, 1, MIDDLE))
    assert oddly_seated(CATEGORIES, items("dining_table", 1.6, 1, MIDDLE))
    assert not oddly_seated(CATEGORIES, items("dining_table", 1.6, 2, BOTH))

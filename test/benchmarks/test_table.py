"""Tables that benches write into pages."""

from benchmarks.table import Row, side_by_side


def test_things_stand_side_by_side() -> None:
    rows = [Row("living_room: gap; learned", 0.3, "m"), Row("bedroom: gap; learned", 0.125, "m"), Row("bedroom: gap; by hand", 2.0, "m")]
    table = "| | living room | bedroom |\n|---|---|---|\n| gap, m | 0.3 | 0.12 / 2 |\n| area, m2 | - | 10 |"
    assert side_by_side([*rows, Row("bedroom: area", 10.0, "m2")]) == table

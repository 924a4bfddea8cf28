"""An evaluation on a terminal, character by character."""

from __future__ import annotations

from evaluation.confidence import Interval
from evaluation.evaluation_file import Evaluation, MetricRow, SummaryRow, TaskRow
from scene_synth_ros.cli.commands.evaluate_command import table_lines


def row(task: str, by: str, key: str | float, value: float | None, low: float | None = None) -> SummaryRow:
    found = Interval(value=value, low=low, high=None if low is None else 2.5)
    return SummaryRow(task=task, by=by, key=key, metrics={"epe": found}, rooms=2, frames=1)


def test_metrics_have_a_line_each_and_ways_a_table_each() -> None:
    tasks = tuple(TaskRow(name=name, metrics=(MetricRow(name="epe", unit="px", better="lower"),)) for name in ("flow", "other"))
    rows = (row("flow", "all", "all", 1.23456, 0.5), row("flow", "class", "bed", None), row("flow", "light", 0.5, 2.0))
    evaluation = Evaluation(title="", algorithm="", created_with="", tasks=tasks, frames=(), summary=rows)
    assert table_lines(evaluation, {"class"}) == [
        "flow, 2 rooms, 1 frame  value  95% interval  unit  better",
        "epe                     1.235    0.5 to 2.5    px   lower",
        "",
        "flow by class  rooms  frames  epe",
        "bed                2       1    -",
        "",
        "other: no frame with an estimate",
    ]
    assert table_lines(evaluation, {"light"})[3:5] == ["flow by light  rooms  frames  epe", "0.5                2       1    2"]

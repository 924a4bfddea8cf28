"""Processors that processes take, of one run in turn, of several without knowing each other."""

import os
from pathlib import Path

import pytest

from scene_synth_ros.workers.processors import claimed_processors, processors_of, worker_environment


@pytest.fixture
def three_processors(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {4, 5, 9})


@pytest.mark.usefixtures("three_processors")
def test_claims_do_not_meet_while_there_are_free_processors() -> None:
    with claimed_processors(1) as one, claimed_processors(1) as two:
        with claimed_processors(1) as three:
            assert (one, two, three) == ([4], [5], [9])
            with claimed_processors(2) as shared:
                assert shared == [4, 5]
        with claimed_processors(2) as last:
            assert last == [4, 9]
    with claimed_processors(7) as everything:
        assert everything == [4, 5, 9]


@pytest.mark.usefixtures("three_processors")
def test_claims_write_nothing_where_others_could_have_laid_a_link(tmp_path: Path) -> None:
    (tmp_path / "letters").mkdir()
    letter = tmp_path / "letters" / "4"
    letter.write_text("dear")
    (tmp_path / f"scene_synth_processors_{os.getuid()}").symlink_to(tmp_path / "letters")
    before = sorted(tmp_path.rglob("*"))
    with claimed_processors(3):
        assert letter.read_text() == "dear"
        assert sorted(tmp_path.rglob("*")) == before


def test_workers_take_processors_in_turn() -> None:
    assert [processors_of(worker, 1, [0, 1]) for worker in range(3)] == [[0], [1], [0]]
    assert [processors_of(worker, 2, [2, 3, 5]) for worker in range(2)] == [[2, 3], [2, 5]]
    assert processors_of(0, 8, [0, 1]) == [0, 1]
    assert worker_environment({"HOME": "/h"}, 3)["OPENBLAS_NUM_THREADS"] == "3"

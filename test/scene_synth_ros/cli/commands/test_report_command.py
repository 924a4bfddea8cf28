"""``scene_synth report``: what it says, and the one line of what it refuses."""

import argparse
from pathlib import Path

import pytest
from evaluation_files import document, frame, write

from scene_synth_ros.cli import command_line
from scene_synth_ros.cli.commands import report_command


def run(*words: str) -> int:
    parser = argparse.ArgumentParser()
    report_command.add_arguments(parser)
    return report_command.run(parser.parse_args(words))


def test_it_says_what_the_page_has_and_opens_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", lambda address: not opened.append(address))
    monkeypatch.setenv("DISPLAY", ":7")
    path = write(tmp_path / "a.json", document([frame("0", 0, {}, {"abs_rel": 1.0, "delta_1": None})]))
    page = tmp_path / "page.html"
    assert run(str(path), "--out", str(page), "--open") == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith(f"report: {page} (1 evaluation, 1 task, 0 factors, 0 pictured frames, 0.") and said[0].endswith(" MB)")
    assert said[1] == "note: 1 of 1 bags not found, so no pictures of them: variants/0; give --bag-root DIR"
    assert opened == [page.as_uri()]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["missing.json"], "missing.json: no such file or directory; check the path"),
        (["bad.json"], "bad.json: expected an evaluation as JSON, got "),
        (["a.json", "--worst", "-1"], "--worst: expected 0 to 100, got -1"),
        (["a.json", "--max-size", "9"], "--max-size: expected 16 to 2048, got 9"),
        (["a.json", "--bag-root", "none"], "--bag-root none: expected a folder, got none; check the path"),
        (["a.json", "--estimates", "bad.json"], "--estimates bad.json: expected a folder, got a file; check the path"),
        (["a.json", "--out", "none/page.html"], "--out none/page.html: expected a file in a folder that exists"),
    ],
)
def test_bad_input_ends_in_one_line(
    words: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "a.json", document([frame("0", 0, {}, {"abs_rel": 1.0, "delta_1": None})]))
    (tmp_path / "bad.json").write_text("{", encoding="utf-8")
    with pytest.raises(SystemExit) as ended:
        command_line.main(["report", *words])
    told = capsys.readouterr().err
    assert ended.value.code == 2 and told.count("\n") == 1 and told.startswith(f"scene_synth report: {message}")
    assert not list(tmp_path.glob("*.html"))

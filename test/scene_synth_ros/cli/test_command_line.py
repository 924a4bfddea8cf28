"""How a command ends: bad input in one line, a fault of the program with all that it takes to report it."""

import sys
from pathlib import Path
from types import ModuleType

import pytest

from scene_description import SceneSynthError
from scene_synth_ros.cli import command_line


@pytest.fixture
def error(monkeypatch: pytest.MonkeyPatch) -> list[BaseException]:
    """Return the list that takes what the command ``sample`` shall raise."""
    raised: list[BaseException] = []

    def run(_arguments: object) -> int:
        raise raised[0]

    module = ModuleType("sample_command")
    module.add_arguments = lambda parser: parser.add_argument("--seed", type=int)
    module.run = run
    monkeypatch.setitem(sys.modules, "scene_synth_ros.cli.commands.sample_command", module)
    return raised


def ended(*words: str) -> int:
    with pytest.raises(SystemExit) as end:
        command_line.main(words)
    return end.value.code


def test_bad_input_is_one_line(error: list[BaseException], capsys: pytest.CaptureFixture[str]) -> None:
    error.append(SceneSynthError("room_type: expected one of bedroom, got dungeon"))
    assert ended("sample", "--seed", "4") == 2
    assert capsys.readouterr().err == "scene_synth sample: room_type: expected one of bedroom, got dungeon\n"


def test_a_fault_of_the_program_says_so_with_traceback_seed_and_command(
    error: list[BaseException], capsys: pytest.CaptureFixture[str]
) -> None:
    error.append(ValueError("operands could not be broadcast"))
    assert ended("sample", "--seed", "4") == 70
    told = capsys.readouterr().err
    assert told.startswith("Traceback (most recent call last):\n") and "in run\n" in told
    assert told.splitlines()[-1] == (
        "fault of the program while scene_synth sample ran with seed 4: ValueError: operands could not be broadcast; "
        "please report it with the lines above and the command: scene_synth sample --seed 4"
    )


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["render", "nosuch.json", "--out", "pictures"], "nosuch.json: no such file or directory; check the path"),
        (["render", ".", "--out", "pictures"], ".: is a directory; name a file, not a folder"),
        (["render", "room.json", "--catalog", "nosuch", "--out", "pictures"], "--catalog nosuch: expected a folder, got none"),
        (["export", "nosuch.json", "room.glb"], "nosuch.json: no such file or directory; check the path"),
        (["export", "room.json", "room.glb", "--catalog", "room.json"], "--catalog room.json: expected a folder, got a file"),
        (["gallery", "--out", "room.json/pictures"], "room.json/pictures: not a directory; a part of the path is a file"),
        (["learn", "nosuch.jsonl", "--out", "grammar.yaml"], "layouts: nosuch.jsonl: no such file or directory; check the path"),
        (["verify", "nosuch"], "nosuch: not found; give the folder of a bag"),
        (["verify", ".", "--catalog", "nosuch"], "--catalog nosuch: expected a folder, got none; check the path"),
    ],
)
def test_what_is_not_there_is_named_with_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: list[str], line: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("room.json").touch()
    assert ended(*words) == 2
    told = capsys.readouterr().err
    assert told.startswith(f"scene_synth {words[0]}: {line}") and told.count("\n") == 1
    assert "Errno" not in told

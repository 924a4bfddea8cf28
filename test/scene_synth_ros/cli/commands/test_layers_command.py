"""The page on layers is what the table gives."""

from pathlib import Path

import pytest

from renderer import LAYERS
from scene_synth_ros.cli.command_line import main
from scene_synth_ros.cli.commands.layers_command import layers_page

PAGE = Path(__file__).resolve().parents[4] / "docs" / "layers.md"


def test_the_page_is_up_to_date() -> None:
    assert PAGE.read_text(encoding="utf-8") == layers_page(), "run: scene_synth layers --markdown > docs/layers.md"


def test_the_command_prints_the_page_or_a_line_for_each_layer(capsys: pytest.CaptureFixture[str]) -> None:
    for words, expected in ((["--markdown"], layers_page()), ([], "")):
        with pytest.raises(SystemExit) as ended:
            main(["layers", *words])
        printed = capsys.readouterr().out
        assert not ended.value.code and (not expected or printed == expected)
    assert [line.split()[:2] for line in printed.splitlines()][:3] == [["color", "rgb8"], ["depth", "32FC1"], ["range", "32FC1"]]
    assert len(printed.splitlines()) == len(LAYERS)

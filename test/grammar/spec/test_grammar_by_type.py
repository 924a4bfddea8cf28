"""Grammars are read when they are asked for, once; those of the user's own stand for those of their room types."""

from pathlib import Path
from unittest import mock

import pytest
from small_grammar import CATEGORIES

from grammar.spec import grammar_file
from grammar.spec.grammar_file import read_grammar, read_room_type
from scene_description.share import config_path


def test_a_grammar_is_read_when_it_is_asked_for_and_once(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text("extends: study.yaml\nroom_type: den\n")
    own = {
        name: read_grammar(path, CATEGORIES) for name, path in (("den", tmp_path / "own.yaml"), ("gym", config_path("grammars/gym.yaml")))
    }
    with mock.patch.object(grammar_file, "read_room_type", wraps=read_room_type) as read:
        table = grammar_file.GrammarTable(("bedroom", "gym"), "learned", CATEGORIES, own)
        assert list(table) == ["bedroom", "gym", "den"] and len(table) == 3 and "bedroom" in table and "attic" not in table
        assert table["gym"] is own["gym"] and table["den"] is own["den"]
        assert not read.called
        assert table["bedroom"] is table["bedroom"]
        read.assert_called_once_with("bedroom", CATEGORIES, "learned")
        with pytest.raises(KeyError):
            table["attic"]

"""The grammars learned from real rooms that come with the program, and the choice between them and those written by hand."""

import re

import numpy as np
import pytest
from small_grammar import CATEGORIES

from grammar import GrammarError, SceneRequest, read_grammar, read_room_type, sample_room
from grammar.learning import grammar_yaml
from grammar.spec.grammar_file import learned_types, room_types
from grammar.synthesize import SceneSynthesizer
from scene_description.share import config_path


@pytest.mark.parametrize("room_type", learned_types())
def test_learned_grammars_give_valid_rooms(room_type):
    grammar = read_room_type(room_type, CATEGORIES, "learned")
    assert grammar.room_type == room_type
    assert grammar != read_room_type(room_type, CATEGORIES)
    # A learned grammar has the base's symbols, and those that the base lacked.
    assert grammar.objects.keys() >= read_room_type(room_type, CATEGORIES).objects.keys()
    for seed in range(3):
        assert sample_room(grammar, CATEGORIES, SceneRequest(room_type=room_type), np.random.default_rng(seed)).validity.valid


@pytest.mark.parametrize("room_type", learned_types())
def test_learned_grammars_say_what_differs_from_their_base(room_type, tmp_path):
    base, learned = (read_room_type(room_type, CATEGORIES, name) for name in ("by_hand", "learned"))
    shipped = config_path(f"learned/{room_type}.yaml").read_text(encoding="utf-8")
    assert f"\nextends: {room_type}.yaml\n" in shipped
    # a file without a base, as older ones are, and one with it read back alike, the order of all keys included
    texts = grammar_yaml(learned, [], {}), grammar_yaml(learned, [], {}, base, f"{room_type}.yaml")
    assert len(texts[1]) < 0.9 * len(texts[0])
    for number, text in enumerate(texts):
        (tmp_path / f"{number}.yaml").write_text(text, encoding="utf-8")
        assert as_written(read_grammar(tmp_path / f"{number}.yaml", CATEGORIES)) == as_written(learned)


def as_written(grammar):
    """Return a grammar as text with its numbers as short as files have them: places that are the base's have more digits there."""
    return re.sub(r"\d+\.\d+(e-\d+)?", lambda number: f"{float(number[0]):.4f}", repr(grammar))


def test_requests_choose_the_set():
    synthesizer = SceneSynthesizer.from_config()
    assert set(synthesizer.learned) == set(learned_types()) < set(room_types())
    for room_type in room_types():
        by_hand = synthesizer.grammar_of(SceneRequest(room_type=room_type, grammar_set="by_hand"))
        assert by_hand is synthesizer.grammars[room_type]
        learned = synthesizer.grammar_of(SceneRequest(room_type=room_type))
        assert learned is synthesizer.learned.get(room_type, by_hand)
        assert (learned is by_hand) == (room_type not in learned_types())


def test_unknown_sets_are_refused():
    with pytest.raises(GrammarError, match=r"grammar set: expected one of learned, by_hand, got 'best'"):
        read_room_type("bedroom", CATEGORIES, "best")

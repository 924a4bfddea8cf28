"""The grammars learned from real rooms that come with the program, and the choice between them and those written by hand."""

import numpy as np
import pytest
from small_grammar import CATEGORIES

from grammar import GrammarError, SceneRequest, read_room_type, sample_room
from grammar.spec.grammar_file import learned_types, room_types
from grammar.synthesize import SceneSynthesizer


@pytest.mark.parametrize("room_type", learned_types())
def test_learned_grammars_give_valid_rooms(room_type):
    grammar = read_room_type(room_type, CATEGORIES, "learned")
    assert grammar.room_type == room_type
    assert grammar != read_room_type(room_type, CATEGORIES)
    # A learned grammar has the base's symbols, and those that the base lacked.
    assert grammar.objects.keys() >= read_room_type(room_type, CATEGORIES).objects.keys()
    for seed in range(3):
        assert sample_room(grammar, CATEGORIES, SceneRequest(room_type=room_type), np.random.default_rng(seed)).validity.valid


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

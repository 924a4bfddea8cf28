"""Learning a grammar's numbers from furnished rooms: branching, sizes, relations, and the weights of the energy."""

from grammar.learning.category_map import CategoryMap, read_category_map
from grammar.learning.choices import SampledCounts
from grammar.learning.contrastive import ContrastiveOptions, curve_csv
from grammar.learning.learn import LearnedGrammar, LearnOptions, learn, room_sampler, split_houses
from grammar.learning.observed import ObservedObject, ObservedOpening, ObservedRoom, mixed
from grammar.learning.read_layouts import LayoutFile, read_layouts
from grammar.learning.truncation import RoomSampler, TruncationOptions, TruncationRow, truncation_csv
from grammar.learning.write_grammar import grammar_yaml
from grammar.learning.write_layouts import layout_from_scene, layout_line

__all__ = [
    "CategoryMap",
    "ContrastiveOptions",
    "LayoutFile",
    "LearnOptions",
    "LearnedGrammar",
    "ObservedObject",
    "ObservedOpening",
    "ObservedRoom",
    "RoomSampler",
    "SampledCounts",
    "TruncationOptions",
    "TruncationRow",
    "curve_csv",
    "grammar_yaml",
    "layout_from_scene",
    "layout_line",
    "learn",
    "mixed",
    "read_category_map",
    "read_layouts",
    "room_sampler",
    "split_houses",
    "truncation_csv",
]

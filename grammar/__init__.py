"""Which rooms are likely: a stochastic grammar from YAML, sampled from the root down, laid out by Metropolis-Hastings, checked exactly.

Imports scene_description, numpy, scipy, numba, shapely and (in one file) yaml; knows nothing of rendering or ROS.

    >>> categories = read_categories(config_path("categories.yaml"))
    >>> grammar = read_room_type("bedroom", categories)
    >>> room = sample_room(grammar, categories, SceneRequest(), np.random.default_rng(7))
"""

from typing import TYPE_CHECKING

from scene_description.on_demand import names_on_demand

if TYPE_CHECKING:
    from grammar.geometry.solids import object_solids
    from grammar.sampled_room import SampledRoom, sample_room
    from grammar.spec.categories import Categories, Category, read_categories
    from grammar.spec.grammar_file import read_grammar, read_room_type, room_types
    from grammar.spec.request import RequestError, SceneRequest
    from grammar.spec.rules import Grammar, GrammarError

__all__ = [
    "Categories",
    "Category",
    "Grammar",
    "GrammarError",
    "RequestError",
    "SampledRoom",
    "SceneRequest",
    "object_solids",
    "read_categories",
    "read_grammar",
    "read_room_type",
    "room_types",
    "sample_room",
]

__getattr__ = names_on_demand(
    __name__,
    {
        "Categories": "spec.categories",
        "Category": "spec.categories",
        "Grammar": "spec.rules",
        "GrammarError": "spec.rules",
        "RequestError": "spec.request",
        "SampledRoom": "sampled_room",
        "SceneRequest": "spec.request",
        "object_solids": "geometry.solids",
        "read_categories": "spec.categories",
        "read_grammar": "spec.grammar_file",
        "read_room_type": "spec.grammar_file",
        "room_types": "spec.grammar_file",
        "sample_room": "sampled_room",
    },
)

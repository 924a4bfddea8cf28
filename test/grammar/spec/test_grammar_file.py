"""Grammar files: what is read, and what is refused with which words."""

import copy
from typing import get_args

import pytest
import yaml
from small_grammar import CATEGORIES, mapping

from grammar.spec.categories import Role, read_categories
from grammar.spec.grammar_file import read_grammar, read_room_type, room_needs, room_types
from grammar.spec.room_rules import RoomNeeds
from grammar.spec.rules import GrammarError
from scene_description.share import config_path

TEXT = """
nodes:
  closet: {kind: and, branches: [{symbol: rest}, {symbol: shelf}]}
  rest: {kind: or, branches: [{symbol: bed, probability: 0.25}, {symbol: bins, probability: 0.75}]}
  bins: {kind: set, branches: [{symbol: bin, multiplicity: [0.1, 0.9]}]}
objects:
  bed: {category: bed, sizes: [{mean_m: [2, 1, 1], sd_m: [0.1, 0.1, 0.1]}], low_m: [1.8, 0.8, 0.9], high_m: [2.2, 1.2, 1.1]}
  bin: {category: waste_bin, sizes: [{mean_m: [0.3, 0.3, 0.4], sd_m: [0.1, 0.1, 0.1]}], low_m: [0.2, 0.2, 0.3], high_m: [0.4, 0.4, 0.5]}
  shelf: {category: bookshelf, sizes: [{mean_m: [0.3, 1, 2], sd_m: [0.1, 0.1, 0.1]}], low_m: [0.2, 0.8, 1.5], high_m: [0.4, 1.2, 2.2]}
"""


def set_at(data, path, value):
    data = copy.deepcopy(data)
    place = data
    *above, last = path
    for key in above:
        place = place[key]
    if value is None:
        del place[last]
    else:
        place[last] = value
    return data


def read(tmp_path, data):
    path = tmp_path / "closet.yaml"
    path.write_text(data if isinstance(data, str) else yaml.safe_dump(data), encoding="utf-8")
    return read_grammar(path, CATEGORIES)


@pytest.mark.parametrize("name", ["base.yaml" * 40, ".", "..", "../base.yaml", "", "a/b"])
def test_a_name_that_is_none_of_a_file_is_refused(tmp_path, name):
    with pytest.raises(GrammarError, match=r"extends: expected "):
        read(tmp_path, f"extends: '{name}'\nroom_type: cell\n")


def test_a_good_file_is_read(tmp_path):
    grammar = read(tmp_path, mapping(TEXT))
    assert grammar.nodes["rest"].branches[1].probability == 0.75
    assert grammar.objects["bed"].sizes[0].mean_m == (2.0, 1.0, 1.0)


def test_every_shipped_grammar_is_read():
    assert "bedroom" in room_types()
    for name in room_types():
        assert read_room_type(name, CATEGORIES).room_type == name


def test_an_extending_file_wins_over_its_base(tmp_path):
    (tmp_path / "base.yaml").write_text(yaml.safe_dump(mapping(TEXT)), encoding="utf-8")
    grammar = read(tmp_path, "extends: base.yaml\nroom_type: cell\nschedule: {beta: 7.0}\n")
    assert (grammar.room_type, grammar.schedule.beta) == ("cell", 7.0)
    assert grammar.root == "closet"


BAD = {
    "unknown_key": (["room", "colour"], 3, r"room\.colour: expected one of .*, got an unknown key"),
    "missing": (["room", "width_m"], None, r"room\.width_m: expected a value, got nothing"),
    "wrong_type": (["schedule", "beta"], "high", r"schedule\.beta: expected a number in .*, got 'high'"),
    "or_sum": (
        ["nodes", "rest", "branches", 0, "probability"],
        0.3,
        r"nodes\.rest\.branches: expected probabilities that sum to 1, got a sum of 1\.05",
    ),
    "set_sum": (
        ["nodes", "bins", "branches", 0, "multiplicity"],
        [0.5, 0.4],
        r"nodes\.bins\.branches\[0\]\.multiplicity: expected prob.* sum of 0\.9",
    ),
    "missing_node": (
        ["nodes", "rest", "branches", 1, "symbol"],
        "boxes",
        r"nodes\.rest\.branches\[1\]\.symbol: expected the symbol .*, got 'boxes'",
    ),
    "cycle": (
        ["nodes", "bins", "branches", 0, "symbol"],
        "rest",
        r"nodes\.rest: expected a graph without cycles, got rest -> bins -> rest",
    ),
    "orphan": (
        ["nodes", "extra"],
        {"kind": "and", "branches": [{"symbol": "bed"}]},
        r"nodes\.extra: expected nodes that 'closet' leads to",
    ),
    "category": (["objects", "bed", "category"], "sofa_bed", r"objects\.bed\.category: expected one of .*, got 'sofa_bed'"),
    "negative_size": (
        ["objects", "bed", "sizes", 0, "mean_m"],
        [-2, 1, 1],
        r"objects\.bed\.sizes\[0\]\.mean_m\[0\]: expected a number in .* m, got -2",
    ),
    "low_above_high": (
        ["objects", "bed", "low_m"],
        [3, 0.8, 0.9],
        r"objects\.bed\.low_m: expected a lower bound below the upper bound 2\.2, got 3",
    ),
    "core_nowhere": (["objects", "bed", "cores"], {"throne": 1.0}, r"objects\.bed\.cores: expected symbols of objects, .*, got 'throne'"),
    "self_core": (["objects", "bed", "cores"], {"bed": 1.0}, r"objects\.bed\.around: expected a value with cores, got nothing"),
    "no_tops": (["objects", "bed", "mount"], "object", r"objects\.bed\.supporters: expected a value with mount 'object', got nothing"),
    "within_nowhere": (["objects", "bed", "within"], "attic", r"objects\.bed\.within: expected the symbol of a node, got 'attic'"),
    "one_each_alone": (["objects", "bed", "one_each"], "place", r"objects\.bed\.one_each: expected no value without cores"),
    "same_as_nobody": (["objects", "bed", "same_place_as"], "bin", r"objects\.bed\.same_place_as: expected an object with one_each"),
    "tied_nowhere": (
        ["objects", "bed", "tied"],
        [{"axis": "width", "to": "throne", "of": "width"}],
        r"objects\.bed\.tied\[0\]\.to: expected the symbol of an object, door, garage_door or window, got 'throne'",
    ),
    "tied_to_no_core": (
        ["objects", "bed", "tied"],
        [{"axis": "width", "to": "core", "of": "width"}],
        r"objects\.bed\.tied\[0\]\.to: expected the symbol of an object, door, garage_door or window, got 'core'",
    ),
    "wish_for_nothing": (
        ["objects", "bed", "in_run"],
        {"near": {"throne": 1}},
        r"objects\.bed\.in_run\.near: expected symbols of objects, end, corner, window or side_window, got 'throne'",
    ),
    "in_line_on_the_floor": (["objects", "bed", "in_line"], True, r"objects\.bed\.in_line: expected mount 'wall' and cores with it"),
    "tied_in_a_circle": (
        ["objects", "bed", "tied"],
        [{"axis": "width", "to": "bed", "of": "width"}],
        r"objects\.bed: expected addresses without cycles, got bed -> bed",
    ),
    "moves": (["moves", "swap"], 0.5, r"moves: expected probabilities that sum to 1"),
    "probability_in_and": (
        ["nodes", "closet", "branches", 0, "probability"],
        0.5,
        r"probability: expected no value in a node of kind 'and', got 0\.5",
    ),
    "root": (["root"], "attic", r"root: expected the symbol of a node, got 'attic'"),
    "no_door": (["openings", "door", "multiplicity"], [0.5, 0.5], r"openings\.door\.multiplicity: expected at least one door"),
}


def test_a_file_may_extend_the_shipped_one_of_its_own_name(tmp_path):
    path = tmp_path / "bedroom.yaml"
    path.write_text("extends: bedroom.yaml\nschedule: {beta: 7.0}\n", encoding="utf-8")
    shipped, own = read_room_type("bedroom", CATEGORIES), read_grammar(path, CATEGORIES)
    assert own.schedule.beta == 7.0
    assert own.objects == shipped.objects


def test_a_whole_mapping_takes_the_place_of_the_one_below_it(tmp_path):
    data = mapping(TEXT)
    data["objects"]["bin"] |= {"cores": {"bed": 0.75, "none": 0.25}, "around": [{"side": "left"}]}
    (tmp_path / "base.yaml").write_text(yaml.safe_dump(data), encoding="utf-8")
    merged, whole = (
        read(tmp_path, f"extends: base.yaml\nobjects: {{bin: {{cores: {tag} {{shelf: 0.5, none: 0.5, bed: 0}}}}}}\n").objects["bin"].cores
        for tag in ("", "!whole")
    )
    assert list(merged) == ["bed", "none", "shelf"]
    assert list(whole) == ["shelf", "none", "bed"]


def test_rules_without_sizes_have_those_of_their_categories(tmp_path):
    data = mapping(TEXT)
    names = ("sizes", "low_m", "high_m")
    data["categories"] = {"waste_bin": {name: data["objects"]["bin"].pop(name) for name in names}, "globe": {}}
    data["objects"]["bin"]["low_m"] = [0.25, 0.25, 0.35]
    rule = read(tmp_path, data).objects["bin"]
    assert rule.sizes == read(tmp_path, mapping(TEXT)).objects["bin"].sizes
    assert (rule.low_m, rule.high_m) == ((0.25, 0.25, 0.35), (0.4, 0.4, 0.5))
    for wrong, words in (
        ([], "categories: expected a mapping, got list"),
        ({"bed": {"mount": "wall"}}, r"categories\.bed: expected a mapping"),
    ):
        with pytest.raises(GrammarError, match=words):
            read(tmp_path, data | {"categories": wrong})


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_is_refused_with_file_and_field_in_one_line(tmp_path, name):
    path, value, words = BAD[name]
    with pytest.raises(GrammarError, match=words) as caught:
        read(tmp_path, set_at(mapping(TEXT), path, value))
    assert str(caught.value).startswith(str(tmp_path / "closet.yaml"))
    assert "\n" not in str(caught.value)


def test_addresses_that_point_in_a_circle_are_refused(tmp_path):
    data = mapping(TEXT)
    for name, core in (("bed", "bin"), ("bin", "bed")):
        data["objects"][name] |= {"cores": {core: 1.0}, "around": [{"side": "left"}]}
    with pytest.raises(GrammarError, match=r"objects\.bed: expected addresses without cycles, got bed -> bin -> bed"):
        read(tmp_path, data)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("nodes: [1, 2}", r"closet\.yaml: line 1, column 13: expected YAML, got"),
        ("nodes: " + 500 * "[", r"closet\.yaml: line 1, column 107: expected YAML, got nesting deeper than 100"),
        # A newer libyaml has a bound of its own and is the first to refuse this one.
        ("nodes: " + 200_000 * "[", r"closet\.yaml: line 1, column 10?07: expected YAML, got .*nesting de"),
        ("root: a\nroot: b\n", r"key 'root' twice"),
        ("- 1\n", r"document: expected a mapping, got list"),
        ("extends: ../closet.yaml\n", r"extends: expected the name of a file in the same folder"),
        ("extends: closet.yaml\n", r"extends: expected files without a cycle"),
        (
            "extends: nowhere.yaml\n",
            r"closet\.yaml: extends: expected a file in the same folder, or one of .*base\.yaml.*, got 'nowhere\.yaml'",
        ),
    ],
)
def test_text_that_is_no_grammar_is_refused(tmp_path, text, words):
    with pytest.raises(GrammarError, match=words):
        read(tmp_path, text)


def test_unknown_room_types_are_refused_by_name():
    with pytest.raises(GrammarError, match=r"room type: expected one of .*bedroom.*, got '\.\./bedroom'"):
        read_room_type("../bedroom", CATEGORIES)


def test_categories_with_unknown_labels_are_refused(tmp_path):
    path = tmp_path / "categories.yaml"
    path.write_text("categories: {bed: {label: hammock}}", encoding="utf-8")
    with pytest.raises(GrammarError, match=r"categories\.bed\.label: expected the name of an NYU40 class, got 'hammock'"):
        read_categories(path)


def test_the_category_table_covers_the_bedroom():
    grammar = read_room_type("bedroom", CATEGORIES)
    assert {rule.category for rule in grammar.objects.values()} <= set(CATEGORIES)
    assert config_path("categories.yaml").is_file()


def test_rooms_need_what_their_files_say_in_roles_that_there_are():
    needs = {name: room_needs(name) for name in room_types()}
    assert {role for each in needs.values() for role in each.roles} <= set(get_args(Role))
    assert needs["kitchen"].roles == ("sink", "hob") and needs["garage"].door_m == 2.0 and needs["living_room"].company
    assert needs["study"] == RoomNeeds() == room_needs("a type of the user's own")


def test_needs_that_are_none_are_refused(tmp_path):
    (tmp_path / "own.yaml").write_text("extends: study.yaml\nneeds: {rolls: [sink]}\n")
    with pytest.raises(GrammarError, match=r"own\.yaml: needs\.rolls"):
        read_grammar(tmp_path / "own.yaml", CATEGORIES)

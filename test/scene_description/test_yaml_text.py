"""The one YAML reader: what it reads, what it refuses, and that every reader of the project is it; the YAML of bags has one form."""

import re
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest
import yaml

from grammar.appearance.looks import read_looks
from grammar.spec.grammar_file import read_grammar
from scene_description import SceneSynthError
from scene_description.yaml_text import MAX_BYTES, MAX_VALUES, YamlError, dump_yaml, flow_yaml, load_yaml
from scene_synth_ros.bags.bag_metadata import read_metadata
from scene_synth_ros.bags.qos_metadata import read_qos
from scene_synth_ros.cli.commands.sample_command import parse_constraints
from scene_synth_ros.cli.parameters.run_profile import apply_overrides, load_profile
from scene_synth_ros.sweep.sweep_file import read_sweep

FOLDED = "words: of a note - that # is longer than a line, 'quoted', with true, null and 1e3 in it, so that it must be folded somewhere"
LEVELS = "abcdefg"
BOMB = "a: &a {x: 1, y: 2, z: 3, u: 4, v: 5, w: 6, s: 7, t: 8}\n" + "".join(
    f"{name}: &{name} {{{', '.join(f'k{i}: *{below}' for i in range(8))}}}\n" for below, name in pairwise(LEVELS)
)
"""Eight aliases of eight aliases and so on: 500 characters that stand for two million values."""


@pytest.mark.parametrize("text", ["", "/synth/camera/depth", FOLDED, "x" * 100, "a\n- b: c\n", f"{FOLDED}\n{FOLDED}", f"é {FOLDED}", "'\""])
def test_texts_are_as_pyyaml_writes_them(text: str) -> None:
    value = {"topics": [{"name": text, "count": 2**63, "qos": [], "none": None}], "custom_data": {"note": text}}
    assert dump_yaml(value) == yaml.safe_dump(value, sort_keys=False, allow_unicode=True)
    assert load_yaml(dump_yaml(value), "text") == value


@pytest.mark.parametrize(
    "text",
    ["", "# nothing", "a", "1_000", "0x1f", "012", "1:30", "1.0e+3", ".inf", "-.5", "~", "yes", "'yes'", "!!str 12", "!!float 3",
     "[]", "{}", "a: [1, {b: c}]", "- a\n- - b\n  - c", "? a\n: b", "|\n two\n lines\n", ">\n folded\n text",
     "a: &x [1]\nb: *x\nc: &y 2\nd: *y",
     "base: &b {p: 1, q: 2}\nuse: {<<: *b, q: 3}",
     "a: &m {x: 1}\nb: &n {x: 2, y: 2}\nc: {<<: [*m, *n], z: 3}", "--- a\n...\n", "\ufeffa: b"],
)  # fmt: skip
def test_values_are_those_of_pyyaml(text: str) -> None:
    assert repr(load_yaml(text, "text")) == repr(yaml.safe_load(text))
    assert repr(load_yaml(text.encode(), "text")) == repr(yaml.safe_load(text))


@pytest.mark.parametrize(
    ("text", "number"), [("1e-9", 1e-9), ("1E5", 1e5), ("-2.5e3", -2500.0), (".5e3", 500.0), ("+1e3", 1e3), ("[1e9]", [1e9])]
)
def test_numbers_with_an_exponent_need_neither_point_nor_sign(text: str, number: object) -> None:
    read = load_yaml(text, "text")
    assert read == number and isinstance(read, type(number))


@pytest.mark.parametrize("text", ["1e-9", "12e05", "1e", "e9", "1e5 m", "1e5\n", "0x1e9", "1_0e3"])
def test_texts_that_look_like_such_numbers_stay_texts(text: str) -> None:
    for written in (dump_yaml({"name": text, "other": f"é {text}"}), dump_yaml({"name": text})):
        assert load_yaml(written, "text")["name"] == text
    assert load_yaml(flow_yaml(text), "text") == text and load_yaml(f"'{text.strip()}'", "text") == text.strip()


def test_dates_stay_texts_and_tags_make_values() -> None:
    assert load_yaml("day: 2024-02-30", "text") == {"day": "2024-02-30"}
    assert load_yaml("a: !pair {x: 1, y: 2}", "text", tags={"!pair": lambda pair: (pair["x"], pair["y"])}) == {"a": (1, 2)}


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("a: 1\na: 2", " line 2, column 1: expected YAML, got key 'a' twice"),
        ("{[1]: 2}", " line 1, column 2: expected YAML, got a key that is no text or number"),
        ("a: [1", " line 2, column 1: expected YAML, got did not find expected ',' or ']'"),
        ("- !!python/name:os.system x", " line 1, column 3: expected YAML, got tag 'tag:yaml.org,2002:python/name:os.system', which means"),
        ("!whole {}", " line 1, column 1: expected YAML, got tag '!whole', which means nothing here"),
        ("&a [*a]", " line 1, column 5: expected YAML, got alias 'a' of nothing that ends before it"),
        ("[" * 200, " line 1, column 101: expected YAML, got nesting deeper than 100"),
        ("[1]\n---\n2", " line 2, column 1: expected YAML, got more than one document"),
        ("a: <<", " line 1, column 4: expected YAML, got << where a value should be"),
        ("<<: 3", " line 1, column 5: expected YAML, got a value of << that is no mapping"),
        ("- 0b_", " line 1, column 3: expected YAML, got '0b_', which is no int"),
        ("1" * 101, " line 1, column 1: expected YAML, got a number of 101 characters"),
        ("1:" * 200_000 + "1", " line 1, column 1: expected YAML, got a number of 400001 characters"),
        (f"[{'a,' * MAX_VALUES}]", " line 1, column 600000: expected YAML, got more than"),
        (f"[&a '{'x' * 5_000_000}', {'*a, ' * 10}]", "expected YAML, got more than"),
        ("x" * (MAX_BYTES + 1), " expected at most"),
        (BOMB, " line 6, column 28: expected YAML, got more than"),
        ("\ud800", " expected YAML, got UnicodeEncodeError"),
        (b"\xff", " expected YAML, got UnicodeDecodeError"),
        (b"\x00", " expected YAML, got text that does not parse"),
    ],
)
def test_other_texts_are_refused_in_one_line_that_says_where(text: str | bytes, place: str) -> None:
    with pytest.raises(YamlError, match=r"^room\.yaml:.*" + re.escape(place)) as caught:
        load_yaml(text, "room.yaml")
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 300


def _of_file(read: Callable[[Path], object]) -> Callable[[str, Path], object]:
    def read_text(text: str, folder: Path) -> object:
        (folder / "file.yaml").write_text(text, encoding="utf-8")
        return read(folder / "file.yaml")

    return read_text


READERS: dict[str, Callable[[str, Path], object]] = {
    "parameters": _of_file(load_profile),
    "grammar": _of_file(lambda path: read_grammar(path, ())),
    "sweep": _of_file(read_sweep),
    "metadata.yaml": _of_file(read_metadata),
    "QoS": lambda text, folder: read_qos(text),
    "override": lambda text, folder: apply_overrides({}, [f"grammar_node.rooms:={text}"]),
    "constraint": lambda text, folder: parse_constraints([f"max_objects:={text}"], "bedroom"),
    "look": lambda text, folder: read_looks((text,)),
}


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("text", [BOMB, "[" * 200, "{a: 1, a: 2}", "1:" * 1000 + "1", "!!python/none x"], ids=lambda text: text[:6])
def test_every_reader_of_yaml_has_these_bounds(tmp_path: Path, reader: str, text: str) -> None:
    with pytest.raises(SceneSynthError, match="expected YAML, got") as caught:
        READERS[reader](text, tmp_path)
    assert "\n" not in str(caught.value)


def test_values_in_flow_style_are_read_as_they_were() -> None:
    for value in (1, 1e-5, "1", "a: b", [1, "x"], {"a": None}, True, "two\nlines", "ö"):
        assert load_yaml(flow_yaml(value), "text") == value

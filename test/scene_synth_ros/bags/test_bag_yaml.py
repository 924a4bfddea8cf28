"""The YAML of bags has one form, whichever emitter wrote it."""

import pytest
import yaml

from scene_synth_ros.bags.bag_yaml import dump_yaml

FOLDED = "words: of a note - that # is longer than a line, 'quoted', with true, null and 1e3 in it, so that it must be folded somewhere"


@pytest.mark.parametrize("text", ["", "/synth/camera/depth", FOLDED, "x" * 100, "a\n- b: c\n", f"{FOLDED}\n{FOLDED}", f"é {FOLDED}", "'\""])
def test_texts_are_as_pyyaml_writes_them(text: str) -> None:
    value = {"topics": [{"name": text, "count": 2**63, "qos": [], "none": None}], "custom_data": {"note": text}}
    assert dump_yaml(value) == yaml.safe_dump(value, sort_keys=False, allow_unicode=True)

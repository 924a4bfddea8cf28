"""Reads YAML of unknown origin, whose loader's many ways to fail become one, and writes the YAML of bags."""

from __future__ import annotations

import yaml

from scene_description import SceneSynthError

_FAST_DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
"""That of libyaml, which not every PyYAML has."""


class BagYamlError(SceneSynthError):
    """A text that is no YAML of plain values; one line."""


def load_yaml(text: str | bytes) -> object:
    """Return the plain value that a YAML text stands for.

    Raises:
        BagYamlError: the text is no YAML, asks for other than plain values, or is nested too deeply.
    """
    try:
        return yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, LookupError, TypeError, AttributeError, ArithmeticError) as error:
        raise BagYamlError(f"no YAML: {' '.join(str(error).split())[:160]}") from None
    except RecursionError:
        raise BagYamlError("no YAML: nested too deeply") from None


def dump_yaml(value: object) -> str:
    """Return the YAML text of a plain value whose keys have 1 to 100 characters, the same with and without libyaml.

    libyaml and PyYAML's own emitter give printable ASCII the same form, and fold and escape other text differently; that is left to the
    latter, which takes ten times as long.
    """
    told = repr(value)
    fast = told.isascii() and "\\" not in told
    return str(yaml.dump(value, Dumper=_FAST_DUMPER if fast else yaml.SafeDumper, sort_keys=False, allow_unicode=True))

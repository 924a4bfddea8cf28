"""Reads YAML of unknown origin; the loader's many ways to fail become one."""

from __future__ import annotations

import yaml

from scene_description import SceneSynthError


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

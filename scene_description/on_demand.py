"""Names that a package hands out when they are asked for, so that a program that needs one of them does not load what the others need.

A module's ``__getattr__`` is called for names that it does not have (PEP 562); packages do so as SPEC 1 of Scientific Python describes.
"""

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def names_on_demand(package: str, modules: Mapping[str, str]) -> Callable[[str], Any]:
    """Return what a package's ``__init__.py`` calls ``__getattr__``.

    Args:
        package: its name.
        modules: name -> the package's module that has it, without the package's name.

    A module of the package must not be called as one of the names: once loaded it would stand for it.
    """

    def get(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        value = getattr(import_module(f"{package}.{modules[name]}"), name)
        setattr(sys.modules[package], name, value)
        return value

    return get

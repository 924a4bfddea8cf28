"""JSON Schema (draft 2020-12) of the documents that types describe, so that other programs can validate them and generate code.

Readers of dataclasses (:mod:`scene_description.strict`) refuse unknown fields, so ``additionalProperties`` is false there; those of
TypedDicts and named tuples take what they know, and leave it open.
"""

import dataclasses
import inspect
import types
import typing
from collections.abc import Mapping
from typing import Any, Literal, Union, get_args, get_origin

from scene_description.strict import Limits, split_annotation

DIALECT = "https://json-schema.org/draft/2020-12/schema"
_SCALARS: dict[Any, dict[str, Any]] = {
    float: {"type": "number"},
    int: {"type": "integer"},
    bool: {"type": "boolean"},
    str: {"type": "string"},
    type(None): {"type": "null"},
    Any: {},
}
_LENGTHS = {"string": ("minLength", "maxLength"), "array": ("minItems", "maxItems"), "object": ("minProperties", "maxProperties")}


def json_schema(annotation: Any, title: str, fields: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return the schema of a document.

    Args:
        annotation: its type: a dataclass, a TypedDict, or whatever a field of one can be.
        title: of the schema.
        fields: annotation of what the file has at its top beside the fields of the type, by name; all of it required.
    """
    definitions: dict[str, Any] = {}
    schema = _described(annotation, definitions)
    if "$ref" in schema:
        schema = definitions.pop(schema["$ref"].rpartition("/")[2])
    for name, extra in (fields or {}).items():
        schema["properties"] = {name: _described(extra, definitions)} | schema["properties"]
        schema["required"] = sorted({*schema.get("required", ()), name})
    document = {"$schema": DIALECT, "title": title} | schema
    return document | ({"$defs": dict(sorted(definitions.items()))} if definitions else {})


def _described(annotation: Any, definitions: dict[str, Any]) -> dict[str, Any]:
    bare, limits = split_annotation(annotation)
    if typing.is_typeddict(bare) or dataclasses.is_dataclass(bare) or (isinstance(bare, type) and hasattr(bare, "_fields")):
        if bare.__name__ not in definitions:
            definitions[bare.__name__] = {}  # types may name themselves
            definitions[bare.__name__] = _record(bare, definitions)
        return {"$ref": f"#/$defs/{bare.__name__}"}
    return _plain(bare, limits, definitions) | _words(limits)


def _plain(bare: Any, limits: Limits, definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of what is no record."""
    origin, args = get_origin(bare), get_args(bare)
    if origin in (Union, types.UnionType):
        choices = [_described(typing.Annotated[arg, limits] if arg in (str, int, float) else arg, definitions) for arg in args]
        return choices[0] if len(choices) == 1 else {"anyOf": choices}
    if origin is Literal:
        return {"enum": list(args)}
    if origin is tuple and args[-1] is not Ellipsis:
        items = [_described(arg, definitions) for arg in args]
        return {"type": "array", "prefixItems": items, "items": False, "minItems": len(items), "maxItems": len(items)}
    if origin in (tuple, list):
        return {"type": "array", "items": _described(args[0], definitions)} | _lengths(limits, "array")
    if origin is not None and issubclass(origin, Mapping):
        return {"type": "object", "additionalProperties": _described(args[1], definitions)} | _lengths(limits, "object")
    schema = dict(_SCALARS[bare])
    if bare is str:
        schema |= _lengths(limits, "string")
        if limits.pattern is not None:
            schema["pattern"] = f"^(?:{limits.pattern})$"
    schema |= {key: bound for key, bound in (("minimum", limits.ge), ("maximum", limits.le)) if bound is not None}
    return schema


def _record(cls: type, definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a class with named fields."""
    hints = typing.get_type_hints(cls, include_extras=True)
    if dataclasses.is_dataclass(cls):
        missing = (dataclasses.MISSING, dataclasses.MISSING)
        required = [field.name for field in dataclasses.fields(cls) if (field.default, field.default_factory) == missing]
        closed = {"additionalProperties": False}
    elif typing.is_typeddict(cls):
        required, closed = sorted(vars(cls)["__required_keys__"]), {}
    else:
        required, closed = list(hints), {}
    schema: dict[str, Any] = {"type": "object"}
    if (text := inspect.cleandoc(cls.__doc__ or "")) and not text.startswith(f"{cls.__name__}("):
        schema["description"] = text
    schema["properties"] = {name: _described(hint, definitions) for name, hint in hints.items()}
    return schema | ({"required": sorted(required)} if required else {}) | closed


def _lengths(limits: Limits, kind: str) -> dict[str, int]:
    least, most = _LENGTHS[kind]
    return {key: bound for key, bound in ((least, limits.min_length), (most, limits.max_length)) if bound is not None}


def _words(limits: Limits) -> dict[str, str]:
    words = limits.description + (f" [{limits.unit}]" if limits.unit else "")
    return {"description": words.strip()} if words else {}

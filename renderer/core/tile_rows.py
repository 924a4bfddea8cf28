"""A packet of 4 x 4 pixels written to images, four neighbours of a row at a time: numba leaves such runs to single numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

TILE = 4
"""Edge of a tile."""
_TRIPLES = ((0, 4, 8, 1), (5, 9, 2, 6), (10, 3, 7, 11))
"""Where the numbers of x0 y0 z0 x1, y1 z1 x2 y2 and z2 x3 y3 z3 lie in x0 .. x3 y0 .. y3 z0 .. z3."""


@intrinsic
def store_rows(typing: Any, source: Any, field: Any, image: Any, at: Any, stride: Any) -> Any:
    """Write ``source[field:][:16]`` to the rows of ``image``, flat, of the same kind of number.

    ``at``: of the tile's first pixel, ``stride``: from row to row.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        begin, pixel = _pointer(context, builder, signature, arguments, 0), _pointer(context, builder, signature, arguments, 2)
        for row in range(TILE):
            _store(builder, _load(builder, begin, row), _row(builder, pixel, arguments[4], row))
        return context.get_dummy_value()

    return types.void(source, types.intp, image, types.intp, types.intp), generate


@intrinsic
def store_vectors(typing: Any, source: Any, field: Any, image: Any, at: Any, stride: Any) -> Any:
    """Write three fields from ``source[field:]`` on, x, y and z, side by side to the rows of ``image``, flat; in numbers, not in pixels."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        begin, pixel = _pointer(context, builder, signature, arguments, 0), _pointer(context, builder, signature, arguments, 2)
        for row in range(TILE):
            x, y, z = (_load(builder, begin, TILE * axis + row) for axis in range(3))
            both = builder.shuffle_vector(x, y, _places(range(2 * TILE)))
            third = builder.shuffle_vector(z, z, _places(range(2 * TILE)))
            target = _row(builder, pixel, arguments[4], row)
            for part, places in enumerate(_TRIPLES):
                place = builder.gep(target, [ir.Constant(ir.IntType(64), TILE * part)])
                _store(builder, builder.shuffle_vector(both, third, _places(places)), place)
        return context.get_dummy_value()

    return types.void(source, types.intp, image, types.intp, types.intp), generate


@intrinsic
def store_bits(typing: Any, source: Any, field: Any, shift: Any, image: Any, at: Any, stride: Any) -> Any:
    """Write ``source[field:][:16]`` to the rows of ``image``, flat: of each the bits from ``shift`` on, as many as the image has."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        begin, pixel = _pointer(context, builder, signature, arguments, 0), _pointer(context, builder, signature, arguments, 3)
        narrow = ir.VectorType(pixel.type.pointee, TILE)
        for row in range(TILE):
            words = _load(builder, begin, row)
            by = builder.trunc(arguments[2], words.type.element)
            shifts = ir.Constant(words.type, ir.Undefined)
            for lane in range(TILE):
                shifts = builder.insert_element(shifts, by, ir.Constant(ir.IntType(32), lane))
            _store(builder, builder.trunc(builder.lshr(words, shifts), narrow), _row(builder, pixel, arguments[5], row))
        return context.get_dummy_value()

    return types.void(source, types.intp, types.intp, image, types.intp, types.intp), generate


def _pointer(context: Any, builder: Any, signature: Any, arguments: Any, index: int) -> Any:
    """Return the address in an array argument of the place that the argument after it names."""
    data = context.make_array(signature.args[index])(context, builder, arguments[index]).data
    return builder.gep(data, [arguments[index + 1]])


def _row(builder: Any, pixel: Any, stride: Any, row: int) -> Any:
    return builder.gep(pixel, [builder.mul(stride, ir.Constant(ir.IntType(64), row))])


def _load(builder: Any, begin: Any, run: int) -> Any:
    """Return four numbers, ``run`` times four behind the first."""
    place = builder.gep(begin, [ir.Constant(ir.IntType(64), TILE * run)])
    return builder.load(builder.bitcast(place, ir.VectorType(begin.type.pointee, TILE).as_pointer()), align=4)


def _store(builder: Any, values: Any, place: Any) -> None:
    builder.store(values, builder.bitcast(place, values.type.as_pointer()), align=1)


def _places(places: Sequence[int]) -> Any:
    return ir.Constant(ir.VectorType(ir.IntType(32), len(places)), list(places))

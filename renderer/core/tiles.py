"""Tiles of 4 x 4 pixels between images and the fields of a packet or of lanes, which hold 16 numbers each, row by row.

Whole tiles go four neighbours of a row at a time, by vector instructions that numba would not make of such short runs; at the image's edge
number by number.  A tile is written to four rows that lie far apart, of many images, more than processors see coming: memory that the next
tiles are written to is asked for beforehand.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from renderer.core.kernel import inlined
from renderer.core.ray_packet import LANES

EDGE = 4
"""Edge of a tile."""
_LINE = 64
"""Bytes of a line of the processor's cache."""


@inlined
def load_numbers(image: NDArray[np.float32], column: int, row: int, field: int, lanes: NDArray[np.float32]) -> None:
    """Copy the tile that begins at (column, row) of an image (height, width) to a field of the lanes.

    Beyond the image its last pixels stand for what is missing.
    """
    if _is_whole(image, column, row):
        _load_whole(lanes, field, image, row * image.shape[1] + column, image.shape[1], 1)
    else:
        _load_part(image.reshape(-1), image.shape[0], image.shape[1], 1, column, row, field, lanes)


@inlined
def load_pairs(image: NDArray[np.float32], column: int, row: int, field: int, lanes: NDArray[np.float32]) -> None:
    """Copy a tile of an image (height, width, 2) to two fields in the same way."""
    if _is_whole(image, column, row):
        _load_whole(lanes, field, image, 2 * (row * image.shape[1] + column), 2 * image.shape[1], 2)
    else:
        _load_part(image.reshape(-1), image.shape[0], image.shape[1], 2, column, row, field, lanes)


@inlined
def load_vectors(image: NDArray[np.float32], column: int, row: int, field: int, lanes: NDArray[np.float32]) -> None:
    """Copy a tile of an image (height, width, 3) to three fields in the same way."""
    if _is_whole(image, column, row):
        _load_whole(lanes, field, image, 3 * (row * image.shape[1] + column), 3 * image.shape[1], 3)
    else:
        _load_part(image.reshape(-1), image.shape[0], image.shape[1], 3, column, row, field, lanes)


@inlined
def store_numbers(lanes: NDArray[np.float32], field: int, column: int, row: int, image: NDArray[np.float32]) -> None:
    """Copy a field of the lanes to the tile that begins at (column, row) of an image (height, width)."""
    if _is_whole(image, column, row):
        _store_whole(lanes, field, image, row * image.shape[1] + column, image.shape[1], 1)
    else:
        _store_part(lanes, field, column, row, image.reshape(-1), image.shape[0], image.shape[1], 1)


@inlined
def store_pairs(lanes: NDArray[np.float32], field: int, column: int, row: int, image: NDArray[np.float32]) -> None:
    """Copy two fields to a tile of an image (height, width, 2)."""
    if _is_whole(image, column, row):
        _store_whole(lanes, field, image, 2 * (row * image.shape[1] + column), 2 * image.shape[1], 2)
    else:
        _store_part(lanes, field, column, row, image.reshape(-1), image.shape[0], image.shape[1], 2)


@inlined
def store_vectors(lanes: NDArray[np.float32], field: int, column: int, row: int, image: NDArray[np.float32]) -> None:
    """Copy three fields to a tile of an image (height, width, 3)."""
    if _is_whole(image, column, row):
        _store_whole(lanes, field, image, 3 * (row * image.shape[1] + column), 3 * image.shape[1], 3)
    else:
        _store_part(lanes, field, column, row, image.reshape(-1), image.shape[0], image.shape[1], 3)


@inlined
def store_bits(lanes: NDArray[np.uint32], field: int, shift: int, column: int, row: int, image: NDArray[Any]) -> None:
    """Copy a field of integers to a tile of an image (height, width): of each the bits from ``shift`` on, as many as the image has."""
    if _is_whole(image, column, row):
        _store_whole_bits(lanes, field, shift, image, row * image.shape[1] + column, image.shape[1])
    else:
        for y in range(row, min(row + EDGE, image.shape[0])):
            for x in range(column, min(column + EDGE, image.shape[1])):
                image[y, x] = lanes[field + (y - row) * EDGE + x - column] >> shift


@inlined
def _is_whole(image: NDArray[Any], column: int, row: int) -> bool:
    height: int = image.shape[0]
    width: int = image.shape[1]
    return row + EDGE <= height and column + EDGE <= width


@inlined
def _load_part(
    image: NDArray[np.float32], height: int, width: int, channels: int, column: int, row: int, field: int, lanes: NDArray[np.float32]
) -> None:
    for k in range(LANES):
        pixel = min(row + (k >> 2), height - 1) * width + min(column + (k & 3), width - 1)
        for channel in range(channels):
            lanes[field + LANES * channel + k] = image[channels * pixel + channel]


@inlined
def _store_part(
    lanes: NDArray[np.float32], field: int, column: int, row: int, image: NDArray[np.float32], height: int, width: int, channels: int
) -> None:
    for y in range(row, min(row + EDGE, height)):
        for x in range(column, min(column + EDGE, width)):
            for channel in range(channels):
                image[channels * (y * width + x) + channel] = lanes[field + LANES * channel + (y - row) * EDGE + x - column]


@intrinsic(prefer_literal=True)
def _load_whole(typing: Any, lanes: Any, field: Any, image: Any, at: Any, stride: Any, channels: Any) -> Any:
    """Copy from ``image``, C-contiguous, to ``lanes[field:]``.

    ``at``: of the tile's first number, ``stride``: from row to row, in numbers; ``channels``: neighbouring numbers of a pixel, a constant.
    """
    count = channels.literal_value

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        target, source = _pointer(context, builder, signature, arguments, 0), _pointer(context, builder, signature, arguments, 2)
        for row in range(EDGE):
            begin = builder.gep(source, [builder.mul(arguments[4], _index(row))])
            runs = [_load(builder, begin, EDGE * i, 1) for i in range(count)]
            for channel in range(count):
                numbers = _chosen(builder, runs, [channel + count * x for x in range(EDGE)])
                _store(builder, numbers, target, LANES * channel + EDGE * row)
        return context.get_dummy_value()

    return types.void(lanes, types.intp, image, types.intp, types.intp, channels), generate


@intrinsic(prefer_literal=True)
def _store_whole(typing: Any, lanes: Any, field: Any, image: Any, at: Any, stride: Any, channels: Any) -> Any:
    """Copy from ``lanes[field:]`` to ``image`` as :func:`_load_whole` does the other way."""
    count = channels.literal_value

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        source, target = _pointer(context, builder, signature, arguments, 0), _pointer(context, builder, signature, arguments, 2)
        for row in range(EDGE):
            begin = builder.gep(target, [builder.mul(arguments[4], _index(row))])
            fields = [_load(builder, source, LANES * channel + EDGE * row, 4) for channel in range(count)]
            for i in range(count):
                places = [EDGE * (number % count) + number // count for number in range(EDGE * i, EDGE * i + EDGE)]
                _store(builder, _chosen(builder, fields, places), begin, EDGE * i)
            _fetch(builder, begin, _LINE // 4 * count)
        return context.get_dummy_value()

    return types.void(lanes, types.intp, image, types.intp, types.intp, channels), generate


@intrinsic
def _store_whole_bits(typing: Any, lanes: Any, field: Any, shift: Any, image: Any, at: Any, stride: Any) -> Any:
    """Copy bits of ``lanes[field:]`` to ``image``, C-contiguous."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        source, target = _pointer(context, builder, signature, arguments, 0), _pointer(context, builder, signature, arguments, 3)
        kind = target.type.pointee
        for row in range(EDGE):
            words = _load(builder, source, EDGE * row, 4)
            by = builder.trunc(arguments[2], words.type.element)
            shifts = ir.Constant(words.type, ir.Undefined)
            for x in range(EDGE):
                shifts = builder.insert_element(shifts, by, ir.Constant(ir.IntType(32), x))
            bits = builder.lshr(words, shifts)
            bits = bits if kind == words.type.element else builder.trunc(bits, ir.VectorType(kind, EDGE))
            begin = builder.gep(target, [builder.mul(arguments[5], _index(row))])
            _store(builder, bits, begin, 0)
            _fetch(builder, begin, _LINE)
        return context.get_dummy_value()

    return types.void(lanes, types.intp, types.intp, image, types.intp, types.intp), generate


def _pointer(context: Any, builder: Any, signature: Any, arguments: Any, number: int) -> Any:
    """Return the address in an array argument of the place that the argument after it names."""
    data = context.make_array(signature.args[number])(context, builder, arguments[number]).data
    return builder.gep(data, [arguments[number + 1]])


def _load(builder: Any, begin: Any, at: int, align: int) -> Any:
    """Return four numbers from ``begin[at]`` on."""
    place = builder.gep(begin, [_index(at)])
    return builder.load(builder.bitcast(place, ir.VectorType(begin.type.pointee, EDGE).as_pointer()), align=align)


def _store(builder: Any, values: Any, begin: Any, at: int) -> None:
    """Write four numbers from ``begin[at]`` on."""
    builder.store(values, builder.bitcast(builder.gep(begin, [_index(at)]), values.type.as_pointer()), align=1)


def _fetch(builder: Any, begin: Any, at: int) -> None:
    """Have the processor fetch the memory at ``begin[at]``, which is to be written, if there is such."""
    place, word = builder.bitcast(builder.gep(begin, [_index(at)]), ir.IntType(8).as_pointer()), ir.IntType(32)
    kind = ir.FunctionType(ir.VoidType(), [place.type, word, word, word])
    prefetch = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0i8")
    for_writing, keep, data = 1, 3, 1
    builder.call(prefetch, [place, *(ir.Constant(word, number) for number in (for_writing, keep, data))])


def _chosen(builder: Any, runs: list[Any], places: list[int]) -> Any:
    """Return four of up to twelve numbers, which come in runs of four."""
    if len(runs) == 1:
        return runs[0]
    first = builder.shuffle_vector(runs[0], runs[1], _places(range(2 * EDGE)))
    last = builder.shuffle_vector(runs[-1], runs[-1], _places(range(2 * EDGE)))
    return builder.shuffle_vector(first, last, _places(places))


def _index(number: int) -> Any:
    return ir.Constant(ir.IntType(64), number)


def _places(places: Iterable[int]) -> Any:
    numbers = list(places)
    return ir.Constant(ir.VectorType(ir.IntType(32), len(numbers)), numbers)

"""Chosen lanes, moved side by side: field by field with a vector instruction where the processor has it, else number by number."""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from renderer.core.kernel import inlined
from renderer.core.ray_packet import LANES

_VECTOR_FEATURE = "+avx512f"
"""LLVM's substitute for other processors is no faster than :func:`_by_number`, and ends the process with floats on some (LLVM 22)."""


@intrinsic
def _compress(typing: Any, source: Any, begin: Any, chosen: Any, where: Any, target: Any, at: Any) -> Any:
    """Write the numbers of ``source[begin:][:16]`` whose ``chosen[where:][:16]`` is positive to ``target[at:]``."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        numbers, weights, place = (
            builder.gep(context.make_array(signature.args[i])(context, builder, arguments[i]).data, [arguments[i + 1]]) for i in (0, 2, 4)
        )
        vector = _VECTOR_FEATURE in context.codegen().magic_tuple()[2].split(",")
        (_by_vector if vector else _by_number)(builder, numbers, weights, place)
        return context.get_dummy_value()

    return types.void(source, types.intp, chosen, types.intp, target, types.intp), generate


def _by_vector(builder: Any, numbers: Any, weights: Any, place: Any) -> None:
    words, floats = ir.VectorType(ir.IntType(32), LANES), ir.VectorType(ir.FloatType(), LANES)
    values = builder.load(builder.bitcast(numbers, words.as_pointer()), align=4)
    mask = builder.fcmp_ordered(">", builder.load(builder.bitcast(weights, floats.as_pointer()), align=4), ir.Constant(floats, None))
    kind = ir.FunctionType(words, [words, mask.type, words])
    function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.experimental.vector.compress.v{LANES}i32")
    packed = builder.call(function, [values, mask, ir.Constant(words, None)])
    builder.store(packed, builder.bitcast(place, words.as_pointer()), align=4)


def _by_number(builder: Any, numbers: Any, weights: Any, place: Any) -> None:
    index = ir.IntType(64)
    count = ir.Constant(index, 0)
    for k in (ir.Constant(index, k) for k in range(LANES)):
        builder.store(builder.load(builder.gep(numbers, [k])), builder.gep(place, [count]))
        chosen = builder.fcmp_ordered(">", builder.load(builder.gep(weights, [k])), ir.Constant(ir.FloatType(), 0.0))
        count = builder.add(count, builder.zext(chosen, index))


@inlined
def pack(numbers: NDArray[np.float32], field: int, lanes: NDArray[np.float32], choice: int, target: NDArray[np.float32], at: int) -> None:
    """Write ``field`` of the lanes whose ``choice`` is positive, in order, from ``target[at]`` on.

    What follows there, up to 16 numbers altogether, may be overwritten.  ``numbers``: what the field is of, the lanes or their packet.
    """
    _compress(numbers, field, lanes, choice, target, at)


@inlined
def pack_slots(slots: NDArray[np.int32], lanes: NDArray[np.float32], choice: int, target: NDArray[np.int32], at: int) -> None:
    """As :func:`pack`, for the lanes' slots."""
    _compress(slots, 0, lanes, choice, target, at)

"""Memory at an address, as numba kernels read and write it."""

from typing import Any

from numba import types
from numba.extending import intrinsic


def _reader_of(element: types.Type) -> Any:
    """Return the function that sees the memory at an address, int64, as a pointer to elements."""

    @intrinsic
    def pointer_to(typing_context, address):  # type: ignore[no-untyped-def]
        def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
            return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

        return types.CPointer(element)(types.int64), generate

    return pointer_to


words_at, addresses_at, floats_at = _reader_of(types.int32), _reader_of(types.int64), _reader_of(types.float32)

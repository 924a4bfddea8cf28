"""Types of calls, found once.

For each call numba tries one candidate after the other, a dozen for a sum, every time anew, though types alone decide: a third of the time
that it takes to compile the grammar's kernels.
"""

from typing import Any

from numba.core.types.functions import BaseFunction

_find = BaseFunction.get_call_type
_found: dict[tuple[int, tuple[Any, ...], tuple[Any, ...]], tuple[BaseFunction, Any]] = {}
"""By function and types of arguments: the function, which is kept so that its number stays its own, and the signature."""


def _get_call_type(self: BaseFunction, context: Any, args: Any, kws: Any) -> Any:
    call = id(self), tuple(args), tuple(sorted(kws.items()))
    if call not in _found:
        _found[call] = self, _find(self, context, args, kws)
    return _found[call][1]


def remember_call_types() -> None:
    """Let numba remember which signature a builtin function has for arguments of some types; what fails is tried again."""
    BaseFunction.get_call_type = _get_call_type  # type: ignore[method-assign]

"""Types of calls are those that numba finds, and found once."""

import operator
from typing import Any

import pytest
from numba import types
from numba.core.errors import TypingError
from numba.core.registry import cpu_target

from kernel_cache import call_types, compiling  # noqa: F401  # what compiles kernels lets numba remember


def function(builtin: Any) -> Any:
    cpu_target.target_context.refresh()
    return cpu_target.typing_context.resolve_value_type(builtin)


@pytest.mark.parametrize("builtin", [operator.add, operator.lt, operator.getitem, max])
def test_a_call_has_the_signature_that_numba_finds_for_its_types(builtin: Any) -> None:
    context, called = cpu_target.typing_context, function(builtin)
    arrays = (types.Array(types.float32, 2, "C"), types.UniTuple(types.intp, 2))
    calls = [arrays] if builtin is operator.getitem else [(types.float32, types.float32), (types.float32, types.int64), (types.int32,) * 2]
    for _ in range(2):
        for args in calls:
            assert called.get_call_type(context, args, {}) == call_types._find(called, context, args, {})


def test_candidates_are_tried_once_for_the_same_types(monkeypatch: pytest.MonkeyPatch) -> None:
    tried, find = [], call_types._find
    monkeypatch.setattr(call_types, "_found", {})
    monkeypatch.setattr(call_types, "_find", lambda called, context, args, kws: tried.append(args) or find(called, context, args, kws))
    called = function(operator.mul)
    for _ in range(3):
        for kind in (types.float32, types.float64):
            called.get_call_type(cpu_target.typing_context, (kind, kind), {})
    assert tried == [(types.float32,) * 2, (types.float64,) * 2]


def test_a_call_that_has_no_type_is_refused_every_time() -> None:
    called = function(operator.add)
    for _ in range(2):
        with pytest.raises(TypingError, match="No implementation of function"):
            called.get_call_type(cpu_target.typing_context, (types.float32, types.Array(types.unicode_type, 1, "C")), {})

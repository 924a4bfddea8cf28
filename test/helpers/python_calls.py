"""How much work a call does, counted in calls of functions: the same on every machine and under any load, as seconds are not."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def counted_calls() -> Iterator[Callable[[], int]]:
    """Count the calls of Python and C functions in this thread while the block runs; call what it gives for the number so far."""
    count = 0

    def count_call(_frame: FrameType, event: str, _argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    before = sys.getprofile()
    sys.setprofile(count_call)
    try:
        yield lambda: count
    finally:
        sys.setprofile(before)

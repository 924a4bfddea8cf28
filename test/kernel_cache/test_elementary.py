"""Elementary functions of arrays against Python's, number by number."""

import math
from collections.abc import Callable

import numpy as np
import pytest

import kernel_cache.elementary as el

VALUES = np.concatenate([np.random.default_rng(2).uniform(1e-3, 1.0, 200), [1e-12, 0.5, 1.0]])


@pytest.mark.parametrize("name", ["exp", "expm1", "log", "log2", "log1p", "sin", "cos", "tan", "acos"])
def test_a_function_is_that_of_the_c_library_to_the_bit(name: str) -> None:
    function: Callable[[float], float] = getattr(math, name)
    found = getattr(el, {"acos": "arccos"}.get(name, name))(VALUES.reshape(29, 7))
    assert found.shape == (29, 7) and found.ravel().tolist() == [function(value) for value in VALUES.tolist()]


def test_functions_of_two_numbers_are_broadcast() -> None:
    powers = el.power(VALUES[:, None], [0.5, 2.4])
    assert powers.tolist() == [[math.pow(value, 0.5), math.pow(value, 2.4)] for value in VALUES.tolist()]
    assert el.arctan2(-1.0, VALUES).tolist() == [math.atan2(-1.0, value) for value in VALUES.tolist()]


def test_types_are_those_of_numpy_and_edges_are_numbers() -> None:
    assert el.sin(np.float32([0.5])).dtype == np.float32 and el.power(np.float32([2.0]), 3).dtype == np.float32
    assert el.cos(np.arange(3)).dtype == np.float64 and isinstance(el.exp(0.0), np.float64) and el.exp(0.0) == 1.0
    assert el.log(0.0) == -math.inf and math.isnan(el.arccos(1.5)) and el.sin(np.empty((0, 2))).shape == (0, 2)

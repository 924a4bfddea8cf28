"""Products of small matrices and vectors whose sums have one order, whatever the processor.

``@`` and LAPACK have other kernels for other processors, which sum in other orders or round once where these round twice.  These are
elementwise products and sums of numpy, which are exact in the same way everywhere.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

_FEW = 8
"""Up to so many terms are added in turn, more by numpy's own sum, and up to so many columns are computed one by one."""


def dot(a: ArrayLike, b: ArrayLike) -> Any:
    """Return the sums of products along the last axis, (...), of arrays (..., k) that are broadcast.

    In the wider of their two types: numpy before 2 would let a term of a vector, which is a scalar, have no say.
    """
    a, b = np.asarray(a), np.asarray(b)
    wider = np.result_type(a.dtype, b.dtype)
    a, b = a.astype(wider, copy=False), b.astype(wider, copy=False)
    if a.shape[-1] > _FEW:
        return (a * b).sum(axis=-1)
    total = a[..., 0] * b[..., 0]
    for k in range(1, a.shape[-1]):
        total = total + a[..., k] * b[..., k]
    return total


def matmul(a: ArrayLike, b: ArrayLike) -> Any:
    """Return ``a @ b``: of vectors (k,) and of matrices (..., n, k) and (..., k, m)."""
    a, b = np.asarray(a), np.asarray(b)
    if b.ndim == 1:
        return dot(a, b)
    if a.ndim == 1:
        return matmul(a[None], b)[..., 0, :]
    if b.shape[-1] <= _FEW:
        return np.stack([dot(a, b[..., None, :, j]) for j in range(b.shape[-1])], axis=-1)
    total = a[..., :, 0, None] * b[..., None, 0, :]
    for k in range(1, b.shape[-2]):
        total += a[..., :, k, None] * b[..., None, k, :]
    return total


def norm(vector: ArrayLike) -> float:
    """Return the Euclidean length of a vector (k,)."""
    return float(np.sqrt(dot(vector, vector)))


def determinant(matrix: NDArray[np.floating]) -> float:
    """Return the determinant of a 3x3 matrix."""
    return float(dot(matrix[0], np.cross(matrix[1], matrix[2])))


def inverse(matrix: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the inverse of a 3x3 matrix, by its cofactors."""
    a, b, c = np.asarray(matrix, np.float64)
    return np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1) / determinant(matrix)

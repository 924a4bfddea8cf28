"""Sample points that depend on nothing but their key: (scene, frame, pixel, sample, pair of dimensions).

The first two dimensions of Sobol's sequence, a (0, 2) sequence, shuffled and scrambled after Owen by hashing, and padded: every pair of
dimensions of every pixel is an independently scrambled copy (Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020; the hash is
Vegdahl's refinement of Laine and Karras's).  Any 2^m samples of a pixel are stratified in each pair.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import inlined, kernel
from renderer.core.ray_packet import LANES

_TO_UNIT = np.float32(2.0**-24)
_HASH_TO_UNIT = 2.0**-32
_GOLDEN = np.uint32(0x9E3779B9)
_BYTE = np.uint32(8)


def make_frame_key(scene_key: int, frame_index: int, apart: tuple[int, ...] = ()) -> np.uint32:
    """Return the key of one frame of one scene; ``apart`` are further numbers that tell cameras of one scene from each other."""
    return np.uint32(np.random.SeedSequence([scene_key, frame_index, *apart]).generate_state(1)[0])


@inlined
def unit_of(bits: np.uint32) -> np.float32:
    """Return a number in [0, 1), a multiple of 2^-24, by the upper 24 bits of a hash."""
    return np.float32(bits >> _BYTE) * _TO_UNIT


@kernel
def mix_bits(value: np.uint32) -> np.uint32:
    """Return a well-mixed 32-bit hash (multiply and shift, constants from C. Wellons' hash prospector)."""
    x = np.uint32(value)
    x = np.uint32(x ^ (x >> np.uint32(16)))
    x = np.uint32(x * np.uint32(0x7FEB352D))
    x = np.uint32(x ^ (x >> np.uint32(15)))
    x = np.uint32(x * np.uint32(0x846CA68B))
    return np.uint32(x ^ (x >> np.uint32(16)))


@kernel
def standard_normal(first: np.uint32, second: np.uint32) -> float:
    """Return a standard normal number from two hashes (Box and Muller 1958)."""
    u, v = (float(first) + 0.5) * _HASH_TO_UNIT, float(second) * _HASH_TO_UNIT
    normal: float = np.sqrt(-2.0 * np.log(u)) * np.cos(2.0 * np.pi * v)
    return normal


@kernel
def reverse_bits(value: np.uint32) -> np.uint32:
    """Return the 32 bits in reverse order."""
    x = np.uint32(value)
    x = np.uint32(((x >> np.uint32(1)) & np.uint32(0x55555555)) | np.uint32((x & np.uint32(0x55555555)) << np.uint32(1)))
    x = np.uint32(((x >> np.uint32(2)) & np.uint32(0x33333333)) | np.uint32((x & np.uint32(0x33333333)) << np.uint32(2)))
    x = np.uint32(((x >> np.uint32(4)) & np.uint32(0x0F0F0F0F)) | np.uint32((x & np.uint32(0x0F0F0F0F)) << np.uint32(4)))
    x = np.uint32(((x >> np.uint32(8)) & np.uint32(0x00FF00FF)) | np.uint32((x & np.uint32(0x00FF00FF)) << np.uint32(8)))
    return np.uint32((x >> np.uint32(16)) | np.uint32(x << np.uint32(16)))


@kernel
def owen_scramble_reversed(value: np.uint32, seed: np.uint32) -> np.uint32:
    """Return a permutation of 32-bit numbers in which each bit depends on lower bits only: Owen scrambling of reversed numbers."""
    x = np.uint32(value)
    x = np.uint32(x ^ np.uint32(x * np.uint32(0x3D20ADEA)))
    x = np.uint32(x + seed)
    x = np.uint32(x * np.uint32((seed >> np.uint32(16)) | np.uint32(1)))
    x = np.uint32(x ^ np.uint32(x * np.uint32(0x05526C56)))
    return np.uint32(x ^ np.uint32(x * np.uint32(0x53A22864)))


@kernel
def sobol_second_reversed(value: np.uint32) -> np.uint32:
    """Return Pascal's triangle mod 2 times the bits: the reversed second Sobol coordinate of index ``value``.

    The matrix is the fifth Kronecker power of [[1, 1], [0, 1]], hence five butterfly steps.
    """
    x = np.uint32(value)
    x = np.uint32(x ^ ((x >> np.uint32(1)) & np.uint32(0x55555555)))
    x = np.uint32(x ^ ((x >> np.uint32(2)) & np.uint32(0x33333333)))
    x = np.uint32(x ^ ((x >> np.uint32(4)) & np.uint32(0x0F0F0F0F)))
    x = np.uint32(x ^ ((x >> np.uint32(8)) & np.uint32(0x00FF00FF)))
    return np.uint32(x ^ (x >> np.uint32(16)))


@kernel
def sample_2d(seeds: NDArray[np.uint32], index: np.uint32, pair: np.uint32, points: NDArray[np.float32]) -> None:
    """Write sample ``index`` of dimension pair ``pair`` of 16 pixels: points[k] and points[16 + k] in [0, 1).

    ``seeds``: (16,) uint32, one hash per pixel; ``points``: (32,) float32.
    """
    reversed_index = reverse_bits(index)
    for k in range(LANES):
        seed = mix_bits(np.uint32(seeds[k] + np.uint32(pair * _GOLDEN)))
        shuffled = reverse_bits(owen_scramble_reversed(reversed_index, seed))
        x = reverse_bits(owen_scramble_reversed(shuffled, mix_bits(np.uint32(seed + np.uint32(1)))))
        y = reverse_bits(owen_scramble_reversed(sobol_second_reversed(shuffled), mix_bits(np.uint32(seed + np.uint32(2)))))
        points[k] = unit_of(x)
        points[LANES + k] = unit_of(y)

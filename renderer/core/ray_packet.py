"""Rays as kernels hand them to Embree: *packets* of 16 with their hits.

A packet is a flat float32 array on a 64-byte boundary with the layout of Embree's ``RTCRayHit16``: each field is 16 neighbouring numbers,
field ``TFAR`` of lane k is ``packet.real[TFAR + k]``; integer fields are seen through a uint32 view of the same memory.  (Flat with
constant offsets, because LLVM then knows that fields never overlap and vectorises loops over lanes.)
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

LANES = 16
PACKET_SIZE = 24 * LANES
"""21 fields of ``RTCRayHit16``, and room for what later versions append."""
ORG_X, ORG_Y, ORG_Z, TNEAR, DIR_X, DIR_Y, DIR_Z, TIME, TFAR, MASK, ID, FLAGS = range(0, 12 * LANES, LANES)
NG_X, NG_Y, NG_Z, BARY_U, BARY_V, PRIM_ID, GEOM_ID, INST_ID, INST_PRIM_ID = range(12 * LANES, 21 * LANES, LANES)
NEAREST, FIRST_FACE = 21 * LANES, 22 * LANES
"""Where the filter of a steady scene keeps the distance and the face of the hit that it has taken.

The filter may get copies of a packet's rays, as of half a packet: each ray says by ``ID`` and ``TIME``, the low and the high half of an
address, where its own are kept.  Nothing moves in these scenes, so Embree does not look at the time.
"""
INVALID_ID = np.uint32(0xFFFFFFFF)
"""``GEOM_ID`` of a ray without a hit (RTC_INVALID_GEOMETRY_ID)."""
MEET_ALL, PASS_PANES = np.uint32(0xFFFFFFFF), np.uint32(1)
"""``MASK`` of rays: such as meet every triangle, and such as panes do not stop."""


class Packet(NamedTuple):
    """16 rays and their hits: float32 and uint32 views of one memory, (PACKET_SIZE,), and which lanes are alive: (16,) int32, -1 or 0.

    The memory goes on behind ``alive`` with room for half a packet, see :func:`intersect16`.
    """

    real: NDArray[np.float32]
    integer: NDArray[np.uint32]
    alive: NDArray[np.int32]


def aligned_floats(count: int) -> NDArray[np.float32]:
    """Return ``count`` zeros, float32, on a 64-byte boundary."""
    memory = np.zeros(count + LANES, np.float32)
    start = (-memory.ctypes.data % 64) // 4
    return memory[start : start + count]


def make_packet() -> Packet:
    """Return a packet on a 64-byte boundary, all rays alive, ray mask set."""
    memory = aligned_floats(PACKET_SIZE + LANES + PACKET_SIZE // 2)
    real, alive = memory[:PACKET_SIZE], memory[PACKET_SIZE : PACKET_SIZE + LANES].view(np.int32)
    integer = real.view(np.uint32)
    integer[MASK : MASK + LANES] = MEET_ALL
    kept = np.uint64(real[NEAREST:].ctypes.data) + 4 * np.arange(LANES, dtype=np.uint64)
    integer[ID : ID + LANES], integer[TIME : TIME + LANES] = kept & np.uint64(0xFFFFFFFF), kept >> np.uint64(32)
    alive[:] = -1
    return Packet(real, integer, alive)

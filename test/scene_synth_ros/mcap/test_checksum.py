"""The checksum of MCAP is that of zlib, whichever library computes it; 0xCBF43926 is the check value of CRC-32/ISO-HDLC."""

from scene_synth_ros.mcap.records import crc32


def test_checksums_are_known_and_continue() -> None:
    assert crc32(b"123456789") == crc32(memoryview(b"56789"), crc32(b"1234")) == 0xCBF43926

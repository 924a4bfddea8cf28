"""Readers with known faults, which a campaign has to find."""

from __future__ import annotations

import os
import time
from pathlib import Path

from fuzz.cases import Reader

SAMPLE = b'{"a": 1, "b": [2, 3]}'


class Refusal(Exception):
    """The error that these readers may raise."""


def refuse_lines(data: bytes, folder: Path) -> None:
    if data != SAMPLE:
        raise Refusal("two\nlines")


def hide_memory(data: bytes, folder: Path) -> None:
    try:
        bytearray(0 if data == SAMPLE else 3 * 2**30)
    except Exception as error:
        raise Refusal("cannot be read") from error


def end(data: bytes, folder: Path) -> None:
    if data != SAMPLE:
        os.abort()


def turn(data: bytes, folder: Path) -> None:
    began = time.process_time()
    while data != SAMPLE and time.process_time() - began < 60.0:
        pass


def wait(data: bytes, folder: Path) -> None:
    time.sleep(0.0 if data == SAMPLE else 60.0)


def refuse(data: bytes, folder: Path) -> None:
    if data != SAMPLE:
        raise Refusal(f"{len(data)} bytes")


READERS = {
    name: Reader(kind="json", make=lambda: [SAMPLE], read=read, refusals=(Refusal,))
    for name, read in (("line", refuse_lines), ("memory", hide_memory), ("crash", end), ("turning", turn), ("waiting", wait))
}
READERS["exception"] = Reader(kind="json", make=lambda: [SAMPLE], read=lambda data, folder: data.decode("ascii").index("b"), refusals=())
SOUND = {"sound": Reader(kind="json", make=lambda: [SAMPLE], read=lambda data, folder: None, refusals=())}
SOUND["refusing"] = Reader(kind="text", make=lambda: [SAMPLE], read=refuse, refusals=(Refusal,))

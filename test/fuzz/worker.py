"""Runs cases of fuzzing in a process of its own, with bounds of memory; started by ``campaign``, to which it speaks in lines.

It reads orders ``READER FIRST LAST`` and writes ``case NUMBER`` before each, ``fault {...}`` for what it finds and ``done`` after an order.
"""

from __future__ import annotations

import contextlib
import json
import os
import resource
import sys
import time
import traceback
from pathlib import Path

from fuzz.cases import Reader, make_case, readers_of

BEYOND_BASE = 2**30
"""Bytes of address space that a case may take beyond what the process has before it."""
_LONGEST_LINE = 5000


def fault_of(reader: Reader, data: bytes, folder: Path, seconds: float) -> dict[str, str] | None:
    """Return what is wrong with how a reader takes a case: kind, text and place; None if it reads or refuses it."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + BEYOND_BASE, resource.RLIM_INFINITY))
    began, fault = time.process_time(), None
    try:
        reader.read(data, folder)
    except BaseException as error:
        fault = _judged(error, reader)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    if fault is None and time.process_time() - began > seconds:
        return {"kind": "slow", "text": f"{time.process_time() - began:.1f} s", "place": ""}
    return fault


def _judged(error: BaseException, reader: Reader) -> dict[str, str] | None:
    chain: list[BaseException] = []
    link: BaseException | None = error
    while link is not None and link not in chain:
        chain.append(link)
        link = link.__cause__ or link.__context__
    memory = next((link for link in chain if isinstance(link, MemoryError)), None)
    if memory is not None:
        return {"kind": "memory", "text": _line(memory), "place": _place(memory)}
    if not isinstance(error, reader.refusals):
        return {"kind": "exception", "text": _line(error), "place": _place(error)}
    text = str(error)
    if not text.isprintable() or not 0 < len(text) <= _LONGEST_LINE:
        odd = sorted({ascii(letter) for letter in text if not letter.isprintable()})
        return {"kind": "line", "text": f"{len(text)} characters, with {' '.join(odd[:5])}: {_line(error)}", "place": _place(error)}
    return None


def _line(error: BaseException) -> str:
    return f"{type(error).__name__}: {str(error)[:300]!a}"


def _place(error: BaseException) -> str:
    """Return the innermost place of the program's own code, and the innermost of all."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if not any(part in frame.filename for part in ("site-packages", "/test/", "/lib/python"))]
    return " < ".join(f"{Path(frame.filename).name}:{frame.lineno} {frame.name}" for frame in (*frames[-1:], *own[-1:]))


def main() -> None:
    """Serve orders until the end of standard input."""
    table, seed, seconds, folder = sys.argv[1], int(sys.argv[2]), float(sys.argv[3]), Path(sys.argv[4], str(os.getpid()))
    out = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # what readers print is none of the lines
    readers = readers_of(table)
    warmed: set[str] = set()
    folder.mkdir()
    with contextlib.suppress(BrokenPipeError):
        for order in sys.stdin:
            name, first, last = order.rsplit(maxsplit=2)
            for sample in () if name in warmed else readers[name].samples:
                readers[name].read(sample, folder)
            warmed.add(name)
            for number in range(int(first), int(last)):
                out.write(f"case {number}\n")
                fault = fault_of(readers[name], make_case(name, readers[name], seed, number).data, folder, seconds)
                if fault is not None:
                    out.write(f"fault {json.dumps(fault)}\n")
            out.write("done\n")


if __name__ == "__main__":
    main()

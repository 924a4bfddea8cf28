"""Fuzzing of a table of readers in worker processes: every case is read or refused in one line, within bounds of time and memory.

``.venv/bin/python test/fuzz/campaign.py --cases 100000 [--seed S] [--reader NAME]`` prints figures and faults,
``.venv/bin/python test/fuzz/campaign.py --reader NAME --seed S --case K [--save FILE]`` runs one case again, with its traceback.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import selectors
import subprocess
import sys
import tempfile
import time
from collections import Counter, deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
if __name__ == "__main__":
    sys.path[:0] = [str(ROOT), str(ROOT / "test"), str(ROOT / "test/helpers")]

from fuzz.cases import Reader, make_case, readers_of  # noqa: E402

TABLE = "fuzz.readers:READERS"
WORKERS = 2
_ORDER = 40
_TICK = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Fault:
    """What a case did that it must not: ``kind`` is crash, hang, slow, memory, exception or line."""

    reader: str
    seed: int
    number: int
    mutations: tuple[str, ...]
    kind: str
    text: str
    place: str

    def __str__(self) -> str:
        again = f"--reader {self.reader} --seed {self.seed} --case {self.number}"
        return f"{self.reader}: {self.kind}: {self.text} at {self.place} after {', '.join(self.mutations)}; again: campaign.py {again}"


@dataclass(frozen=True)
class Outcome:
    """Cases by reader, the faults that they found, and how long it took."""

    cases: Mapping[str, int]
    faults: tuple[Fault, ...]
    seconds: float

    def report(self) -> str:
        """Return a table of readers, and one line for each fault that differs from the others."""
        found = Counter(fault.reader for fault in self.faults)
        rows = [f"{name:24s}{count:9d} cases{found[name]:7d} faults" for name, count in self.cases.items()]
        alike = {(fault.reader, fault.kind, fault.place, fault.text[:30]): fault for fault in reversed(self.faults)}
        total = f"{sum(self.cases.values())} cases, {len(self.faults)} faults of {len(alike)} kinds in {self.seconds:.0f} s"
        return "\n".join([*rows, *map(str, alike.values()), total])


class _Worker:
    """A process that runs orders, started again where a case ends it."""

    def __init__(self, table: str, seed: int, seconds: float, folder: str) -> None:
        self._command = [sys.executable, "-m", "fuzz.worker", table, str(seed), str(seconds), folder]
        self._seconds = seconds
        self.start()

    def start(self) -> None:
        paths = os.pathsep.join([str(ROOT), str(ROOT / "test"), str(ROOT / "test/helpers")])
        self.process = subprocess.Popen(
            self._command,
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": paths, "OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
        )
        self.order: tuple[str, int, int] | None = None
        self.case: int | None = None
        self._text = b""

    def give(self, order: tuple[str, int, int]) -> None:
        self.order, self.case = order, None
        assert self.process.stdin is not None
        self.process.stdin.write("{} {} {}\n".format(*order).encode())
        self._began = self._spent()

    def lines(self) -> Iterator[tuple[str, str]]:
        """Yield the lines that are there as (first word, rest); ("end", "") where the process has ended."""
        assert self.process.stdout is not None
        data = os.read(self.process.stdout.fileno(), 1 << 16)
        *lines, self._text = (self._text + data).split(b"\n")
        for line in lines:
            word, _, rest = line.decode().partition(" ")
            if word == "case":
                self.case, self._began = int(rest), self._spent()
            yield word, rest
        if not data:
            yield "end", ""

    def hangs(self) -> bool:
        """Return whether the case has used up its time; a machine that is busy does not count, a case that sleeps does."""
        processor, clock = (now - then for now, then in zip(self._spent(), self._began, strict=True))
        return self.case is not None and (processor > self._seconds or clock > 6.0 * self._seconds)

    def _spent(self) -> tuple[float, float]:
        try:
            fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            return 0.0, time.monotonic()
        return (int(fields[11]) + int(fields[12])) / _TICK, time.monotonic()

    def end(self) -> None:
        self.process.kill()
        self.process.wait()
        for pipe in (self.process.stdin, self.process.stdout):
            if pipe is not None:
                pipe.close()


def run_campaign(cases: int, seed: int, *, table: str = TABLE, only: str = "", seconds: float = 10.0) -> Outcome:
    """Run so many cases over all readers of a table, or one, each reader's part by its share.

    Args:
        cases: at least so many.
        seed: of all choices.
        table: ``module:name`` of the readers.
        only: name of a reader; empty: all.
        seconds: of the processor that a case may take.
    """
    began = time.monotonic()
    readers = {name: reader for name, reader in readers_of(table).items() if only in ("", name)}
    whole = sum(reader.share for reader in readers.values())
    counts = {name: math.ceil(cases * reader.share / whole) for name, reader in readers.items()}
    with tempfile.TemporaryDirectory(prefix="fuzz_") as folder:
        campaign = _Campaign(readers, seed, counts)
        campaign.run([_Worker(table, seed, seconds, folder) for _ in range(WORKERS)])
    return Outcome(counts, tuple(campaign.faults), time.monotonic() - began)


class _Campaign:
    """Hands out orders to workers and gathers what they find."""

    def __init__(self, readers: Mapping[str, Reader], seed: int, counts: Mapping[str, int]) -> None:
        self._readers, self._seed = readers, seed
        spans = ((name, first, min(first + _ORDER, count)) for name, count in counts.items() for first in range(0, count, _ORDER))
        self._orders = deque(spans)
        self._selector = selectors.DefaultSelector()
        self.faults: list[Fault] = []

    def run(self, workers: Sequence[_Worker]) -> None:
        try:
            for worker in workers:
                self._begin(worker)
            while any(worker.order for worker in workers):
                for key, _ in self._selector.select(0.5):
                    self._listen(key.data)
                for worker in workers:
                    if worker.order and worker.hangs():
                        self._replace(worker, "hang")
        finally:
            self._selector.close()
            for worker in workers:
                worker.end()

    def _listen(self, worker: _Worker) -> None:
        for word, rest in worker.lines():
            if word == "fault":
                self._note(worker, **json.loads(rest))
            elif word == "done":
                self._give_next(worker)
            elif word == "end":
                self._replace(worker, "crash")

    def _begin(self, worker: _Worker) -> None:
        self._selector.register(worker.process.stdout, selectors.EVENT_READ, worker)  # type: ignore[arg-type]
        self._give_next(worker)

    def _give_next(self, worker: _Worker) -> None:
        worker.order = worker.case = None
        if self._orders:
            worker.give(self._orders.popleft())

    def _replace(self, worker: _Worker, kind: str) -> None:
        """Note a case that ended its process, or has to be ended, and go on after it."""
        self._selector.unregister(worker.process.stdout)  # type: ignore[arg-type]
        order, case = worker.order, worker.case
        worker.end()
        if order is not None and case is None:
            raise RuntimeError(
                f"a worker ended with {worker.process.returncode} before the first case of {order[0]}: are its samples valid?"
            )
        if order is not None and case is not None:
            self._note(worker, kind, f"status {worker.process.returncode}", "?")
            if case + 1 < order[2]:
                self._orders.appendleft((order[0], case + 1, order[2]))
        worker.start()
        self._begin(worker)

    def _note(self, worker: _Worker, kind: str, text: str, place: str) -> None:
        assert worker.order is not None and worker.case is not None
        name = worker.order[0]
        mutations = make_case(name, self._readers[name], self._seed, worker.case).mutations
        self.faults.append(Fault(name, self._seed, worker.case, mutations, kind, text, place))


def main() -> None:
    """Run a campaign, or one case again."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=time.time_ns() % 2**32, help="drawn from the clock where there is none")
    parser.add_argument("--reader", default="")
    parser.add_argument("--case", type=int, help="run this one only, in this process")
    parser.add_argument("--save", type=Path, help="write the bytes of the case")
    parser.add_argument("--table", default=TABLE)
    arguments = parser.parse_args()
    if arguments.case is None:
        print(f"seed {arguments.seed}")
        print(run_campaign(arguments.cases, arguments.seed, table=arguments.table, only=arguments.reader).report())
        return
    reader = readers_of(arguments.table)[arguments.reader]
    case = make_case(arguments.reader, reader, arguments.seed, arguments.case)
    print(f"{len(case.data)} bytes after {', '.join(case.mutations)}: {case.data[:500]!r}")
    if arguments.save:
        arguments.save.write_bytes(case.data)
    with tempfile.TemporaryDirectory(prefix="fuzz_") as folder:
        print(f"read: {reader.read(case.data, Path(folder))!r:.500}")


if __name__ == "__main__":
    main()

"""Processes that compile the same kernel at the same time."""

import os
import signal
import subprocess
import sys
import time

import pytest

from kernel_cache import turns
from kernel_cache.turns import Turns

KERNEL = """
from kernel_cache.compiling import compiled

def total(count):
    return count + 1

total = compiled(total)
"""
COMPILE = """
import sys, time
from numba.core import event

class Slow(event.Listener):
    def on_start(self, found):
        print("compiles", flush=True)
        time.sleep({pause_s})

    def on_end(self, found):
        pass

event.register("numba:compile", Slow())
from kernels import total
print(total(1), flush=True)
"""


def start(folder, pause_s):
    (folder / "kernels.py").write_text(KERNEL)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache"), "PYTHONPATH": f"{folder}{os.pathsep}{os.getcwd()}"}
    return subprocess.Popen([sys.executable, "-c", COMPILE.format(pause_s=pause_s)], env=environment, stdout=subprocess.PIPE, text=True)


def finish(process):
    out, _ = process.communicate(timeout=60)
    return out.split()


def test_who_comes_second_waits_and_loads(tmp_path):
    first = start(tmp_path, 3.0)
    assert first.stdout.readline() == "compiles\n"
    second = start(tmp_path, 0.0)
    assert finish(second) == ["2"]
    assert finish(first) == ["2"]


def test_a_turn_ends_with_a_killed_process(tmp_path):
    first = start(tmp_path, 60.0)
    assert first.stdout.readline() == "compiles\n"
    second = start(tmp_path, 0.0)
    time.sleep(0.2)
    first.send_signal(signal.SIGKILL)
    assert finish(second) == ["compiles", "2"]
    first.communicate()


def hold(folder, kernel):
    take = f"from kernel_cache.turns import Turns\nTurns.of({str(folder)!r}).take({kernel!r})"
    code = f"import sys\n{take}\nprint('held', flush=True)\nsys.stdin.read()"
    process = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "held\n"
    return process


@pytest.mark.parametrize("kernel, waits", [("a (int64,)", True), ("a (float64,)", False), ("b (int64,)", False)])
def test_a_turn_is_of_one_kernel_and_signature(tmp_path, monkeypatch, kernel, waits):
    monkeypatch.setattr(turns, "_LONGEST_S", 0.3)
    with hold(tmp_path, "a (int64,)") as holder:
        began = time.monotonic()
        mine = Turns(str(tmp_path))
        mine.take(kernel)  # a process that has stopped is not waited for without end
        assert (time.monotonic() - began > 0.25) == waits
        mine.end(kernel)
        holder.stdin.close()


def test_where_no_file_can_be_locked_nobody_waits(tmp_path):
    (tmp_path / "file").write_text("")
    nowhere = Turns(str(tmp_path / "file" / "folder"))
    nowhere.take("a")
    nowhere.end("a")

"""The kernels' cache on disk, as processes that write it at the same time leave it."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest
from numba import config
from numba.core.registry import cpu_target

from kernel_cache.compiling import KernelCache, SealedCacheFile, compiled, is_kept
from kernel_cache.processor import COMMON


def cache(folder: Path, stamp: str) -> SealedCacheFile:
    return SealedCacheFile(str(folder), "kernel", stamp)


def test_an_entry_comes_back_for_its_key_and_sources_only(tmp_path):
    cache(tmp_path, "old").save("float32", "code")
    assert cache(tmp_path, "old").load("float32") == "code"
    assert cache(tmp_path, "old").load("float64") is None
    assert cache(tmp_path, "new").load("float32") is None


def test_data_that_another_process_has_not_yet_replaced_is_no_entry(tmp_path):
    cache(tmp_path, "old").save("float32", "old code")
    # the other one has written its index, and not yet the data
    cache(tmp_path, "new")._save_index({"float32": "kernel.1.nbc"})
    assert cache(tmp_path, "new").load("float32") is None
    cache(tmp_path, "new").save("float32", "new code")
    assert cache(tmp_path, "new").load("float32") == "new code"


def test_two_signatures_that_were_written_to_one_file_do_not_stand_for_each_other(tmp_path):
    cache(tmp_path, "new").save("float32", "code of float32")
    # the other one began with an empty index, too, and was the last to write it
    cache(tmp_path, "new")._save_index({"float64": "kernel.1.nbc"})
    assert cache(tmp_path, "new").load("float64") is None
    cache(tmp_path, "new").save("float32", "code of float32")
    cache(tmp_path, "new").save("float64", "code of float64")
    assert [cache(tmp_path, "new").load(key) for key in ("float32", "float64")] == ["code of float32", "code of float64"]


class Gone:
    """Pickled by name, so that it cannot be read back once the name is away."""


def test_entries_of_classes_that_are_gone_count_as_absent(tmp_path, monkeypatch):
    key = Gone()
    cache(tmp_path, "old").save(key, Gone)
    monkeypatch.delattr(f"{__name__}.Gone")
    assert cache(tmp_path, "new").load("float32") is None
    cache(tmp_path, "new").save("float32", "code")
    assert cache(tmp_path, "new").load("float32") == "code"


def test_kernels_work_where_no_folder_can_be_written(monkeypatch, capsys):
    monkeypatch.setattr(KernelCache._impl_class, "_locator_classes", [])
    assert [compiled(lambda x: x + 1)(1), compiled(lambda x: x + 2)(1)] == [2, 3]
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and lines[0].endswith("set NUMBA_CACHE_DIR to a folder that can be written")


def test_a_kernel_is_kept_once_it_is_compiled(monkeypatch, tmp_path):
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    kernel = compiled(lambda x: x + 3)
    assert not is_kept(kernel)
    kernel(1)
    assert is_kept(kernel)
    monkeypatch.setattr(KernelCache._impl_class, "_locator_classes", [])
    assert not is_kept(compiled(lambda x: x + 3))


@pytest.mark.parametrize("name", ["kernel.nbi", "kernel.1.nbc"])
def test_files_that_are_not_whole_count_as_absent(tmp_path, name):
    cache(tmp_path, "new").save("float32", "code")
    whole = (tmp_path / name).read_bytes()
    for damaged in (b"", whole[:20], whole[:-9], whole[:-9] + b"?" + whole[-8:], bytes(len(whole)), whole + b"?"):
        (tmp_path / name).write_bytes(damaged)
        assert cache(tmp_path, "new").load("float32") is None
        cache(tmp_path, "new").save("float32", "code")
        assert cache(tmp_path, "new").load("float32") == "code"


def test_a_file_that_cannot_be_read_counts_as_absent(tmp_path):
    for name in ("kernel.nbi", "kernel.1.nbc"):
        (tmp_path / name).mkdir()
    assert cache(tmp_path, "new").load("float32") is None


def test_kernels_work_when_the_disk_is_full(monkeypatch, capsys):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(SealedCacheFile, "_write", full)
    assert [compiled(lambda x: x + 1)(1), compiled(lambda x: x + 2)(1)] == [2, 3]
    (line,) = capsys.readouterr().err.splitlines()
    assert "No space left on device" in line


CONSTANT = """
VALUE = {value}
"""
KERNELS = """
from grammar.constant import VALUE
from kernel_cache.compiling import LinkedCompiler, compiled

def share(count):
    return count * VALUE

inner = compiled(share, no_cpython_wrapper=True, pipeline_class=LinkedCompiler)

def total(count):
    return inner(count) + 1

outer = compiled(total)
"""
AT_ONCE = """
import os, random, signal, sys, time
from pathlib import Path
import kernel_cache.compiling

SEED, ROUNDS = map(int, sys.argv[1:])
PROCESSES, TYPES = 3, (1, 1.5)

def work(value, types):
    from grammar.kernels import outer
    for count in types:
        assert outer(count) == count * value + 1, (outer(count), count, value)
    return sum(outer.stats.cache_hits.values())

def start(value, types, all_found=False):
    if process := os.fork():
        return process
    status = 1
    try:
        status = 0 if work(value, types) == len(types) or not all_found else 2
    finally:
        sys.stderr.flush()
        os._exit(status)

def status_of(process):
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])

draw = random.Random(SEED)
seconds = 0.5
for value in range(2, 2 + ROUNDS):
    Path("grammar/constant.py").write_text(f"VALUE = {value}")
    began = time.monotonic()
    running = [start(value, draw.sample(TYPES, len(TYPES))) for _ in range(PROCESSES)]
    time.sleep(draw.uniform(0.0, seconds))
    killed = running.pop()
    os.kill(killed, signal.SIGKILL)
    assert {status_of(process) for process in running} == {0} and status_of(killed) in (0, -signal.SIGKILL)
    seconds = time.monotonic() - began
    for all_found in (False, True):
        assert status_of(start(value, TYPES, all_found)) == 0, (value, all_found)
"""


def test_first_kernels_of_processes_at_once_of_which_some_are_killed_are_right_and_kept(tmp_path: Path) -> None:
    """In rounds, before each of which a constant changes that the kernels take in; every process that is not killed gets it right."""
    (tmp_path / "grammar").mkdir()
    for name, text in {"__init__": "", "kernels": KERNELS}.items():
        (tmp_path / "grammar" / f"{name}.py").write_text(text)
    (tmp_path / "kernel_cache").symlink_to(Path(__file__).parents[2] / "kernel_cache")
    env = {**os.environ, "PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1", "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    done = subprocess.run([sys.executable, "-c", AT_ONCE, "1", "2"], cwd=tmp_path, env=env, capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")


def test_one_cache_serves_all_processors_with_avx2():
    """What numba puts into the key of an entry: the triple, the processor, its features."""
    assert not COMMON or cpu_target.target_context.codegen().magic_tuple()[1:] == ("x86-64-v3", "")

"""The kernels' cache on disk, as processes that write it at the same time leave it."""

from pathlib import Path

from numba.core.registry import cpu_target

from kernel_cache.compiling import KernelCache, SealedCacheFile, compiled
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
    assert len(lines) == 1 and lines[0].endswith("set NUMBA_CACHE_DIR to a folder that can")


def test_one_cache_serves_all_processors_with_avx2():
    """What numba puts into the key of an entry: the triple, the processor, its features."""
    assert not COMMON or cpu_target.target_context.codegen().magic_tuple()[1:] == ("x86-64-v3", "")

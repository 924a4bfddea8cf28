"""How kernels are compiled fast and kept on disk.

A kernel that only kernels call needs no machine code of its own: numba links its LLVM module into those of its callers, and optimises and
translates the whole there.  Left to itself numba does both at every step of a chain of calls, for all that hangs on the kernel.

A kernel takes the kernels that it calls, and constants, from other files into its machine code, so its cache is renewed when one of these
changes: no process can run a stale kernel.  Processes that compile at the same time share the files: numba writes its index before the data
that it points to, under names that count up and are used again, so what a file holds is told by the file itself.  What one of them
compiles the others wait for (:mod:`kernel_cache.turns`).

What is private to numba and used here stands in ``test/kernel_cache/test_numba_interfaces.py``, which names what a new version has lost.
"""

import hashlib
import inspect
import pickle
import sys
from collections.abc import Callable
from functools import cache, wraps
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder

from kernel_cache.call_types import remember_call_types
from kernel_cache.processor import compile_for_all
from kernel_cache.sources import source_stamp
from kernel_cache.turns import Turns

_SEAL_BYTES = 32

compile_for_all()
remember_call_types()


def compiled(function: Callable[..., Any], **settings: Any) -> Any:
    """Return a function that numba compiles in nopython mode with some settings, when it is first called, and keeps on disk."""
    dispatcher = njit(**settings)(function)
    try:
        dispatcher._cache = KernelCache(function)
    except RuntimeError:  # numba has found no folder that it can write
        _say_uncached("neither the package's folder nor the user's cache folder can be written")
    else:
        dispatcher.compile = dispatcher._cache.ending_turns(dispatcher.compile)
    return dispatcher


def is_kept(kernel: Any) -> bool:
    """Return whether something that was compiled of a kernel, of its present sources, is on disk."""
    kept = kernel._cache
    return isinstance(kept, KernelCache) and bool(kept._cache_file._load_index())


@cache
def _say_uncached(why: str) -> None:
    """Tell it once a process."""
    sys.stderr.write(f"kernels are compiled anew in every process: {why}; set NUMBA_CACHE_DIR to a folder that can be written\n")


class KernelCache(FunctionCache):  # type: ignore[misc]
    """Numba's cache of one function on disk, good for the sources of the function's file and of all that this imports from here."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        stamp = source_stamp(inspect.getfile(function))
        self._cache_file = SealedCacheFile(self._cache_path, self._impl.filename_base, stamp)
        self._turns = Turns.of(self._cache_path)

    def load_overload(self, sig: object, target_context: Any) -> Any:
        """Return what was compiled of a signature, None if it is this process's turn to compile it."""
        kept = super().load_overload(sig, target_context)
        if kept is None:
            self._turns.take(self._kernel(sig))
            kept = super().load_overload(sig, target_context)
        return kept

    def ending_turns(self, compile_overload: Callable[[Any], Any]) -> Callable[[Any], Any]:
        """Return a dispatcher's method that compiles, such that the turn ends that it took, whether or not it compiled."""

        @wraps(compile_overload)
        def compile_in_turn(sig: Any) -> Any:
            try:
                return compile_overload(sig)
            finally:
                self._turns.end(self._kernel(sig))

        return compile_in_turn

    def _kernel(self, sig: object) -> str:
        return f"{self._impl.filename_base} {sig}"

    def save_overload(self, sig: object, data: object) -> None:
        """Keep what was compiled; where that cannot be, on a full disk for one, it works all the same in this process."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            _say_uncached(f"they cannot be kept, {error.strerror}")


class SealedCacheFile(IndexDataCacheFile):  # type: ignore[misc]
    """Numba's index and data files, each sealed by a digest of what is in it and of the sources.

    A file that is not whole, or cannot be read, or is of other sources or another version of numba, counts as absent, and so does data of
    another key.  None of these is unpickled, so classes that it names may be gone.
    """

    def save(self, key: object, data: object) -> None:
        """Write an entry."""
        super().save(key, (key, data))

    def load(self, key: object) -> Any:
        """Return the data of an entry, None if there is none."""
        of, data = super().load(key) or (None, None)
        return data if of == key else None

    def _save_index(self, overloads: dict[object, str]) -> None:
        self._write(self._index_path, overloads)

    def _load_index(self) -> dict[object, str]:
        return self._read(self._index_path) or {}

    def _save_data(self, name: str, data: object) -> None:
        self._write(self._data_path(name), data)

    def _load_data(self, name: str) -> Any:
        return self._read(self._data_path(name))

    def _write(self, path: str, content: object) -> None:
        pickled = self._dump(content)
        with self._open_for_write(path) as file:
            file.write(self._seal(pickled) + pickled)

    def _read(self, path: str) -> Any:
        """Return the content of a file, None if there is none that counts."""
        try:
            found = Path(path).read_bytes()
        except OSError:
            return None
        seal, pickled = found[:_SEAL_BYTES], found[_SEAL_BYTES:]
        return pickle.loads(pickled) if seal == self._seal(pickled) else None

    def _seal(self, pickled: bytes) -> bytes:
        digest = hashlib.blake2b(f"{self._version} {self._source_stamp}".encode(), digest_size=_SEAL_BYTES)
        digest.update(pickled)
        return digest.digest()


class _NoEnvironment:
    """Stands where numba tells the machine code of a function its environment; there is none of either."""

    def set_env(self, name: str, environment: object) -> None:
        """Do nothing."""


class LinkedLibrary(JITCodeLibrary):  # type: ignore[misc]
    """The LLVM module of a kernel that only kernels call, to be linked into theirs: neither optimised here nor made machine code."""

    codegen = _NoEnvironment()

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0, numba's word for a function that Python cannot call."""
        return 0

    def serialize_using_object_code(self) -> Any:
        """Return what the cache keeps: the LLVM module."""
        return self.serialize_using_bitcode()


class OptimizedLibrary(LinkedLibrary):
    """One that is optimised first: a caller's loops are smaller for it, which made the path tracer a twentieth faster."""

    def _optimize_final_module(self) -> None:
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)


class LinkedCompiler(CompilerBase):  # type: ignore[misc]
    """Numba's compiler, for kernels that only kernels call.

    Attributes:
        library: the kind of library that it makes.
    """

    library: type[LinkedLibrary] = LinkedLibrary

    def define_pipelines(self) -> list[Any]:
        """Return numba's pipeline, which is to fill such a library."""
        self.state.library = self.library(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        return [DefaultPassBuilder.define_nopython_pipeline(self.state)]

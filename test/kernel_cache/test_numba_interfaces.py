"""What kernels use of numba beyond its public interface is there, so that a new version tells by name what it has lost."""

from typing import Any

import numba
import pytest
from numba.core import caching, codegen, compiler
from numba.core.options import TargetOptions
from numba.core.targetconfig import Option
from numba.core.types import functions

from kernel_cache.compiling import KernelCache, LinkedCompiler, compiled

INTERFACES: dict[str, tuple[Any, tuple[str, ...]]] = {
    "caching.FunctionCache": (caching.FunctionCache, ("_impl_class", "load_overload", "save_overload")),
    "caching.IndexDataCacheFile": (caching.IndexDataCacheFile, ("save", "load", "_dump", "_save_index", "_load_index")),
    "codegen.JITCodeLibrary": (
        codegen.JITCodeLibrary,
        (
            "codegen",
            "_optimize_final_module",
            "_finalize_final_module",
            "_finalize_dynamic_globals",
            "_verify_declare_only_symbols",
            "get_pointer_to_function",
            "serialize_using_object_code",
            "serialize_using_bitcode",
        ),
    ),
    "codegen.JITCPUCodegen": (codegen.JITCPUCodegen, ("_module_pass_manager",)),
    "types.functions.BaseFunction": (functions.BaseFunction, ("get_call_type", "get_impl_key")),
    "compiler.CompilerBase": (compiler.CompilerBase, ("define_pipelines",)),
    "compiler.DefaultPassBuilder": (compiler.DefaultPassBuilder, ("define_nopython_pipeline",)),
}
"""What kernels build on -> the class, and what of it they call or replace."""


@pytest.mark.parametrize("name", INTERFACES)
def test_numba_has_what_kernels_build_on(name: str) -> None:
    cls, members = INTERFACES[name]
    missing = [member for member in members if not hasattr(cls, member)]
    assert not missing, f"numba {numba.__version__}: core.{name} has no {', '.join(missing)}; kernel_cache uses it"


@pytest.mark.parametrize("name", ["nogil", "error_model", "_nrt", "no_cfunc_wrapper", "no_cpython_wrapper", "forceinline"])
def test_numba_knows_the_options_of_kernels(name: str) -> None:
    options = {key for cls in numba.core.cpu.CPUTargetOptions.__mro__ for key in vars(cls)}
    assert name in options, f"numba {numba.__version__}: njit has no option {name}; renderer/core/kernel.py uses it"
    assert issubclass(numba.core.cpu.CPUTargetOptions, TargetOptions)


def test_a_compiler_has_the_flag_that_says_arrays_are_apart() -> None:
    assert isinstance(compiler.Flags.options["noalias"], Option), f"numba {numba.__version__}: compiler.Flags has no noalias"


def add(a, b):
    return a + b


def test_a_dispatcher_takes_a_cache() -> None:
    kernel = compiled(add, nogil=True)
    assert isinstance(kernel._cache, KernelCache), f"numba {numba.__version__}: a dispatcher has no _cache"
    assert kernel(1, 2) == 3 and kernel.stats.cache_path
    assert set(vars(kernel._cache)) >= {"_impl", "_cache_path", "_cache_file"}
    assert kernel._cache._impl.filename_base and kernel._cache._cache_file._source_stamp


def test_a_linked_kernel_is_called_by_kernels() -> None:
    inner = compiled(add, no_cpython_wrapper=True, pipeline_class=LinkedCompiler)
    outer = numba.njit(lambda a: inner(a, a))
    assert outer(4) == 8

"""What numpy and BLAS compute by one kernel or another, as the processor allows, stands on no way to a published byte."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = (
    *("scene_description", "grammar", "renderer"),
    *(f"scene_synth_ros/{name}" for name in ("messages", "render", "synthesize", "offline", "convert", "splits", "cli/files")),
)
NOT_PUBLISHED = ("grammar/learning/", "grammar/diagnostics.py", "grammar/drawing/")
"""Learned grammars, which are made once, so that what is published depends on their bytes; drawings."""
KERNELS = {"entry", "kernel", "inlined", "making_arrays", "cfunc", "njit"}
"""Decorators of functions that numba compiles: numpy's functions are the C library's there, but its products are BLAS."""
BLAS = {"dot", "matmul", "inner", "vdot", "tensordot", "einsum", "convolve", "correlate", "cov", "corrcoef", "polyfit"}
LAPACK = {"leggauss", "hermgauss", "roots_legendre", "make_interp_spline", "solve_banded"}
"""What solves by kernels of BLAS; ``CubicSpline`` with natural ends does not."""
DISPATCHED = {
    *("exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "sin", "cos", "tan", "arcsin", "arccos", "arctan", "arctan2"),
    *("sinh", "cosh", "tanh", "arcsinh", "arccosh", "arctanh", "power", "float_power", "cbrt", "geomspace", "logspace"),
}


def asks_for_the_processor(tree: ast.AST, *, compiled: bool = False) -> Iterator[tuple[int, str]]:
    """Yield line and name of what does; ``compiled``: whether numba compiles it."""
    if isinstance(tree, ast.FunctionDef):
        compiled = compiled or any(ast.unparse(item).split("(")[0].split(".")[-1] in KERNELS for item in tree.decorator_list)
    if isinstance(tree, ast.BinOp | ast.AugAssign) and isinstance(tree.op, ast.MatMult):
        yield tree.lineno, "@"
    if isinstance(tree, ast.Attribute):
        of = ast.unparse(tree.value)
        names = BLAS if compiled else BLAS | DISPATCHED
        if (of == "np.linalg" and tree.attr not in ("norm", "LinAlgError")) or (of == "np" and tree.attr in names):
            yield tree.lineno, f"{of}.{tree.attr}"
    if isinstance(tree, ast.BinOp) and isinstance(tree.op, ast.Pow) and not compiled:
        whole = isinstance(tree.left, ast.Constant | ast.UnaryOp) or (isinstance(tree.right, ast.Constant) and tree.right.value == 2)
        if not whole:
            yield tree.lineno, "**"
    if isinstance(tree, ast.Call) and isinstance(tree.func, ast.Attribute):
        given = {keyword.arg for keyword in tree.keywords}
        if ast.unparse(tree.func) == "np.linalg.norm" and "axis" not in given:
            yield tree.lineno, "np.linalg.norm without axis"
        elif tree.func.attr in ("argsort", "argpartition") and "kind" not in given and not compiled:
            yield tree.lineno, f"{tree.func.attr} without kind"
    if (isinstance(tree, ast.Name) and tree.id in LAPACK) or (isinstance(tree, ast.Attribute) and tree.attr in LAPACK):
        yield tree.lineno, ast.unparse(tree)
    for child in ast.iter_child_nodes(tree):
        yield from asks_for_the_processor(child, compiled=compiled)


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_product_and_no_function_depends_on_the_processor(folder: str) -> None:
    files = sorted((ROOT / folder).rglob("*.py"))
    assert files
    told = [
        f"{name}:{line}: {what}"
        for path in files
        if not (name := path.relative_to(ROOT).as_posix()).startswith(NOT_PUBLISHED)
        for line, what in asks_for_the_processor(ast.parse(path.read_text()))
    ]
    assert not told, "use scene_description/products.py, kernel_cache/elementary.py or math:\n" + "\n".join(told)


def test_what_depends_on_the_processor_is_found() -> None:
    text = (
        "a @ b\nnp.sin(x)\nx ** 0.7\nnp.linalg.solve(a, b)\nnp.linalg.norm(v)\norder = x.argsort()\n"
        "@kernel\ndef f(a):\n    return np.sin(a) + np.dot(a, a)\nnp.polynomial.legendre.leggauss(5)\nmake_interp_spline(x, y)\n"
    )
    assert [line for line, _ in asks_for_the_processor(ast.parse(text))] == [1, 2, 3, 4, 5, 6, 9, 10, 11]
    fine = "x ** 2\n2.0 ** 5\nnp.linalg.norm(v, axis=1)\nx.argsort(kind='stable')\nnp.sqrt(x)\n"
    assert not list(asks_for_the_processor(ast.parse(fine)))

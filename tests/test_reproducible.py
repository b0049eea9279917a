"""The same numbers in a process that compiles its kernels as in one that reads them from Numba's cache."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PLATE = ("ancf.rubber", "ancf.relaxation", "ancf.moduli", "ancf.column_products")
KERNELS = ("reference_fe.kernel", "reference_fe.rubber", "reference_fe.contact_kernel", *PLATE)
SOLVE = """
import hashlib
from compare.scene import load
from reference_fe.run import solve
scene = load("cantilever_plain_patch").override({"analysis.until": 0.2})
result = solve(scene, scene.ladder("reference", "quick")[0])
print(hashlib.sha256(result.displacement.tobytes()).hexdigest())
"""


def compiled(module):
    """Decorators and calls by the name of each function of a module: {name: (decorators, names that it calls)}."""
    tree = ast.parse((ROOT / f"{module.replace('.', '/')}.py").read_text())
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef) and node.decorator_list]
    return {
        function.name: (
            {ast.unparse(decorator) for decorator in function.decorator_list},
            {ast.unparse(node.func) for node in ast.walk(function) if isinstance(node, ast.Call)},
        )
        for function in functions
    }


def test_what_a_kernel_calls_is_inlined():
    """Otherwise the process that compiles links another version, of other rounding, than one that reads the cache."""
    found = {module: compiled(module) for module in KERNELS}
    called = set().union(*(calls for own in found.values() for _, calls in own.values()))
    inner = {(m, name) for m, own in found.items() for name in own if name in called}
    assert len(inner) > 15
    assert [place for place in inner if "inlined" not in found[place[0]][place[1]][0]] == []


@pytest.mark.slow
def test_compiling_and_reading_the_cache_give_equal_numbers(tmp_path):
    """Two processes, the first with an empty cache: the reference's displacements bit for bit."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(ROOT)}
    runs = [
        subprocess.run([sys.executable, "-c", SOLVE], env=environment, capture_output=True, text=True) for _ in "ab"
    ]
    assert [run.returncode for run in runs] == [0, 0], runs[0].stderr
    assert runs[0].stdout == runs[1].stdout != ""

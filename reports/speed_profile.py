"""Where a run of ANCF spends its time, part by part, and how many operations of each part no run can spare."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from ancf.linear_solver import LinearSolver
from ancf.parity import basis
from ancf.quadratic_form import ALL
from ancf.split_form import SplitFormElements
from reports.timing import least

Form = tuple[int, list[tuple[int, int]]]  # points; of each block the pairs of functions and the enhanced strains
PARTS = ("force", "tangent", "factor", "solve", "inertia", "energies", "picture")


@contextmanager
def clocked() -> Iterator[tuple[dict[str, float], dict[str, int]]]:
    """CPU seconds and calls by part of what ANCF solves inside; the clocks cost about 2 microseconds a call."""
    import ancf.run
    from ancf.system import System

    spent, calls = dict.fromkeys(PARTS, 0.0), dict.fromkeys(PARTS, 0)

    def timed(part: str, function: Callable) -> Callable:
        def call(*arguments, **named):
            begin = time.process_time()
            found = function(*arguments, **named)
            spent[part] += time.process_time() - begin
            calls[part] += 1
            return found

        return call

    factorise = timed("factor", LinearSolver.factorise)
    parts = {
        (System, "force_internal"): timed("force", System.force_internal),
        (System, "tangent"): timed("tangent", System.tangent),
        (System, "inertia"): timed("inertia", System.inertia),
        (System, "energies"): timed("energies", System.energies),
        (ancf.run, "_outline"): timed("picture", ancf.run._outline),
        (LinearSolver, "factorise"): lambda *arguments: timed("solve", factorise(*arguments)),
    }
    with replaced(parts):
        yield spent, calls


@contextmanager
def integrated() -> Iterator[list[Form]]:
    """Points and blocks of every form that is integrated meanwhile."""
    import ancf.quadratic_form
    import ancf.split_form

    forms, integrate = [], ancf.quadratic_form.integrate

    def call(parts, material, pair, coupled=((ALL, ALL),)):
        modes = np.arange(parts.M.shape[-1])
        sizes = [(len(pair.first[block]), len(modes[acting])) for block, acting in coupled]
        forms.append((len(parts.volume), sizes))
        return integrate(parts, material, pair, coupled)

    with replaced({(module, "integrate"): call for module in (ancf.quadratic_form, ancf.split_form)}):
        yield forms


@contextmanager
def replaced(functions: dict[tuple[Any, str], Callable]) -> Iterator[None]:
    """Attributes (owner, name) replaced for a while."""
    kept = {place: getattr(*place) for place in functions}
    try:
        for place, function in functions.items():
            setattr(*place, function)
        yield
    finally:
        for place, function in kept.items():
            setattr(*place, function)


def operations(system, calls: dict[str, int], forms: list[Form]) -> dict[str, float]:
    """10^9 additions and multiplications of the matrix products of each part of a run.

    Set-up: half of X^T X and Y^T Y, which are symmetric, and M^T X of every form (see `ancf.quadratic_form`). Forces,
    tangents and energies: the products with the pre-integrated tensors, and T^T K T where they are split by parity;
    the stress counts once where a tangent or an energy follows a force. Banded factors: n k^2, solutions 4 n k.
    """
    elements, solver = system.body.elements, LinearSolver(system.assembly.pattern)
    stress, tangent = (_of_products(elements, name) for name in ("stress", "tangent"))
    if isinstance(elements, SplitFormElements):
        (m, n), count = basis(elements.shape).T.shape, len(elements.form_of)
        tangent += count * 12 * m * n * (m + n)
    n, k, single = system.unknowns, solver.bandwidth, len(elements._portions) == 1
    again = 0 if single else stress
    found = {
        "set-up": sum(map(_integration, forms)),
        "force": calls["force"] * stress,
        "tangent": calls["tangent"] * (again + tangent),
        "energies": calls["energies"] * again,
        "factor": calls["factor"] * n * k**2,
        "solve": calls["solve"] * 4 * n * k,
    }
    return {part: 1e-9 * float(number) for part, number in found.items()}


def bare(system, q: np.ndarray, calls: dict[str, int], repeats: int = 50) -> dict[str, float]:
    """CPU seconds of the same products with tensors, factors and solutions, called by NumPy and LAPACK with nothing
    between them and their data in the cache: calls by part, times the least of `repeats`, at the state q."""
    solver, elements = LinearSolver(system.assembly.pattern), system.body.elements
    stiff = system.tangent(q) + q.size * system.mass_values
    solve, residual = solver.factorise(stiff), system.force_internal(q)
    factor = least(lambda: solver.factorise(stiff), repeats)
    found = {"factor": calls["factor"] * factor, "solve": calls["solve"] * least(lambda: solve(residual), repeats)}
    for part, name in (("force", "stress"), ("tangent", "tangent")):
        products = [product for portion in elements._portions for product in getattr(portion, name)]
        found[part] = calls[part] * least(lambda own=products: [np.matmul(*product) for product in own], repeats)
    return found


def _of_products(elements, name: str) -> int:
    """Operations of all portions' products for the stress or the tangent."""
    products = (product for portion in elements._portions for product in getattr(portion, name))
    return sum(2 * out.size * vectors.shape[-1] for vectors, _, out in products)


def _integration(form: Form) -> int:
    """Operations that integrate one form."""
    points, blocks = form
    return sum((6 * points + modes) * m * (m + 1) + 12 * points * m * modes for m, modes in blocks)

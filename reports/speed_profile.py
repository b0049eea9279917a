"""Where a run of ANCF spends its time, part by part, and how many operations of each part no run can spare."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

PARTS = ("force", "tangent", "factor", "solve", "inertia", "energies", "picture")


@contextmanager
def clocked() -> Iterator[tuple[dict[str, float], dict[str, int]]]:
    """CPU seconds and calls by part of what ANCF solves inside; the clocks cost about 2 microseconds a call."""
    import ancf.run
    from ancf.linear_solver import LinearSolver
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
    with _replaced(parts):
        yield spent, calls


@contextmanager
def integrated() -> Iterator[list[tuple[int, int, int]]]:
    """Points, pairs of functions and enhanced strains of every form that is integrated meanwhile."""
    import ancf.quadratic_form

    forms, integrate = [], ancf.quadratic_form._integrate

    def call(parts, material, pair):
        forms.append((len(parts.volume), len(pair.first), parts.M.shape[-1]))
        return integrate(parts, material, pair)

    with _replaced({(ancf.quadratic_form, "_integrate"): call}):
        yield forms


@contextmanager
def _replaced(functions: dict[tuple[Any, str], Callable]) -> Iterator[None]:
    """Attributes (owner, name) replaced for a while."""
    kept = {place: getattr(*place) for place in functions}
    try:
        for place, function in functions.items():
            setattr(*place, function)
        yield
    finally:
        for place, function in kept.items():
            setattr(*place, function)


def operations(system, calls: dict[str, int], forms: list[tuple[int, int, int]]) -> dict[str, float]:
    """10^9 additions and multiplications of the matrix products of each part of a run.

    Set-up: half of X^T X and Y^T Y, which are symmetric, and M^T X of every form (see `ancf.quadratic_form`). Forces,
    tangents and energies: the products of the pre-integrated tensors. Banded factors: n k^2, solutions 4 n k.
    """
    from ancf.linear_solver import LinearSolver

    elements, solver = system.body.elements, LinearSolver(system.assembly.pattern)
    stress, even, odd = (2 * np.prod(getattr(elements, name).shape[1:]) for name in ("stress", *TANGENT))
    count, n, k = len(elements.form_of), system.unknowns, solver.bandwidth
    found = {
        "set-up": sum(6 * q * m * (m + 1) + 12 * q * m * modes + modes * m * (m + 1) for q, m, modes in forms),
        "force": calls["force"] * count * stress,
        "tangent": calls["tangent"] * count * (stress + 6 * even + 3 * odd),
        "energies": calls["energies"] * count * stress,
        "factor": calls["factor"] * n * k**2,
        "solve": calls["solve"] * 4 * n * k,
    }
    return {part: 1e-9 * float(number) for part, number in found.items()}


TANGENT = ("symmetric", "antisymmetric")

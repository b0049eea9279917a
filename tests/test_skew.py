"""The chapter of skew plates: its thin values, its rhombi at rest, and how a failure shows."""

import math

import numpy as np
import pytest
from skfem import Basis, ElementTriP2, MeshTri, condense, solve
from skfem.models.poisson import laplace, mass, unit_load

from reports.hard_cases import skew
from reports.hard_cases.chapter import Outcome
from reports.unit import Measured


@pytest.mark.parametrize("angle", skew.ANGLES)
def test_thin_values_are_two_poisson_problems(angle):
    """48 x 48 x 2 quadratic triangles: 3e-4, what an obtuse corner of 150 degrees leaves."""
    lines, turn = np.linspace(0, 1, 49), math.radians(angle)
    square = MeshTri.init_tensor(lines, lines)
    mesh = MeshTri(np.stack([square.p[0] + square.p[1] * math.sin(turn), square.p[1] * math.cos(turn)]), square.t)
    basis = Basis(mesh, ElementTriP2())
    K, held = laplace.assemble(basis), basis.get_dofs()
    moment = solve(*condense(K, unit_load.assemble(basis), D=held))
    w = solve(*condense(K, mass.assemble(basis) @ moment, D=held))
    middle = np.array([[(1 + math.sin(turn)) / 2], [math.cos(turn) / 2]])
    assert (basis.probes(middle) @ w)[0] == pytest.approx(skew.KIRCHHOFF[angle], rel=3e-4)


def test_morleys_printed_value_is_the_thin_one_to_its_digits():
    assert skew.KIRCHHOFF[60.0] == pytest.approx(0.408e-3, abs=0.0005e-3)


def test_a_thin_square_bends_as_kirchhoffs_plate():
    """Thin, not skewed, 8x8: 0.5 %, a soft support and the mesh."""
    found = skew.solve("supported", 0.0, skew.THIN, "ancf", [{"element": "enriched", "mesh": [8, 8]}])["rows"][0]
    assert found["w"] == pytest.approx(skew.KIRCHHOFF[0.0], rel=5e-3)


def test_a_unit_that_died_is_missed_cases_without_numbers():
    dead = [Outcome(a, Measured(a.name, a.arguments, "failed: killed", {})) for a in skew.units("standard")]
    cases = skew.present(dead).cases
    assert {(case.value, case.met) for case in cases} == {(None, False)}
    assert len({case.name for case in cases}) == len(cases)

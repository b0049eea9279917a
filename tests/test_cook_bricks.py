"""The bricks that stand for a published program: their law, and the printed table."""

import numpy as np
import pytest

from reports.hard_cases import benchmark_tables as tables
from reports.hard_cases.cook_bricks import BULK, MU, SLOPES, solve, stress


@pytest.mark.parametrize("law", SLOPES)
def test_the_tangent_is_the_derivative_of_the_stress(law):
    """1e-7: differences of 1e-6 of a quadratic error term and round-off of 1e-10."""
    random = np.random.default_rng(3)
    F = np.eye(3) + 0.2 * random.standard_normal((3, 3))
    step = random.standard_normal((3, 3))
    _, A = (found[0, 0] for found in stress(F[None, None], law))
    ahead, behind = (stress((F + h * step)[None, None], law)[0][0, 0] for h in (1e-6, -1e-6))
    np.testing.assert_allclose(np.einsum("iJkL,kL->iJ", A, step), (ahead - behind) / 2e-6, atol=1e-7)


@pytest.mark.parametrize("law", SLOPES)
def test_the_law_is_linear_elasticity_for_small_strains(law):
    """Uniaxial strain of 1e-7: lambda + 2 mu = k + 4/3 mu, to the square of the strain."""
    P, _ = stress(np.diag([1 + 1e-7, 1.0, 1.0])[None, None], law)
    assert P[0, 0, 0, 0] == pytest.approx((BULK + 4 / 3 * MU) * 1e-7, rel=1e-6)


@pytest.mark.parametrize(("degree", "elements"), [(1, 1), (1, 2), (1, 4), (2, 1), (2, 2)])
def test_free_faces_give_the_published_table_and_held_ones_do_not(degree, elements):
    """Half a printed digit: the table that speaks of plane strain is of a free sheet."""
    printed = tables.COOK_RUBBER[degree][elements]
    rise = {faces: solve(elements, degree, faces, "gallery")["moves"]["corner"][0][1] for faces in ("free", "held")}
    assert rise["free"] == pytest.approx(printed, abs=0.005)
    assert abs(rise["held"] - printed) > 0.02

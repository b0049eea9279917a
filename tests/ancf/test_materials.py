"""Each function of a material is the derivative of the one before."""

import numpy as np
import pytest

from ancf.material import from_engineering

MATERIAL = from_engineering(2.0e6, 0.3)
RNG = np.random.default_rng(2)


def symmetric(scale):
    E = RNG.uniform(-scale, scale, (3, 3))
    return (E + E.T) / 2


def test_stress_is_the_derivative_of_energy():
    """Central differences of a quadratic are exact but for round-off."""
    E, dE = symmetric(0.3), symmetric(1e-3)
    difference = MATERIAL.energy(E + dE) - MATERIAL.energy(E - dE)
    assert 2 * np.sum(MATERIAL.stress(E) * dE) == pytest.approx(difference, rel=1e-10)


def test_tangent_is_the_derivative_of_stress():
    E, dE = symmetric(0.3), symmetric(1.0)
    difference = MATERIAL.stress(E + dE) - MATERIAL.stress(E)
    np.testing.assert_allclose(np.einsum("prst,st->pr", MATERIAL.tangent(E), dE), difference, rtol=1e-12)


def test_uniaxial_stress_gives_youngs_modulus_and_poissons_ratio():
    E = np.diag([1e-3, -0.3e-3, -0.3e-3])
    np.testing.assert_allclose(MATERIAL.stress(E), np.diag([2.0e3, 0, 0]), atol=1e-9)


@pytest.mark.parametrize("constants", [(-1.0, 0.3), (1.0, 0.5), (1.0, -1.0), (np.nan, 0.0), (1.0, np.nan)])
def test_impossible_constants_are_refused(constants):
    with pytest.raises(ValueError):
        from_engineering(*constants)

"""Each function of a material is the derivative of the one before."""

import numpy as np
import pytest

from ancf.material import MooneyRivlin, from_engineering

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


RUBBERS = {
    "neo-Hooke": MooneyRivlin(1.0e6, 0.0, 1.5e7),
    "mu01 alone": MooneyRivlin(0.0, 1.0e6, 1.5e7),
    "both": MooneyRivlin(0.8e6, 0.2e6, 3.0e7),
    "volume alone": MooneyRivlin(0.0, 0.0, 3.0e7),
}


@pytest.fixture(params=RUBBERS.values(), ids=RUBBERS)
def rubber(request):
    return request.param


def test_rubbers_stress_is_the_derivative_of_its_energy(rubber):
    """Central differences err by the square of their step (1e-5) times some thousands: C has small eigenvalues."""
    E, dE = symmetric(0.15), symmetric(1e-5)
    difference = rubber.energy(E + dE) - rubber.energy(E - dE)
    assert 2 * np.sum(rubber.stress(E) * dE) == pytest.approx(difference, rel=1e-6)


def test_rubbers_tangent_is_the_derivative_of_its_stress(rubber):
    E, dE = symmetric(0.15), symmetric(1e-5)
    difference = rubber.stress(E + dE) - rubber.stress(E - dE)
    change = 2 * np.einsum("prst,st->pr", rubber.tangent(E), dE)
    np.testing.assert_allclose(change, difference, atol=1e-6 * np.abs(difference).max())


def test_rubber_at_rest_is_the_linear_solid(rubber):
    """No energy, no stress, and the moduli of its two Lame constants."""
    rest, one = np.zeros((3, 3)), np.eye(3)
    assert rubber.energy(rest) == 0
    np.testing.assert_allclose(rubber.stress(rest), 0, atol=1e-9 * rubber.bulk)
    identity = (np.einsum("ps,rt->prst", one, one) + np.einsum("pt,rs->prst", one, one)) / 2
    expected = rubber.lame * np.einsum("pr,st->prst", one, one) + 2 * rubber.shear * identity
    np.testing.assert_allclose(rubber.tangent(rest), expected, atol=1e-9 * rubber.bulk)


def cauchy(rubber, F):
    """True stress F S F^T / J of a deformation gradient."""
    F = np.asarray(F, dtype=float)
    return F @ rubber.stress((F.T @ F - np.eye(3)) / 2) @ F.T / np.linalg.det(F)


@pytest.mark.parametrize("stretch", [0.5, 1.3, 3.0])
def test_closed_forms_of_rubber_that_keeps_its_volume(rubber, stretch):
    """Differences of true stresses of an incompressible solid (Ogden 1984): uniaxial, equal biaxial, simple shear."""
    x, mu10, mu01 = stretch, rubber.mu10, rubber.mu01
    uniaxial, biaxial = cauchy(rubber, np.diag([x, x**-0.5, x**-0.5])), cauchy(rubber, np.diag([x, x, x**-2]))
    scale = 1e-9 * rubber.bulk * (x + 1 / x) ** 4
    assert uniaxial[0, 0] - uniaxial[1, 1] == pytest.approx(2 * (x**2 - 1 / x) * (mu10 + mu01 / x), abs=scale)
    assert biaxial[0, 0] - biaxial[2, 2] == pytest.approx(2 * (x**2 - x**-4) * (mu10 + mu01 * x**2), abs=scale)
    sheared = cauchy(rubber, [[1, x, 0], [0, 1, 0], [0, 0, 1]])
    assert sheared[0, 1] == pytest.approx(2 * (mu10 + mu01) * x, abs=scale)
    assert sheared[0, 0] - sheared[2, 2] == pytest.approx(2 * mu10 * x**2, abs=scale)  # Poynting's effect
    assert sheared[1, 1] - sheared[2, 2] == pytest.approx(-2 * mu01 * x**2, abs=scale)


@pytest.mark.parametrize("volume", [0.8, 1.3])
def test_pressure_of_a_change_of_volume(rubber, volume):
    """k (J - 1), whatever the other constants are."""
    np.testing.assert_allclose(
        cauchy(rubber, np.eye(3) * np.cbrt(volume)), rubber.bulk * (volume - 1) * np.eye(3), atol=1e-9 * rubber.bulk
    )

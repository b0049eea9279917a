"""Hyperelastic materials: energy, stress and tangent of the Green-Lagrange strain E (..., 3, 3).

Each is the derivative of the one before. A material is a frozen dataclass with these three methods.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class SaintVenantKirchhoff:
    """W = lambda/2 tr(E)^2 + mu E:E with the Lame constants in Pa."""

    lame: float
    shear: float

    def energy(self, E: np.ndarray) -> np.ndarray:
        """Strain energy density W (...) in J/m3."""
        trace = np.trace(E, axis1=-2, axis2=-1)
        return self.lame / 2 * trace**2 + self.shear * np.einsum("...pr,...pr->...", E, E)

    def stress(self, E: np.ndarray) -> np.ndarray:
        """Second Piola-Kirchhoff stress S = lambda tr(E) 1 + 2 mu E (..., 3, 3) in Pa."""
        trace = np.trace(E, axis1=-2, axis2=-1)
        return self.lame * trace[..., None, None] * np.eye(3) + 2 * self.shear * E

    def tangent(self, E: np.ndarray) -> np.ndarray:
        """C = lambda 1 x 1 + 2 mu I (..., 3, 3, 3, 3) in Pa, constant."""
        one = np.eye(3)
        identity = (np.einsum("ps,rt->prst", one, one) + np.einsum("pt,rs->prst", one, one)) / 2
        C = self.lame * np.einsum("pr,st->prst", one, one) + 2 * self.shear * identity
        return np.broadcast_to(C, (*E.shape[:-2], 3, 3, 3, 3))


@dataclass(frozen=True)
class MooneyRivlin:
    """W = mu10 (I1 J^(-2/3) - 3) + mu01 (I2 J^(-4/3) - 3) + k/2 (J - 1)^2, constants in Pa (paper, section 6).

    Invariants of the right Cauchy-Green tensor C = 1 + 2 E: I1 = tr C, I2 = (I1^2 - C:C) / 2, J^2 = det C. Not a
    number where det C is not positive. With f1 = mu10 J^(-2/3), f2 = mu01 J^(-4/3) and J dW/dJ = s,

        S = 2 f1 1 + 2 f2 (I1 1 - C) + s C^-1,    s = -2/3 f1 I1 - 4/3 f2 I2 + k J (J - 1),
        dS/dE = Y x C^-1 + C^-1 x Y + c C^-1 x C^-1 - 2 s C^-1 . C^-1 + 4 f2 (1 x 1 - I),
        Y = -4/3 f1 1 - 8/3 f2 (I1 1 - C),    c = J ds/dJ = 4/9 f1 I1 + 16/9 f2 I2 + k J (2 J - 1).
    """

    mu10: float
    mu01: float
    bulk: float

    @property
    def shear(self) -> float:
        """Shear modulus (Pa) at rest."""
        return 2 * (self.mu10 + self.mu01)

    @property
    def lame(self) -> float:
        """First Lame constant (Pa) at rest."""
        return self.bulk - 2 / 3 * self.shear

    def energy(self, E: np.ndarray) -> np.ndarray:
        """Strain energy density W (...) in J/m3."""
        _, I1, I2, J = _invariants(E)
        W = self.mu10 * (I1 * J ** (-2 / 3) - 3) + self.mu01 * (I2 * J ** (-4 / 3) - 3) + self.bulk / 2 * (J - 1) ** 2
        return W[..., 0, 0]

    def stress(self, E: np.ndarray) -> np.ndarray:
        """Second Piola-Kirchhoff stress S (..., 3, 3) in Pa."""
        C, I1, I2, J = _invariants(E)
        f1, f2, s, _ = self._factors(I1, I2, J)
        return 2 * f1 * np.eye(3) + 2 * f2 * (I1 * np.eye(3) - C) + s * np.linalg.inv(C)

    def tangent(self, E: np.ndarray) -> np.ndarray:
        """dS/dE (..., 3, 3, 3, 3) in Pa."""
        C, I1, I2, J = _invariants(E)
        f1, f2, s, c = self._factors(I1, I2, J)
        one, inverse = np.eye(3), np.linalg.inv(C)
        half = -4 / 3 * f1 * one - 8 / 3 * f2 * (I1 * one - C) + c / 2 * inverse
        f2, s = f2[..., None, None], s[..., None, None]
        products = _outer(half, inverse) + _outer(inverse, half) - 2 * s * _symmetric_product(inverse)
        return products + 4 * f2 * (_outer(one, one) - _symmetric_product(one))

    def _factors(self, I1: np.ndarray, I2: np.ndarray, J: np.ndarray) -> tuple[np.ndarray, ...]:
        """f1, f2, s and c (..., 1, 1) in Pa."""
        f1, f2, k = self.mu10 * J ** (-2 / 3), self.mu01 * J ** (-4 / 3), self.bulk
        s = -2 / 3 * f1 * I1 - 4 / 3 * f2 * I2 + k * J * (J - 1)
        return f1, f2, s, 4 / 9 * f1 * I1 + 16 / 9 * f2 * I2 + k * J * (2 * J - 1)


def _invariants(E: np.ndarray) -> tuple[np.ndarray, ...]:
    """C (..., 3, 3), and I1, I2 and J (..., 1, 1)."""
    C = 2 * E + np.eye(3)
    I1 = np.trace(C, axis1=-2, axis2=-1)
    I2 = (I1**2 - np.einsum("...pr,...pr->...", C, C)) / 2
    with np.errstate(invalid="ignore"):
        J = np.sqrt(np.linalg.det(C))
    return C, *(value[..., None, None] for value in (I1, I2, J))


def _outer(X: np.ndarray, Y: np.ndarray) -> np.ndarray:
    """X x Y (..., 3, 3, 3, 3)."""
    return np.einsum("...pr,...st->...prst", X, Y)


def _symmetric_product(X: np.ndarray) -> np.ndarray:
    """X . X, (X_ps X_rt + X_pt X_rs) / 2 (..., 3, 3, 3, 3)."""
    return (np.einsum("...ps,...rt->...prst", X, X) + np.einsum("...pt,...rs->...prst", X, X)) / 2


def from_engineering(youngs_modulus: float, poissons_ratio: float) -> SaintVenantKirchhoff:
    """Material from E (Pa) and nu. Raises ValueError outside E > 0, -1 < nu < 1/2."""
    if not youngs_modulus > 0:
        raise ValueError(f"Young's modulus must be positive, got {youngs_modulus}")
    if not -1 < poissons_ratio < 0.5:
        raise ValueError(f"Poisson's ratio must lie between -1 and 1/2, got {poissons_ratio}")
    shear = youngs_modulus / (2 * (1 + poissons_ratio))
    return SaintVenantKirchhoff(2 * shear * poissons_ratio / (1 - 2 * poissons_ratio), shear)

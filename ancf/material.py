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


def from_engineering(youngs_modulus: float, poissons_ratio: float) -> SaintVenantKirchhoff:
    """Material from E (Pa) and nu. Raises ValueError outside E > 0, -1 < nu < 1/2."""
    if not youngs_modulus > 0:
        raise ValueError(f"Young's modulus must be positive, got {youngs_modulus}")
    if not -1 < poissons_ratio < 0.5:
        raise ValueError(f"Poisson's ratio must lie between -1 and 1/2, got {poissons_ratio}")
    shear = youngs_modulus / (2 * (1 + poissons_ratio))
    return SaintVenantKirchhoff(2 * shear * poissons_ratio / (1 - 2 * poissons_ratio), shear)

"""The Mooney-Rivlin law at very many points, component by component: the fast twin of `ancf.material`.

A symmetric tensor is six arrays of equal shape in the order of VOIGT, its components (not doubled). Arrays of few
operations on many points run at the speed of memory; the formulas are those of `material.MooneyRivlin`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ancf.material import MooneyRivlin

VOIGT = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
Six = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


class State(NamedTuple):
    """C, its cofactors, I2, det C = J^2, and f1, f2, s, c of `material.MooneyRivlin`, at each point."""

    C: Six
    cofactor: Six
    I1: np.ndarray
    I2: np.ndarray
    J: np.ndarray
    square: np.ndarray
    f1: np.ndarray
    f2: np.ndarray
    s: np.ndarray


def state(material: MooneyRivlin, C: Six) -> State:
    """State of a right Cauchy-Green tensor; not a number where its determinant is not positive."""
    C11, C22, C33, C23, C13, C12 = C
    K11, K22, K33 = C22 * C33 - C23 * C23, C11 * C33 - C13 * C13, C11 * C22 - C12 * C12
    K23, K13, K12 = C13 * C12 - C11 * C23, C12 * C23 - C22 * C13, C13 * C23 - C33 * C12
    square = C11 * K11 + C12 * K12 + C13 * K13
    scalar = scalars(material, C11 + C22 + C33, K11 + K22 + K33, square)
    return State(C, (K11, K22, K33, K23, K13, K12), **scalar)


def scalars(material: MooneyRivlin, I1: np.ndarray, I2: np.ndarray, square: np.ndarray) -> dict[str, np.ndarray]:
    """What of a State depends on I1, I2 and det C alone."""
    J = np.sqrt(square)
    root = np.exp(np.log(square) / -3)  # J^(-2/3)
    f1, f2 = material.mu10 * root, material.mu01 * root * root
    s = (-2 / 3) * f1 * I1 - (4 / 3) * f2 * I2 + material.bulk * (square - J)
    return dict(I1=I1, I2=I2, J=J, square=square, f1=f1, f2=f2, s=s)


def energy(material: MooneyRivlin, at: State) -> np.ndarray:
    """Strain energy density W in J/m3."""
    isochoric = at.f1 * at.I1 + at.f2 * at.I2 - 3 * (material.mu10 + material.mu01)
    return isochoric + material.bulk / 2 * (at.J - 1) ** 2


def stress(at: State) -> list[np.ndarray]:
    """Second Piola-Kirchhoff stress S, six arrays in Pa."""
    inverse, twice = at.s / at.square, 2 * at.f2
    spherical = 2 * at.f1 + twice * at.I1
    S = [inverse * K - twice * C for K, C in zip(at.cofactor, at.C, strict=True)]
    return [spherical + S[0], spherical + S[1], spherical + S[2], *S[3:]]


def moduli(material: MooneyRivlin, at: State) -> list[list[np.ndarray]]:
    """dS/dE as the upper triangle rows[m][n - m], m <= n in the order of VOIGT, in Pa."""
    volumetric = material.bulk * (2 * at.square - at.J)
    c = (4 / 9) * at.f1 * at.I1 + (16 / 9) * at.f2 * at.I2 + volumetric
    inverse = [K / at.square for K in at.cofactor]
    y, spherical = (8 / 3) * at.f2, (-4 / 3) * at.f1 - (8 / 3) * at.f2 * at.I1
    half = [y * C + c / 2 * inv for C, inv in zip(at.C, inverse, strict=True)]
    half[:3] = [spherical + h for h in half[:3]]
    rows = [[half[m] * inverse[n] + inverse[m] * half[n] for n in range(m, 6)] for m in range(6)]
    of = {pair: m for m, pair in enumerate(VOIGT)} | {pair[::-1]: m for m, pair in enumerate(VOIGT)}
    for m, (p, r) in enumerate(VOIGT):
        for n, (q, t) in list(enumerate(VOIGT))[m:]:
            one, other = inverse[of[p, q]] * inverse[of[r, t]], inverse[of[p, t]] * inverse[of[r, q]]
            rows[m][n - m] -= at.s * (one + other)
    for m in range(3):
        for n in range(m + 1, 3):
            rows[m][n - m] += 4 * at.f2
        rows[m + 3][0] -= 2 * at.f2
    return rows

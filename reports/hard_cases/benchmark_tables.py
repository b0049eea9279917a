"""The values that the benchmarks are judged by, as their sources print them."""

from __future__ import annotations

SZE = "Sze, Liu, Lo, Finite Elem. Anal. Des. 40 (2004) 1551"
SZE_END_SHEAR = {2: (4.933, 1.604), 4: (6.698, 3.286)}
"""Section 3.1, Abaqus S4R 16x1: alpha = P L^2 / EI -> (W, -U) of the tip; P_max = 4 is alpha = 4."""

SZE_END_MOMENT = {5: (7.639, 4.361), 10: (7.639, 12.000), 15: (2.546, 14.546), 20: (0.000, 12.000)}
"""Section 3.2, exact columns: twentieths of the moment that closes the circle -> (W, -U) of the tip."""

YAMASHITA = "Yamashita, Valkeapaa, Jayakumar, Sugiyama, J. Comput. Nonlinear Dyn. 10 (2015) 051012, Fig. 4"
CORNER_LOAD = -0.6485
"""Deflection (m) between 27-node solids from below and thin plates from above, +- 0.001; extrapolated, not printed."""
CORNER_LOAD_CHRONO = -0.643744
"""Chrono's ANCF 3423 on 4x4 elements, t = 4 s: not converged."""

PRINCETON = "Obrezkov, Mikkola, Matikainen, Nonlinear Dyn. 109 (2022) 527, ANSYS solid 4x12x500"
PRINCETON_TIP = {
    (8.896, 0): ((0.0107141763, 0.0), (0.01069752828, 0.0)),
    (8.896, 15): ((0.01061328706, 0.04208232124), (0.01057180106, 0.04101165651)),
    (8.896, 30): ((0.0101116963, 0.07939482948), (0.009938278402, 0.07696749069)),
    (8.896, 45): ((0.008837226265, 0.108987937), (0.008686786771, 0.105976311)),
    (8.896, 60): ((0.006604665004, 0.129887616), (0.006500006282, 0.127251299)),
    (8.896, 75): ((0.003538889001, 0.14219437), (0.003481999513, 0.13959474)),
    (8.896, 90): ((0.0, 0.146245978), (0.0, 0.143848652)),
    (13.345, 0): ((0.01606423724, 0.0), (0.01603700622, 0.0)),
    (13.345, 15): ((0.01645825752, 0.06435812858), (0.01637026068, 0.06270699533)),
    (13.345, 45): ((0.0151861844, 0.156467239), (0.0148505521, 0.153554457)),
    (13.345, 60): ((0.011578375, 0.181861627), (0.01127173264, 0.179978534)),
    (13.345, 90): ((0.0, 0.200677707), (0.0, 0.197669499)),
}
"""(force in N, angle in degrees) -> (chordwise, flapwise) tip displacement in m of ANSYS's beams and of its solid."""

COFEA = "CoFEA, Cook's membrane, quadratic tetrahedra, very fine"
COOK = {"stress": 23.96, 1 / 3: 32.00, 0.4999: 28.00}
"""Plane stress at the middle of the edge (the classic value); plane strain at its corner, by Poisson's ratio."""
COOK_COFEA = {1 / 3: (32.27, 32.20, 32.28), 0.4999: (27.52, 27.52, 27.56)}
"""CalculiX, Code_Aster, Elmer at the corner."""

BLOWN = {("tube", 1.1): 0.5011725, ("tube", 2.0): 0.5003938, ("sphere", 1.1): 0.2507674}
"""u(A) / A by B / A under the pressure of the closed form's 0.5 and 0.25: the radial equation with k = 1000 mu."""
DEALII = "Pelteret, McBride, deal.II code gallery, Quasi-Static Finite-Strain Compressible Elasticity, 2016"
COOK_RUBBER = {
    1: {1: 5.15, 2: 8.72, 4: 12.02, 8: 13.61, 16: 14.13, 32: 14.28, 64: 14.32},
    2: {1: 12.19, 2: 13.83, 4: 14.22, 8: 14.30, 16: 14.32, 32: 14.33, 64: 14.33},
}
"""mm at the upper corner of the edge, by degree of the bricks and bricks a side; `cook_bricks` says of what."""
COOK_BRICKS = 14.7226
"""mm at the middle of the edge, plane strain, our law: cook_bricks of degree 2, 16 a side (8 a side: 14.7082)."""

LE10 = -5.38
"""NAFEMS LE10: stress YY (MPa) at D."""

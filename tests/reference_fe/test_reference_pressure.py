"""Pressure that follows its face: derivative, resultant, against a dead one, a tube blown up."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_matrix, triu

from compare.scene import parse
from reference_fe.loads import pressure_force
from reference_fe.pressure import follower_pressure
from reference_fe.run import solve

RAMP = ((0.0, 0.0), (1.0, 1.0))


def bent(solid) -> np.ndarray:
    """A smooth displacement (n, 3) that is not small."""
    x, y, z = solid.mesh.doflocs
    return 0.1 * np.column_stack([np.sin(2 * y + z), np.cos(3 * x * y), x * x + np.sin(2 * z + y)])


@pytest.fixture(params=[-1, 1], ids=["bottom", "top"])
def side(request):
    return request.param


def solids(build):
    return {"flat": (build.solid(replace(build.grooved, grooves=()), 0.4), 0.05), "curved": (build.curved(0.4), 0.1)}


@pytest.mark.parametrize("which", ["flat", "curved"])
def test_at_rest_it_is_the_dead_pressure(build, which, side):
    """Of the undeformed face. On the curved one both rules miss what is rational: 1e-6."""
    solid, half = solids(build)[which]
    expected = 2.0e3 * pressure_force(solid, side, half)
    found = follower_pressure(solid, side, half, 4.0e3, RAMP).force(np.zeros_like(expected), 0.5)
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


def test_it_turns_and_grows_with_its_face(build, side):
    solid, half = solids(build)["flat"]
    load = follower_pressure(solid, side, half, 1.0, RAMP)
    turn = 1.5 * np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    points = solid.mesh.doflocs.T
    total = load.force(points @ turn.T - points, 1.0).sum(axis=0)
    np.testing.assert_allclose(total, -side * 1.5**2 * 0.8 * turn[:, 2] / 1.5, atol=1e-12)


@pytest.mark.parametrize("which", ["flat", "curved"])
def test_the_stiffness_is_the_symmetric_part_of_the_derivative(build, which, side):
    """The force is quadratic in u: central differences are exact but for round-off."""
    solid, half = solids(build)[which]
    load, u = follower_pressure(solid, side, half, 3.0e3, RAMP), bent(solid)
    held = solid.box.doflocs[0] < 1e-9
    system = build.system(solid, held)
    where = system.pattern
    values = np.zeros(where.indices.size)
    load.subtract_stiffness(where, u, 0.7, 1.0, values)
    size = 3 * where.free.size
    upper = csr_matrix((values, where.indices, where.indptr), shape=(size, size))
    found = (upper + triu(upper, 1).T).toarray()
    derivative = np.empty((size, size))
    for column in range(size):
        step = np.zeros_like(u)
        step[where.free[column // 3], column % 3] = 0.5
        derivative[:, column] = (load.force(u + step, 0.7) - load.force(u - step, 0.7))[where.free].ravel()
    expected = -(derivative + derivative.T) / 2
    np.testing.assert_allclose(found, expected, atol=1e-10 * np.abs(expected).max())


def test_a_tube_of_rubber_blown_up_by_a_fifth():
    """Incompressible neo-Hooke in plane strain, A = 1, B = 1.5 (closed form):
    p / mu = ln(la / lb) + (lb^-2 - la^-2) / 2 with lb^2 = 1 + (la^2 - 1) (A / B)^2.

    k / mu = 1e4 leaves 1e-4, two tetrahedra through the wall 1 %.
    """
    la, mu = 1.2, 1e6
    lb = math.sqrt(1 + (la**2 - 1) / 1.5**2)
    radius = 1.25
    arc = [[0.0, radius], [radius, radius], [radius, 0.0]]
    surface = {
        "kind": "nurbs",
        "degree": [1, 2],
        "knots": [[0, 0, 1, 1], [0, 0, 0, 1, 1, 1]],
        "control_points": [[[x, *place] for place in arc] for x in (0.0, 0.2)],
        "weights": [[1.0, 0.5**0.5, 1.0]] * 2,
    }
    pressure = mu * (math.log(la / lb) + (lb**-2 - la**-2) / 2)
    question = parse(
        {
            "name": "tube",
            "title": "a quarter of a tube",
            "surface": surface,
            "thickness": 0.5,
            "material": {"kind": "mooney-rivlin", "mu10": mu / 2, "bulk_modulus": 1e4 * mu},
            "supports": [
                {"kind": "symmetry", "edge": "y0", "normal": "Y"},
                {"kind": "symmetry", "edge": "y1", "normal": "Z"},
                {"kind": "hold", "whole": True, "components": ["X"]},
            ],
            "loads": [
                {"kind": "pressure", "face": "bottom", "pressure": pressure, "follower": True, "history": RAMP},
            ],
            "probes": [{"name": "inner", "at": [0.5, 0.0, -0.25]}, {"name": "outer", "at": [0.5, 1.0, 0.25]}],
            "analysis": {"kind": "static"},
            "reference": {"levels": [{"size": 0.25, "time_step": 0.25}]},
        },
        "tube",
    )
    result = solve(question, question.reference.levels[0])
    assert result.status == "ok", result.message
    inner, outer = result.displacement[-1]
    np.testing.assert_allclose([inner[2], outer[1]], [la - 1, 1.5 * (lb - 1)], rtol=0.01)

"""The layer that elements on a free edge hold: compatible, harmless, and what it is worth."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ancf.free_edge import layer_strains
from ancf.mesh import grid
from ancf.quadrature import Rule
from ancf.run import solve
from ancf.shape import FAMILY
from ancf.supports import clamp, free_edges, hold_edge
from ancf.system import system
from compare.scene import load

EDGES = ("x0", "x1", "y0", "y1")
CELL = ((0.3, 0.7), (0.1, 0.3))
THICKNESS = 0.05
LINES = (np.array([0.0, 0.3, 0.7, 1.2]), np.array([0.0, 0.25, 0.6]))


def turn_at(x, y, z, edge, degree=2):
    """Strain components and turn of the layer at points of CELL, taken as a rule of the plate's thickness."""
    points = np.stack(np.broadcast_arrays(x, y, z), axis=-1).reshape(-1, 3).astype(float)
    both = np.concatenate([points, points * [1, 1, -1]])  # mean z = 0
    weights = np.full(len(both), 0.4 * 0.2 * THICKNESS / len(both))
    inverse = np.broadcast_to(np.eye(3), (len(both), 3, 3))
    return [part[: len(points)] for part in layer_strains(Rule(both, weights, 0), CELL, edge, inverse, degree)]


@pytest.mark.parametrize("edge", EDGES)
def test_the_layer_vanishes_on_the_other_sides(edge):
    """No neighbour sees it: to round-off of its size on the edge itself, 1.5 for the first bubble at the middle."""
    x, y = np.linspace(*CELL[0], 9), np.linspace(*CELL[1], 9)
    sides = {"x0": (CELL[0][0], y), "x1": (CELL[0][1], y), "y0": (x, CELL[1][0]), "y1": (x, CELL[1][1])}
    for side, at in sides.items():
        turn = turn_at(*at, 0.01, edge)[3]
        assert np.abs(turn).max() > 1 if side == edge else np.abs(turn).max() < 1e-14


@pytest.mark.parametrize("edge", EDGES)
def test_its_strains_are_those_of_its_displacement(edge):
    """u = z turn along the edge, differenced: 1e-7 of lambda, whose square h^2 / 6 is the error."""
    along, h = 1 - "xy".index(edge[0]), 1e-6
    x, y, z = np.array([0.41, 0.52, 0.66]), np.array([0.12, 0.29, 0.2]), 0.013
    E_13, E_12, E_11, turn = turn_at(x, y, z, edge)
    steps = [np.array([h, 0.0]), np.array([0.0, h])]
    by = [(turn_at(x + s[0], y + s[1], z, edge)[3] - turn_at(x - s[0], y - s[1], z, edge)[3]) / (2 * h) for s in steps]
    np.testing.assert_allclose(E_13, turn / 2, atol=1e-14)
    np.testing.assert_allclose(E_12, z * by[1 - along] / 2, atol=1e-7)
    np.testing.assert_allclose(E_11, z * by[along], atol=1e-7)


@pytest.fixture
def element():
    return "enriched"


@pytest.mark.parametrize("kind", ["plain", "grooved", "curved, grooved"])
def test_truths_hold_with_layers(make_body, kind, deformed):
    """At rest and turned there is no force; the quadratic form equals the sum over points; six modes cost nothing."""
    fast, plain = (make_body(kind, free=EDGES, pointwise=pointwise) for pointwise in (False, True))
    vectors = fast.mesh.vectors
    turned = vectors @ Rotation.from_rotvec([0.9, -1.4, 1.1]).as_matrix().T
    for Q in (vectors, turned):
        assert np.abs(fast.elements.force(Q[fast.connectivity])).max() < 1e-13 * 2e6 * THICKNESS
    Q = deformed(fast)[fast.connectivity]
    force = plain.elements.force(Q)
    np.testing.assert_allclose(fast.elements.force(Q), force, atol=1e-12 * np.abs(force).max())
    acting = system(fast, np.zeros(vectors.size, dtype=bool), (), THICKNESS)
    K = acting.assembly.pattern.full(acting.tangent(vectors.ravel())).toarray()
    eigenvalues = np.linalg.eigvalsh(K / np.outer(acting.lengths, acting.lengths)) / np.abs(K).max()
    assert np.abs(eigenvalues[:6]).max() < 1e-13 < 1e-8 < eigenvalues[6]


def test_free_edges_make_elements_of_their_own(make_body):
    """5 x 5 equal elements: inside, on a long side, on a short one, in a corner; images of each other share a form.

    Square elements have one form for both sides; with the edge x0 held there are the same kinds; between two free
    edges there is one kind, and one at either end.
    """
    even = (np.linspace(0, 1.2, 6), np.linspace(0, 0.6, 6))
    square = (np.linspace(0, 1, 6), np.linspace(0, 1, 6))
    assert make_body(lines=even, free=EDGES).shapes == make_body(lines=even, free=("x1", "y0", "y1")).shapes == 4
    assert make_body(lines=square, free=EDGES).shapes == 3
    assert make_body(lines=square, free=EDGES, points=(6, 7, 3)).shapes == 4
    assert make_body(lines=(even[0], np.array([0, 0.6])), free=EDGES).shapes == 2
    assert make_body(lines=even, free=()).shapes == 1


def test_a_free_edge_is_one_whose_director_is_held_nowhere():
    """The corner of a clamped edge does not clamp its neighbours; a soft simple support leaves the layer."""
    mesh = grid(*LINES, None, FAMILY["enriched"])
    assert free_edges(mesh, clamp(mesh, "x0", "tangential")) == ("x1", "y0", "y1")
    assert free_edges(mesh, hold_edge(mesh, "y1", [2], face=False)) == EDGES
    assert free_edges(mesh, hold_edge(mesh, "y1", [1], face=True)) == ("x0", "x1", "y0")


def deflection(n, layer, monkeypatch):
    """Of the corner of the plain plate under a small load, n x n elements."""
    shape = FAMILY["enriched"]
    monkeypatch.setitem(FAMILY, "enriched", shape if layer else type(shape)(**{**vars(shape), "layer": None}))
    scene = load("cantilever_plain_patch").override(
        {"analysis.kind": "static", "analysis.every": 1.0, "loads.0.force": [0.0, 0.0, -0.05]}
    )
    level = scene.ladder("ancf")[0].model_copy(update={"mesh": (n, n), "element": "enriched", "time_step": 1.0})
    found = -solve(scene, level).position("P")[-1, 2]
    monkeypatch.undo()
    return found


def test_coarse_elements_follow_the_layer_and_never_too_far(monkeypatch):
    """Two thirds of the error of 2, 4 and 8 elements was the layer (at 2 nearly one half); it stays on the stiff side.

    The limit, 8.9020e-4 m, is that of 32 x 32 elements, which resolve the layer with or without.
    """
    limit = 8.9020e-4
    for n, left in ((2, 0.6), (4, 0.35), (8, 0.5)):
        with_layer, without = (1 - deflection(n, layer, monkeypatch) / limit for layer in (True, False))
        assert 0 < with_layer < left * without

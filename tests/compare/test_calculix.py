"""The adapter to CalculiX: the deck it writes, the answer it reads, and a bar that it solves where it is installed."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from compare.external import calculix
from compare.external.calculix import CalculixError, Problem, deck, read

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))

# What CalculiX 2.20 wrote for two printed nodes and two steps.
DAT = """
 displacements (vx,vy,vz) for set PRINTED and time  0.5000000E-01

         2  1.000000E-03  0.000000E+00 -2.500000E-04
         4 -1.234567E-05  0.000000E+00  3.000000E+00

 displacements (vx,vy,vz) for set PRINTED and time  0.1000000E+00

         2  2.000000E-03  0.000000E+00 -5.000000E-04
         4 -2.234567E-05  1.000000E-30  4.000000E+00
"""


def quadratic(corners, tetrahedra):
    """Nodes (n, 3) and tetrahedra (e, 10) in CalculiX's order of straight tetrahedra."""
    nodes, number, made = [tuple(point) for point in corners], {}, []
    for cell in tetrahedra:
        middles = []
        for a, b in EDGES:
            key = frozenset((cell[a], cell[b]))
            if key not in number:
                number[key] = len(nodes)
                nodes.append(tuple((np.array(corners[cell[a]]) + corners[cell[b]]) / 2))
            middles.append(number[key])
        made.append([*cell, *middles])
    return np.array(nodes), np.array(made)


@pytest.fixture
def single():
    """One tetrahedron, its face x = 0 fixed, pulled at the corner (1, 0, 0)."""
    nodes, tetrahedra = quadratic(CORNERS, [(0, 1, 2, 3)])
    force = np.zeros_like(nodes)
    force[1, 0] = 2.5
    held = np.flatnonzero(nodes[:, 0] == 0)
    return Problem(nodes, tetrahedra, held, force, [(0, 0), (1, 1)], 1000.0, 1e6, 0.25, 0.05, 0.1, np.array([1, 3]))


def test_the_deck_states_the_problem(single):
    lines = deck(single).splitlines()
    after = {one.partition(",")[0]: other for one, other in pairwise(lines) if one.startswith("*")}
    assert after["*ELEMENT"] == "1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10"
    assert [float(word) for word in after["*ELASTIC"].split(",")] == [1e6, 0.25]
    assert [float(word) for word in after["*DYNAMIC"].split(",")] == [0.05, 0.1]
    assert float(after["*DENSITY"]) == 1000.0
    assert after["*CLOAD"] == "2, 1, 2.500000000000e+00"
    assert "*NSET, NSET=FIXED" in lines and "1, 3, 4, 7, 8, 10," in lines
    assert "*STEP, NLGEOM, INC=14" in lines and "*DYNAMIC, DIRECT, ALPHA=0." in lines


def test_no_number_is_longer_than_calculix_reads(single):
    """Fields have 20 characters; a node at -1e-17 / 3 would have more in full."""
    far = replace(single, nodes=single.nodes - 1e-17 / 3)
    words = [word.strip() for line in deck(far).splitlines() if line[0] != "*" for word in line.split(",")]
    assert max(map(len, words)) <= 20


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"tetrahedra": np.arange(4)[None]}, "tetrahedra"),
        ({"force": np.zeros((3, 3))}, "force"),
        ({"fixed": np.array([99])}, "fixed"),
        ({"printed": np.array([], int)}, "printed"),
        ({"step": 0.2}, "step"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(single, change, words):
    with pytest.raises(ValueError, match=words):
        deck(replace(single, **change))


def test_the_answer_is_read_in_the_order_asked_for():
    times, displacement = read(DAT, np.array([3, 1]))
    assert times.tolist() == [0.05, 0.1]
    np.testing.assert_array_equal(displacement[1], [[-2.234567e-05, 1e-30, 4.0], [2e-3, 0.0, -5e-4]])


def test_an_answer_that_is_not_there_is_named():
    with pytest.raises(CalculixError, match="no displacements"):
        read("", np.array([0]))
    with pytest.raises(CalculixError, match="node 7"):
        read(DAT, np.array([7]))


def test_a_missing_program_is_named(single, monkeypatch):
    monkeypatch.setattr(calculix, "PROGRAM", "no-such-program")
    assert not calculix.available()
    with pytest.raises(CalculixError, match="not installed"):
        calculix.solve(single)


needs_ccx = pytest.mark.skipif(not calculix.available(), reason="ccx is not installed")


@needs_ccx
def test_what_calculix_refuses_is_quoted(single):
    """A tetrahedron turned inside out has a negative Jacobian."""
    inverted = single.tetrahedra[:, [0, 2, 1, 3, 6, 5, 4, 7, 9, 8]]
    with pytest.raises(CalculixError, match="ERROR"):
        calculix.solve(replace(single, tetrahedra=inverted))


@needs_ccx
def test_a_bar_pulled_along_its_axis_stretches_as_the_closed_form_says():
    """One quadratic tetrahedron in uniform strain under nu = 0: F = A S (1 + e), S = E (e + e^2 / 2) (SVK).

    The face x = 0 of a unit cube of six tetrahedra is fixed; with nu = 0 uniform stretch is exact. The mass is so
    small that inertia plays no part (1e-9 kg); seven digits are printed.
    """
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    cells = [(0, 4, 6, 7), (0, 6, 2, 7), (0, 2, 3, 7), (0, 3, 1, 7), (0, 1, 5, 7), (0, 5, 4, 7)]
    nodes, tetrahedra = quadratic(corners, cells)
    e, young = 0.1, 1e6
    resultant = young * (e + e**2 / 2) * (1 + e)
    force = np.zeros_like(nodes)
    for a, b, c in ((4, 6, 7), (5, 4, 7)):  # a uniform traction on a flat facet acts on its three middles alike
        for one, other in ((a, b), (b, c), (a, c)):
            middle = (corners[one] + corners[other]) / 2
            force[np.flatnonzero((np.abs(nodes - middle) < 1e-12).all(axis=1)), 0] += resultant / 2 / 3
    assert force.sum() == pytest.approx(resultant)
    held, face = np.flatnonzero(nodes[:, 0] == 0), np.flatnonzero(nodes[:, 0] == 1)
    problem = Problem(nodes, tetrahedra, held, force, [(0, 0), (1, 1)], 1e-9, young, 0.0, 0.25, 1.0, face)
    answer = calculix.solve(problem)
    assert answer.times.tolist() == [0.25, 0.5, 0.75, 1.0]
    np.testing.assert_allclose(answer.displacement[-1], np.tile([e, 0, 0], (len(face), 1)), atol=1e-5)
    assert 0 < answer.cpu_seconds and 0 < answer.wall_seconds

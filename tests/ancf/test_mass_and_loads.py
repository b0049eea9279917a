"""Mass, momentum, and how loads and probes see the field."""

import numpy as np
import pytest

from ancf.element import integrand
from ancf.functional import mean_over_edge, mean_over_region, mean_through_thickness, value_at
from ancf.loads import spread
from ancf.mesh import grid
from ancf.nurbs import Surface
from ancf.shape import FAMILY
from ancf.subdomain import BOTTOM, GROOVE, Band, element_rule
from ancf.supports import clamp

EVEN = (np.linspace(0, 1.0, 4), np.linspace(0, 0.8, 3))
GROOVE_X = Band(BOTTOM, GROOVE, 0, (0.2, 0.3), 0.03)


def kinetic(plate, v):
    return 0.5 * np.sum(v * (plate.mass @ v))


def spin(plate, omega):
    return np.cross(omega, plate.mesh.vectors)


def test_total_mass_is_density_times_kept_volume(make_body):
    plate = make_body(lines=EVEN, bands=(GROOVE_X,))
    assert plate.volume == pytest.approx(0.8 * 0.05 - 0.1 * 0.03, rel=1e-13)
    assert plate.total_mass == pytest.approx(2000 * plate.volume, rel=1e-13)


def test_momentum_and_centre_of_the_grooved_plate(make_body):
    """Box minus groove: centre by subtraction."""
    plate = make_body(lines=EVEN, bands=(GROOVE_X,))
    box, cut = 0.8 * 0.05, 0.1 * 0.03
    y = (box * 0.4 - cut * 0.25) / (box - cut)
    z = (0 - cut * (-0.025 + 0.015)) / (box - cut)
    np.testing.assert_allclose(plate.mass_row @ plate.mesh.vectors / plate.total_mass, [0.5, y, z], rtol=1e-12)


@pytest.mark.parametrize("axis", range(3))
def test_rotary_inertia_of_the_grooved_plate(make_body, axis):
    """Spinning about an axis through the origin: box minus groove, each by its closed form."""
    plate = make_body(lines=EVEN, bands=(GROOVE_X,))

    def second_moments(ranges):
        volume = np.prod([b - a for a, b in ranges])
        return volume * np.array([(a * a + a * b + b * b) / 3 for a, b in ranges])

    moments = second_moments([(0, 1), (0, 0.8), (-0.025, 0.025)]) - second_moments(
        [(0, 1), (0.2, 0.3), (-0.025, 0.005)]
    )
    inertia = 2000 * (moments.sum() - moments[axis])
    assert kinetic(plate, spin(plate, 3.0 * np.eye(3)[axis])) == pytest.approx(0.5 * inertia * 9.0, rel=1e-12)


def test_mass_matrix_is_symmetric_and_positive(plate):
    M = plate.mass.toarray()
    np.testing.assert_allclose(M, M.T, atol=1e-15 * np.abs(M).max())
    assert np.linalg.eigvalsh(M).min() > 0


def annulus(inner=1.0, outer=2.0):
    """Quarter of a flat annulus, exact: first parameter along the arc, second along the radius."""
    w = np.sqrt(0.5)
    arc = np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    return Surface(
        (2, 1),
        ([0, 0, 0, 1, 1, 1], [0, 0, 1, 1]),
        np.stack([outer * arc, inner * arc], axis=1),
        [[1, 1], [w, w], [1, 1]],
    )


@pytest.mark.parametrize(
    "shape, element, order",
    [
        ("cylinder", "conforming", 2),
        ("annulus", "conforming", 4),
        ("cylinder", "enriched", 4),
        ("annulus", "enriched", 4),
    ],
)
def test_curved_volume_converges_to_the_exact_one(shape, element, order):
    """Cubic Hermite interpolation of the mid-surface errs like h^4, which the flat annulus shows; linear
    interpolation of the normal shortens it between nodes by a factor cos(half the angle), which is h^2,
    and quadratic interpolation, which has it right in the middle too, like h^4.
    """
    surface = annulus() if shape == "annulus" else PANEL
    exact = {"cylinder": 0.5 * np.pi / 2 * 0.05, "annulus": np.pi / 4 * 3 * 0.05}[shape]
    errors = []
    for n in (2, 4, 8):
        lines = np.linspace(0, 1, n + 1)
        mesh = grid(*((lines, [0, 1]) if shape == "annulus" else ([0, 0.5], lines)), surface, FAMILY[element])
        parts = [
            integrand(mesh.shape, element_rule(cell, (), 0.05, (7, 7, 3)), cell, Q)
            for cell, Q in zip(mesh.cells, mesh.element_vectors, strict=True)
        ]
        errors.append(abs(sum(part.volume.sum() for part in parts) - exact))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, order, atol=0.2)


def test_mid_surface_converges_to_the_cylinder():
    """Between nodes the distance from the axis errs like h^4, as for any cubic Hermite interpolation."""
    errors = []
    for n in (4, 8, 16):
        mesh = grid([0, 0.5], np.linspace(0, 1, n + 1), PANEL)
        middles = (np.arange(n) + 0.5) / n
        at = np.array([value_at(mesh, 0.25, y, 0.0) for y in middles]) @ mesh.vectors
        errors.append(np.abs(np.linalg.norm(at[:, 1:], axis=1) - 1).max())
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 4, atol=0.2)


W = np.sqrt(0.5)
PANEL = Surface(
    (1, 2),
    ([0, 0, 0.5, 0.5], [0, 0, 0, 1, 1, 1]),
    [[[x, -W, W], [x, 0, 2 * W], [x, W, W]] for x in (0.0, 0.5)],
    [[1, W, 1]] * 2,
)


@pytest.mark.parametrize(
    "row, where",
    [
        (lambda p: value_at(p.mesh, 0.37, 0.61, 0.01), (0.37, 0.61, 0.01)),
        (lambda p: value_at(p.mesh, 1.0, 0.8, 0.0), (1.0, 0.8, 0.0)),
        (lambda p: mean_through_thickness(p.mesh, (GROOVE_X,), 0.05, 0.5, 0.25), (0.5, 0.25, 0.015)),
        (lambda p: mean_over_region(p.mesh, (GROOVE_X,), 0.05, ((0.8, 1.0), (0.3, 0.8))), (0.9, 0.55, 0.0)),
        (lambda p: mean_over_edge(p.mesh, (), 0.05, "y1"), (0.5, 0.8, 0.0)),
    ],
)
def test_functionals_find_the_centre_of_where_they_look(make_body, row, where):
    """A functional of the reference field is a mean reference position."""
    plate = make_body(lines=EVEN, bands=(GROOVE_X,))
    np.testing.assert_allclose(row(plate) @ plate.mesh.vectors, where, atol=1e-13)


def test_grooved_edge_is_averaged_over_its_kept_face(make_body):
    plate = make_body(lines=EVEN, bands=(GROOVE_X,))
    box, cut = 0.8 * 0.05, 0.1 * 0.03
    expected = [1.0, (box * 0.4 - cut * 0.25) / (box - cut), cut * 0.01 / (box - cut)]
    np.testing.assert_allclose(mean_over_edge(plate.mesh, (GROOVE_X,), 0.05, "x1") @ plate.mesh.vectors, expected)


def test_region_beside_the_plate_is_refused(make_body):
    with pytest.raises(ValueError, match="misses"):
        mean_over_region(make_body().mesh, (), 0.05, ((3.0, 4.0), (0.0, 0.1)))
    with pytest.raises(ValueError, match="outside"):
        value_at(make_body().mesh, 3.0, 0.1, 0.0)


def test_history_is_linear_between_its_points_and_constant_beyond():
    load = spread(np.ones(2), (0.0, 0.0, 1.0), ((0.0, 0.0), (1.0, 2.0), (2.0, 2.0)))
    assert [load.factor(t) for t in (-1.0, 0.25, 1.5, 9.0)] == [0.0, 0.5, 2.0, 2.0]


@pytest.mark.parametrize("edge, along", [("x0", "r_y"), ("x1", "r_y"), ("y0", "r_x"), ("y1", "r_x")])
def test_clamps_hold_what_they_say(make_body, element, edge, along):
    mesh = make_body(lines=EVEN).mesh
    every, tangential = (clamp(mesh, edge, g).reshape(-1, 3).all(axis=1) for g in ("all", "tangential"))
    nodes = {"x": 3, "y": 4}[edge[0]]
    edges = nodes - 1 if element == "enriched" else 0
    assert every.sum() == len(mesh.shape.node_kinds) * nodes + edges
    assert tangential.sum() == 3 * nodes + edges
    assert set(mesh.kinds[tangential]) == {"r", "r_z", along, *mesh.shape.edge_kinds}
